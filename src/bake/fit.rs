//! One track: the fewest keys that keep every sample of it within a tolerance.

use crate::clip::{Curve, Interpolation};
use crate::math::rotation;
use glam::{DVec3, Quat, Vec3};

/// How values of a track are compared, and what of them is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Unit quaternions: radians between them.
    Rotation,
    /// Vectors: their distance.
    Vector,
    /// Morph weights: the largest difference.
    Weights,
}

/// The source of a track, sampled where it may bend.
pub(super) struct Samples {
    pub kind: Kind,
    pub width: usize,
    /// Seconds, ascending. Two equal times are a jump: the value before it and the one after.
    pub times: Vec<f64>,
    /// `width` numbers a time.
    pub values: Vec<f32>,
}

/// Between two keys of a cubic, so many samples; more where the keys are far apart in time.
const CUBIC_STEPS: usize = 8;

impl Samples {
    /// Of a curve: its keys, and points between them.
    pub fn of(curve: &Curve, kind: Kind) -> Self {
        let keys = curve.times();
        let mut out = Self { kind, width: curve.width(), times: vec![], values: vec![] };
        for (k, &t) in keys.iter().enumerate() {
            if k > 0 && keys[k - 1] == t {
                continue;
            }
            if k > 0 {
                out.between(curve, keys[k - 1], t);
            }
            out.push(curve, t);
        }
        out.align();
        out
    }

    fn between(&mut self, curve: &Curve, from: f64, to: f64) {
        match curve.interpolation() {
            // The value that is held, up to the jump.
            Interpolation::Hold => {
                let held = self.values[self.values.len() - self.width..].to_vec();
                self.times.push(to);
                self.values.extend(held);
            }
            Interpolation::Linear => self.push(curve, 0.5 * (from + to)),
            Interpolation::CatmullRom(_) | Interpolation::Hermite => {
                (1..CUBIC_STEPS).for_each(|i| self.push(curve, from + (to - from) * i as f64 / CUBIC_STEPS as f64));
            }
        }
    }

    fn push(&mut self, curve: &Curve, t: f64) {
        let from = self.values.len();
        self.times.push(t);
        self.values.resize(from + self.width, 0.0);
        if self.kind == Kind::Rotation {
            self.values[from..].copy_from_slice(&curve.sample_rotation(t).to_array());
        } else {
            curve.sample(t, &mut self.values[from..]);
        }
    }

    /// Neighbouring quaternions on the same half of the sphere.
    fn align(&mut self) {
        if self.kind == Kind::Rotation {
            for i in 1..self.times.len() {
                if self.quat(i).dot(self.quat(i - 1)) < 0.0 {
                    self.values[4 * i..4 * i + 4].iter_mut().for_each(|v| *v = -*v);
                }
            }
        }
    }

    pub fn len(&self) -> usize {
        self.times.len()
    }

    pub fn value(&self, i: usize) -> &[f32] {
        &self.values[i * self.width..(i + 1) * self.width]
    }

    fn quat(&self, i: usize) -> Quat {
        Quat::from_slice(self.value(i))
    }

    /// How far two values are apart: radians, or the unit of the values.
    pub fn distance(&self, a: &[f32], b: &[f32]) -> f64 {
        match self.kind {
            Kind::Rotation => rotation::angle_between(Quat::from_slice(a), Quat::from_slice(b)) as f64,
            Kind::Vector => wide(a).distance(wide(b)),
            Kind::Weights => a.iter().zip(b).map(|(a, b)| (a - b).abs() as f64).fold(0.0, f64::max),
        }
    }

    /// Whether a jump lies between sample `i` and the next.
    pub fn jumps(&self, i: usize) -> bool {
        i + 1 < self.len() && self.times[i] == self.times[i + 1]
    }

    /// Whether all of it lies within `tolerance` of a value.
    pub fn is_constant(&self, value: &[f32], tolerance: f64) -> bool {
        (0..self.len()).all(|i| self.distance(self.value(i), value) <= tolerance)
    }
}

fn wide(v: &[f32]) -> DVec3 {
    Vec3::from_slice(v).as_dvec3()
}

/// Keys of straight pieces: of samples, with the values that are stored for them.
pub(super) struct Pieces {
    /// Samples that became keys.
    pub keys: Vec<usize>,
    /// What is stored for each.
    pub values: Vec<f32>,
}

/// The fewest keys from sample `0` to the last whose straight pieces stay within `tolerance` of every sample. `stored` is what a
/// file will hold of a value: pieces are tried as they will be played.
pub(super) fn straight(s: &Samples, tolerance: f64, stored: impl Fn(&[f32]) -> Vec<f32>) -> Pieces {
    let n = s.len();
    let mut out = Pieces { keys: vec![0], values: stored(s.value(0)) };
    let mut from = 0;
    while from + 1 < n {
        if s.jumps(from) {
            // Two keys at one time; the piece between them has no length.
            from += 1;
        } else {
            from = reach(s, from, tolerance, &stored);
        }
        out.keys.push(from);
        out.values.extend(stored(s.value(from)));
    }
    out
}

/// The last sample that a straight piece from `from` may end at: doubling steps, then bisection.
fn reach(s: &Samples, from: usize, tolerance: f64, stored: &impl Fn(&[f32]) -> Vec<f32>) -> usize {
    let a = stored(s.value(from));
    let end = (from + 1..s.len()).find(|&i| s.jumps(i)).unwrap_or(s.len() - 1);
    let fits = |to: usize| {
        let b = stored(s.value(to));
        let h = s.times[to] - s.times[from];
        (from + 1..to).all(|i| {
            let u = ((s.times[i] - s.times[from]) / h) as f32;
            off(s.kind, &a, &b, u, s.value(i)) <= tolerance
        })
    };
    let (mut good, mut step) = (from + 1, 1);
    let mut bad = end + 1;
    while good + step <= end {
        if !fits(good + step) {
            bad = good + step;
            break;
        }
        good += step;
        step *= 2;
    }
    while bad - good > 1 {
        let middle = good + (bad - good) / 2;
        if fits(middle) { good = middle } else { bad = middle }
    }
    good.min(end)
}

/// How far a straight piece from `a` to `b` is from a value at `u`.
fn off(kind: Kind, a: &[f32], b: &[f32], u: f32, value: &[f32]) -> f64 {
    match kind {
        Kind::Rotation => {
            let q = rotation::slerp(Quat::from_slice(a), Quat::from_slice(b), u);
            rotation::angle_between(q, Quat::from_slice(value)) as f64
        }
        Kind::Vector => wide(a).lerp(wide(b), u as f64).distance(wide(value)),
        Kind::Weights => {
            let each = a.iter().zip(b).zip(value).map(|((a, b), v)| (a + (b - a) * u - v).abs() as f64);
            each.fold(0.0, f64::max)
        }
    }
}
