//! Which extensions are understood, which only change the look, and which stop an import.

use super::error::{GltfError, Result};
use super::warnings::Warnings;
use ::gltf::json::Root;

/// Read as they are meant.
const READ: &[&str] = &[
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Change how things look, or what is written beside them; geometry and motion are right without them.
const LOOK: &[&str] = &[
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "EXT_texture_avif",
    "KHR_animation_pointer",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];

/// Refuse what is required and unknown; warn of what is left out.
pub(super) fn check(root: &Root, w: &mut Warnings) -> Result<()> {
    let look = |name: &str| LOOK.contains(&name) || name.starts_with("KHR_materials_");
    let known = |name: &str| READ.contains(&name) || look(name);
    if let Some(name) = root.extensions_required.iter().find(|n| !known(n)) {
        return Err(GltfError::Extension { name: name.clone(), hint: hint(name) });
    }
    let mut named: Vec<&String> = root.extensions_used.iter().chain(&root.extensions_required).collect();
    named.sort();
    named.dedup();
    for name in named {
        if READ.contains(&name.as_str()) {
            continue;
        } else if look(name) {
            w.push("extensionsUsed", format!("`{name}` is left out or approximated; only the look differs"));
        } else {
            w.push("extensionsUsed", format!("`{name}` is unknown and ignored"));
        }
    }
    Ok(())
}

fn hint(name: &str) -> &'static str {
    match name {
        "EXT_mesh_gpu_instancing" => "write the instances out as nodes (`uninstance` of glTF-Transform)",
        _ => "export the file without it",
    }
}
