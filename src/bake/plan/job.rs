//! One track on its way: what it is made into with what it is allowed.

use crate::bake::fit::{self, Kind, Samples};
use crate::bake::{BakeDesc, Goal, cubic};
use crate::clip::{Curve, Interpolation, Target};

/// Largest error of a normalised 16-bit quaternion, radians, and of its interpolation.
const SHORT_ERROR: f64 = 7e-5;

/// A track on its way.
pub(super) struct Job {
    pub target: Target,
    pub source: Curve,
    pub samples: Samples,
    /// What it shows without keys.
    pub rest: Vec<f32>,
    /// Metres that a unit of its error may move a vertex by.
    pub lever: f64,
    /// Its share beside the others'.
    pub weight: f64,
    /// What it was made into with the share at hand; none if it only shows the rest.
    pub made: Option<Made>,
}

/// What a track was made into.
#[derive(Clone)]
pub(super) struct Made {
    pub curve: Curve,
    /// Whether its values are integers in the file.
    pub short: bool,
    pub form: Form,
    /// By how much wider pieces were tried (see [`fit::fitted`]).
    pub wider: f64,
}

/// How keys were found.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Straight pieces.
    Straight,
    /// As they were.
    Kept,
    /// Cubics with slopes by a rule.
    Rule,
    /// Cubics with slopes of their own.
    Slopes,
}

/// How much is tried for a track.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Straight pieces: enough to see where the share will be.
    Draft,
    /// What served last time.
    Again,
    /// All forms.
    Full,
}

impl Goal {
    /// What a curve costs beside others of its track.
    fn cost(self, curve: &Curve, short: bool, source: &Curve) -> usize {
        match self {
            Self::Keys => curve.times().len(),
            Self::Bytes => {
                let times = if curve.times() == source.times() { 0 } else { 4 * curve.times().len() };
                times + curve.values().len() * if short { 2 } else { 4 }
            }
        }
    }
}

impl Job {
    pub fn keys(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.curve.times().len())
    }

    /// The fewest keys within `allowed`.
    pub fn reduced(&self, allowed: f64, desc: &BakeDesc, effort: Effort) -> Option<Made> {
        let (s, goal) = (&self.samples, desc.goal);
        if s.is_constant(&self.rest, allowed) {
            return None;
        }
        let unit = self.unit(allowed).filter(|_| desc.quantize);
        let short = unit.is_some();
        let stored = |v: &[f32]| match unit {
            Some(unit) => v.iter().map(|x| (x * unit).round().clamp(-unit, unit) / unit).collect(),
            None => v.to_vec(),
        };
        let made = |curve, short, form| Made { curve, short, form, wider: 1.0 };
        let first = stored(s.value(0));
        if s.is_constant(&first, allowed) {
            let curve = Curve::new(vec![s.times[0]], first, s.width, Interpolation::Hold);
            return curve.ok().map(|c| made(c, short, Form::Straight));
        }
        if desc.keep_keys {
            // Slopes need more than 16 bits hold.
            let source = self.source.with_slopes();
            let short = short && source.interpolation() != Interpolation::Hermite;
            let values = if short { stored(source.values()) } else { source.values().to_vec() };
            let curve = Curve::new(source.times().to_vec(), values, s.width, source.interpolation());
            return curve.ok().map(|c| made(c, short, Form::Kept));
        }
        if self.source.interpolation() == Interpolation::Hold {
            return Some(made(self.steps(allowed, stored), short, Form::Straight));
        }
        let last = self.made.as_ref().filter(|_| effort == Effort::Again);
        let tried = |form: Form| last.is_none_or(|last| last.form == form);
        if last.is_some_and(|last| last.form == Form::Slopes) {
            return Some(made(cubic::own_slopes(s, allowed), false, Form::Slopes));
        }
        let own = [Interpolation::Linear, Interpolation::Hermite].contains(&self.source.interpolation());
        let wider = match last {
            Some(last) if last.wider > 1.0 => std::slice::from_ref(&last.wider),
            Some(_) => &[],
            None if effort == Effort::Draft => &fit::WIDER_DRAFT,
            None => &fit::WIDER,
        };
        let (pieces, wider) = fit::fitted(s, allowed, wider, stored);
        let mut best = Made { wider, ..made(self.straight(&pieces), short, Form::Straight) };
        let mut others = vec![];
        // Keys that stay where all of them were share their times with other tracks.
        if goal == Goal::Bytes && self.source.interpolation() == Interpolation::Linear {
            others.push(made(self.straight(&fit::all(s, stored)), short, Form::Kept));
        } else if own || goal == Goal::Keys {
            others.push(made(self.source.clone(), false, Form::Kept));
        }
        // No cubic is smaller than three straight pieces, and for a draft both cost the same error.
        if pieces.keys.len() > 4 && effort != Effort::Draft {
            if goal == Goal::Keys && tried(Form::Rule) {
                others.extend(cubic::by_rule(s, allowed).map(|curve| made(curve, false, Form::Rule)));
            }
            if tried(Form::Slopes) {
                others.push(made(cubic::own_slopes(s, allowed), false, Form::Slopes));
            }
        }
        let cost = |made: &Made| goal.cost(&made.curve, made.short, &self.source);
        for other in others {
            if cost(&other) < cost(&best) {
                best = Made { wider, ..other };
            }
        }
        Some(best)
    }

    /// The integer that stands for 1, if integers hold the track's values well enough: a third of what is allowed, or exactly.
    fn unit(&self, allowed: f64) -> Option<f32> {
        match self.samples.kind {
            Kind::Rotation => (SHORT_ERROR < 0.3 * allowed).then_some(32_767.0),
            Kind::Weights => {
                let values = self.source.values();
                let within = |least: f32| values.iter().all(|v| (least..=1.0).contains(v));
                let units = if within(0.0) { [255.0, 65_535.0] } else { [127.0, 32_767.0] };
                let exact = self.source.integers().map(|form| form.unit());
                let fine = |unit: &f32| 0.5 / (*unit as f64) < 0.3 * allowed || exact == Some(*unit);
                units.into_iter().find(fine).filter(|_| within(-1.0))
            }
            _ => None,
        }
    }

    fn straight(&self, pieces: &fit::Pieces) -> Curve {
        let s = &self.samples;
        let times = pieces.keys.iter().map(|&k| s.times[k]).collect();
        let curve = Curve::new(times, pieces.values.clone(), s.width, Interpolation::Linear);
        curve.expect("keys of a curve, in order")
    }

    /// Steps whose value changes.
    fn steps(&self, allowed: f64, stored: impl Fn(&[f32]) -> Vec<f32>) -> Curve {
        let (mut times, mut values) = (vec![], Vec::<f32>::new());
        let width = self.samples.width;
        for (k, &t) in self.source.times().iter().enumerate() {
            let v = self.source.value(k);
            let last = values.len().checked_sub(width).map(|from| &values[from..]);
            if last.is_none_or(|last| self.samples.distance(last, v) > allowed) {
                times.push(t);
                values.extend(stored(v));
            }
        }
        Curve::new(times, values, width, Interpolation::Hold).expect("keys of a curve, in order")
    }
}
