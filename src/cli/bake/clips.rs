//! Which clips are baked, and what is done to them before.

use super::values::{factor, part, seconds};
use crate::cli::{Failure, say, say::Say};
use sinew::bake::edit::{self, EditError, Reference, RootMotion};
use sinew::bake::{BakeDesc, Gauge};
use sinew::clip::{Clip, Target, Track};
use sinew::io::Import;
use sinew::io::gltf::Carried;
use sinew::pose::Pose;
use sinew::time::Range;

#[derive(clap::Args)]
#[command(next_help_heading = "Edits, in this order")]
pub(super) struct EditArgs {
    /// Only this part of each clip, in seconds; either end may be left out, and one beyond the clip's is the clip's.
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
    /// Left does what right did: bones are paired by their names (arm.L and arm.R, LeftFoot and RightFoot).
    #[arg(long)]
    mirror: bool,
    /// Take out the way over the ground of the first bone that carries the skin, with heading its turning about the vertical too. Where it
    /// went is kept as a moving node `root motion` and in the animation's extras.
    #[arg(long, value_name = "ground|heading", num_args = 0..=1, require_equals = true, default_missing_value = "ground", value_parser = ["ground", "heading"])]
    in_place: Option<String>,
    /// Bend the end of each clip into its start, over so long (0.2s, 150ms): value and slope are continuous.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    loop_blend: Option<f64>,
    /// The clips are loops: the last keys become the first, bit for bit. Clips that end as they begin are loops by themselves.
    #[arg(long)]
    r#loop: bool,
    /// Write differences from the rest pose or from the clip's first moment, to be added to other clips (as three.js does): rotations
    /// reference⁻¹·q, everything else v − reference.
    #[arg(long, value_name = "rest|first", value_parser = ["rest", "first"])]
    additive: Option<String>,
    /// Keys at whole frames of this rate only, and at the clip's ends.
    #[arg(long, value_name = "N", value_parser = fps)]
    pub fps: Option<f64>,
    /// Move and drop no keys but those of tracks that stand still.
    #[arg(long)]
    pub keep_keys: bool,
}

impl EditArgs {
    /// Whether all clips become one.
    pub fn joins(&self) -> bool {
        self.concat.is_some()
    }
}

fn fps(text: &str) -> Result<f64, String> {
    let wrong = || "expected a rate from 0.01 to 10000 keys a second, as in 30".to_owned();
    text.parse::<f64>().ok().filter(|f| (0.01..=1e4).contains(f)).ok_or_else(wrong)
}

/// A clip as it is to be baked.
pub(super) struct Edited {
    pub clip: Clip,
    /// Which of the file's it takes the place of.
    pub replaces: Option<usize>,
    /// Where it went, if it was taken in place.
    pub motion: Option<RootMotion>,
    /// What it is to be added to, if it is a difference.
    pub over: Option<Pose>,
    /// It ends as it begins.
    pub cycle: bool,
    /// What of it moves no bone.
    pub carried: Vec<Carried>,
}

/// Stands for the first of the things that are no bones, while clips are cut and joined.
const BEYOND: usize = usize::MAX / 2;

/// The clips as they are to be baked.
pub(super) fn edited(
    args: &EditArgs,
    import: &Import,
    chosen: &[usize],
    beyond: &[Vec<Carried>],
    desc: &BakeDesc,
    say: &Say,
) -> Result<Vec<Edited>, Failure> {
    let clips = import.asset.character.clips();
    let all: Vec<&Carried> = beyond.iter().flatten().collect();
    let mut out = vec![];
    for &c in chosen {
        let mut clip = clips[c].clone();
        for one in beyond.get(c).into_iter().flatten() {
            let first = BEYOND + all.iter().position(|a| a.moves_as(one)).expect("it is one of them");
            clip.tracks.push(Track { target: Target::Weights { first }, curve: one.curve.clone() });
        }
        if let Some(ends) = args.trim {
            clip = trimmed(&clip, ends, say)?;
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
    let alone = out.len() == 1;
    let one = |(mut clip, replaces): (Clip, _)| {
        let index = |t: &Track| match t.target {
            Target::Weights { first } => first.checked_sub(BEYOND),
            _ => None,
        };
        let own = clip.tracks.iter().filter_map(|t| Some(all[index(t)?].with(t.curve.clone())));
        let carried = own.collect();
        clip.tracks.retain(|t| index(t).is_none());
        Ok(Edited { carried, ..placed(args, import, clip, replaces, desc, alone, say)? })
    };
    out.into_iter().map(one).collect()
}

fn trimmed(clip: &Clip, [from, to]: [Option<f64>; 2], say: &Say) -> Result<Clip, Failure> {
    let whole = clip.playback();
    let (name, Range { start, end }) = (say::name(&clip.name), whole);
    let range = Range { start: from.unwrap_or(start), end: to.unwrap_or(end) };
    if range.start >= end || range.end <= start || range.start >= range.end {
        let message =
            format!("--trim: clip {name} runs from {start} to {end} s; nothing would be left of it");
        return Err(Failure::Usage(message));
    }
    if range.start < start || range.end > end {
        say.note(&format!("--trim: clip {name} runs from {start} to {end} s; there is nothing beyond"));
    }
    Ok(edit::trim(clip, range))
}

/// What is done to one clip after it was cut and joined.
fn placed(
    args: &EditArgs,
    import: &Import,
    mut clip: Clip,
    replaces: Option<usize>,
    desc: &BakeDesc,
    alone: bool,
    say: &Say,
) -> Result<Edited, Failure> {
    let character = &import.asset.character;
    if args.mirror {
        let mirror = character.mirror();
        if character.skeleton().ids().all(|b| mirror.pair(b) == b) {
            let message = "--mirror: no two bones are left and right of each other by name (arm.L and arm.R, LeftFoot and RightFoot)";
            return Err(Failure::Usage(message.into()));
        }
        clip = clip.mirrored(character.skeleton(), &mirror);
    }
    let mut motion = None;
    if let Some(how) = &args.in_place {
        match edit::in_place(character, &clip, how == "heading") {
            Ok((still, way)) => (clip, motion) = (still, Some(way)),
            // Among several clips some stand still anyway.
            Err(e @ EditError::NoRoot { .. }) if !alone => say.note(&format!("--in-place: {e}")),
            Err(e) => return Err(refused("--in-place", &e)),
        }
    }
    if let Some(seconds) = args.loop_blend {
        let all = clip.range().duration();
        if seconds > all {
            say.note(&format!(
                "--loop-blend {seconds}s: clip {} lasts {all:.3} s; all of it is bent",
                say::name(&clip.name)
            ));
        }
        clip = edit::blend(&clip, seconds);
    }
    let apart = Gauge::of(character, desc).seam(&clip);
    if args.r#loop && apart.share() > 1.0 {
        let message = format!(
            "--loop: clip {} begins and ends {:.3} mm apart, more than the tolerance of {:.3} mm; --loop-blend 0.2s bends its end into its start",
            say::name(&clip.name),
            1e3 * apart.distance,
            1e3 * apart.limit
        );
        return Err(Failure::Differs(message));
    }
    let cycle =
        args.r#loop || args.loop_blend.is_some() || (apart.share() <= AGREE && clip.range().duration() > 0.0);
    let mut over = None;
    if let Some(from) = &args.additive {
        let reference = if from == "rest" { Reference::Rest } else { Reference::First };
        let base = edit::reference_pose(character, &clip, reference);
        clip = edit::additive(&clip, &base).map_err(|e| refused("--additive", &e))?;
        over = Some(base);
    }
    Ok(Edited { clip, replaces, motion, over, cycle, carried: vec![] })
}

/// Ends apart by no more than this part of the tolerance are taken for the same pose.
const AGREE: f64 = 0.05;

fn refused(option: &str, e: &EditError) -> Failure {
    Failure::Usage(format!("{option}: {e}"))
}

impl EditArgs {
    /// What of the edits is a matter of how keys are chosen.
    pub fn wanted(&self, desc: BakeDesc) -> BakeDesc {
        BakeDesc { fps: self.fps, keep_keys: self.keep_keys, ..desc }
    }

    /// What clips are differences from.
    pub fn reference(&self) -> Option<&str> {
        self.additive.as_deref()
    }
}
