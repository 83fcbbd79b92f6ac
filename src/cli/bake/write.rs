//! The file that comes out.

use super::report::Done;
use super::{Args, fresh, to};
use crate::cli::batch::{self, Names};
use crate::cli::{Failure, say, say::Say};
use serde_json::{Map, Value, json};
use sinew::io::gltf::{Carried, MeshForm};
use sinew::io::picture::{AtomicFile, Folder};
use sinew::io::{self, Import, gltf};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Say so before the work and not after it.
pub(super) fn check_name(name: &str, endings: &[&str]) -> Result<(), Failure> {
    let known =
        Path::new(name).extension().is_some_and(|e| endings.iter().any(|k| e.eq_ignore_ascii_case(k)));
    match known {
        true => Ok(()),
        false => {
            let all = endings.join(", .");
            Err(Failure::Usage(format!("-o {name}: expected a name that ends in one of .{all}")))
        }
    }
}

/// The output's name, which no other output of this run has.
pub(super) fn claim(
    args: &Args,
    names: &mut Names,
    input: &Path,
    clip: &str,
    index: usize,
) -> Result<PathBuf, Failure> {
    let output = PathBuf::from(names.fill(input, clip, index));
    let source = if clip.is_empty() { String::new() } else { format!("clip {} of ", say::name(clip)) };
    names.claim(output.clone(), format!("{source}{}", input.display()))?;
    batch::keep_inputs(args.inputs.iter(), &output)?;
    Ok(output)
}

pub(super) fn check_output(args: &Args, names: &Names, output: &Path) -> Result<(), Failure> {
    let name = output.display();
    if output.exists() && !args.force {
        return Err(Failure::Run(format!("{name}: the file exists; --force overwrites it")));
    }
    if names.template.tells_inputs() || names.template.tells_clips() {
        return batch::make_folder(output);
    }
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty());
    match folder.filter(|f| !f.is_dir()) {
        Some(folder) => Err(Failure::Run(format!("{name}: there is no folder {}", folder.display()))),
        None => Ok(()),
    }
}

pub(super) fn write(
    args: &Args,
    input: &Path,
    output: &Path,
    import: &Import,
    done: &[Done],
    forms: Option<&BTreeMap<usize, MeshForm>>,
    report: &Value,
    say: &Say,
) -> Result<(), Failure> {
    let extras = Map::from_iter([("sinew".to_owned(), report.clone())]);
    if to::is_rig(output) {
        let files = fresh::rig(output, input, import, done, say)?;
        let files = files.iter().map(|(name, bytes)| (output.with_file_name(name), &bytes[..]));
        return put_together(args, &files.collect::<Vec<_>>());
    }
    let mut out = match import.format.as_str() {
        "glTF" => rewritten(args, input, import, done, extras)?,
        _ => fresh::gltf(input, import, done, extras, say)?,
    };
    notes(args, import, done, &mut out);
    // What lies beside the input is not beside an output in another folder.
    let there = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder(input);
    let bad = |e| Failure::Input(format!("{}: {e}", input.display()));
    if folder.canonicalize().ok() != there.canonicalize().ok() {
        out.embed_pictures(Some(folder)).map_err(bad)?;
    }
    if let Some(forms) = forms {
        out.quantize(forms).map_err(bad)?;
    }
    // What came packed does not grow.
    if let Some(extension) = out.stranger().filter(|_| args.forms.meshopt) {
        return Err(stranger("--meshopt", extension));
    }
    if args.forms.meshopt || import.extensions.iter().any(|e| e.ends_with("_meshopt_compression")) {
        out.compress().map_err(bad)?;
    }
    put(args, output, &out)
}

/// One file, or two.
pub(super) fn put(args: &Args, output: &Path, out: &gltf::Rewritten) -> Result<(), Failure> {
    if output.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        let bin = output.with_extension("bin");
        let uri = bin.file_name().unwrap_or_default().to_string_lossy().into_owned();
        return put_together(args, &[(bin, &out.bin), (output.to_owned(), &out.gltf(&uri))]);
    }
    put_bytes(args, output, &out.glb())
}

pub(super) fn put_bytes(args: &Args, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    AtomicFile::write(path, bytes, args.force, Folder::MustExist).map_err(|e| Failure::Run(e.to_string()))
}

pub(super) fn put_together(args: &Args, files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    AtomicFile::write_together(files, args.force, Folder::MustExist).map_err(|e| Failure::Run(e.to_string()))
}

fn folder(input: &Path) -> &Path {
    input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The input with other clips.
pub(super) fn rewritten(
    args: &Args,
    input: &Path,
    import: &Import,
    done: &[Done],
    extras: Map<String, Value>,
) -> Result<gltf::Rewritten, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", input.display()));
    let bytes = io::read_file(input).map_err(|e| bad(&e))?;
    let clips: Vec<gltf::NewClip> = done
        .iter()
        .map(|d| gltf::NewClip {
            clip: &d.baked.clip,
            short: &d.baked.short,
            replaces: d.edited.replaces.filter(|_| args.motion.is_empty()),
            carried: Some(&d.edited.carried),
        })
        .collect();
    let change = gltf::Change { clips: &clips, extras, influences: args.forms.limits() };
    gltf::changed(&bytes, Some(folder(input)), import, change).map_err(|e| bad(&e))
}

/// Bytes cannot move where more may be said of them than is known.
pub(super) fn stranger(option: &str, extension: &str) -> Failure {
    let message = format!(
        "{option}: `{extension}` may say where bytes are; take it out of the file first, or leave {option} out"
    );
    Failure::Usage(message)
}

/// What the input's clips move beside bones.
pub(super) fn beyond(args: &Args, input: &Path, import: &Import) -> Result<Vec<Vec<Carried>>, Failure> {
    if !args.motion.is_empty() || !import.extensions.iter().any(|e| e == "KHR_animation_pointer") {
        return Ok(vec![]);
    }
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", input.display()));
    let bytes = io::read_file(input).map_err(|e| bad(&e))?;
    gltf::carried(&bytes, Some(folder(input))).map_err(|e| bad(&e))
}

/// What the clips' edits leave to be said.
fn notes(args: &Args, import: &Import, done: &[Done], out: &mut gltf::Rewritten) {
    for (i, d) in done.iter().enumerate() {
        if let Some(from) = args.edits.reference() {
            out.note(i, "additive", from.into());
        }
        if let Some(m) = &d.edited.motion {
            let bone = import.asset.character.skeleton().name(m.bone);
            let way: Vec<[f64; 3]> = m.translations.iter().map(|t| t.to_array()).collect();
            out.note(
                i,
                "rootMotion",
                json!({"bone": bone, "times": m.times, "translations": way, "yaw": m.yaw}),
            );
            out.add_moving_node(i, "root motion", &m.times, &way, &m.yaw);
        }
    }
}
