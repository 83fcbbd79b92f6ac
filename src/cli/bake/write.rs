//! The file that comes out.

use super::report::Done;
use super::{Args, fresh, to};
use crate::cli::{Failure, say::Say};
use serde_json::{Map, Value};
use sinew::io::picture::{AtomicFile, Folder};
use sinew::io::{self, Import, gltf};
use std::path::Path;

/// Say so before the work and not after it.
pub(super) fn check_output(args: &Args) -> Result<(), Failure> {
    let name = args.output.display();
    let known = args
        .output
        .extension()
        .is_some_and(|e| ["glb", "gltf", "json"].iter().any(|k| e.eq_ignore_ascii_case(k)));
    if !known {
        return Err(Failure::Usage(format!("-o {name}: expected a name that ends in .glb, .gltf or .json")));
    }
    if args.output.exists() && !args.force {
        return Err(Failure::Run(format!("{name}: the file exists; --force overwrites it")));
    }
    let folder = args.output.parent().filter(|p| !p.as_os_str().is_empty());
    match folder.filter(|f| !f.is_dir()) {
        Some(folder) => Err(Failure::Run(format!("{name}: there is no folder {}", folder.display()))),
        None => Ok(()),
    }
}

pub(super) fn write(
    args: &Args,
    import: &Import,
    done: &[Done],
    report: &Value,
    say: &Say,
) -> Result<(), Failure> {
    let extras = Map::from_iter([("sinew".to_owned(), report.clone())]);
    if to::is_rig(&args.output) {
        for (name, bytes) in fresh::rig(&args.output, &args.input, import, done, say)? {
            put(args, &args.output.with_file_name(name), &bytes)?;
        }
        return Ok(());
    }
    let out = match import.format.as_str() {
        "glTF" => rewritten(args, import, done, extras)?,
        _ => fresh::gltf(&args.input, import, done, extras, say)?,
    };
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        let bin = args.output.with_extension("bin");
        let uri = bin.file_name().unwrap_or_default().to_string_lossy().into_owned();
        put(args, &bin, &out.bin)?;
        return put(args, &args.output, &out.gltf(&uri));
    }
    put(args, &args.output, &out.glb())
}

fn put(args: &Args, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    AtomicFile::write(path, bytes, args.force, Folder::MustExist).map_err(|e| Failure::Run(e.to_string()))
}

/// The input with other clips.
fn rewritten(
    args: &Args,
    import: &Import,
    done: &[Done],
    extras: Map<String, Value>,
) -> Result<gltf::Rewritten, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", args.input.display()));
    let bytes = io::read_file(&args.input).map_err(|e| bad(&e))?;
    let folder = args.input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let clips: Vec<gltf::NewClip> = done
        .iter()
        .map(|d| gltf::NewClip { clip: &d.baked.clip, short: &d.baked.short, replaces: d.replaces })
        .collect();
    let name = args.input.display().to_string();
    let mut out =
        gltf::with_clips(&bytes, Some(folder), &name, import, &clips, extras).map_err(|e| bad(&e))?;
    // What lies beside the input is not beside an output in another folder.
    let there = args.output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.canonicalize().ok() != there.canonicalize().ok() {
        out.embed_pictures(Some(folder)).map_err(|e| bad(&e))?;
    }
    Ok(out)
}
