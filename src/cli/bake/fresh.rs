//! Files that do not come from a glTF file: rigs of ours, and glTF of other formats.

use super::report::Done;
use crate::cli::{Failure, say::Say};
use serde_json::{Map, Value};
use sinew::asset::Asset;
use sinew::clip::Clip;
use sinew::image::Rgba8;
use sinew::io::picture::{PngLevel, encode_png};
use sinew::io::{Import, gltf, rig_json};
use sinew::scene::Texture;
use std::path::Path;

/// A glTF file of an import of any format.
pub(super) fn gltf(
    input: &Path,
    import: &Import,
    done: &[Done],
    extras: Map<String, Value>,
    say: &Say,
) -> Result<gltf::Rewritten, Failure> {
    let pictures = pictures(&import.asset)?;
    let new: Vec<gltf::NewClip> = done
        .iter()
        .map(|d| gltf::NewClip { clip: &d.baked.clip, short: &d.baked.short, replaces: None, carried: None })
        .collect();
    let bad = |e: gltf::GltfError| Failure::Input(format!("{}: {e}", input.display()));
    let (out, warnings) = gltf::write(&import.asset, &pictures, &new, extras).map_err(bad)?;
    say.warnings(input, &warnings);
    Ok(out)
}

/// An asset's textures as PNG.
pub(super) fn pictures(asset: &Asset) -> Result<Vec<Vec<u8>>, Failure> {
    asset.textures.iter().map(png).collect()
}

fn png(texture: &Texture) -> Result<Vec<u8>, Failure> {
    let [width, height] = [texture.width(), texture.height()].map(|n| n as usize);
    let picture = Rgba8 { width, height, data: texture.rgba() };
    encode_png(&picture, PngLevel::Balanced).map_err(|e| Failure::Run(e.to_string()))
}

/// A rig, its poses and its pictures: their names, the rig last, and what is in them.
pub(super) fn rig(
    output: &Path,
    input: &Path,
    import: &Import,
    done: &[Done],
    say: &Say,
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let names: Vec<String> = (0..import.asset.textures.len()).map(|i| format!("{stem}.{i}.png")).collect();
    let mut rig = rig_json::export(&stem, &import.asset, &names);
    let clips: Vec<Clip> = done.iter().map(|d| d.baked.clip.clone()).collect();
    let poses = rig_json::export_poses(&import.asset.character, &clips);
    say.warnings(input, &rig.warnings);
    say.warnings(input, &poses.warnings);
    let of = &import.timeline;
    let held = [
        ("frame rate", of.rate.is_some()),
        ("ranges", of.clips.iter().any(|c| c.range.is_some() || c.preview.is_some())),
        ("markers", of.clips.iter().any(|c| !c.markers.is_empty())),
    ];
    let lost: Vec<&str> = held.iter().filter(|k| k.1).map(|k| k.0).collect();
    if !lost.is_empty() {
        let lost = lost.join(", ");
        say.warn(&format!("{}: left out, since bakes may change times: {lost}", input.display()));
    }
    let mut files = vec![];
    for (name, texture) in names.iter().zip(&import.asset.textures) {
        if rig.document.materials.iter().any(|m| m.texture.as_ref() == Some(name)) {
            files.push((name.clone(), png(texture)?));
        }
    }
    let beside = format!("{stem}.poses.json");
    rig.document.poses = Some(vec![beside.clone()]);
    files.push((beside, poses.document.to_text().into_bytes()));
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    files.push((name, rig.document.to_text().into_bytes()));
    Ok(files)
}
