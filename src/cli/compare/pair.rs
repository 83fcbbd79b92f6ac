//! Two files, frame by frame.

use super::pairs::Pair;
use sinew::image::Rgba8;
use sinew::io;
use sinew::io::picture::{Frame, Frames, Pixels, frames_of};
use sinew::measure::picture::{amplification, panels};
use sinew::measure::{Compared, Summary, Tolerance};
use std::path::{Path, PathBuf};

/// What became of a pair.
pub enum Verdict {
    /// Nothing differs.
    Equal,
    /// Something differs, within the bounds.
    Within,
    /// Why it is not as it should be.
    Past(String),
    /// One of the two is not there.
    Missing(String),
    /// One of the two is no picture.
    Unreadable(String),
}

impl Verdict {
    pub fn name(&self) -> &'static str {
        match self {
            Self::Equal => "equal",
            Self::Within => "within",
            Self::Past(_) => "past",
            Self::Missing(_) => "missing",
            Self::Unreadable(_) => "unreadable",
        }
    }

    pub fn fine(&self) -> bool {
        matches!(self, Self::Equal | Self::Within)
    }

    pub fn reason(&self) -> Option<&str> {
        match self {
            Self::Past(why) | Self::Missing(why) | Self::Unreadable(why) => Some(why),
            Self::Equal | Self::Within => None,
        }
    }
}

/// A pair that was compared.
pub struct Outcome {
    pub name: PathBuf,
    pub verdict: Verdict,
    /// Figures of the frames that both have, if they could be compared.
    pub summary: Summary,
    /// Frames of each.
    pub frames: [usize; 2],
    /// Width and height of each.
    pub sizes: [Option<[usize; 2]>; 2],
    /// Sums of the delays, milliseconds.
    pub durations_ms: [f64; 2],
    /// The three panels of the worst frame, until they are written.
    pub panels: Option<Rgba8>,
    /// How much they are amplified.
    pub gain: u8,
    /// Where they are, or why not.
    pub drawn: Option<Result<PathBuf, String>>,
}

impl Outcome {
    fn new(name: &Path) -> Self {
        Self {
            name: name.to_owned(),
            verdict: Verdict::Equal,
            summary: Summary::default(),
            frames: [0; 2],
            sizes: [None; 2],
            durations_ms: [0.0; 2],
            panels: None,
            gain: 1,
            drawn: None,
        }
    }

    pub fn message(&self) -> String {
        format!("{}: {}", self.name.display(), self.verdict.reason().unwrap_or(self.verdict.name()))
    }

    /// One more reason.
    fn past(&mut self, why: String) {
        match &mut self.verdict {
            Verdict::Past(before) => *before = format!("{before}; {why}"),
            verdict => *verdict = Verdict::Past(why),
        }
    }

    fn count(&mut self, side: usize, frame: &Frame) {
        self.frames[side] += 1;
        let (ms, of) = frame.delay_ms;
        self.durations_ms[side] += f64::from(ms) / f64::from(of.max(1));
        self.sizes[side] = self.sizes[side].or(Some(match &frame.pixels {
            Pixels::Codes(p) => [p.width, p.height],
            Pixels::Light(p) => [p.width, p.height],
        }));
    }

    /// Compare two frames of one place.
    fn add(&mut self, expected: Pixels, actual: Pixels, tolerance: &Tolerance, draw: bool) {
        let compared = match (&expected, &actual) {
            (Pixels::Codes(a), Pixels::Codes(b)) => Compared::of(a, b),
            (Pixels::Light(a), Pixels::Light(b)) => Compared::of_light(a, b),
            (a, b) => Compared::of(&a.clone().into_codes(), &b.clone().into_codes()),
        };
        let (worse, codes) = match compared {
            Ok(c) => {
                let first = matches!(self.verdict, Verdict::Equal | Verdict::Within);
                let worse = self.summary.add(&c);
                if !c.equal() && first {
                    self.verdict = Verdict::Within;
                }
                if let Err(why) = tolerance.check(&c)
                    && first
                {
                    let number = self.frames[0];
                    let place = if number > 1 { format!("frame {number}: ") } else { String::new() };
                    self.past(format!("{place}{why}"));
                }
                (worse, c.difference.worst.codes)
            }
            Err(sides) => {
                let first = self.frames[0] == 1;
                if first {
                    self.past(sides.to_string());
                }
                (first, 255)
            }
        };
        if worse && draw {
            self.gain = amplification(codes);
            self.panels = Some(panels(&expected.into_codes(), &actual.into_codes(), self.gain));
        }
    }
}

/// Read both and compare every frame that both have.
pub fn compare(pair: &Pair, tolerance: &Tolerance, draw: bool) -> Outcome {
    let mut outcome = Outcome::new(&pair.name);
    let (Some(expected), Some(actual)) = (&pair.expected, &pair.actual) else {
        let side =
            if pair.expected.is_none() { "it is not among the expected ones" } else { "it is missing" };
        outcome.verdict = Verdict::Missing(side.into());
        return outcome;
    };
    if let Err(why) = files(expected, actual, tolerance, draw, &mut outcome) {
        outcome.verdict = Verdict::Unreadable(why);
        outcome.panels = None;
    }
    outcome
}

fn files(
    expected: &Path,
    actual: &Path,
    tolerance: &Tolerance,
    draw: bool,
    outcome: &mut Outcome,
) -> Result<(), String> {
    let read = |path: &Path| io::read_file(path).map_err(|e| named(path, &e));
    let (a, b) = (read(expected)?, read(actual)?);
    let open = |path, bytes| frames_of(bytes).map_err(|e| named(path, &e));
    let (mut a, mut b) = (open(expected, &a)?, open(actual, &b)?);
    let same_format = a.format() == b.format();
    let mut late = None;
    loop {
        let (x, y) = (next(&mut a, expected)?, next(&mut b, actual)?);
        for (side, frame) in [&x, &y].into_iter().enumerate() {
            frame.iter().for_each(|frame| outcome.count(side, frame));
        }
        match (x, y) {
            (None, None) => break,
            (Some(x), Some(y)) => {
                if same_format && late.is_none() && !same_delay(x.delay_ms, y.delay_ms) {
                    late = Some(format!("frame {} lasts another time", outcome.frames[0]));
                }
                outcome.add(x.pixels, y.pixels, tolerance, draw);
            }
            // The longer one is counted to its end.
            _ => {}
        }
    }
    let [should, is] = outcome.frames;
    if should != is {
        outcome.past(format!("{is} frames, expected {should}"));
    }
    late.into_iter().for_each(|why| outcome.past(why));
    Ok(())
}

/// Whether two fractions of a millisecond are one.
fn same_delay(a: (u32, u32), b: (u32, u32)) -> bool {
    u64::from(a.0) * u64::from(b.1) == u64::from(b.0) * u64::from(a.1)
}

fn named(path: &Path, e: &dyn std::fmt::Display) -> String {
    format!("{}: {e}", path.display())
}

fn next(frames: &mut Frames, path: &Path) -> Result<Option<Frame>, String> {
    frames.next().transpose().map_err(|e| named(path, &e))
}
