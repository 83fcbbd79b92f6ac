//! Textures: which picture, how it lies on a surface, how it is sampled; and pairs of them baked into Blinn-Phong maps.

use super::bake::{self, Grid, Size, Workflow};
use super::document::Document;
use super::pictures::{self, Ahead, Pictures, with_mips};
use super::warnings::Warnings;
use crate::io::Options;
use crate::scene::{Content, Filter, Texture, TextureId, TextureRef, WrapMode};
use ::gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
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

/// Baked maps; the material's own factors are then 1, and its exponent is [`super::surface::SHARPEST`].
pub(super) struct Baked {
    pub diffuse: Option<TextureRef>,
    pub specular: Option<TextureRef>,
}

/// Where a texture repeats and how it is filtered, in a form that has an order.
type Sampling = [u8; 3];

/// All that a baked pair follows from: pictures, sampling, whether they lie alike, factors.
type Inputs = ([Option<usize>; 2], [Sampling; 2], bool, Content, Vec<u32>);

/// Pictures of the file, and the textures made of them so far.
pub(super) struct Textures<'a> {
    doc: &'a Document<'a>,
    pictures: Pictures,
    /// The texture that holds a picture's pixels now.
    holder: Vec<Option<TextureId>>,
    made: Vec<Texture>,
    plain: BTreeMap<(usize, Sampling, Content), TextureId>,
    baked: BTreeMap<Inputs, [TextureId; 2]>,
    /// Bytes that may still be made of the pictures.
    left: u64,
    /// The material at hand goes without maps.
    skip: bool,
}

impl<'a> Textures<'a> {
    /// Decode all pictures that materials use; none if the options leave them out.
    pub fn load(
        doc: &'a Document<'a>,
        base: Option<&Path>,
        slots: impl Iterator<Item = Slot>,
        options: &Options,
        ahead: Option<Ahead>,
        w: &mut Warnings,
    ) -> Self {
        let mut wanted = vec![false; doc.root.images.len()];
        for slot in slots.filter(|_| options.textures) {
            match source(doc, slot.texture).map(|s| wanted.get_mut(s)) {
                Some(Some(flag)) => {
                    *flag = true;
                    minified(doc, slot.texture, w);
                }
                _ => {
                    w.push(format!("textures[{}]", slot.texture), "has no picture that can be read; left out")
                }
            }
        }
        let pictures = pictures::load(doc, base, &wanted, ahead, w);
        let holder = vec![None; pictures.list.len()];
        let (made, plain, baked) = Default::default();
        let left = pictures.allowance;
        Self { doc, pictures, holder, made, plain, baked, left, skip: false }
    }

    /// Leave the materials to come without maps, or no longer.
    pub fn skip(&mut self, skip: bool) {
        self.skip = skip;
    }

    /// A texture as the file has it; `None` where it is missing or pictures are left out.
    pub fn plain(&mut self, slot: Slot, content: Content, w: &mut Warnings) -> Option<TextureRef> {
        let picture = self.picture(slot)?;
        let (wrap, filter) = self.sampling(slot);
        let key = (picture, code(wrap, filter), content);
        let id = match self.plain.get(&key) {
            Some(id) => *id,
            None => {
                let (width, height) = self.size(picture);
                // The first texture takes the pixels over; only further ones are copies.
                let bytes = match self.holder[picture] {
                    None => std::mem::take(&mut self.pictures.list[picture].bytes),
                    Some(_) => {
                        self.afford(with_mips(width, height), w)?;
                        self.pixels(picture).to_vec()
                    }
                };
                let id = self.push((width, height), bytes, content, slot)?;
                self.holder[picture].get_or_insert(id);
                self.plain.insert(key, id);
                id
            }
        };
        lay(id, slot, w)
    }

    /// Diffuse and specular maps of a colour texture and a second one, pixel by pixel in the finer of their grids.
    ///
    /// Where they lie differently on the surface, each keeps its own layout and sees the other's mean. Materials of the
    /// same inputs share the maps. `None` without pictures, or where there is no room for more maps.
    pub fn bake(
        &mut self,
        [color, second]: [Option<Slot>; 2],
        content: Content,
        factor: Vec3,
        workflow: Workflow,
        w: &mut Warnings,
    ) -> Option<Baked> {
        let get = |s: Option<Slot>| s.and_then(|s| self.picture(s).map(|p| (s, p)));
        let (a, b) = (get(color), get(second));
        let (slot_a, slot_b) = (a.map(|a| a.0), b.map(|b| b.0));
        let (slot_a, slot_b) = (slot_a.or(slot_b)?, slot_b.or(slot_a)?);
        let alike = slot_a.layout_equals(&slot_b);
        if !alike {
            w.push(
                "materials",
                "colour and roughness textures lie differently; each was combined with the other's mean",
            );
        }
        let samplings = [slot_a, slot_b].map(|s| self.sampling(s));
        let codes = samplings.map(|(wrap, filter)| code(wrap, filter));
        let pictures = [a.map(|a| a.1), b.map(|b| b.1)];
        let key = (pictures, codes, alike, content, workflow.bits(factor));
        let [diffuse, specular] = match self.baked.get(&key) {
            Some(ids) => *ids,
            None => {
                let srgb = [true, matches!(workflow, Workflow::Specular { .. })];
                let own = pictures.map(|p| p.map_or((1, 1), |p| self.size(p)));
                let sizes = bake::sizes(own[0], own[1], alike);
                self.afford(sizes.iter().map(|&(width, height)| with_mips(width, height)).sum(), w)?;
                let grid = |k: usize| {
                    let bytes = pictures[k].map_or(&[255; 4][..], |p| self.pixels(p));
                    Grid { size: own[k], bytes, wrap: samplings[k].0, srgb: srgb[k] }
                };
                let [diffuse, specular] = bake::bake(&grid(0), &grid(1), alike, factor, workflow);
                let diffuse = self.push(sizes[0], diffuse, content, slot_a)?;
                // The specular map's alpha is an exponent.
                let specular = self.push(sizes[1], specular, Content::ColorAndNumber, slot_b)?;
                let ids = [diffuse, specular];
                self.baked.insert(key, ids);
                ids
            }
        };
        Some(Baked { diffuse: lay(diffuse, slot_a, w), specular: lay(specular, slot_b, w) })
    }

    /// Take bytes out of what may still be made.
    fn afford(&mut self, bytes: u64, w: &mut Warnings) -> Option<()> {
        let Some(left) = self.left.checked_sub(bytes) else {
            let limit = self.pictures.allowance >> 20;
            w.push("materials", format!("maps made for them would take more than {limit} MiB; left out"));
            return None;
        };
        self.left = left;
        Some(())
    }

    fn picture(&self, slot: Slot) -> Option<usize> {
        self.pictures.of(source(self.doc, slot.texture)?).filter(|_| !self.skip)
    }

    fn size(&self, picture: usize) -> Size {
        (self.pictures.list[picture].width, self.pictures.list[picture].height)
    }

    fn pixels(&self, picture: usize) -> &[u8] {
        match self.holder[picture] {
            Some(id) => &self.made[id.0 as usize].levels()[0],
            None => &self.pictures.list[picture].bytes,
        }
    }

    fn sampling(&self, slot: Slot) -> ([WrapMode; 2], Filter) {
        let json = self.doc.root.textures.get(slot.texture);
        let sampler = json.and_then(|t| t.sampler).and_then(|s| self.doc.root.samplers.get(s.value()));
        sampling(sampler)
    }

    fn push(&mut self, size: Size, bytes: Vec<u8>, content: Content, slot: Slot) -> Option<TextureId> {
        let (wrap, filter) = self.sampling(slot);
        let texture = Texture::new(size.0 as u32, size.1 as u32, bytes, content, wrap, filter).ok()?;
        self.made.push(texture);
        Some(TextureId(self.made.len() as u32 - 1))
    }

    /// The textures, in the order of their ids.
    pub fn finish(self) -> Vec<Texture> {
        self.made
    }
}

/// The picture of a texture: WebP where the file offers it.
pub(super) fn source(doc: &Document, texture: usize) -> Option<usize> {
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

/// Say where a picture is asked to be made smaller in another way than ours.
fn minified(doc: &Document, texture: usize, w: &mut Warnings) {
    let Some(index) = doc.root.textures[texture].sampler.map(|s| s.value()) else { return };
    let Some(sampler) = doc.root.samplers.get(index) else { return };
    let ours = match sampling(Some(sampler)).1 {
        Filter::Nearest => MinFilter::NearestMipmapNearest,
        Filter::Trilinear => MinFilter::LinearMipmapLinear,
    };
    if sampler.min_filter.is_some_and(|f| f != Checked::Valid(ours)) {
        let message = "its minFilter is ignored; mip levels are mixed linearly, or taken nearest where magFilter is NEAREST";
        w.push(format!("samplers[{index}]"), message);
    }
}

fn code(wrap: [WrapMode; 2], filter: Filter) -> Sampling {
    [wrap[0] as u8, wrap[1] as u8, filter as u8]
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
