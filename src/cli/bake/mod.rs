//! `sinew bake`: curves to curves within an error.

mod clips;
mod forms;
mod fresh;
mod mesh;
mod motion;
mod report;
mod to;
mod values;
mod write;

use super::batch::{Names, Outcome};
use super::{Failure, load, print, say, say::Say};
use clips::EditArgs;
use forms::Forms;
use report::Done;
use serde_json::{Value, json};
use sinew::bake::edit::EditError;
use sinew::bake::{BakeDesc, BakeError, Gauge, Goal, Metric, Stage};
use sinew::clip::Clip;
use sinew::io::{Import, Options};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use values::{Tolerance, fewest, metric, pin, tolerance};

const EXAMPLES: &str = "\
Examples:
  sinew bake fox.glb -o small.glb                       0.01% of the character's diagonal
  sinew bake fox.glb -o small.glb --tolerance 0.5mm
  sinew bake fox.glb -o run.gltf --clip Run --json
  sinew bake fox.glb -o back.glb --clip Walk --trim 0.2..0.6 --reverse --speed 1.5
  sinew bake fox.glb -o all.glb --concat Everything
  sinew bake fox.glb -o fox.json                        a rig of ours: XZX angles, to be edited
  sinew bake fox.json -o fox.glb                        and back
  sinew bake walk.bvh -o walk.glb                       a capture on its own skeleton
  sinew bake hero.glb --motion walk.bvh -o walks.glb --retarget map.json
  sinew bake walk.glb -o spot.glb --in-place --loop-blend 0.2s --mirror
  sinew bake wave.glb -o wave-add.glb --additive first --fps 30 --keep-keys
  sinew bake *.glb -o small/{name}.glb                  many files; one that fails does not stop the others
  sinew bake fox.glb -o fox.sinew                       packed clips: play them with --motion fox.sinew
  sinew bake fox.glb -o fox.stl --pose-at 0.5           as it stands, for printing and sculpting
  sinew bake fox.glb -o fox.pc2 --vertices --clip Run   where each point is, frame by frame
  sinew bake fox.glb -o light.glb --influences 2
  sinew bake fox.glb -o tiny.glb --quantize-mesh --meshopt   vertices in integers, same tolerance
  sinew bake fox.glb -o clips/{name}-{clip}.glb         each clip in a file of its own

No vertex of the skin moves by more than the tolerance, at any time: vertices are compared at all keys, and between
them until the second derivatives of the bones' motion leave no room for more. What was reached is printed and
written into asset.extras.sinew. From glTF to glTF everything but the animations is carried through untouched, unless
an option says otherwise. Where the bound cannot be kept, nothing is written and the exit code is 4.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// glTF files (.gltf, .glb), rigs (.json) or captures (.bvh).
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Where the result goes: .glb, .gltf with a .bin beside it, .json (a rig of ours) with poses and pictures beside it, or .sinew for
    /// packed clips. {name} and {folder} are the input's, {clip} and {index} make a file a clip.
    #[arg(short, long, value_name = "FILE")]
    output: String,
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
    /// What there is to be little of: bytes of the file, or keys to edit, which cubic curves need fewer of. Keys for rigs (.json), bytes
    /// otherwise.
    #[arg(long, value_name = "bytes|keys", value_parser = fewest)]
    fewest: Option<Goal>,
    /// Keep rotations and morph weights as 32-bit floating point.
    #[arg(long)]
    no_quantize: bool,
    /// Worker threads; one a core by default. The result does not depend on them.
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
    /// Overwrite an existing file.
    #[arg(short, long)]
    force: bool,
    /// Print the report as JSON: an object, or, where several files are written, a list of one for each with its `input` and its `output`
    /// or `error`.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    to: to::To,
    #[command(flatten)]
    motion: motion::Motion,
    #[command(flatten)]
    edits: EditArgs,
    #[command(flatten)]
    forms: Forms,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    let mut names = Names::new(&args.output)?;
    write::check_name(&names.example(), args.forms.endings())?;
    args.to.form(Path::new(&names.example()))?;
    args.forms.check(args, &names.example())?;
    names.tell_apart(args.inputs.len())?;
    if names.template.tells_clips() && args.edits.joins() {
        let message = "--concat makes one clip of all, and the output's name asks for a file a clip; leave out {clip} and {index}, or --concat";
        return Err(Failure::Usage(message.into()));
    }
    let many = args.inputs.len() > 1 || names.template.tells_clips();
    let (mut outcome, mut told) = (Outcome::default(), vec![]);
    for input in &args.inputs {
        if let Err(failure) = file(args, input, &mut names, &mut told, &mut outcome, say) {
            if !many {
                return Err(failure);
            }
            told.push(json!({"input": input, "error": failure.message(), "exit": failure.code()}));
            outcome.fail(failure, say);
        }
    }
    if args.json {
        let whole = if many { told.into() } else { told.pop().unwrap_or(Value::Null) };
        print(format!("{whole:#}\n").as_bytes())?;
    }
    outcome.sum_up("nothing was written")
}

/// Bake one input into one file, or into one for each of its clips.
fn file(
    args: &Args,
    input: &Path,
    names: &mut Names,
    told: &mut Vec<Value>,
    outcome: &mut Outcome,
    say: &Say,
) -> Result<(), Failure> {
    let apart = names.template.tells_clips();
    if !apart {
        let output = write::claim(args, names, input, "", 0)?;
        write::check_output(args, names, &output)?;
        let (import, motions) = read(args, input, say)?;
        return one(args, &import, &motions, input, &output, None, told, outcome, say);
    }
    let (import, motions) = read(args, input, say)?;
    for clip in chosen(args, input, &import)? {
        let name = &import.asset.character.clips()[clip].name;
        let output = write::claim(args, names, input, name, clip);
        let done = output.and_then(|output| {
            write::check_output(args, names, &output)?;
            one(args, &import, &motions, input, &output, Some(clip), told, outcome, say)
        });
        if let Err(failure) = done {
            told.push(
                json!({"input": input, "clip": name, "error": failure.message(), "exit": failure.code()}),
            );
            outcome.fail(failure, say);
        }
    }
    Ok(())
}

/// The input, its clips perhaps those of other files.
fn read(args: &Args, input: &Path, say: &Say) -> Result<(Import, Vec<Value>), Failure> {
    // From glTF to glTF pictures are not touched.
    let named = |e: &str| input.extension().is_some_and(|x| x.eq_ignore_ascii_case(e));
    let textures = to::is_rig(Path::new(&args.output)) || !(named("glb") || named("gltf"));
    let mut import = load(input, Options { textures }, say)?;
    if import.setting.is_some() {
        let message = format!("{}: this is a {}; expected a character", input.display(), import.format);
        return Err(Failure::Usage(message));
    }
    let motions = args.motion.apply(&mut import, say)?;
    Ok((import, motions))
}

fn chosen(args: &Args, input: &Path, import: &Import) -> Result<Vec<usize>, Failure> {
    let clips = import.asset.character.clips();
    let chosen: Vec<usize> = match super::find_clip(import, args.clip.as_deref())? {
        Some(one) if args.clip.is_some() => vec![one],
        _ => (0..clips.len()).collect(),
    };
    let nothing = chosen.is_empty() && !args.forms.any();
    if nothing && import.format == "glTF" && !to::is_rig(Path::new(&args.output)) {
        return Err(Failure::Input(format!("{}: there are no clips to bake", input.display())));
    }
    Ok(chosen)
}

fn threads(args: &Args) -> usize {
    args.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, Into::into), Into::into)
}

/// What is promised of a file's clips.
fn desc(args: &Args, import: &Import) -> Result<(BakeDesc, f64), Failure> {
    let character = &import.asset.character;
    let threads = threads(args);
    let diagonal = Gauge::new(character, threads).diagonal();
    let pins = args.pin.iter().map(|(name, limit)| {
        let missing =
            || Failure::Usage(format!("--pin {name}: there is no such bone; `sinew info --json` lists them"));
        Ok((character.skeleton().find(name).ok_or_else(missing)?, *limit))
    });
    let vertices = character.instances().iter().map(|i| character.mesh(i).positions.len()).sum::<usize>();
    let tolerance = match args.tolerance {
        Tolerance::Metres(m) => m,
        Tolerance::OfDiagonal(_) if diagonal == 0.0 => {
            let message =
                "nothing in it has an extent that a percentage could be of; give a length: --tolerance 1mm";
            return Err(Failure::Usage(message.into()));
        }
        Tolerance::OfDiagonal(part) => part * diagonal,
    };
    let desc = BakeDesc {
        tolerance,
        metric: match args.metric {
            // A skeleton without a skin: what may hang on its bones.
            Metric::Vertices if vertices == 0 => Metric::Shell(0.02 * diagonal),
            metric => metric,
        },
        pins: pins.collect::<Result<_, _>>()?,
        quantize: !args.no_quantize,
        goal: args.fewest.unwrap_or(if to::is_rig(Path::new(&args.output)) {
            Goal::Keys
        } else {
            Goal::Bytes
        }),
        threads,
        ..BakeDesc::default()
    };
    Ok((args.edits.wanted(desc), diagonal))
}

/// Bake the chosen clips, or this one, into one file.
fn one(
    args: &Args,
    import: &Import,
    motions: &[Value],
    input: &Path,
    output: &Path,
    clip: Option<usize>,
    told: &mut Vec<Value>,
    outcome: &mut Outcome,
    say: &Say,
) -> Result<(), Failure> {
    let chosen = clip.map_or_else(|| chosen(args, input, import), |c| Ok(vec![c]))?;
    let form = args.to.form(output)?;
    let placed = |f: Failure| {
        let message = format!("{}: {}", input.display(), f.message());
        f.with_message(message)
    };
    let (desc, diagonal) = desc(args, import).map_err(placed)?;
    let beyond = write::beyond(args, input, import)?;
    let edited = clips::edited(&args.edits, import, &chosen, &beyond, &desc, say).map_err(placed)?;
    let limited = args.forms.limited(import, &edited, say);
    let import = limited.as_ref().map_or(import, |l| &l.0);
    if let Some(report) =
        args.forms.write(args, [input, output], import, &edited, &desc, say).map_err(placed)?
    {
        outcome.done += 1;
        told.push(report);
        return Ok(());
    }
    let quantized =
        args.forms.quantize_mesh.then(|| mesh::quantized(args, input, import, &edited, &desc, say));
    let quantized = quantized.transpose()?;
    let character = quantized.as_ref().map_or(&import.asset.character, |q| &q.character);
    let mesh = quantized.as_ref().filter(|_| desc.metric == Metric::Vertices).map_or(0.0, |q| q.error);
    let allowed = desc.tolerance - mesh;
    let bar = say.clip_progress(edited.len());
    let mut done = vec![];
    for e in &edited {
        tell_coarse_times(&e.clip, say);
        let desc = BakeDesc { tolerance: allowed, cycle: e.cycle, over: e.over.clone(), ..desc.clone() };
        let poses = AtomicUsize::new(0);
        let watch = |stage: Stage, n: usize| {
            let all = poses.fetch_add(n, Ordering::Relaxed) + n;
            let doing = if stage == Stage::Check { "checking" } else { "searching" };
            let clip = say::name(&e.clip.name);
            bar.set_message(format!("{}, {clip}: {doing}, {all} poses compared", input.display()));
        };
        let baked = to::bake(form, character, &e.clip, &desc, &watch);
        done.push(Done { edited: e, baked: baked.map_err(failure).map_err(placed)?, allowed, mesh });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut report = report::report(import, &done, args, &desc, diagonal);
    if !motions.is_empty() {
        report["motions"] = motions.into();
    }
    if let Some((_, cost)) = &limited {
        report["influences"] = cost.clone();
    }
    if let Some(q) = &quantized {
        report["mesh"] = q.told.clone();
    }
    write::write(args, input, output, import, &done, quantized.as_ref().map(|q| &q.forms), &report, say)?;
    outcome.done += 1;
    for d in done.iter().filter(|_| !args.json) {
        say.note(&report::line(import, d, diagonal));
    }
    (report["input"], report["output"]) = (json!(input), json!(output));
    told.push(report);
    if !args.json {
        say.note(&format!("wrote {}", output.display()));
    }
    Ok(())
}

/// Late keys that single precision does not tell apart 240 times a second.
fn tell_coarse_times(clip: &Clip, say: &Say) {
    let end = clip.range().end as f32;
    let step = end.next_up() - end;
    if step > 1.0 / 240.0 && step < 1.0 {
        let name = say::name(&clip.name);
        say.warn(&format!(
            "clip {name}: its keys at {end} s are stored in single precision, {step} s apart at best"
        ));
    }
}

fn failure(e: BakeError) -> Failure {
    let message = e.to_string();
    match e {
        BakeError::Missed { .. } | BakeError::Frames { .. } => Failure::Differs(message),
        BakeError::Late { .. } | BakeError::Edit(EditError::Times { .. } | EditError::TooManyKeys { .. }) => {
            Failure::Input(message)
        }
        _ => Failure::Usage(message),
    }
}
