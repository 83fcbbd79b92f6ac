//! glTF 2.0: the importer. Every node becomes a bone, every primitive of the scene a mesh instance.
//!
//! The JSON gets its types from the `gltf` crate's schema; every index, length and number is checked here before it is used,
//! so that any bytes whatever end in an asset or in an error.

mod accessor;
mod attributes;
mod bake;
mod beside;
mod carried;
mod clips;
mod compress;
mod compressed;
mod container;
mod document;
mod draco;
mod error;
mod extensions;
mod geometry;
mod glance;
mod influences;
mod keys;
mod material;
mod mend;
mod mounts;
mod nodes;
mod pictures;
mod prune;
mod quantize;
mod rewrite;
mod skins;
mod surface;
mod textures;
mod triangles;
mod uri;
mod warnings;
mod wear;
mod write;

pub use carried::{Carried, carried};
pub use error::GltfError;
pub use quantize::{MeshForm, vertices_of};
pub use rewrite::{Change, NewClip, Rewritten, changed};
pub use wear::wear;
pub use write::write;

use super::{Import, Options};
use crate::asset::Asset;
use crate::character::Character;
use document::Document;
use error::Result;
use std::mem::take;
use std::path::Path;
use warnings::Warnings;

/// Read a `.gltf` or `.glb` file, told apart by content, and the buffers and pictures beside it.
///
/// ```
/// use sinew::io::{Options, gltf};
/// let text = br#"{ "asset": { "version": "2.0" }, "nodes": [{ "name": "hip" }, { "name": "hip" }] }"#;
/// let import = gltf::import_bytes(text, None, &Options::default()).unwrap();
/// assert_eq!(import.asset.character.skeleton().len(), 2);
/// assert!(import.warnings[0].to_string().starts_with("nodes[1].name: "));
/// let e = gltf::import_bytes(b"glTF", None, &Options::default()).unwrap_err();
/// assert!(e.to_string().starts_with("byte 4: expected a GLB version"));
/// ```
///
/// # Errors
/// [`GltfError`], with the place in the file, what was expected and what was found.
pub fn import(path: &Path, options: &Options) -> std::result::Result<Import, GltfError> {
    let file = || path.display().to_string();
    let read = |source| GltfError::Read { place: "file".into(), file: file(), source };
    let bytes = super::read_file(path).map_err(read)?;
    let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    import_bytes(&bytes, folder, options)
}

/// Read a file's bytes; `base_dir` is where its relative URIs are looked up; without one they are errors.
///
/// # Errors
/// [`GltfError`], with the place in the file, what was expected and what was found.
pub fn import_bytes(
    bytes: &[u8],
    base_dir: Option<&Path>,
    options: &Options,
) -> std::result::Result<Import, GltfError> {
    import_while(bytes, base_dir, options, &mut |_| ())
}

/// [`import_bytes`], and what [`super::import_while`] says.
pub(super) fn import_while(
    bytes: &[u8],
    base_dir: Option<&Path>,
    options: &Options,
    meanwhile: &mut dyn FnMut(&Import),
) -> Result<Import> {
    let mut w = Warnings::default();
    let parts = container::split(bytes)?;
    std::thread::scope(|scope| {
        let ahead = options.textures.then(|| pictures::Ahead::begin(scope, &parts)).flatten();
        let root = mend::root(parts.json, &mut w)?;
        extensions::check(&root, &mut w)?;
        let doc = Document::new(root, parts.bin, base_dir, &mut w)?;
        assemble(&doc, base_dir, options, ahead, meanwhile, w)
    })
}

fn assemble(
    doc: &Document,
    base: Option<&Path>,
    options: &Options,
    ahead: Option<pictures::Ahead>,
    meanwhile: &mut dyn FnMut(&Import),
    mut w: Warnings,
) -> Result<Import> {
    let nodes = nodes::build(doc, &clips::animated(doc), &mut w)?;
    let mut geometry = geometry::build(doc, &nodes, &mut w)?;
    let clips = clips::build(doc, &nodes, &geometry.runs, &mut w)?;
    let (meshes, instances) = (take(&mut geometry.meshes), take(&mut geometry.instances));
    let character =
        Character::new(nodes.skeleton, meshes, instances, take(&mut geometry.rest_weights), clips)?;
    let cameras = mounts::cameras(doc, &nodes.in_scene, &nodes.bone_of, &mut w)?;
    let lights = mounts::lights(doc, &nodes.in_scene, &nodes.bone_of, &character)?;
    let mut extensions = doc.root.extensions_used.clone();
    extensions.extend(doc.root.extensions_required.iter().cloned());
    extensions.sort();
    extensions.dedup();
    let mut import = Import {
        asset: Asset { character, cameras, lights, ..Asset::default() },
        format: "glTF".into(),
        generator: doc.root.asset.generator.clone().unwrap_or_default(),
        nodes: nodes.node_of,
        primitives: take(&mut geometry.sources),
        extensions,
        ..Import::default()
    };
    if ahead.as_ref().is_some_and(pictures::Ahead::is_at_work) {
        meanwhile(&import);
    }
    let looks = material::build(doc, base, options, &geometry, ahead, &mut w)?;
    (import.asset.materials, import.asset.textures) = (looks.materials, looks.textures);
    import.warnings = w.finish();
    Ok(import)
}
