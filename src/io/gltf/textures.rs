//! Textures: which picture, how it lies on a surface, how it is sampled; and pairs of them baked into Blinn-Phong maps.

use super::document::Document;
use super::pictures::{self, Picture};
use super::surface::{Gloss, Phong, SHARPEST};
use super::warnings::Warnings;
use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
use crate::io::Options;
use crate::scene::{Filter, Texture, TextureId, TextureRef, WrapMode};
use ::gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use ::gltf::json::validation::Checked;
use glam::{Affine2, Vec2, Vec3};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::Path;

/// How a material refers to a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slot {
    /// Index of the texture.
    pub texture: usize,
    uv_set: u32,
    transform: Affine2,
}

impl Slot {
    /// From the fields that all references share.
    pub fn new(texture: usize, tex_coord: u32, others: Option<&Map<String, Value>>) -> Self {
        let mut slot = Self { texture, uv_set: tex_coord, transform: Affine2::IDENTITY };
        if let Some(t) = others.and_then(|o| o.get("KHR_texture_transform")) {
            let number = |v: &Value, default: f32| v.as_f64().map_or(default, |x| x as f32);
            let pair = |v: &Value, d: f32| Vec2::new(number(&v[0], d), number(&v[1], d));
            slot.place(pair(&t["offset"], 0.0), number(&t["rotation"], 0.0), pair(&t["scale"], 1.0));
            slot.uv_set = t["texCoord"].as_u64().map_or(slot.uv_set, |n| n.min(9) as u32);
        }
        slot
    }

    /// From a plain reference.
    pub fn of(info: &Info) -> Self {
        let extensions = info.extensions.as_ref();
        let mut slot = Self::new(info.index.value(), info.tex_coord, extensions.map(|e| &e.others));
        if let Some(t) = extensions.and_then(|e| e.texture_transform.as_ref()) {
            slot.place(t.offset.0.into(), t.rotation.0, t.scale.0.into());
            slot.uv_set = t.tex_coord.unwrap_or(slot.uv_set);
        }
        slot
    }

    /// `offset · rotation · scale`; positive angles turn from +v to +u, since v runs down.
    fn place(&mut self, offset: Vec2, rotation: f32, scale: Vec2) {
        let t = Affine2::from_scale_angle_translation(scale, -rotation, offset);
        self.transform = if t.is_finite() { t } else { Affine2::IDENTITY };
    }

    fn layout_equals(&self, other: &Self) -> bool {
        self.uv_set == other.uv_set && self.transform == other.transform
    }
}

/// What the second texture of a baked pair holds, and the constants beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Workflow {
    /// Green: roughness; blue: metallic.
    Metallic { metallic: f32, roughness: f32 },
    /// RGB: specular colour (sRGB); alpha: glossiness.
    Specular { specular: Vec3, glossiness: f32 },
}

impl Workflow {
    /// Coefficients for a diffuse or base colour, and a pixel of the second texture (white without one).
    pub fn phong(&self, color: Vec3, pixel: [u8; 4]) -> Phong {
        self.shade(&Gloss::new(self.roughness(pixel)), color, pixel)
    }

    fn roughness(&self, pixel: [u8; 4]) -> f32 {
        match *self {
            Self::Metallic { roughness, .. } => roughness * pixel[1] as f32 / 255.0,
            Self::Specular { glossiness, .. } => 1.0 - glossiness * pixel[3] as f32 / 255.0,
        }
    }

    /// The byte that alone decides the roughness.
    fn gloss_byte(&self, pixel: [u8; 4]) -> usize {
        match self {
            Self::Metallic { .. } => pixel[1] as usize,
            Self::Specular { .. } => pixel[3] as usize,
        }
    }

    fn shade(&self, gloss: &Gloss, color: Vec3, pixel: [u8; 4]) -> Phong {
        match *self {
            Self::Metallic { metallic, .. } => gloss.metallic(color, metallic * pixel[2] as f32 / 255.0),
            Self::Specular { specular, .. } => gloss.specular(color, specular * linear(pixel)),
        }
    }
}

/// Baked maps; the material's own factors are then 1, and its exponent is [`SHARPEST`].
pub(super) struct Baked {
    pub diffuse: Option<TextureRef>,
    pub specular: Option<TextureRef>,
}

/// Pictures of the file, and the textures made of them so far.
pub(super) struct Textures<'a> {
    doc: &'a Document<'a>,
    pictures: Vec<Option<Picture>>,
    made: Vec<Texture>,
    of: BTreeMap<(usize, Option<usize>, bool), TextureId>,
}

impl<'a> Textures<'a> {
    /// Decode all pictures that materials use; none if the options leave them out.
    pub fn load(
        doc: &'a Document<'a>,
        base: Option<&Path>,
        slots: impl Iterator<Item = Slot>,
        options: &Options,
        w: &mut Warnings,
    ) -> Self {
        let mut wanted = vec![false; doc.root.images.len()];
        for slot in slots.filter(|_| options.textures) {
            match source(doc, slot.texture).map(|s| wanted.get_mut(s)) {
                Some(Some(flag)) => *flag = true,
                _ => {
                    w.push(format!("textures[{}]", slot.texture), "has no picture that can be read; left out")
                }
            }
        }
        let pictures = pictures::load(doc, base, &wanted, w);
        Self { doc, pictures, made: Vec::new(), of: BTreeMap::new() }
    }

    /// A texture as the file has it; `None` where it is missing or pictures are left out.
    pub fn plain(&mut self, slot: Slot, srgb: bool, w: &mut Warnings) -> Option<TextureRef> {
        let picture = self.picture(slot)?;
        let json = self.doc.root.textures.get(slot.texture)?;
        let sampler = json.sampler.map(|s| s.value());
        let key = (source(self.doc, slot.texture)?, sampler, srgb);
        let id = match self.of.get(&key) {
            Some(id) => *id,
            None => {
                let rgba = picture.rgba.clone();
                let (width, height) = (picture.width, picture.height);
                let id = self.push(width, height, rgba, srgb, slot)?;
                self.of.insert(key, id);
                id
            }
        };
        lay(id, slot, w)
    }

    /// Diffuse and specular maps of a colour texture and a second one, pixel by pixel in the finer of their grids.
    ///
    /// Where they lie differently on the surface, each keeps its own layout and sees the other's mean.
    pub fn bake(
        &mut self,
        color: Option<Slot>,
        second: Option<Slot>,
        factor: Vec3,
        workflow: Workflow,
        w: &mut Warnings,
    ) -> Option<Baked> {
        let white = Picture { width: 1, height: 1, rgba: vec![255; 4] };
        let get = |s: Option<Slot>| s.and_then(|s| self.picture(s).map(|p| (s, p)));
        let (a, b) = (get(color), get(second));
        let (slot_a, slot_b) = (a.map(|a| a.0), b.map(|b| b.0));
        let (slot_a, slot_b) = (slot_a.or(slot_b)?, slot_b.or(slot_a)?);
        let (pa, pb) = (a.map_or(&white, |a| a.1), b.map_or(&white, |b| b.1));
        let table: Vec<Gloss> = (0..=255).map(|i| Gloss::new(workflow.roughness([i; 4]))).collect();
        let shade = |pixel: [u8; 4], second: [u8; 4]| {
            workflow.shade(&table[workflow.gloss_byte(second)], factor * linear(pixel), second)
        };
        let (diffuse, specular, size_a, size_b);
        if slot_a.layout_equals(&slot_b) {
            size_a = (pa.width.max(pb.width), pa.height.max(pb.height));
            size_b = size_a;
            let at = |x, y| (pa.at((x, y), size_a), pb.at((x, y), size_a));
            diffuse = map(size_a, |x, y| diffuse_texel(&shade(at(x, y).0, at(x, y).1), at(x, y).0[3]));
            specular = map(size_a, |x, y| specular_texel(&shade(at(x, y).0, at(x, y).1)));
        } else {
            w.push(
                "materials",
                "colour and roughness textures lie differently; each was combined with the other's mean",
            );
            (size_a, size_b) = ((pa.width, pa.height), (pb.width, pb.height));
            let (mean_a, mean_b) = (mean(pa), mean(pb));
            diffuse = map(size_a, |x, y| {
                let p = pa.at((x, y), size_a);
                diffuse_texel(&shade(p, mean_b), p[3])
            });
            specular = map(size_b, |x, y| specular_texel(&shade(mean_a, pb.at((x, y), size_b))));
        }
        let diffuse = self.push(size_a.0, size_a.1, diffuse, true, slot_a).and_then(|id| lay(id, slot_a, w));
        let specular =
            self.push(size_b.0, size_b.1, specular, true, slot_b).and_then(|id| lay(id, slot_b, w));
        Some(Baked { diffuse, specular })
    }

    fn picture(&self, slot: Slot) -> Option<&Picture> {
        self.pictures.get(source(self.doc, slot.texture)?)?.as_ref()
    }

    fn push(
        &mut self,
        width: usize,
        height: usize,
        rgba: Vec<u8>,
        srgb: bool,
        slot: Slot,
    ) -> Option<TextureId> {
        let json = self.doc.root.textures.get(slot.texture)?;
        let sampler = json.sampler.and_then(|s| self.doc.root.samplers.get(s.value()));
        let (wrap, filter) = sampling(sampler);
        let texture = Texture::new(width as u32, height as u32, rgba, srgb, wrap, filter).ok()?;
        self.made.push(texture);
        Some(TextureId(self.made.len() as u32 - 1))
    }

    /// The textures, in the order of their ids.
    pub fn finish(self) -> Vec<Texture> {
        self.made
    }
}

/// The picture of a texture: WebP where the file offers it.
fn source(doc: &Document, texture: usize) -> Option<usize> {
    let json = doc.root.textures.get(texture)?;
    let webp = json.extensions.as_ref().and_then(|e| e.others.get("EXT_texture_webp"));
    let webp = webp.and_then(|v| v["source"].as_u64()).map(|n| n as usize);
    webp.or(Some(json.source.value())).filter(|&i| i < doc.root.images.len())
}

fn lay(texture: TextureId, slot: Slot, w: &mut Warnings) -> Option<TextureRef> {
    if slot.uv_set > 1 {
        w.push(
            "materials",
            "a texture uses a third set of coordinates; only two are kept, and it is left out",
        );
        return None;
    }
    Some(TextureRef { texture, uv_set: slot.uv_set as u8, transform: slot.transform })
}

fn sampling(sampler: Option<&Sampler>) -> ([WrapMode; 2], Filter) {
    let Some(s) = sampler else { return Default::default() };
    let wrap = |w: Checked<WrappingMode>| match w {
        Checked::Valid(WrappingMode::ClampToEdge) => WrapMode::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => WrapMode::Mirror,
        _ => WrapMode::Repeat,
    };
    let filter = match s.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Trilinear,
    };
    ([wrap(s.wrap_s), wrap(s.wrap_t)], filter)
}

fn linear(pixel: [u8; 4]) -> Vec3 {
    Vec3::new(
        LINEAR_OF_SRGB8[pixel[0] as usize],
        LINEAR_OF_SRGB8[pixel[1] as usize],
        LINEAR_OF_SRGB8[pixel[2] as usize],
    )
}

fn map((width, height): (usize, usize), texel: impl Fn(usize, usize) -> [u8; 4]) -> Vec<u8> {
    let mut out = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        (0..width).for_each(|x| out.extend(texel(x, y)));
    }
    out
}

fn diffuse_texel(p: &Phong, alpha: u8) -> [u8; 4] {
    [srgb8(p.diffuse.x), srgb8(p.diffuse.y), srgb8(p.diffuse.z), alpha]
}

/// RGB: `k_s`; alpha: the power of [`SHARPEST`] that is `p`.
fn specular_texel(p: &Phong) -> [u8; 4] {
    let power = p.shininess.ln() / SHARPEST.ln();
    [srgb8(p.specular.x), srgb8(p.specular.y), srgb8(p.specular.z), (power * 255.0 + 0.5) as u8]
}

fn mean(p: &Picture) -> [u8; 4] {
    let count = (p.rgba.len() / 4).max(1) as u64;
    std::array::from_fn(|k| (p.rgba.iter().skip(k).step_by(4).map(|&b| b as u64).sum::<u64>() / count) as u8)
}
