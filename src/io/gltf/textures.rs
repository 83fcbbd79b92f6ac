//! Textures: pictures decoded in parallel, and how they lie on surfaces.

use super::document::Document;
use super::uri;
use super::warnings::Warnings;
use crate::io::Options;
use crate::scene::{Filter, Texture, TextureId, TextureRef, WrapMode};
use ::gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use ::gltf::json::validation::Checked;
use glam::{Affine2, Vec2};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Decoded RGBA.
pub(super) struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

/// Pictures of the file, and the textures made of them so far.
pub(super) struct Textures<'a> {
    doc: &'a Document<'a>,
    pictures: Vec<Option<Picture>>,
    made: Vec<Texture>,
    of: BTreeMap<(usize, bool), TextureId>,
}

impl<'a> Textures<'a> {
    /// Decode all pictures that textures use; none if the options leave them out.
    pub fn load(doc: &'a Document<'a>, base: Option<&Path>, options: &Options, w: &mut Warnings) -> Self {
        let count = if options.textures { doc.root.images.len() } else { 0 };
        let mut pictures = Vec::with_capacity(count);
        for i in 0..count {
            let place = format!("images[{i}]");
            let picture = bytes(doc, base, i).and_then(|b| decode(&b));
            pictures.push(Some(picture.unwrap_or_else(|why| {
                w.push(place, format!("{why}; plain white is used"));
                Picture { width: 1, height: 1, rgba: vec![255; 4] }
            })));
        }
        Self { doc, pictures, made: Vec::new(), of: BTreeMap::new() }
    }

    /// A texture as the file has it.
    pub fn plain(&mut self, info: &Info, srgb: bool) -> Option<TextureRef> {
        let index = info.index.value();
        let texture = self.make(index, srgb)?;
        Some(TextureRef { texture, uv_set: info.tex_coord.min(1) as u8, transform: transform(info) })
    }

    fn make(&mut self, index: usize, srgb: bool) -> Option<TextureId> {
        if let Some(id) = self.of.get(&(index, srgb)) {
            return Some(*id);
        }
        let json = self.doc.root.textures.get(index)?;
        let picture = self.pictures.get(json.source.value())?.as_ref()?;
        let sampler = json.sampler.and_then(|s| self.doc.root.samplers.get(s.value()));
        let (wrap, filter) = sampling(sampler);
        let t = Texture::new(picture.width, picture.height, picture.rgba.clone(), srgb, wrap, filter).ok()?;
        let id = TextureId(self.made.len() as u32);
        self.made.push(t);
        self.of.insert((index, srgb), id);
        Some(id)
    }

    /// The textures, in the order of their ids.
    pub fn finish(self) -> Vec<Texture> {
        self.made
    }
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

/// `offset · rotation · scale` (KHR_texture_transform).
fn transform(info: &Info) -> Affine2 {
    let t = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    t.map_or(Affine2::IDENTITY, |t| {
        Affine2::from_scale_angle_translation(
            Vec2::from_array(t.scale.0),
            -t.rotation.0,
            Vec2::from_array(t.offset.0),
        )
    })
}

fn bytes<'a>(doc: &'a Document, base: Option<&Path>, i: usize) -> Result<Cow<'a, [u8]>, String> {
    let image = &doc.root.images[i];
    let place = format!("images[{i}]");
    match (&image.uri, image.buffer_view) {
        (Some(u), _) => uri::load(u, base, &place).map(Cow::Owned).map_err(|e| e.to_string()),
        (None, Some(v)) => {
            let (bytes, _) = doc.view(v.value(), &place).map_err(|e| e.to_string())?;
            Ok(Cow::Borrowed(bytes))
        }
        (None, None) => Err("has neither a URI nor a buffer view".into()),
    }
}

#[cfg(feature = "pictures")]
fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|e| e.to_string())?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(1 << 14);
    limits.max_image_height = Some(1 << 14);
    limits.max_alloc = Some(1 << 29);
    reader.limits(limits);
    let rgba = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    Ok(Picture { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
}

#[cfg(not(feature = "pictures"))]
fn decode(_: &[u8]) -> Result<Picture, String> {
    Err("pictures are not decoded in this build (feature `pictures`)".into())
}
