//! `sinew compare`: pictures and films against what they should be.

mod pair;
mod pairs;
mod report;

use super::{Failure, print, say::Say};
use pair::{Outcome, Verdict};
use pairs::Pair;
use sinew::frames::in_order;
use sinew::io::picture::{AtomicFile, Folder, PngLevel, encode_png};
use sinew::measure::Tolerance;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sinew compare golden/walk.png walk.png
  sinew compare golden/ frames/ --diff diffs/ --max-diff 1
  sinew compare golden.gif walk.gif --psnr-min 40 --ssim-min 0.99 --json

Without bounds nothing may differ. Every bound that is given must hold for every frame; --max-diff and --max-pixels together allow
so many pixels to be off by more. In folders files of one name belong together; one that is missing on either side is a
difference. Films must have the same number of frames and, in the same format, the same times. Colour under alpha 0 is not compared.

PSNR is of 8-bit codes (R, G, B; with alpha where a picture is not opaque), SSIM of luma in windows of 11 × 11 (Wang et al. 2004).
Exit codes: 0 alike, 4 past a bound, 3 a file cannot be read.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// What it should be: a picture (PNG, JPEG, WebP, EXR), a film (GIF, APNG, WebP) or a folder of them.
    expected: PathBuf,
    /// What it is: a file, or a folder if the other is one.
    actual: PathBuf,
    /// Least peak signal to noise, dB.
    #[arg(long, value_name = "DB", value_parser = parse_decibels)]
    psnr_min: Option<f64>,
    /// Least structural similarity, up to 1.
    #[arg(long, value_name = "SSIM", value_parser = parse_similarity)]
    ssim_min: Option<f64>,
    /// Codes of 255 that any channel of a pixel may be off.
    #[arg(long, value_name = "CODES")]
    max_diff: Option<u8>,
    /// Pixels of a frame that may be off by more.
    #[arg(long, value_name = "N")]
    max_pixels: Option<usize>,
    /// Draw expected | difference | actual of what differs, amplified: a PNG, or a folder (an existing one, or a name that ends in /). Overwrites.
    #[arg(long, value_name = "FILE|FOLDER")]
    diff: Option<PathBuf>,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Worker threads; 0 takes one a processor. The result does not depend on it.
    #[arg(long, default_value = "0", value_name = "N")]
    threads: usize,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    let pairs = pairs::find(&args.expected, &args.actual, say)?;
    let folder = pairs::is_folder(&args.expected);
    let places = places(args, &pairs, folder)?;
    let tolerance =
        Tolerance { psnr: args.psnr_min, ssim: args.ssim_min, codes: args.max_diff, pixels: args.max_pixels };

    let ends = |p: &PathBuf| p.as_os_str().to_string_lossy().ends_with('/');
    let in_folder = folder || args.diff.as_ref().is_some_and(ends);

    // Pairs are compared in parallel and reported in order.
    let processors = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = if args.threads == 0 { processors } else { args.threads.min(256) };
    let bar = say.progress(pairs.len());
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(pairs.len());
    let job = |_: &mut (), i: usize| {
        let mut outcome = pair::compare(&pairs[i], &tolerance, places[i].is_some());
        if let Some(panels) = outcome.panels.take() {
            outcome.drawn = places[i].as_ref().map(|place| draw(place, &panels, in_folder));
        }
        outcome
    };
    let receive = |_, outcome| {
        bar.inc(1);
        outcomes.push(outcome);
        Ok(())
    };
    let _ = in_order(pairs.len(), threads.min(pairs.len()).max(1), || (), job, receive);
    bar.finish_and_clear();

    let text = if args.json { report::as_json(&outcomes) } else { report::as_text(&outcomes, say.verbose) };
    print(text.as_bytes())?;
    conclude(&outcomes, say)
}

/// Write the three panels.
fn draw(place: &Path, panels: &sinew::image::Rgba8, in_folder: bool) -> Result<PathBuf, String> {
    let folder = if in_folder { Folder::Create } else { Folder::MustExist };
    let bytes = encode_png(panels, PngLevel::Fast).map_err(|e| e.to_string())?;
    AtomicFile::write(place, &bytes, true, folder).map_err(|e| e.to_string())?;
    Ok(place.to_owned())
}

/// Where the panels of each pair go.
fn places(args: &Args, pairs: &[Pair], folder: bool) -> Result<Vec<Option<PathBuf>>, Failure> {
    let Some(diff) = &args.diff else { return Ok(vec![None; pairs.len()]) };
    let refuse = |why: &str| Failure::Usage(format!("--diff {}: {why}", diff.display()));
    let is_folder = folder || diff.is_dir() || diff.as_os_str().to_string_lossy().ends_with('/');
    if folder && diff.is_file() {
        return Err(refuse("folders are compared; expected a folder, found a file"));
    }
    if !is_folder && diff.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(refuse("expected a name that ends in .png, or a folder's that ends in /"));
    }
    let place = |p: &Pair| if is_folder { diff.join(as_png(&p.name)) } else { diff.clone() };
    let places: Vec<PathBuf> = pairs.iter().map(place).collect();

    // What is compared is never written over.
    let inputs = pairs.iter().flat_map(|p| [&p.expected, &p.actual]).flatten();
    let inputs: std::collections::BTreeSet<PathBuf> = inputs.filter_map(|p| p.canonicalize().ok()).collect();
    if places.iter().any(|p| p.canonicalize().is_ok_and(|p| inputs.contains(&p))) {
        return Err(refuse("this would write over what is compared; choose another name"));
    }
    Ok(places.into_iter().map(Some).collect())
}

/// `walk.gif` as `walk.gif.png`; what is a PNG keeps its name.
fn as_png(name: &Path) -> PathBuf {
    if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return name.to_owned();
    }
    let mut name = name.as_os_str().to_owned();
    name.push(".png");
    name.into()
}

/// The exit code that all outcomes together ask for.
fn conclude(outcomes: &[Outcome], say: &Say) -> Result<(), Failure> {
    let count = |of: fn(&Verdict) -> bool| outcomes.iter().filter(|o| of(&o.verdict)).count();
    for o in outcomes {
        match (&o.drawn, &o.verdict) {
            (Some(Err(why)), _) => return Err(Failure::Run(format!("--diff: {why}"))),
            (_, Verdict::Unreadable(why)) if outcomes.len() > 1 => say.error(why),
            _ => {}
        }
    }
    let unreadable = outcomes.iter().find_map(|o| match &o.verdict {
        Verdict::Unreadable(why) => Some(why.clone()),
        _ => None,
    });
    if let Some(why) = unreadable {
        let n = count(|v| matches!(v, Verdict::Unreadable(_)));
        let message = format!("{n} of {} pairs cannot be read; the others were compared", outcomes.len());
        return Err(Failure::Input(if outcomes.len() > 1 { message } else { why }));
    }
    let off = count(|v| !v.fine());
    match off {
        0 => Ok(()),
        _ if outcomes.len() == 1 => Err(Failure::Differs(outcomes[0].message())),
        _ => Err(Failure::Differs(format!("{off} of {} pictures differ", outcomes.len()))),
    }
}

fn parse_decibels(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite());
    number.ok_or_else(|| "expected decibels, as in 40".into())
}

fn parse_similarity(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|n| (-1.0..=1.0).contains(n));
    number.ok_or_else(|| "expected a number up to 1, as in 0.99".into())
}
