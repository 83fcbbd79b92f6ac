//! Options of time: which clip, and which of its moments.

use crate::cli::{Failure, find_clip};
use sinew::frames::Moment;
use sinew::io::Import;
use sinew::time::{FrameSet, Range, Rate, Wrap, frame_count, frame_time};
use std::path::{Path, PathBuf};

/// Most frames of one film: eleven hours at 24 a second.
const MOST_FRAMES: usize = 1_000_000;

#[derive(clap::Args)]
#[command(next_help_heading = "Time")]
pub struct TimeArgs {
    /// Clip by name or index; the first by default.
    #[arg(long, value_name = "NAME|INDEX")]
    clip: Option<String>,
    /// The rest pose, untouched by any clip.
    #[arg(long, conflicts_with_all = ["clip", "poses"])]
    rest: bool,
    /// Clips from this file instead of the input's: poses (.json) or packed clips (.sinew).
    #[arg(long, value_name = "FILE", visible_alias = "motion")]
    pub poses: Option<PathBuf>,
    /// Draw this moment, in seconds.
    #[arg(long, value_name = "SECONDS", conflicts_with = "frames", allow_hyphen_values = true, value_parser = parse_seconds)]
    at: Option<f64>,
    /// Draw these frames only, as in 1-48x2,60.
    #[arg(long, value_name = "SET", allow_hyphen_values = true)]
    frames: Option<FrameSet>,
    /// Frames a second, as in 24, 29.97 or 30000/1001.
    #[arg(long, default_value = "24", value_name = "RATE")]
    pub fps: Rate,
    /// What times outside the clip show: its ends (clamp), the clip again (loop), or there and back (ping-pong).
    #[arg(long, default_value = "clamp", value_name = "MODE", value_parser = parse_wrap)]
    wrap: Wrap,
}

/// A frame's number and what it shows.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub number: i64,
    pub moment: Moment,
}

impl TimeArgs {
    /// The clip that is asked for.
    pub fn clip(&self, import: &Import) -> Result<Option<usize>, Failure> {
        if self.rest { Ok(None) } else { find_clip(import, self.clip.as_deref()) }
    }

    /// The frames to be drawn; `alone` if one picture is wanted where nothing says which, of a moment that the scene may say; `lap` if the camera walks around in
    /// so many seconds.
    pub fn frames(
        &self,
        input: &Path,
        range: Range,
        alone: Option<Option<f64>>,
        lap: Option<f64>,
    ) -> Result<Vec<Frame>, Failure> {
        if let (Some(t), None) = (self.at, lap) {
            return Ok(vec![Frame { number: 1, moment: t.into() }]);
        }
        let steps = lap.map(|lap| self.steps(lap));
        let timed = |n: i64| Frame { number: n, moment: self.moment(range, n, steps) };
        let whole = Range { start: 0.0, end: lap.unwrap_or(range.duration()) };
        match &self.frames {
            Some(set) => Ok(set.iter().map(timed).collect()),
            None if alone.is_some() => Ok(match alone.flatten().filter(|_| lap.is_none()) {
                Some(t) => vec![Frame { number: 1, moment: t.into() }],
                None => vec![timed(1)],
            }),
            None => {
                let count = frame_count(whole, self.fps.fps(), MOST_FRAMES);
                let count =
                    count.map_err(|e| Failure::Run(format!("{}: {e} (--frames, --fps)", input.display())))?;
                Ok((1..=count as i64).map(timed).collect())
            }
        }
    }

    /// Frames of a lap: frame 1 is without a turn, and so would be the one after the last.
    fn steps(&self, lap: f64) -> f64 {
        (lap * self.fps.fps()).round().max(1.0)
    }

    fn moment(&self, range: Range, number: i64, steps: Option<f64>) -> Moment {
        let time = self.at.unwrap_or_else(|| frame_time(range.start, number, self.fps));
        let around = |steps: f64| std::f64::consts::TAU * ((number as f64 - 1.0).rem_euclid(steps) / steps);
        Moment { time, turn: steps.map_or(0.0, around) as f32 }
    }

    /// Whether a moment shows the clip's first or last pose because it lies outside.
    pub fn is_frozen(&self, range: Range, time: f64, lap: Option<f64>) -> bool {
        let outside = time < range.start - 1e-9 || time > range.end + 1e-9;
        range.duration() > 0.0 && outside && self.wrap(lap) == Wrap::Clamp
    }

    /// What times outside the clip show; a clip goes on while the camera walks around.
    pub fn wrap(&self, lap: Option<f64>) -> Wrap {
        if lap.is_some() && self.wrap == Wrap::Clamp { Wrap::Loop } else { self.wrap }
    }

    /// What to say where the film of a lap ends in the midst of the clip, and so jumps.
    pub fn seam(&self, range: Range, lap: f64) -> Option<String> {
        let clip = range.duration() * if self.wrap == Wrap::PingPong { 2.0 } else { 1.0 };
        if self.at.is_some() || clip <= 0.0 {
            return None;
        }
        let times = (lap / clip).round().max(1.0);
        if (lap - times * clip).abs() * self.fps.fps() <= 0.5 {
            return None;
        }
        let fits = format!("{:.3}", times * clip);
        let fits = fits.trim_end_matches('0').trim_end_matches('.');
        let loops = if times == 1.0 { "once".into() } else { format!("{times} times") };
        Some(format!(
            "the clip of {clip:.3} s is cut where the turn of {lap} s ends; --turntable {fits} shows it {loops}"
        ))
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|t| t.is_finite()).ok_or_else(|| "expected seconds".into())
}

fn parse_wrap(text: &str) -> Result<Wrap, String> {
    match text {
        "clamp" => Ok(Wrap::Clamp),
        "loop" => Ok(Wrap::Loop),
        "ping-pong" => Ok(Wrap::PingPong),
        _ => Err("expected clamp, loop or ping-pong".into()),
    }
}
