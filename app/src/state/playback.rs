//! The playhead: where it may stand and how it runs.

use super::State;
use sinew::time::{Range, Wrap, wrap};

/// What happens at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LoopMode {
    /// Start again.
    #[default]
    Loop,
    /// Stop.
    Once,
    /// There and back.
    PingPong,
}

/// How the playhead runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// Seconds since it started, as if nothing ended; `None` where it stands.
    pub playing: Option<f64>,
    /// At the end.
    pub mode: LoopMode,
    /// Clip seconds a real second, 0.25 to 2.
    pub speed: f64,
    /// Show every frame, however long it takes, or drop frames to keep time.
    pub every_frame: bool,
    /// What is played: the clip's range, or a part to look at.
    pub range: Range,
}

impl Default for Playback {
    fn default() -> Self {
        Self {
            playing: None,
            mode: LoopMode::Loop,
            speed: 1.0,
            every_frame: false,
            range: Range { start: 0.0, end: 2.0 },
        }
    }
}

impl Playback {
    /// With numbers that can be played.
    pub(super) fn checked(mut self) -> Self {
        self.speed = if self.speed.is_finite() { self.speed.clamp(0.25, 2.0) } else { 1.0 };
        if !(self.range.start.is_finite() && self.range.end.is_finite()) {
            self.range = Self::default().range;
        }
        self.range.end = self.range.end.max(self.range.start);
        self
    }
}

/// Times beyond this many seconds are mistakes: a day.
const FAR: f64 = 86_400.0;

impl State {
    /// Seconds a frame.
    pub fn frame_seconds(&self) -> f64 {
        1.0 / self.document.rate.fps()
    }

    /// The frame at `t`, frame 0 at 0 s, with its fraction.
    pub fn frame_at(&self, t: f64) -> f64 {
        t * self.document.rate.fps()
    }

    /// The second of a frame; the one place that says where frames are.
    pub fn time_of(&self, frame: f64) -> f64 {
        frame * f64::from(self.document.rate.seconds()) / f64::from(self.document.rate.frames())
    }

    /// `t` on its frame.
    pub fn snapped(&self, t: f64) -> f64 {
        self.time_of(self.frame_at(t.clamp(-FAR, FAR)).round())
    }

    /// Where a key goes: on its frame, if times snap.
    pub fn key_time(&self, t: f64) -> f64 {
        if self.snap { self.snapped(t) } else { t.clamp(-FAR, FAR) }
    }

    /// Distinct key times of the chosen bones (or of everything) next to the playhead.
    pub fn neighbour_key(&self, forward: bool) -> Option<f64> {
        let bones = &self.selection.bones;
        let of = |b: Option<_>| bones.is_empty() || b.is_some_and(|b| bones.contains(&b));
        let tracks = self.active().tracks.iter().filter(|t| of(t.target.bone()));
        let near = tracks.filter_map(|t| {
            let times = t.curve.times();
            if forward {
                times.get(times.partition_point(|&k| k <= self.time + 1e-6))
            } else {
                times.get(times.partition_point(|&k| k < self.time - 1e-6).checked_sub(1)?)
            }
        });
        near.copied().reduce(if forward { f64::min } else { f64::max })
    }

    pub(super) fn set_time(&mut self, t: f64) {
        if !t.is_finite() {
            return;
        }
        self.time = t.clamp(-FAR, FAR);
        if self.playback.playing.is_some() {
            self.playback.playing = Some(self.time - self.playback.range.start);
        }
    }

    pub(super) fn play(&mut self, on: bool) {
        let Playback { range, mode, .. } = self.playback;
        if on && self.playback.playing.is_none() {
            let inside = self.time >= range.start && self.time < range.end;
            let again = !inside || (mode == LoopMode::Once && self.time >= range.end);
            self.time = if again { range.start } else { self.time };
            self.playback.playing = Some(self.time - range.start);
        } else if !on && self.playback.playing.take().is_some() && self.snap {
            self.time = self.snapped(self.time);
        }
    }

    pub(super) fn tick(&mut self, dt: f64) {
        let Playback { playing: Some(at), range, mode, speed, every_frame } = self.playback else { return };
        // After a pause of the machine nothing is caught up with.
        let dt = if dt.is_finite() { dt.clamp(0.0, 1.0) } else { 0.0 };
        let at = at + if every_frame { self.frame_seconds() } else { dt * speed };
        let how = match mode {
            LoopMode::Loop => Wrap::Loop,
            LoopMode::Once => Wrap::Clamp,
            LoopMode::PingPong => Wrap::PingPong,
        };
        self.time = wrap(range.start + at, range, how);
        self.playback.playing = (mode != LoopMode::Once || at < range.duration()).then_some(at);
    }
}
