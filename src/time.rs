//! Seconds in f64: ranges, what happens outside them, and the times of frames.
//!
//! f32 seconds have an ulp of 7.8 ms after a day, so time stays f64 and is wrapped before it becomes local.

mod frame_set;
mod rate;
mod shard;
mod timeline;

pub use frame_set::{FrameSet, FrameSetError, frame_time};
pub use rate::{Rate, RateError};
pub use shard::{Shard, ShardError};
pub use timeline::{ClipTimeline, Marker, Timeline};

/// A closed interval of seconds.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Range {
    /// First second.
    pub start: f64,
    /// Last second, `≥ start`.
    pub end: f64,
}

impl Range {
    /// `end − start`, in seconds.
    pub fn duration(&self) -> f64 {
        self.end - self.start
    }
}

/// What a time outside the range of a clip means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The nearest end.
    #[default]
    Clamp,
    /// Start again: `start + (t − start) mod duration`.
    Loop,
    /// There and back again.
    PingPong,
}

/// The time inside `range` that `t` stands for.
///
/// ```
/// use sinew::time::{Range, Wrap, wrap};
/// let r = Range { start: 1.0, end: 3.0 };
/// assert_eq!(wrap(5.5, r, Wrap::Clamp), 3.0);
/// assert_eq!(wrap(5.5, r, Wrap::Loop), 1.5);
/// assert_eq!(wrap(4.5, r, Wrap::PingPong), 1.5);
/// ```
pub fn wrap(t: f64, range: Range, mode: Wrap) -> f64 {
    let d = range.duration();
    if d.is_nan() || d <= 0.0 || !t.is_finite() {
        return range.start;
    }
    let local = t - range.start;
    let inside = match mode {
        Wrap::Clamp => local.clamp(0.0, d),
        // A time inside, its end included, is left alone.
        _ if (0.0..=d).contains(&local) => local,
        Wrap::Loop => local.rem_euclid(d),
        Wrap::PingPong => {
            let m = local.rem_euclid(2.0 * d);
            if m > d { 2.0 * d - m } else { m }
        }
    };
    range.start + inside
}

/// Number of frames that show `range` at `fps`, to the nearest whole frame and at least one.
///
/// A loop's last frame would repeat its first, so the end itself is left out; a duration of 23.04 frames makes 23, since a 24th
/// would almost repeat the first and the loop would stutter.
///
/// # Errors
/// [`TooManyFrames`] beyond `limit`: a last key at 10³⁰ s is a mistake, not an allocation.
pub fn frame_count(range: Range, fps: f64, limit: usize) -> Result<usize, TooManyFrames> {
    let n = (range.duration().max(0.0) * fps).round();
    if n > limit as f64 || !n.is_finite() {
        return Err(TooManyFrames { frames: n, limit });
    }
    Ok((n as usize).max(1))
}

/// More frames than anybody can mean.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the range holds {frames:.0} frames, more than the limit of {limit}; choose a shorter range or a lower rate"
)]
pub struct TooManyFrames {
    /// Frames that the range would hold.
    pub frames: f64,
    /// The limit that was set.
    pub limit: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_survives_a_billion_turns() {
        let r = Range { start: 0.0, end: 2.0 };
        assert!((wrap(2e9 + 0.25, r, Wrap::Loop) - 0.25).abs() < 1e-6);
        assert!((wrap(-0.5, r, Wrap::Loop) - 1.5).abs() < 1e-12);
        assert!((wrap(-0.5, r, Wrap::PingPong) - 0.5).abs() < 1e-12);
        assert_eq!(wrap(f64::NAN, r, Wrap::Loop), 0.0);
        assert_eq!(wrap(9.0, Range { start: 4.0, end: 4.0 }, Wrap::Loop), 4.0);
    }

    #[test]
    fn frames_of_a_loop_leave_out_the_end() {
        let r = |end| Range { start: 0.0, end };
        assert_eq!(frame_count(r(2.0), 24.0, 9999), Ok(48));
        assert_eq!(frame_count(r(0.0), 24.0, 9999), Ok(1));
        assert_eq!(frame_count(r(0.7083333), 24.0, 9999), Ok(17));
        assert_eq!(frame_count(r(0.96), 24.0, 9999), Ok(23));
        assert!(frame_count(r(1e30), 24.0, 9999).is_err());
    }
}
