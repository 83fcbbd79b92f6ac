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
    /// Clips from this file instead of the input's.
    #[arg(long, value_name = "FILE")]
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
    pub wrap: Wrap,
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

    /// The frames to be drawn; `alone` if one picture is wanted where nothing says which.
    pub fn frames(&self, input: &Path, range: Range, alone: bool) -> Result<Vec<Frame>, Failure> {
        if let Some(t) = self.at {
            return Ok(vec![Frame { number: 1, moment: t.into() }]);
        }
        let timed = |n: i64| Frame { number: n, moment: frame_time(range.start, n, self.fps).into() };
        match &self.frames {
            Some(set) => Ok(set.iter().map(timed).collect()),
            None if alone => Ok(vec![timed(1)]),
            None => {
                let count = frame_count(range, self.fps.fps(), MOST_FRAMES);
                let count =
                    count.map_err(|e| Failure::Run(format!("{}: {e} (--frames, --fps)", input.display())))?;
                Ok((1..=count as i64).map(timed).collect())
            }
        }
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
