//! Curves that are shown, and where their values are.

use crate::panels::axis::{self, Axis};
use crate::state::document::{components, track_name};
use crate::state::{EditClip, Selection, State};
use egui::{Color32, Pos2, Rect, pos2};
use sinew::clip::{Target, Track};
use std::rc::Rc;
use std::sync::Arc;

/// Curves shown at once; more could not be told apart.
const MOST: usize = 96;

/// One component of a track.
pub(super) struct Channel<'a> {
    pub(super) track: usize,
    pub(super) component: usize,
    pub(super) of: &'a Track,
    pub(super) name: String,
    pub(super) color: Color32,
    /// Shown value is `(stored · unit − middle) / half`: degrees, or −1…1 where curves are normalised.
    pub(super) unit: f64,
    pub(super) middle: f64,
    pub(super) half: f64,
    pub(super) seen: Rc<Seen>,
}

/// What can be seen of a curve, in its unit.
#[derive(Default)]
pub(super) struct Seen {
    /// At every other point from the left edge to the right one.
    values: Vec<f64>,
    low: f64,
    high: f64,
}

/// What was seen last, kept while curves and the time axis are the same: a playhead that moves samples nothing.
#[derive(Default)]
pub(super) struct Looks {
    of: Option<(Arc<EditClip>, Arc<Selection>, Axis)>,
    all: Vec<Rc<Seen>>,
}

impl Looks {
    fn at(&mut self, channels: &mut [Channel<'_>], state: &State, axis: &Axis) {
        let clip = &state.document.clips[state.clip];
        let same = |(c, s, a): &(Arc<EditClip>, Arc<Selection>, Axis)| {
            Arc::ptr_eq(c, clip) && Arc::ptr_eq(s, &state.selection) && a == axis
        };
        if !self.of.as_ref().is_some_and(same) {
            self.of = Some((clip.clone(), state.selection.clone(), *axis));
            self.all = channels.iter().map(|c| Rc::new(c.look(axis))).collect();
        }
        channels.iter_mut().zip(&self.all).for_each(|(c, seen)| c.seen = seen.clone());
    }
}

impl Channel<'_> {
    fn shown(&self, value: f64) -> f64 {
        (value - self.middle) / self.half
    }

    /// A key's value in the curve's unit.
    fn value(&self, k: usize) -> f64 {
        f64::from(self.of.curve.value(k)[self.component]) * self.unit
    }

    fn look(&self, axis: &Axis) -> Seen {
        let count = (axis.rect.width() / 2.0).max(0.0) as usize + 2;
        let t = |i: usize| axis.t(axis.rect.left() + 2.0 * i as f32);
        let values: Vec<f64> = (0..count).map(|i| self.sampled(t(i))).collect();
        let keys = axis.visible(self.of.curve.times());
        let step = (keys.len() / 256).max(1);
        let all = values.iter().copied().chain(keys.step_by(step).map(|k| self.value(k)));
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        Seen { values, low, high }
    }

    /// Smallest and largest value of what can be seen.
    pub(super) fn extent(&self) -> (f64, f64) {
        (self.shown(self.seen.low), self.shown(self.seen.high))
    }

    /// What can be seen, as points.
    pub(super) fn points(&self, axis: &Axis, values: &Values) -> Vec<Pos2> {
        let at = |(i, v): (usize, &f64)| pos2(axis.rect.left() + 2.0 * i as f32, values.y(self.shown(*v)));
        self.seen.values.iter().enumerate().map(at).collect()
    }

    /// Stored value a unit of the axis.
    pub(super) fn stored_unit(&self) -> f64 {
        self.half / self.unit
    }

    pub(super) fn key(&self, k: usize) -> (f64, f64) {
        (self.of.curve.times()[k], self.shown(self.value(k)))
    }

    fn sampled(&self, t: f64) -> f64 {
        let value = if let Target::Rotation(_) = self.of.target {
            self.of.curve.sample_rotation(t).to_array()[self.component]
        } else {
            let mut v = vec![0.0; self.of.curve.width()];
            self.of.curve.sample(t, &mut v);
            v[self.component]
        };
        f64::from(value) * self.unit
    }

    pub(super) fn at(&self, t: f64) -> f64 {
        self.shown(self.sampled(t))
    }

    pub(super) fn bit(&self) -> u8 {
        1 << self.component.min(7)
    }
}

/// Values to points.
#[derive(Clone, Copy)]
pub(super) struct Values {
    pub(super) rect: Rect,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Values {
    pub(super) fn y(&self, v: f64) -> f32 {
        let part = (v - self.low) / (self.high - self.low);
        self.rect.bottom() - (part.clamp(-1e3, 1e3) as f32) * self.rect.height()
    }

    pub(super) fn v(&self, y: f32) -> f64 {
        self.low + f64::from((self.rect.bottom() - y) / self.rect.height()) * (self.high - self.low)
    }
}

/// Curves of the selected bones, or of the tracks whose keys are selected.
pub(super) fn channels<'a>(state: &'a State, axis: &Axis, looks: &mut Looks) -> Vec<Channel<'a>> {
    let skeleton = state.document.skeleton();
    let bones = &state.selection.bones;
    let of = |(i, t): &(usize, &std::sync::Arc<Track>)| match t.target.bone() {
        Some(b) if !bones.is_empty() => bones.contains(&b),
        _ => state.selection.keys.contains_key(&(*i as u32)),
    };
    let mut out = Vec::new();
    for (track, t) in state.active().tracks.iter().enumerate().filter(of).take(MOST) {
        let full = track_name(skeleton, t);
        let bone = full.rsplit_once('.').map_or(full.as_str(), |(b, _)| b);
        let unit = if matches!(t.target, Target::Xzx(_)) { 180.0 / std::f64::consts::PI } else { 1.0 };
        for (component, name) in components(&state.document, t).into_iter().enumerate() {
            let color = hue(component, track);
            out.push(Channel {
                track,
                component,
                of: t,
                name: format!("{bone}.{name}"),
                color,
                unit,
                middle: 0.0,
                half: 1.0,
                seen: Rc::default(),
            });
        }
    }
    out.truncate(MOST);
    looks.at(&mut out, state, axis);
    for c in out.iter_mut().filter(|_| state.view.normalise) {
        let (lo, hi) = c.extent();
        (c.middle, c.half) = ((lo + hi) / 2.0, ((hi - lo) / 2.0).max(1e-6));
    }
    out
}

/// Red, green, blue by component; paler from bone to bone.
pub(super) fn hue(component: usize, track: usize) -> Color32 {
    let base = [[240, 90, 90], [110, 210, 90], [90, 150, 255], [220, 180, 80]][component % 4];
    let pale = (track % 3) as f32 * 0.25;
    let [r, g, b] = base.map(|c| (c as f32 + (235.0 - c as f32) * pale) as u8);
    Color32::from_rgb(r, g, b)
}

/// The key within half a hit area of a point.
pub(super) fn nearest<'c, 'a>(
    channels: &'c [Channel<'a>],
    axis: &Axis,
    values: &Values,
    at: Pos2,
) -> Option<(&'c Channel<'a>, usize)> {
    let (t0, t1) = (axis.t(at.x - axis::HIT), axis.t(at.x + axis::HIT));
    let near = channels.iter().flat_map(|c| {
        let times = c.of.curve.times();
        let run = times.partition_point(|&t| t < t0)..times.partition_point(|&t| t <= t1);
        run.map(move |k| (c, k))
    });
    let far = |(c, k): &(&Channel<'_>, usize)| {
        let (t, v) = c.key(*k);
        pos2(axis.x(t), values.y(v)).distance(at)
    };
    near.filter(|n| far(n) <= axis::HIT * 1.4).min_by(|a, b| far(a).total_cmp(&far(b)))
}
