//! Documents to files: our rig and poses, and glTF.

use super::open::{Kind, Source, named};
use sinew::asset::Asset;
use sinew::bake::{BakeDesc, Metric, xzx};
use sinew::character::Character;
use sinew::clip::{Clip, Target};
use sinew::image::Rgba8;
use sinew::io::picture::{AtomicFile, Folder, PngLevel, encode_png};
use sinew::io::{self, Options, Warning, gltf, rig_json};
use sinew::time::Timeline;
use std::path::{Path, PathBuf};

/// Write bytes whole or not at all, over what is there.
///
/// # Errors
/// What the system says, with the file's name.
pub fn put(path: &Path, bytes: &[u8]) -> Result<(), String> {
    AtomicFile::write(path, bytes, true, Folder::MustExist).map_err(|e| named(path, &e))
}

/// Save: a rig's poses where they came from; anything else as a rig at `to`.
///
/// # Errors
/// A message with the file that could not be written.
pub fn save(
    to: &Path,
    source: Option<&Source>,
    asset: &Asset,
    clips: &[Clip],
    timeline: &Timeline,
) -> Result<Vec<String>, String> {
    if !to.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        let hint = "expected a name that ends in .json; glTF and pictures are exported";
        return Err(format!("{}: {hint}", to.display()));
    }
    let own = source.is_some_and(|s| s.kind == Kind::Rig && s.path == to);
    if own {
        return poses_of(to, &asset.character, clips, timeline);
    }
    let stem = to.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<String> = (0..asset.textures.len()).map(|i| format!("{stem}.{i}.png")).collect();
    for (name, png) in names.iter().zip(pictures(asset)?) {
        put(&to.with_file_name(name), &png)?;
    }
    let mut rig = rig_json::export(&stem, asset, &names);
    let poses = format!("{stem}.poses.json");
    rig.document.poses = Some(vec![poses.clone()]);
    let of_clips = rig_json::export_poses(&asset.character, clips);
    let text = of_clips.document.with_timeline(timeline).to_text();
    put(&to.with_file_name(poses), text.as_bytes())?;
    put(to, rig.document.to_text().as_bytes())?;
    let all = rig.warnings.iter().chain(&of_clips.warnings);
    Ok(all.map(Warning::to_string).collect())
}

/// Poses of a rig that stays as it is.
fn poses_of(
    rig: &Path,
    character: &Character,
    clips: &[Clip],
    timeline: &Timeline,
) -> Result<Vec<String>, String> {
    let bytes = io::read_file(rig).map_err(|e| named(rig, &e))?;
    let mut document = rig_json::Rig::from_bytes(&bytes).map_err(|e| named(rig, &e))?;
    let folder = rig.parent().unwrap_or(Path::new(""));
    let beside = folder.join("../poses").join(rig.file_name().unwrap_or_default());
    let place: PathBuf = match document.poses.as_deref() {
        Some([one]) => folder.join(one),
        None if beside.is_file() => beside,
        None | Some([]) => {
            let name = format!("{}.poses.json", rig.file_stem().unwrap_or_default().to_string_lossy());
            document.poses = Some(vec![name.clone()]);
            put(rig, document.to_text().as_bytes())?;
            folder.join(name)
        }
        Some(several) => {
            return Err(format!(
                "{}: its poses come from {} files; save it elsewhere",
                rig.display(),
                several.len()
            ));
        }
    };
    let poses = rig_json::export_poses(character, clips);
    put(&place, poses.document.with_timeline(timeline).to_text().as_bytes())?;
    Ok(poses.warnings.iter().map(Warning::to_string).collect())
}

/// Textures as PNG.
fn pictures(asset: &Asset) -> Result<Vec<Vec<u8>>, String> {
    let encode = |t: &sinew::scene::Texture| {
        let (width, height) = (t.width() as usize, t.height() as usize);
        encode_png(&Rgba8 { width, height, data: t.rgba() }, PngLevel::Balanced).map_err(|e| e.to_string())
    };
    asset.textures.iter().map(encode).collect()
}

/// How clips are measured where their kind of rotation changes.
pub fn desc(character: &Character) -> BakeDesc {
    let posed = character.posed(&character.rest_pose());
    let ends = character.skeleton().ids().map(|b| posed.origin(b));
    let (low, high) =
        ends.fold((glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let size = (high - low).length();
    let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
    let skinned = character.meshes().iter().any(|m| !m.positions.is_empty());
    let metric = if skinned { Metric::Vertices } else { Metric::Shell(0.03 * size) };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    BakeDesc { tolerance: 1e-4 * size, metric, quantize: false, threads, ..BakeDesc::default() }
}

/// A clip in the words that glTF has, and which tracks are short.
fn for_gltf(character: &Character, clip: &Clip) -> Result<(Clip, Vec<bool>), String> {
    if !clip.tracks.iter().any(|t| matches!(t.target, Target::Xzx(_))) {
        return Ok((clip.clone(), vec![]));
    }
    let baked =
        xzx::to_quat(character, clip, &desc(character)).map_err(|e| format!("clip `{}`: {e}", clip.name))?;
    Ok((baked.clip, baked.short))
}

/// A glTF file with these clips: the source's own, everything else in it carried through, or a new one.
///
/// # Errors
/// A message with the file that could not be read or written.
pub fn gltf(
    to: &Path,
    source: Option<&Source>,
    asset: &Asset,
    clips: &[Clip],
) -> Result<Vec<String>, String> {
    let ready = clips.iter().map(|c| for_gltf(&asset.character, c)).collect::<Result<Vec<_>, _>>()?;
    let own = source.filter(|s| s.kind == Kind::Gltf);
    let there = own.map_or(0, |_| asset.character.clips().len());
    let new = |(i, c): (usize, &'_ (Clip, Vec<bool>))| {
        (i < there).then_some(i).filter(|_| clips.len() == there && !c.0.tracks.is_empty())
    };
    let new: Vec<gltf::NewClip> = ready
        .iter()
        .enumerate()
        .map(|(i, c)| gltf::NewClip { clip: &c.0, short: &c.1, replaces: new((i, c)), carried: None })
        .collect();
    let (out, notes) = match own {
        Some(source) => {
            let bytes = io::read_file(&source.path).map_err(|e| named(&source.path, &e))?;
            let folder = source.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let import =
                io::import(&source.path, &Options::default()).map_err(|e| named(&source.path, &e))?;
            let bad = |e: gltf::GltfError| named(&source.path, &e);
            let change = gltf::Change { clips: &new, ..Default::default() };
            let mut out = gltf::changed(&bytes, Some(folder), &import, change).map_err(bad)?;
            out.embed_pictures(Some(folder)).map_err(bad)?;
            (out, vec![])
        }
        None => {
            let written = gltf::write(asset, &pictures(asset)?, &new, Default::default());
            written.map_err(|e| named(to, &e))?
        }
    };
    if to.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        let bin = to.with_extension("bin");
        put(&bin, &out.bin)?;
        put(to, &out.gltf(&bin.file_name().unwrap_or_default().to_string_lossy()))?;
    } else {
        put(to, &out.glb())?;
    }
    Ok(notes.iter().map(Warning::to_string).collect())
}
