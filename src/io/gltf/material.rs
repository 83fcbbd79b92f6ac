//! Metallic-roughness materials as Blinn-Phong ones.
//!
//! One mapping, with base colour `b`, metallic `m` and roughness `r`, all linear:
//!
//! - `α = r²`; exponent `p = clamp(2/α² − 2, 4, 1024)` (Karis 2013: the Blinn-Phong lobe as wide as GGX's);
//! - `F₀ = lerp(0.04, b, m)`; `k = F₀ · (p + 8)/8 · (1 − α)`: the normalised lobe (Akenine-Möller et al. 2018, 9.8.1), less the
//!   share `α` that is so wide that it looks matt;
//! - `k_s = k / (1 + max k)`: a lamp's mirror image is thousands of times brighter than a screen can be, so highlights are
//!   compressed, hue kept, instead of clipped to white;
//! - `k_d = b · ((1 − m) + m · (0.4 + 0.4 α))`: there is no environment for metals to mirror, so they keep a share of their
//!   colour as if they mirrored a grey one, the more the rougher they are.

use super::document::Document;
use super::error::Result;
use super::textures;
use super::warnings::Warnings;
use crate::io::Options;
use crate::scene::{AlphaMode, Material, Texture};
use ::gltf::json;
use ::gltf::json::validation::Checked;
use glam::{Vec3, Vec4};
use std::path::Path;

/// Materials of the file, the default one last if it is needed, and their textures.
pub(super) struct Looks {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
}

/// Blinn-Phong coefficients of one point of a surface.
pub(super) struct Phong {
    /// `k_d` over the base colour.
    pub matt: f32,
    /// `k_s`.
    pub specular: Vec3,
    /// `p`.
    pub shininess: f32,
}

/// Largest exponent: a highlight about 4° wide.
pub(super) const SHARPEST: f32 = 1024.0;

/// The mapping (see the module).
pub(super) fn phong(base: Vec3, metallic: f32, roughness: f32) -> Phong {
    let m = metallic.clamp(0.0, 1.0);
    let alpha = roughness.clamp(0.0, 1.0).powi(2);
    let shininess = (2.0 / (alpha * alpha).max(1e-6) - 2.0).clamp(4.0, SHARPEST);
    let k = Vec3::splat(0.04).lerp(base, m) * ((shininess + 8.0) / 8.0 * (1.0 - alpha));
    let specular = k / (1.0 + k.max_element());
    Phong { matt: (1.0 - m) + m * (0.4 + 0.4 * alpha), specular, shininess }
}

/// All materials.
pub(super) fn build(
    doc: &Document,
    base: Option<&Path>,
    options: &Options,
    default: bool,
    w: &mut Warnings,
) -> Result<Looks> {
    let mut textures = textures::Textures::load(doc, base, options, w);
    let mut materials = Vec::with_capacity(doc.root.materials.len() + 1);
    for (i, m) in doc.root.materials.iter().enumerate() {
        materials.push(one(m, i, &mut textures));
    }
    if default {
        let m = json::Material::default();
        materials.push(Material { name: "default".into(), ..one(&m, materials.len(), &mut textures) });
    }
    Ok(Looks { materials, textures: textures.finish() })
}

fn one(m: &json::Material, i: usize, textures: &mut textures::Textures) -> Material {
    let pbr = &m.pbr_metallic_roughness;
    let color = Vec4::from_array(pbr.base_color_factor.0);
    let look = phong(color.truncate(), pbr.metallic_factor.0, pbr.roughness_factor.0);
    let cutoff = m.alpha_cutoff.map_or(0.5, |c| c.0);
    Material {
        name: m.name.clone().unwrap_or_else(|| format!("material_{i}")),
        diffuse: (color.truncate() * look.matt).extend(color.w),
        diffuse_map: pbr.base_color_texture.as_ref().and_then(|t| textures.plain(t, true)),
        specular: look.specular,
        shininess: look.shininess,
        emissive: Vec3::from_array(m.emissive_factor.0),
        emissive_map: m.emissive_texture.as_ref().and_then(|t| textures.plain(t, true)),
        alpha: match m.alpha_mode {
            Checked::Valid(json::material::AlphaMode::Mask) => AlphaMode::Mask(cutoff),
            Checked::Valid(json::material::AlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        },
        double_sided: m.double_sided,
        ..Material::default()
    }
}
