//! Curves to curves within a stated error on the skin.
//!
//! Each track gets the fewest keys that keep it within a tolerance of its own: its share of the error divided by its lever, the
//! distance to the farthest vertex that it moves. The shares are then grown together, and one by one, as long as the worst vertex
//! stays within what was asked for. What is promised was measured on the vertices, at keys, at frames and between them.

mod bound;
mod cost;
mod cubic;
pub mod edit;
mod fit;
mod gauge;
mod pack;
mod plan;
pub mod retarget;
#[cfg(test)]
mod tests;
mod times;
pub mod vertices;
pub mod xzx;

pub use gauge::{Gauge, Lever, Looks, Metric, Spot, Stage, Watch, Worst};
pub use pack::{PackedBake, pack};

use crate::character::Character;
use crate::clip::Clip;
use crate::pose::Pose;
use crate::skeleton::BoneId;
use plan::Plan;
use std::borrow::Cow;
use times::Verdict;

/// How a clip is to be baked.
///
/// ```
/// use sinew::bake::BakeDesc;
/// let half_a_millimetre = BakeDesc { tolerance: 5e-4, ..BakeDesc::default() };
/// assert!(half_a_millimetre.quantize);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BakeDesc {
    /// Metres that any point may be off at any time.
    pub tolerance: f64,
    /// Which points.
    pub metric: Metric,
    /// Bones whose origin and tip may be off by so many metres only.
    pub pins: Vec<(BoneId, f64)>,
    /// Rotations may be stored as normalised 16-bit integers, where the bound allows.
    pub quantize: bool,
    /// Keys stand at whole frames of this rate only, and at the clip's ends (see [`edit::resample`]).
    pub fps: Option<f64>,
    /// No key moves or goes, but those of tracks that stand still.
    pub keep_keys: bool,
    /// The clip is a loop and stays one: its last keys are its first, bit for bit (see [`edit::close`]).
    pub cycle: bool,
    /// The clip is additive (see [`edit::additive`]), and measured as it plays over this pose.
    pub over: Option<Pose>,
    /// What there is to be little of.
    pub goal: Goal,
    /// Worker threads; the result does not depend on them.
    pub threads: usize,
}

/// What a bake makes little of: it decides between hold, linear, Catmull-Rom and cubic curves, track by track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Goal {
    /// Bytes of a glTF file, where a cubic key takes three values. Catmull-Rom curves have no place there.
    #[default]
    Bytes,
    /// Keys, for people to edit.
    Keys,
}

impl Goal {
    /// How much of it a bake leaves.
    fn left(self, report: &Report) -> usize {
        match self {
            Self::Bytes => report.bytes[1],
            Self::Keys => report.keys[1],
        }
    }
}

impl Default for BakeDesc {
    /// A millimetre, on the skin.
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            metric: Metric::Vertices,
            pins: vec![],
            quantize: true,
            fps: None,
            keep_keys: false,
            cycle: false,
            over: None,
            goal: Goal::Bytes,
            threads: 1,
        }
    }
}

/// What was reached.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Report {
    /// The worst point that was found.
    pub worst: Worst,
    /// What no point exceeds at any time, as a part of its limit: between the moments looked at, second derivatives of the bones' motion bound
    /// what can hide. Rounding of single precision aside, the true maximum lies between `worst` and this.
    pub ceiling: f64,
    /// Moments at which all vertices were compared.
    pub moments: usize,
    /// Keys before and after.
    pub keys: [usize; 2],
    /// Bytes of keys before and after, as glTF stores them: times that several tracks share count once.
    pub bytes: [usize; 2],
}

/// A clip that does what another does, within an error.
#[derive(Clone, Debug, Default)]
pub struct Baked {
    /// The new clip.
    pub clip: Clip,
    /// For each track, whether its values are 16-bit integers in the file.
    pub short: Vec<bool>,
    /// What was reached.
    pub report: Report,
}

/// Why a clip cannot be baked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// A tolerance that is not a positive number.
    #[error("a tolerance of {found} m; expected more than 0")]
    Tolerance {
        /// What was asked for.
        found: f64,
    },
    /// Vertices are to keep a bound, and there are none.
    #[error(
        "there is no skin that could keep a bound; measure a shell around the bones instead (`--metric shell:3cm`)"
    )]
    NoSkin,
    /// The bound cannot be kept.
    #[error(
        "clip `{clip}`: asked for {tolerance:.3e} m, reached {reached:.3e} m at {time:.4} s; single precision holds no less here: \
         ask for more"
    )]
    Missed {
        /// Which clip.
        clip: String,
        /// Metres asked for.
        tolerance: f64,
        /// Metres reached.
        reached: f64,
        /// Where, seconds.
        time: f64,
    },
    /// So many frames a second do not keep the bound.
    #[error(
        "clip `{clip}`: with keys at {fps} frames a second only, asked for {tolerance:.3e} m, reached {reached:.3e} m at {time:.4} s; {better}"
    )]
    Frames {
        /// Which clip.
        clip: String,
        /// The rate.
        fps: f64,
        /// Metres asked for.
        tolerance: f64,
        /// Metres reached.
        reached: f64,
        /// Where, seconds.
        time: f64,
        /// Which rate would.
        better: Rates,
    },
    /// A last key beyond what anybody can mean.
    #[error(
        "clip `{clip}`: its last key is at {time:.3e} s, where single precision tells times {step:.3e} s apart; cut the clip (`--trim ..T`)"
    )]
    Late {
        /// Which clip.
        clip: String,
        /// Seconds.
        time: f64,
        /// Seconds from one time to the next.
        step: f64,
    },
    /// A clip that cannot be resampled.
    #[error(transparent)]
    Edit(#[from] edit::EditError),
}

/// Which of the usual rates keeps a bound, if any does.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Rates(pub Option<f64>);

impl std::fmt::Display for Rates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Some(fps) => write!(f, "{fps} frames a second would"),
            None => f.write_str("no usual rate would: something changes at once between frames, or too fast"),
        }
    }
}

/// Rates that are tried where the one asked for does not suffice.
const USUAL: [f64; 14] =
    [12.0, 15.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 240.0, 480.0, 960.0];

/// Searches that are made again with the moments that were missed.
const SEARCHES: usize = 4;

/// What is over by less is made up for by a smaller share.
const LITTLE: f64 = 1.06;

/// Ends of a loop that agree to this part of their track, or radians, are made equal.
const SEAM: f64 = 1e-3;

/// Find few keys that move the character as `clip` does. They stand at times that a file holds, in single precision; what the rounding of
/// times costs is part of the bound, but for jumps, which are compared at the rounded time.
///
/// # Errors
/// [`BakeError`]: a tolerance that is none, one that is finer than single precision or than frames allow, or a clip without an end.
///
/// # Panics
/// If the clip is not of the character.
pub fn bake(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<Baked, BakeError> {
    bake_watched(character, clip, desc, &|_, _| {})
}

/// The same, and tell how many poses were compared as it goes.
///
/// # Errors
/// As [`bake`].
///
/// # Panics
/// As [`bake`].
pub fn bake_watched(
    character: &Character,
    clip: &Clip,
    desc: &BakeDesc,
    watch: Watch,
) -> Result<Baked, BakeError> {
    check(character, clip, desc)?;
    let start = start(clip, desc, desc.fps)?;
    bake_from(character, clip, &start, desc, watch)
}

/// With keys chosen from those of `start`.
fn bake_from(
    character: &Character,
    clip: &Clip,
    start: &Clip,
    desc: &BakeDesc,
    watch: Watch,
) -> Result<Baked, BakeError> {
    // Keys stand at times that a file can hold. Where a clip jumps, it is meant to jump then.
    let start = &*times::in_single(start, |_| true);
    let clip = &*times::in_single(clip, bound::has_jumps);
    let mut gauge = Gauge::of(character, desc).watched(watch);
    let mut plan = Plan::new(character, clip, start, &gauge, desc);
    gauge.enter(Stage::Search);
    let mut baked = plan.search(&gauge);
    gauge.enter(Stage::Check);
    for round in 0..12 {
        let Verdict { worst, ceiling, moments, over } = times::verify(&gauge, clip, &baked.clip);
        let report = &mut baked.report;
        (report.worst, report.ceiling, report.moments) = (worst, ceiling, moments);
        if ceiling <= 1.0 {
            return Ok(fewer(desc.goal, &mut plan, &gauge, clip, baked));
        }
        // What hid between the moments of the search is searched with.
        if round < SEARCHES && worst.share() > LITTLE {
            gauge.enter(Stage::Search);
            baked = plan.search_with(&gauge, over);
            gauge.enter(Stage::Check);
            continue;
        }
        // Or else: aim a little lower.
        let over = if worst.share() > 1.0 { worst.share() } else { ceiling };
        baked = plan.within(&gauge, (0.95 / over).min(0.9));
    }
    let plain = plan.untouched();
    let Verdict { worst, ceiling, moments, .. } = times::verify(&gauge, clip, &plain.clip);
    if ceiling <= 1.0 {
        return Ok(Baked { report: Report { worst, ceiling, moments, ..plain.report }, ..plain });
    }
    let name = clip.name.clone();
    let (tolerance, reached, time) = (worst.limit, ceiling * worst.limit, worst.time);
    let Some(fps) = desc.fps else {
        return Err(BakeError::Missed { clip: name, tolerance, reached, time });
    };
    let keeps = |fps: &f64| {
        let frames = self::start(clip, desc, Some(*fps));
        frames.is_ok_and(|frames| times::verify(&gauge, clip, &frames).ceiling <= 1.0)
    };
    let better = Rates(USUAL.into_iter().filter(|r| *r > fps).find(keeps));
    Err(BakeError::Frames { clip: name, fps, tolerance, reached, time, better })
}

/// What was found, or all keys where they are if that is less.
fn fewer(goal: Goal, plan: &mut Plan, gauge: &Gauge, clip: &Clip, found: Baked) -> Baked {
    let mut kept = plan.kept(gauge);
    if goal.left(&kept.report) >= goal.left(&found.report) {
        return found;
    }
    let Verdict { worst, ceiling, moments, .. } = times::verify(gauge, clip, &kept.clip);
    let report = &mut kept.report;
    (report.worst, report.ceiling, report.moments) = (worst, ceiling, moments);
    if ceiling <= 1.0 { kept } else { found }
}

/// Whether what is asked for means anything.
fn check(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<(), BakeError> {
    let mut asked = std::iter::once(desc.tolerance).chain(desc.pins.iter().map(|p| p.1));
    if let Some(found) = asked.find(|t| t.is_nan() || *t <= 0.0) {
        return Err(BakeError::Tolerance { found });
    }
    let vertices = character.instances().iter().map(|i| character.mesh(i).positions.len()).sum::<usize>();
    if vertices == 0 && desc.metric == Metric::Vertices {
        return Err(BakeError::NoSkin);
    }
    // Times that no file holds to the second are a mistake, and looking between them has no end.
    let range = clip.range();
    let time = if range.end.abs() > range.start.abs() { range.end } else { range.start };
    let step = edit::spacing(time.abs());
    if step >= 1.0 { Err(BakeError::Late { clip: clip.name.clone(), time, step }) } else { Ok(()) }
}

/// The keys to choose from.
fn start<'c>(clip: &'c Clip, desc: &BakeDesc, fps: Option<f64>) -> Result<Cow<'c, Clip>, BakeError> {
    let frames = fps.map(|fps| edit::resample(clip, fps)).transpose()?;
    let frames = frames.map_or(Cow::Borrowed(clip), Cow::Owned);
    Ok(if desc.cycle { Cow::Owned(edit::close(&frames, SEAM)) } else { frames })
}
