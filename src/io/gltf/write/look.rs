//! Materials: Blinn-Phong as metallic-roughness, near what the importer makes of that again.
//!
//! `k_d` is the base colour of something that is no metal, and the exponent gives the roughness (`p = 2/α² − 2`, `α = r²`); a
//! surface without highlights has roughness 1. Maps of highlights have no place here.

use crate::asset::Asset;
use crate::io::Warning;
use crate::io::gltf::rewrite::{Rewritten, mime};
use crate::scene::{AlphaMode, Filter, Material, TextureRef, WrapMode};
use glam::{Affine2, Vec3, Vec4};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Materials, textures, samplers and pictures.
pub(super) fn write(out: &mut Rewritten, asset: &Asset, pictures: &[Vec<u8>], warnings: &mut Vec<Warning>) {
    let has_pictures = !pictures.is_empty() && pictures.len() == asset.textures.len();
    let mut used = Extensions::default();
    let mut place = vec![0; asset.textures.len()];
    let referred = asset.materials.iter().flat_map(maps).map(|m| m.texture.0).collect::<BTreeSet<u32>>();
    for (i, &t) in referred.iter().enumerate().filter(|_| has_pictures) {
        place[t as usize] = i;
    }
    let places = has_pictures.then_some(&place[..]);
    for m in &asset.materials {
        let json = material(m, places, &mut used, warnings);
        out.push("materials", json);
    }
    if has_pictures {
        let list = asset.textures.iter().zip(pictures).enumerate();
        for (_, (texture, bytes)) in list.filter(|(i, _)| referred.contains(&(*i as u32))) {
            let view = out.view(bytes);
            let source = out.push("images", json!({"bufferView": view, "mimeType": mime(bytes)}));
            let wrap = |w: WrapMode| match w {
                WrapMode::Repeat => 10497,
                WrapMode::Mirror => 33648,
                WrapMode::Clamp => 33071,
            };
            let [min, mag] = match texture.filter() {
                Filter::Nearest => [9984, 9728],
                Filter::Trilinear => [9987, 9729],
            };
            let [s, t] = texture.wrap().map(wrap);
            let sampler = json!({"wrapS": s, "wrapT": t, "minFilter": min, "magFilter": mag});
            let known = out.json.get("samplers").and_then(Value::as_array);
            let known = known.and_then(|all| all.iter().position(|other| *other == sampler));
            let sampler = known.unwrap_or_else(|| out.push("samplers", sampler));
            out.push("textures", json!({"source": source, "sampler": sampler}));
        }
    }
    for (n, what) in [(asset.cameras.len(), "cameras"), (asset.lights.len(), "lights")] {
        if n > 0 {
            warnings.push(Warning { place: what.into(), message: format!("{n} left out") });
        }
    }
    for name in used.0 {
        out.push("extensionsUsed", name.into());
    }
}

/// References that have a place in glTF.
fn maps(m: &Material) -> impl Iterator<Item = TextureRef> {
    [m.diffuse_map, m.normal_map, m.occlusion_map, m.emissive_map].into_iter().flatten()
}

/// Names of extensions, each once.
#[derive(Default)]
struct Extensions(BTreeSet<&'static str>);

fn material(
    m: &Material,
    places: Option<&[usize]>,
    used: &mut Extensions,
    warnings: &mut Vec<Warning>,
) -> Value {
    let mut warn = |message: &str| {
        warnings.push(Warning { place: format!("material `{}`", m.name), message: message.into() })
    };
    let roughness =
        if m.specular.max_element() <= 0.0 { 1.0 } else { (2.0 / (m.shininess + 2.0)).powf(0.25) };
    let base = m.diffuse.clamp(Vec4::ZERO, Vec4::ONE);
    let mut pbr = json!({"baseColorFactor": base.to_array(), "metallicFactor": 0, "roughnessFactor": roughness.clamp(0.0, 1.0)});
    let mut json = json!({"doubleSided": m.double_sided});
    let mut extensions = json!({});
    if !m.name.is_empty() {
        json["name"] = m.name.clone().into();
    }
    let mut map =
        |of: Option<TextureRef>, extra: Value| -> Option<Value> { Some(lay(of?, places?, extra, used)) };
    if let Some(t) = map(m.diffuse_map, json!({})) {
        pbr["baseColorTexture"] = t;
    }
    if let Some(t) = map(m.normal_map, json!({"scale": m.normal_scale})) {
        json["normalTexture"] = t;
    }
    if let Some(t) = map(m.occlusion_map, json!({"strength": m.occlusion_strength.clamp(0.0, 1.0)})) {
        json["occlusionTexture"] = t;
    }
    if let Some(t) = map(m.emissive_map, json!({})) {
        json["emissiveTexture"] = t;
    }
    let strongest = m.emissive.max_element();
    if strongest > 0.0 {
        json["emissiveFactor"] = json!((m.emissive.max(Vec3::ZERO) / strongest.max(1.0)).to_array());
    }
    if strongest > 1.0 {
        used.0.insert("KHR_materials_emissive_strength");
        extensions["KHR_materials_emissive_strength"] = json!({"emissiveStrength": strongest});
    }
    match m.alpha {
        AlphaMode::Opaque => (),
        AlphaMode::Mask(cutoff) => {
            (json["alphaMode"], json["alphaCutoff"]) = ("MASK".into(), cutoff.max(0.0).into())
        }
        AlphaMode::Blend => json["alphaMode"] = "BLEND".into(),
    }
    if m.unlit {
        used.0.insert("KHR_materials_unlit");
        extensions["KHR_materials_unlit"] = json!({});
    }
    json["pbrMetallicRoughness"] = pbr;
    if extensions != json!({}) {
        json["extensions"] = extensions;
    }
    if m.specular_map.is_some() {
        warn("its map of highlights is left out");
    }
    if m.mirror != Vec3::ZERO || m.transmission != Vec3::ZERO || m.ambient.is_some() {
        warn("mirror, glass or a colour of its own in ambient light is left out");
    }
    json
}

/// A reference to a texture, as it lies on the surface.
fn lay(of: TextureRef, places: &[usize], mut json: Value, used: &mut Extensions) -> Value {
    json["index"] = places[of.texture.0 as usize].into();
    if of.uv_set > 0 {
        json["texCoord"] = of.uv_set.into();
    }
    if of.transform != Affine2::IDENTITY {
        used.0.insert("KHR_texture_transform");
        let (scale, angle, offset) = of.transform.to_scale_angle_translation();
        let place = json!({"offset": offset.to_array(), "rotation": -angle, "scale": scale.to_array()});
        json["extensions"] = json!({"KHR_texture_transform": place});
    }
    json
}
