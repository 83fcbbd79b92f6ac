//! What it costs that a character's vertices are others than they were: fewer influences, coarser numbers, or straight ways from frame to
//! frame. The bones stay as they are.

use super::BakeDesc;
use super::bound::{Bound, Change};
use super::gauge::{Gauge, Spot, Worst};
use super::times::{self, Motions, Verdict};
use crate::character::{Binding, Character, Scratch};
use crate::clip::Clip;
use glam::{DVec3, Vec3};

/// What it costs over a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// The vertex that was measured to be farthest off.
    pub worst: Worst,
    /// Metres that no vertex exceeds at any time, rounding of single precision aside; not known where `worst` is over the limit.
    pub ceiling: f64,
    /// Moments looked at.
    pub moments: usize,
}

impl Cost {
    fn of(verdict: &Verdict, desc: &BakeDesc) -> Self {
        let Verdict { worst, ceiling, moments, .. } = *verdict;
        Self { worst, ceiling: ceiling * desc.tolerance, moments }
    }
}

/// Vertices that have fewer influences in `less`, and the largest sum of weights that one of them lost.
pub fn dropped(character: &Character, less: &Character) -> (usize, f32) {
    let mut out = (0, 0.0_f32);
    for (a, b) in character.instances().iter().zip(less.instances()) {
        let (Binding::Skin { weights: a, .. }, Binding::Skin { weights: b, .. }) = (&a.binding, &b.binding)
        else {
            continue;
        };
        for v in 0..a.vertex_count() {
            let lost: f32 = a.of(v).skip(b.per_vertex()).map(|w| w.1).sum();
            out = (out.0 + usize::from(lost > 0.0), out.1.max(lost));
        }
    }
    out
}

/// What it costs over a clip to play it on `changed`, which is `character` with as many vertices elsewhere. The search ends where the
/// tolerance is exceeded; its metric and its pins have no meaning here.
///
/// # Panics
/// If the clip is not of the character, or the two differ in more than their vertices' places and influences.
pub fn changed(character: &Character, changed: &Character, clip: &Clip, desc: &BakeDesc) -> Cost {
    let gauge = Gauge::of(character, desc);
    let all = (0..character.instances().len()).map(|i| Change::new(Some(character), changed, i));
    let changes: Vec<Change> = all.filter(|c| !c.is_none()).collect();
    if changes.is_empty() {
        return Cost::default();
    }
    let bound = Bound::new(&gauge, [clip, clip]);
    let motions = Changed { gauge: &gauge, bound, clip, changed, changes };
    Cost::of(&times::bracket(&gauge, &times::knots(&[clip]), &motions), desc)
}

/// What it costs that vertices go straight from where they are at one of `frames` to where they are at the next; before the first and after
/// the last they stand.
///
/// # Panics
/// If the clip is not of the character, or there are no frames.
pub fn straight(character: &Character, clip: &Clip, frames: &[f64], desc: &BakeDesc) -> Cost {
    let gauge = Gauge::of(character, desc);
    let changes = (0..character.instances().len()).map(|i| Change::new(None, character, i)).collect();
    let range = clip.playback();
    let mut knots: Vec<f64> = times::knots(&[clip]).into_iter().chain(frames.iter().copied()).collect();
    knots.retain(|t| (range.start..=range.end).contains(t));
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    let motions = Straight { gauge: &gauge, bound: Bound::new(&gauge, [clip, clip]), clip, frames, changes };
    Cost::of(&times::bracket(&gauge, &knots, &motions), desc)
}

struct Changed<'a> {
    gauge: &'a Gauge<'a>,
    bound: Bound<'a>,
    clip: &'a Clip,
    changed: &'a Character,
    changes: Vec<Change>,
}

impl Motions for Changed<'_> {
    fn apart(&self, times: &[f64], _floor: f64) -> Vec<Worst> {
        self.gauge.map(times, |time| {
            let c = self.gauge.character;
            let pose = self.gauge.pose(self.clip, time);
            let posed = c.posed(&pose);
            let center = c.center(&posed);
            let mut scratch = Scratch::default();
            let [mut p, mut q] = [vec![], vec![]];
            let mut worst = Worst { time, ..Worst::default() };
            for Change { instance, .. } in &self.changes {
                c.positions(*instance, &pose, &posed, center, &mut scratch, &mut p);
                self.changed.positions(*instance, &pose, &posed, center, &mut scratch, &mut q);
                let apart = p.iter().zip(&q).map(|(p, q)| p.distance(*q) as f64);
                worst = farthest(worst, *instance, apart, self.gauge.limit);
            }
            worst
        })
    }

    fn bend(&self, times: [f64; 2]) -> f64 {
        self.bound.bend_of(self.clip, times, &self.changes)
    }

    fn end_before(&self, t: f64) -> f64 {
        self.bound.end_before(t)
    }
}

struct Straight<'a> {
    gauge: &'a Gauge<'a>,
    bound: Bound<'a>,
    clip: &'a Clip,
    frames: &'a [f64],
    changes: Vec<Change>,
}

impl Straight<'_> {
    /// Where all vertices of an instance are, in the world.
    fn places(&self, instance: usize, time: f64) -> impl Iterator<Item = DVec3> {
        let c = self.gauge.character;
        let pose = self.gauge.pose(self.clip, time);
        let posed = c.posed(&pose);
        let center = c.center(&posed);
        let mut points: Vec<Vec3> = vec![];
        c.positions(instance, &pose, &posed, center, &mut Scratch::default(), &mut points);
        points.into_iter().map(move |p| center + p.as_dvec3())
    }
}

impl Motions for Straight<'_> {
    fn apart(&self, times: &[f64], _floor: f64) -> Vec<Worst> {
        self.gauge.map(times, |time| {
            let next = self.frames.partition_point(|f| *f <= time).min(self.frames.len() - 1);
            let (a, b) = (self.frames[next.saturating_sub(1)], self.frames[next]);
            let part = if b > a { ((time - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
            let end = self.clip.playback().end;
            let mut worst = Worst { time, ..Worst::default() };
            for instance in 0..self.changes.len() {
                let [a, b, own] = [a, b, time].map(|t| self.places(instance, t.min(end)));
                let apart = a.zip(b).zip(own).map(|((a, b), own)| a.lerp(b, part).distance(own));
                worst = farthest(worst, instance, apart, self.gauge.limit);
            }
            worst
        })
    }

    fn bend(&self, times: [f64; 2]) -> f64 {
        self.bound.bend_of(self.clip, times, &self.changes)
    }

    fn end_before(&self, t: f64) -> f64 {
        self.bound.end_before(t)
    }
}

fn farthest(worst: Worst, instance: usize, apart: impl Iterator<Item = f64>, limit: f64) -> Worst {
    apart.enumerate().fold(worst, |worst, (vertex, distance)| match distance > worst.distance {
        true => Worst { distance, limit, spot: Some(Spot::Vertex { instance, vertex }), ..worst },
        false => worst,
    })
}
