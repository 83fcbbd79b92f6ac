//! A first look into a GLB: where the picture is that most of it shows, before anything is checked.
//!
//! It is a guess that saves time, so it says nothing of what is wrong: who uses it compares what it found with what the file turns out
//! to ask for.

use super::container::Parts;
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Bytes of JSON beyond which a second look at them takes longer than a picture.
const LONG: usize = 1 << 20;

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Root {
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    images: Vec<Image>,
    buffer_views: Vec<View>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    material: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Material {
    pbr_metallic_roughness: Option<Pbr>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Pbr {
    base_color_texture: Option<Info>,
}

#[derive(Deserialize)]
struct Info {
    index: usize,
}

#[derive(Deserialize)]
struct Texture {
    source: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Image {
    buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    byte_offset: Option<usize>,
    byte_length: usize,
    extensions: Option<IgnoredAny>,
}

/// The bytes, in the binary chunk, of the base colour of the first mesh that has a picture for it.
pub(super) fn first_picture<'a>(parts: &Parts<'a>) -> Option<&'a [u8]> {
    let bin = parts.bin.filter(|_| parts.json.len() <= LONG)?;
    let root: Root = serde_json::from_slice(parts.json).ok()?;
    let materials =
        root.meshes.iter().flat_map(|m| &m.primitives).filter_map(|p| root.materials.get(p.material?));
    let mut colors = materials.filter_map(|m| m.pbr_metallic_roughness.as_ref()?.base_color_texture.as_ref());
    let image = colors.find_map(|info| root.images.get(root.textures.get(info.index)?.source?))?;
    let view = root.buffer_views.get(image.buffer_view?)?;
    if view.buffer != 0 || view.extensions.is_some() {
        return None;
    }
    bin.get(view.byte_offset.unwrap_or(0)..)?.get(..view.byte_length)
}
