//! `sinew bake`: curves to curves within an error.

mod clips;
mod report;
mod values;
mod write;

use super::{Failure, load, print, say::Say};
use report::Done;
use sinew::bake::{self, BakeDesc, BakeError, Gauge, Goal, Metric};
use sinew::io::Options;
use std::path::PathBuf;
use values::{Tolerance, factor, fewest, metric, part, pin, tolerance};

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
    /// What there is to be little of: bytes of the file, or keys to edit, which cubic curves need fewer of.
    #[arg(long, value_name = "bytes|keys", default_value = "bytes", value_parser = fewest)]
    fewest: Goal,
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

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    write::check_output(args)?;
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
    let desc = BakeDesc {
        tolerance: metres,
        metric: args.metric,
        pins,
        quantize: !args.no_quantize,
        goal: args.fewest,
        threads,
        ..BakeDesc::default()
    };
    let clips = clips::edited(args, &import, &chosen)?;
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
    let told = report::report(&import, &done, args.metric, metres, diagonal);
    write::write(args, &import, &done, &told)?;
    if args.json {
        return print(format!("{told:#}\n").as_bytes());
    }
    for d in &done {
        say.note(&report::line(&import, d, diagonal));
    }
    say.note(&format!("wrote {}", args.output.display()));
    Ok(())
}
