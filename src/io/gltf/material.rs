//! Materials: what glTF says of a surface, as a Blinn-Phong material. The mapping itself is in `surface.rs`.

use super::bake::Workflow;
use super::document::Document;
use super::error::Result;
use super::geometry::Geometry;
use super::pictures::Ahead;
use super::textures::{Slot, Textures};
use super::warnings::Warnings;
use crate::io::Options;
use crate::scene::{AlphaMode, Content, Material, Texture};
use ::gltf::json;
use ::gltf::json::validation::Checked;
use glam::{Vec3, Vec4};
use std::path::Path;

/// Materials of the file, the default one last if it is needed, and their textures.
pub(super) struct Looks {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
}

/// All materials; those that nothing drawn uses go without maps.
pub(super) fn build(
    doc: &Document,
    base: Option<&Path>,
    options: &Options,
    geometry: &Geometry,
    ahead: Option<Ahead>,
    w: &mut Warnings,
) -> Result<Looks> {
    let drawn = geometry.drawn.iter().filter_map(|&i| doc.root.materials.get(i));
    let mut textures = Textures::load(doc, base, drawn.flat_map(slots), options, ahead, w);
    let mut materials = Vec::with_capacity(doc.root.materials.len() + 1);
    for (i, m) in doc.root.materials.iter().enumerate() {
        let name = m.name.clone().unwrap_or_else(|| format!("material_{i}"));
        textures.skip(!geometry.drawn.contains(&i));
        materials.push(one(m, name, &mut textures, w));
    }
    if geometry.default_material {
        materials.push(one(&json::Material::default(), "default".into(), &mut textures, w));
    }
    Ok(Looks { materials, textures: textures.finish() })
}

/// Every reference to a texture that is looked at.
fn slots(m: &json::Material) -> Vec<Slot> {
    let (color, second) = pair(m);
    let rest = [m.emissive_texture.as_ref().map(Slot::of), normal(m), occlusion(m)];
    [color, second].into_iter().chain(rest).flatten().collect()
}

/// The colour texture and the one that varies its reflectance.
fn pair(m: &json::Material) -> (Option<Slot>, Option<Slot>) {
    match m.extensions.as_ref().and_then(|e| e.pbr_specular_glossiness.as_ref()) {
        Some(g) => {
            (g.diffuse_texture.as_ref().map(Slot::of), g.specular_glossiness_texture.as_ref().map(Slot::of))
        }
        None => {
            let pbr = &m.pbr_metallic_roughness;
            let of = |t: &Option<json::texture::Info>| t.as_ref().map(Slot::of);
            (of(&pbr.base_color_texture), of(&pbr.metallic_roughness_texture))
        }
    }
}

fn normal(m: &json::Material) -> Option<Slot> {
    let t = m.normal_texture.as_ref()?;
    Some(Slot::new(t.index.value(), t.tex_coord, t.extensions.as_ref().map(|e| &e.others)))
}

fn occlusion(m: &json::Material) -> Option<Slot> {
    let t = m.occlusion_texture.as_ref()?;
    Some(Slot::new(t.index.value(), t.tex_coord, t.extensions.as_ref().map(|e| &e.others)))
}

/// Colour, alpha and the constants of the workflow.
fn factors(m: &json::Material) -> (Vec4, Workflow) {
    match m.extensions.as_ref().and_then(|e| e.pbr_specular_glossiness.as_ref()) {
        Some(g) => {
            let (specular, glossiness) = (Vec3::from_array(g.specular_factor.0), g.glossiness_factor.0);
            (Vec4::from_array(g.diffuse_factor.0), Workflow::Specular { specular, glossiness })
        }
        None => {
            let pbr = &m.pbr_metallic_roughness;
            let (metallic, roughness) = (pbr.metallic_factor.0, pbr.roughness_factor.0);
            (Vec4::from_array(pbr.base_color_factor.0), Workflow::Metallic { metallic, roughness })
        }
    }
}

fn one(m: &json::Material, name: String, textures: &mut Textures, w: &mut Warnings) -> Material {
    let cutoff = m.alpha_cutoff.map_or(0.5, |c| c.0);
    let strength = m.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |s| s.emissive_strength.0);
    let mut out = Material {
        name,
        emissive: finite(Vec3::from_array(m.emissive_factor.0) * strength),
        emissive_map: m
            .emissive_texture
            .as_ref()
            .and_then(|t| textures.plain(Slot::of(t), Content::ColorAndNumber, w)),
        normal_map: normal(m).and_then(|s| textures.plain(s, Content::Numbers, w)),
        normal_scale: m.normal_texture.as_ref().map_or(1.0, |t| t.scale),
        occlusion_map: occlusion(m).and_then(|s| textures.plain(s, Content::Numbers, w)),
        occlusion_strength: m.occlusion_texture.as_ref().map_or(1.0, |t| t.strength.0),
        alpha: match m.alpha_mode {
            Checked::Valid(json::material::AlphaMode::Mask) => AlphaMode::Mask(cutoff),
            Checked::Valid(json::material::AlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        },
        double_sided: m.double_sided,
        unlit: m.extensions.as_ref().is_some_and(|e| e.unlit.is_some()),
        ..Material::default()
    };
    reflect(m, &mut out, textures, w);
    out
}

/// Diffuse and specular coefficients and their maps.
fn reflect(m: &json::Material, out: &mut Material, textures: &mut Textures, w: &mut Warnings) {
    let (color, mut workflow) = factors(m);
    let (color_slot, second) = pair(m);
    // On an opaque surface alpha means nothing, so it must not weigh colours.
    let content = if out.alpha == AlphaMode::Opaque { Content::ColorAndNumber } else { Content::Color };
    let rgb = finite(color.truncate());
    if out.unlit {
        out.diffuse = rgb.extend(color.w);
        out.specular = Vec3::ZERO;
        out.diffuse_map = color_slot.and_then(|s| textures.plain(s, content, w));
        return;
    }

    // Where reflectance varies, or a metal's varies with its colour, both maps are made pixel by pixel.
    let tinted = matches!(workflow, Workflow::Metallic { metallic, .. } if metallic > 0.0);
    if second.is_some() || (tinted && color_slot.is_some()) {
        if let Some(baked) = textures.bake([color_slot, second], content, rgb, workflow, w) {
            out.diffuse = Vec3::ONE.extend(color.w);
            out.diffuse_map = baked.diffuse;
            out.specular = Vec3::ONE;
            out.shininess = super::surface::SHARPEST;
            out.specular_map = baked.specular;
            return;
        }
        // A map that is not read most often says that little of the surface is metal.
        if let (Workflow::Metallic { metallic, .. }, Some(_)) = (&mut workflow, second) {
            *metallic = 0.0;
        }
    }
    let look = workflow.phong(rgb, [255; 4]);
    out.diffuse = look.diffuse.extend(color.w);
    out.diffuse_map = color_slot.and_then(|s| textures.plain(s, content, w));
    out.specular = look.specular;
    out.shininess = look.shininess;
}

fn finite(v: Vec3) -> Vec3 {
    if v.is_finite() { v } else { Vec3::ONE }
}
