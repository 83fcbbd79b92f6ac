//! The look of one glTF file on another.

use super::container;
use super::document::Document;
use super::error::{Result, value};
use super::mend;
use super::rewrite::{Rewritten, mime};
use super::warnings::Warnings;
use serde_json::{Map, Value};
use std::path::Path;

/// Extensions that are about looks alone.
const LOOKS: [&str; 3] = ["KHR_materials_", "KHR_texture_", "EXT_texture_"];

/// Give a file that was written for the character of `bytes` the materials, textures and pictures that it has there, as they are.
///
/// # Errors
/// [`GltfError`](super::GltfError) as for importing.
pub fn wear(out: &mut Rewritten, bytes: &[u8], base_dir: Option<&Path>) -> Result<()> {
    let parts = container::split(bytes)?;
    let mut w = Warnings::default();
    let doc = Document::new(mend::root(parts.json, &mut w)?, parts.bin, base_dir, &mut w)?;
    let mut from: Map<String, Value> =
        serde_json::from_slice(parts.json).map_err(|e| value("the JSON", "an object", e.to_string()))?;
    for key in ["materials", "textures", "samplers", "images"] {
        match from.remove(key) {
            Some(list) => drop(out.json.insert(key.into(), list)),
            None => drop(out.json.remove(key)),
        }
    }
    let list = |json: &Map<String, Value>, key: &str| {
        json.get(key).and_then(Value::as_array).cloned().unwrap_or_default()
    };
    for i in 0..list(&out.json, "images").len() {
        let Some(view) = out.json["images"][i]["bufferView"].as_u64() else { continue };
        let (bytes, _) = doc.view(view as usize, &format!("images[{i}].bufferView"))?;
        out.json["images"][i]["mimeType"] = mime(bytes).into();
        let view = out.view(bytes);
        out.json["images"][i]["bufferView"] = view.into();
    }
    for key in ["extensionsUsed", "extensionsRequired"] {
        let looks = |e: &Value| {
            let name = e.as_str().unwrap_or_default();
            LOOKS.iter().any(|l| name.starts_with(l)) && name != "KHR_materials_variants"
        };
        let kept: Vec<Value> = list(&from, key).into_iter().filter(looks).collect();
        match kept.is_empty() {
            true => drop(out.json.remove(key)),
            false => drop(out.json.insert(key.into(), kept.into())),
        }
    }
    // What had no material has none again.
    let count = list(&out.json, "materials").len() as u64;
    for p in super::prune::primitives(&mut out.json) {
        if p["material"].as_u64().is_some_and(|m| m >= count) {
            p.as_object_mut().map(|p| p.remove("material"));
        }
    }
    Ok(())
}
