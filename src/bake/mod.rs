//! Curves to curves within a stated error on the skin.
//!
//! Each track gets the fewest keys that keep it within a tolerance of its own: its share of the error divided by its lever, the
//! distance to the farthest vertex that it moves. The shares are then grown together, and one by one, as long as the worst vertex
//! stays within what was asked for. What is promised was measured on the vertices, at keys, at frames and between them.

pub mod edit;
mod fit;
mod gauge;
mod plan;
mod times;

pub use gauge::{Gauge, Lever, Worst};

use crate::character::Character;
use crate::clip::Clip;
use plan::Plan;

/// How a clip is to be baked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeDesc {
    /// Metres that any vertex may be off at any time.
    pub tolerance: f64,
    /// Rotations may be stored as normalised 16-bit integers, where the bound allows.
    pub quantize: bool,
    /// Worker threads; the result does not depend on them.
    pub threads: usize,
}

/// What was reached.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Report {
    /// The worst vertex that was found.
    pub worst: Worst,
    /// No vertex is farther off than that, metres: the worst found, and what may hide between the moments looked at.
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
}

/// Find few keys that move the character as `clip` does.
///
/// # Errors
/// [`BakeError`]: a tolerance that is none, or one that is finer than single precision.
///
/// # Panics
/// If the clip is not of the character.
pub fn bake(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<Baked, BakeError> {
    if desc.tolerance.is_nan() || desc.tolerance <= 0.0 {
        return Err(BakeError::Tolerance { found: desc.tolerance });
    }
    let gauge = Gauge::new(character, desc.threads);
    let mut plan = Plan::new(character, clip, &gauge, desc);
    let mut baked = plan.search(&gauge);
    let mut share = 1.0;
    for _ in 0..8 {
        let (worst, ceiling, moments) = times::verify(&gauge, clip, &baked.clip);
        let report = &mut baked.report;
        (report.worst, report.ceiling, report.moments) = (worst, ceiling, moments);
        if ceiling <= desc.tolerance {
            return Ok(baked);
        }
        // What hid between the moments of the search: aim a little lower.
        share *= (0.95 * desc.tolerance / ceiling).min(0.9);
        baked = plan.within(share);
    }
    let plain = plan.untouched();
    let (worst, ceiling, moments) = times::verify(&gauge, clip, &plain.clip);
    if ceiling <= desc.tolerance {
        return Ok(Baked { report: Report { worst, ceiling, moments, ..plain.report }, ..plain });
    }
    let clip = clip.name.clone();
    Err(BakeError::Missed { clip, tolerance: desc.tolerance, reached: ceiling, time: worst.time })
}
