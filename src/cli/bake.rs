//! `sinew bake`: curves to curves within an error.

use super::{Failure, load, print, say::Say};
use serde_json::{Map, Value, json};
use sinew::bake::{self, BakeDesc, BakeError, Baked, Gauge, Metric, Spot, edit};
use sinew::clip::Clip;
use sinew::io::picture::{AtomicFile, Folder};
use sinew::io::{self, Import, Options, gltf};
use sinew::time::Range;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sinew bake fox.glb -o small.glb                       0.01% of the character's diagonal
  sinew bake fox.glb -o small.glb --tolerance 0.5mm
  sinew bake fox.glb -o run.gltf --clip Run --json
  sinew bake fox.glb -o back.glb --clip Walk --trim 0.2..0.6 --reverse --speed 1.5
  sinew bake fox.glb -o all.glb --concat Everything

No vertex of the skin moves by more than the tolerance, at any time: at keys, at frames and between them, compared
240 times a second or more, with an estimate of what hides between. What was reached is printed
and written into asset.extras.sinew. Everything but the animations is carried through untouched. Where the bound cannot be kept, nothing is
written and the exit code is 4.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb).
    input: PathBuf,
    /// Where the result goes: .glb, or .gltf with a .bin beside it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// How far any vertex may be off: metres (0.001, 1m, 2cm, 0.5mm) or a part of the rest pose's diagonal (0.02%).
    #[arg(long, value_name = "LENGTH|PERCENT", default_value = "0.01%", value_parser = tolerance)]
    tolerance: Tolerance,
    /// What must not stray: every vertex of the skin, or a shell of this radius around every bone (shell:3cm).
    #[arg(long, value_name = "vertices|shell:LENGTH", default_value = "vertices", value_parser = metric)]
    metric: Metric,
    /// A bone whose origin and tip must keep to less, as in LeftFoot=0.01mm; may be given several times.
    #[arg(long, value_name = "BONE=LENGTH", value_parser = pin)]
    pin: Vec<(String, f64)>,
    /// Only this clip, by name or index; all of them by default.
    #[arg(long, value_name = "NAME|INDEX")]
    clip: Option<String>,
    /// Only this part of each clip, in seconds; either end may be left out.
    #[arg(long, value_name = "FROM..TO", value_parser = part, allow_hyphen_values = true)]
    trim: Option<[Option<f64>; 2]>,
    /// Turn the clips round.
    #[arg(long)]
    reverse: bool,
    /// Play faster: 2 lasts half as long.
    #[arg(long, value_name = "FACTOR", value_parser = factor, allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Join the clips into one of this name.
    #[arg(long, value_name = "NAME", conflicts_with = "clip")]
    concat: Option<String>,
    /// Keep rotations as 32-bit floating point.
    #[arg(long)]
    no_quantize: bool,
    /// Worker threads; one a core by default. The result does not depend on them.
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    /// Overwrite an existing file.
    #[arg(short, long)]
    force: bool,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy)]
enum Tolerance {
    Metres(f64),
    OfDiagonal(f64),
}

fn tolerance(text: &str) -> Result<Tolerance, String> {
    let units = [("%", 0.01), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("", 1.0)];
    let (unit, scale) = units.into_iter().find(|u| text.ends_with(u.0)).expect("the last fits all");
    let number = text[..text.len() - unit.len()].trim().parse::<f64>();
    match number.map(|n| n * scale) {
        Ok(n) if n > 0.0 && n.is_finite() && unit == "%" => Ok(Tolerance::OfDiagonal(n)),
        Ok(n) if n > 0.0 && n.is_finite() => Ok(Tolerance::Metres(n)),
        _ => Err("expected a length above 0 (0.5mm, 2cm, 0.001) or a part of the diagonal (0.02%)".into()),
    }
}

/// `0.5..2`, `..2` or `0.5..`.
fn part(text: &str) -> Result<[Option<f64>; 2], String> {
    let wrong = || "expected two times in seconds, as in 0.5..2, ..2 or 0.5..".to_owned();
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let end = |t: &str| match t.trim() {
        "" => Ok(None),
        t => t.parse::<f64>().ok().filter(|t| t.is_finite()).map(Some).ok_or_else(wrong),
    };
    match [end(from)?, end(to)?] {
        [Some(a), Some(b)] if a >= b => Err(format!("{a} is not before {b}")),
        ends => Ok(ends),
    }
}

fn factor(text: &str) -> Result<f64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|f| (1e-3..=1e3).contains(f))
        .ok_or_else(|| "expected a number from 0.001 to 1000, as in 2 or 0.5".into())
}

/// The clips as they are to be baked, and which of the file's each takes the place of.
fn edited(args: &Args, import: &Import, chosen: &[usize]) -> Result<Vec<(Clip, Option<usize>)>, Failure> {
    let clips = import.asset.character.clips();
    let mut out = vec![];
    for &c in chosen {
        let mut clip = clips[c].clone();
        if let Some([from, to]) = args.trim {
            let whole = clip.playback();
            let range = Range { start: from.unwrap_or(whole.start), end: to.unwrap_or(whole.end) };
            if range.start >= whole.end || range.end <= whole.start || range.start >= range.end {
                let (name, Range { start, end }) = (super::say::name(&clip.name), whole);
                let message =
                    format!("--trim: clip {name} runs from {start} to {end} s; nothing would be left of it");
                return Err(Failure::Usage(message));
            }
            clip = edit::trim(&clip, range);
        }
        if args.reverse {
            clip = edit::reverse(&clip);
        }
        if let Some(factor) = args.speed {
            clip = edit::speed(&clip, factor);
        }
        out.push((clip, Some(c)));
    }
    if let Some(name) = &args.concat {
        let all: Vec<&Clip> = out.iter().map(|c| &c.0).collect();
        out = vec![(edit::concat(name, &all), None)];
    }
    Ok(out)
}

fn metres(text: &str) -> Option<f64> {
    match tolerance(text) {
        Ok(Tolerance::Metres(m)) => Some(m),
        _ => None,
    }
}

fn metric(text: &str) -> Result<Metric, String> {
    let shell = text.strip_prefix("shell:").and_then(metres).map(Metric::Shell);
    let metric = if text == "vertices" { Some(Metric::Vertices) } else { shell };
    metric.ok_or_else(|| "expected vertices, or shell: and a length, as in shell:3cm".into())
}

fn pin(text: &str) -> Result<(String, f64), String> {
    let pin = text.rsplit_once('=').and_then(|(bone, length)| Some((bone.to_owned(), metres(length)?)));
    pin.ok_or_else(|| "expected a bone and a length, as in LeftFoot=0.01mm".into())
}

/// Say so before the work and not after it.
fn check_output(args: &Args) -> Result<(), Failure> {
    let name = args.output.display();
    let known =
        args.output.extension().is_some_and(|e| ["glb", "gltf"].iter().any(|k| e.eq_ignore_ascii_case(k)));
    if !known {
        return Err(Failure::Usage(format!("-o {name}: expected a name that ends in .glb or .gltf")));
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

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    check_output(args)?;
    let import = load(&args.input, Options::default(), say)?;
    if import.format != "glTF" {
        let message =
            format!("{}: baking reads glTF files; this is a {}", args.input.display(), import.format);
        return Err(Failure::Usage(message));
    }
    let clips = import.asset.character.clips();
    let chosen: Vec<usize> = match super::find_clip(&import, args.clip.as_deref())? {
        Some(one) if args.clip.is_some() => vec![one],
        _ => (0..clips.len()).collect(),
    };
    if chosen.is_empty() {
        return Err(Failure::Input(format!("{}: there are no clips to bake", args.input.display())));
    }
    let threads =
        args.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, Into::into), Into::into);
    let diagonal = Gauge::new(&import.asset.character, threads).diagonal();
    let pins = args.pin.iter().map(|(name, limit)| {
        let bone = import.asset.character.skeleton().find(name);
        let missing =
            || Failure::Usage(format!("--pin {name}: there is no such bone; `sinew info` lists them"));
        Ok((bone.ok_or_else(missing)?, *limit))
    });
    let pins = pins.collect::<Result<_, _>>()?;
    let metres = match args.tolerance {
        Tolerance::Metres(m) => m,
        Tolerance::OfDiagonal(part) => part * diagonal,
    };
    let desc =
        BakeDesc { tolerance: metres, metric: args.metric, pins, quantize: !args.no_quantize, threads };
    let clips = edited(args, &import, &chosen)?;
    let bar = say.progress(clips.len());
    let mut done = vec![];
    for (clip, replaces) in &clips {
        let baked = bake::bake(&import.asset.character, clip, &desc).map_err(|e| match e {
            BakeError::Missed { .. } => Failure::Differs(format!("{}: {e}", args.input.display())),
            _ => Failure::Usage(format!("{}: {e}", args.input.display())),
        })?;
        done.push(Done { clip, replaces: *replaces, baked });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = report(&import, &done, args.metric, metres, diagonal);
    write(args, &import, &done, &report)?;
    if args.json {
        return print(format!("{report:#}\n").as_bytes());
    }
    for d in &done {
        say.note(&line(&import, d, diagonal));
    }
    say.note(&format!("wrote {}", args.output.display()));
    Ok(())
}

/// A clip, and what was made of it.
struct Done<'a> {
    clip: &'a Clip,
    replaces: Option<usize>,
    baked: Baked,
}

fn bone_of(import: &Import, b: &Baked) -> String {
    let character = &import.asset.character;
    let bone = match b.report.worst.spot {
        Some(Spot::Vertex { instance, vertex }) => character.bones_of(instance, vertex).next(),
        Some(Spot::Bone(bone)) => Some(bone),
        None => None,
    };
    bone.map_or_else(String::new, |b| character.skeleton().name(b).into())
}

fn line(import: &Import, done: &Done, diagonal: f64) -> String {
    let (clip, r) = (done.clip, &done.baked.report);
    format!(
        "{}: {} → {} keys, {} → {} bytes; at most {:.4} mm off ({:.4}% of the diagonal), at {:.3} s on {}",
        super::say::name(&clip.name),
        r.keys[0],
        r.keys[1],
        r.bytes[0],
        r.bytes[1],
        1e3 * r.ceiling * r.worst.limit,
        100.0 * r.ceiling * r.worst.limit / diagonal.max(1e-30),
        r.worst.time,
        super::say::name(&bone_of(import, &done.baked)),
    )
}

fn worst(import: &Import, b: &Baked) -> Value {
    let mut worst = json!({"time": b.report.worst.time, "bone": bone_of(import, b)});
    if let Some(Spot::Vertex { instance, vertex }) = b.report.worst.spot {
        (worst["instance"], worst["vertex"]) = (instance.into(), vertex.into());
    }
    worst
}

fn report(import: &Import, done: &[Done], metric: Metric, metres: f64, diagonal: f64) -> Value {
    let metric_name = match metric {
        Metric::Vertices => "vertices".to_owned(),
        Metric::Shell(radius) => format!("shell of {radius} m"),
    };
    let clips = done.iter().map(|d| {
        let (b, r) = (&d.baked, &d.baked.report);
        json!({
            "clip": d.clip.name,
            "error": r.ceiling * r.worst.limit,
            "measured": r.worst.distance,
            "limit": r.worst.limit,
            "worst": worst(import, b),
            "moments": r.moments,
            "keys": r.keys,
            "bytes": r.bytes,
        })
    });
    json!({"tolerance": metres, "diagonal": diagonal, "metric": metric_name, "clips": clips.collect::<Vec<_>>()})
}

fn write(args: &Args, import: &Import, done: &[Done], report: &Value) -> Result<(), Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", args.input.display()));
    let bytes = io::read_file(&args.input).map_err(|e| bad(&e))?;
    let folder = args.input.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let clips: Vec<gltf::NewClip> = done
        .iter()
        .map(|d| gltf::NewClip { clip: &d.baked.clip, short: &d.baked.short, replaces: d.replaces })
        .collect();
    let extras = Map::from_iter([("sinew".to_owned(), report.clone())]);
    let name = args.input.display().to_string();
    let mut out =
        gltf::with_clips(&bytes, Some(folder), &name, import, &clips, extras).map_err(|e| bad(&e))?;
    // What lies beside the input is not beside an output in another folder.
    let there = args.output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.canonicalize().ok() != there.canonicalize().ok() {
        out.embed_pictures(Some(folder)).map_err(|e| bad(&e))?;
    }
    let put = |path: &Path, bytes: &[u8]| {
        AtomicFile::write(path, bytes, args.force, Folder::MustExist).map_err(|e| Failure::Run(e.to_string()))
    };
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        let bin = args.output.with_extension("bin");
        let uri = bin.file_name().unwrap_or_default().to_string_lossy().into_owned();
        put(&bin, &out.bin)?;
        return put(&args.output, &out.gltf(&uri));
    }
    put(&args.output, &out.glb())
}
