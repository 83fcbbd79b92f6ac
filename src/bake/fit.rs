//! One track: the fewest keys that keep every sample of it within a tolerance.

use crate::clip::{Curve, Interpolation};
use crate::math::{euler, rotation};
use glam::{DVec3, Quat, Vec3};

/// How values of a track are compared, and what of them is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Unit quaternions: radians between them.
    Rotation,
    /// XZX angles: radians that the bone turns by.
    Angles,
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
    /// The samples that were keys of the curve.
    pub own: Vec<usize>,
    /// Those that a jump follows, ascending.
    breaks: Vec<usize>,
}

/// Parts between two keys of a cubic, at whose ends samples are taken.
const CUBIC_STEPS: usize = 8;

/// And between two of a straight piece: fitted cubics bulge between samples.
const STRAIGHT_STEPS: usize = 4;

impl Samples {
    /// Of a curve: its keys, and points between them.
    pub fn of(curve: &Curve, kind: Kind) -> Self {
        let keys = curve.times();
        let mut out =
            Self { kind, width: curve.width(), times: vec![], values: vec![], own: vec![], breaks: vec![] };
        let held = curve.interpolation() == Interpolation::Hold;
        for (k, &t) in keys.iter().enumerate() {
            // Of keys at one time the last holds; elsewhere the curve arrives at one and leaves from another.
            if held && keys.get(k + 1) == Some(&t) {
                continue;
            }
            let before = out.times.last().copied();
            if let Some(before) = before.filter(|&b| b < t) {
                out.between(curve, before, t);
            }
            out.own.push(out.times.len());
            out.times.push(t);
            let value = curve.value(k);
            match kind {
                Kind::Rotation => out.values.extend(rotation::unit(Quat::from_slice(value)).to_array()),
                _ => out.values.extend(value),
            }
        }
        out.align();
        out.seal();
        out
    }

    /// Without the points between keys, so that keys are chosen among keys.
    pub fn at_keys(self) -> Self {
        let values = self.own.iter().flat_map(|&i| self.value(i).to_vec()).collect();
        let times: Vec<f64> = self.own.iter().map(|&i| self.times[i]).collect();
        let mut out = Self { own: (0..times.len()).collect(), times, values, ..self };
        out.seal();
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
            Interpolation::Linear => self.spread(curve, from, to, STRAIGHT_STEPS),
            Interpolation::CatmullRom(_) | Interpolation::Hermite => {
                self.spread(curve, from, to, CUBIC_STEPS);
            }
        }
    }

    fn spread(&mut self, curve: &Curve, from: f64, to: f64, steps: usize) {
        for i in 1..steps {
            // Keys may come to stand here, and files hold their times in single precision.
            let t = (from + (to - from) * i as f64 / steps as f64) as f32 as f64;
            if t < to && self.times.last().is_none_or(|last| *last < t) {
                self.push(curve, t);
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
            Kind::Angles => angles_apart(wide(a), wide(b)),
            Kind::Vector => wide(a).distance(wide(b)),
            Kind::Weights => a.iter().zip(b).map(|(a, b)| (a - b).abs() as f64).fold(0.0, f64::max),
        }
    }

    fn seal(&mut self) {
        self.breaks = (0..self.len()).filter(|&i| self.jumps(i)).collect();
    }

    /// The last sample that can be reached from `i` without a jump; not `i` itself.
    fn run_end(&self, i: usize) -> usize {
        let next = self.breaks.partition_point(|b| *b <= i);
        self.breaks.get(next).copied().unwrap_or(self.len() - 1)
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

/// Radians between triples that are near each other. Turns count, so one that is a turn off is not near.
fn angles_apart(a: DVec3, b: DVec3) -> f64 {
    euler::xzx_distance(a.to_array(), b.to_array())
}

/// Keys of straight pieces: of samples, with the values that are stored for them.
pub(super) struct Pieces {
    /// Samples that became keys.
    pub keys: Vec<usize>,
    /// What is stored for each.
    pub values: Vec<f32>,
}

/// How much wider than the tolerance pieces between exact keys may be tried, so that keys moved off the curve bring them within it:
/// a chord errs to one side, and moving it to the middle of its error halves it.
pub(super) const WIDER: [f64; 4] = [2.0, 1.7, 1.4, 1.2];

/// And where a guess will do.
pub(super) const WIDER_DRAFT: [f64; 1] = [1.7];

/// Few keys whose straight pieces stay within `tolerance` of every sample; the first and the last are exact, so that loops close.
/// `stored` is what a file will hold of a value: pieces are tried as they will be played. `wider` is tried in order; the one that served is
/// returned, 1 where none did.
pub(super) fn fitted(
    s: &Samples,
    tolerance: f64,
    wider: &[f64],
    stored: impl Fn(&[f32]) -> Vec<f32>,
) -> (Pieces, f64) {
    let exact = straight(s, &Near::new(tolerance), &stored);
    for &wider in wider {
        let mut pieces = straight(s, &Near::new(wider * tolerance), &stored);
        if pieces.keys.len() < exact.keys.len() {
            settle(s, &mut pieces, &stored);
            if s.holds(&pieces, tolerance) {
                return (pieces, wider);
            }
        }
    }
    (exact, 1.0)
}

/// How far pieces are from the samples at most.
pub(super) fn worst(s: &Samples, p: &Pieces) -> f64 {
    let mut worst = 0.0_f64;
    s.each(p, |piece, u, value| {
        worst = worst.max(piece.off(u, value));
        true
    });
    worst
}

impl Samples {
    /// Whether the pieces stay within the tolerance of every sample.
    fn holds(&self, p: &Pieces, tolerance: f64) -> bool {
        let near = Near::new(tolerance);
        self.each(p, |piece, u, value| near.holds(piece, u, value))
    }

    /// Go through every sample with the piece that it belongs to, until one is refused.
    fn each<'s>(&'s self, p: &'s Pieces, mut take: impl FnMut(&Straight, f64, &'s [f32]) -> bool) -> bool {
        let w = self.width;
        p.keys.windows(2).enumerate().all(|(k, ends)| {
            let (a, b) = (&p.values[k * w..(k + 1) * w], &p.values[(k + 1) * w..(k + 2) * w]);
            let piece = Straight::new(self.kind, a, b);
            let from = self.times[ends[0]];
            let h = self.times[ends[1]] - from;
            let at = |i: usize| if h > 0.0 { (self.times[i] - from) / h } else { (i - ends[0]) as f64 };
            (ends[0]..=ends[1]).all(|i| take(&piece, at(i), self.value(i)))
        })
    }
}

/// Move the keys between jumps to where the squares of all samples' errors are least: a tridiagonal system for each component.
fn settle(s: &Samples, p: &mut Pieces, stored: &impl Fn(&[f32]) -> Vec<f32>) {
    let n = p.keys.len();
    let (mut from, w) = (0, s.width);
    while from + 1 < n {
        let to = (from..n - 1).find(|&k| s.jumps(p.keys[k])).unwrap_or(n - 1);
        if to > from + 1 {
            for (k, v) in settled(s, &p.keys[from..=to]).chunks(w).enumerate() {
                let v = if s.kind == Kind::Rotation {
                    rotation::unit(Quat::from_slice(v)).to_array().to_vec()
                } else {
                    v.to_vec()
                };
                p.values[(from + 1 + k) * w..(from + 2 + k) * w].copy_from_slice(&stored(&v));
            }
        }
        from = (to + 1).max(from + 1);
    }
}

/// Values of the inner ones of these keys.
fn settled(s: &Samples, keys: &[usize]) -> Vec<f32> {
    let (n, w) = (keys.len() - 2, s.width);
    let (mut diagonal, mut beside) = (vec![0.0_f64; n], vec![0.0_f64; n]);
    let mut right = vec![0.0_f64; n * w];
    for (k, ends) in keys.windows(2).enumerate() {
        let h = s.times[ends[1]] - s.times[ends[0]];
        // The sample at a key belongs to the piece that it ends.
        for i in ends[0] + 1..=ends[1] {
            let u = (s.times[i] - s.times[ends[0]]) / h;
            let (left, own) = (k.checked_sub(1), Some(k).filter(|&k| k < n));
            for (row, weight) in [(left, 1.0 - u), (own, u)] {
                let Some(row) = row else { continue };
                diagonal[row] += weight * weight;
                for c in 0..w {
                    right[row * w + c] += weight * s.value(i)[c] as f64;
                }
            }
            match (left, own) {
                (Some(l), Some(_)) => beside[l] += u * (1.0 - u),
                // The ends are known.
                (Some(l), None) => {
                    (0..w).for_each(|c| right[l * w + c] -= u * (1.0 - u) * s.value(keys[n + 1])[c] as f64)
                }
                (None, Some(o)) => {
                    (0..w).for_each(|c| right[o * w + c] -= u * (1.0 - u) * s.value(keys[0])[c] as f64)
                }
                (None, None) => {}
            }
        }
    }
    for r in 1..n {
        let m = beside[r - 1] / diagonal[r - 1];
        diagonal[r] -= m * beside[r - 1];
        for c in 0..w {
            right[r * w + c] -= m * right[(r - 1) * w + c];
        }
    }
    for r in (0..n).rev() {
        for c in 0..w {
            let next = if r + 1 < n { beside[r] * right[(r + 1) * w + c] } else { 0.0 };
            right[r * w + c] = (right[r * w + c] - next) / diagonal[r];
        }
    }
    right.iter().map(|v| *v as f32).collect()
}

/// The fewest keys from sample `0` to the last whose straight pieces stay within `tolerance` of every sample.
fn straight(s: &Samples, near: &Near, stored: &impl Fn(&[f32]) -> Vec<f32>) -> Pieces {
    let n = s.len();
    let mut out = Pieces { keys: vec![0], values: stored(s.value(0)) };
    let mut from = 0;
    while from + 1 < n {
        if s.jumps(from) {
            // Two keys at one time; the piece between them has no length.
            from += 1;
        } else {
            from = reach(s, from, near, stored);
        }
        out.keys.push(from);
        out.values.extend(stored(s.value(from)));
    }
    out
}

/// All keys of the curve as they are, for tracks whose times others share.
pub(super) fn all(s: &Samples, stored: impl Fn(&[f32]) -> Vec<f32>) -> Pieces {
    Pieces { keys: s.own.clone(), values: s.own.iter().flat_map(|&i| stored(s.value(i))).collect() }
}

/// The last sample that a straight piece from `from` may end at: doubling steps, then bisection.
fn reach(s: &Samples, from: usize, near: &Near, stored: &impl Fn(&[f32]) -> Vec<f32>) -> usize {
    let a = stored(s.value(from));
    let end = s.run_end(from);
    let fits = |to: usize| {
        let b = stored(s.value(to));
        let piece = Straight::new(s.kind, &a, &b);
        let h = s.times[to] - s.times[from];
        let holds = |i: usize| near.holds(&piece, (s.times[i] - s.times[from]) / h, s.value(i));
        // Most pieces that are too long miss their middle.
        to == from + 1 || (holds(from + (to - from) / 2) && (from + 1..to).all(holds))
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

/// A straight piece between two values.
pub(super) struct Straight<'v> {
    kind: Kind,
    a: &'v [f32],
    b: &'v [f32],
    /// Of quaternions: half the angle between them, and the sign that brings them together.
    theta: f64,
    sign: f64,
}

impl<'v> Straight<'v> {
    pub fn new(kind: Kind, a: &'v [f32], b: &'v [f32]) -> Self {
        let mut out = Self { kind, a, b, theta: 0.0, sign: 1.0 };
        if kind == Kind::Rotation {
            let [p, q] = [a, b].map(|v| Quat::from_slice(v).as_dquat());
            out.sign = if p.dot(q) < 0.0 { -1.0 } else { 1.0 };
            out.theta = 2.0 * (p - q * out.sign).length().atan2((p + q * out.sign).length());
        }
        out
    }

    /// Shoemake's slerp, not normalised.
    #[inline]
    fn arc(&self, u: f64) -> [f64; 4] {
        let part = |u: f64| {
            // sin(uθ)/sin θ by its series: the next term is below 1e-8 here.
            if self.theta > 0.25 {
                return (u * self.theta).sin() / self.theta.sin().max(1e-9);
            }
            let (t, u2) = (self.theta * self.theta, u * u);
            let third = (31.0 + u2 * (-49.0 + u2 * (21.0 - 3.0 * u2))) / 15120.0;
            u * (1.0 + t * ((1.0 - u2) / 6.0 + t * ((7.0 + u2 * (-10.0 + 3.0 * u2)) / 360.0 + t * third)))
        };
        let [p, q] = [part(1.0 - u), self.sign * part(u)];
        std::array::from_fn(|c| p * self.a[c] as f64 + q * self.b[c] as f64)
    }

    /// How far it is from a value at `u`: radians, or the unit of the values.
    pub fn off(&self, u: f64, value: &[f32]) -> f64 {
        let (a, b) = (self.a, self.b);
        match self.kind {
            Kind::Rotation => {
                let (sine2, unit) = sine2(self.arc(u), value);
                2.0 * (sine2 / unit.max(1e-30)).sqrt().min(1.0).asin()
            }
            Kind::Angles => angles_apart(wide(a).lerp(wide(b), u), wide(value)),
            Kind::Vector => wide(a).lerp(wide(b), u).distance(wide(value)),
            Kind::Weights => {
                let each = a.iter().zip(b).zip(value);
                each.map(|((a, b), v)| (a + (b - a) * u as f32 - v).abs() as f64).fold(0.0, f64::max)
            }
        }
    }
}

/// The squared sine of the angle between two quaternions as vectors of four, times both squared lengths: by Lagrange's identity, so that
/// nothing cancels; and those lengths' product.
#[inline]
fn sine2(q: [f64; 4], value: &[f32]) -> (f64, f64) {
    let v: [f64; 4] = std::array::from_fn(|c| value[c] as f64);
    let minor = |i: usize, j: usize| (q[i] * v[j] - q[j] * v[i]).powi(2);
    let sum = minor(0, 1) + minor(0, 2) + minor(0, 3) + minor(1, 2) + minor(1, 3) + minor(2, 3);
    let length2 = |a: [f64; 4]| a.iter().map(|c| c * c).sum::<f64>();
    (sum, length2(q) * length2(v))
}

/// What is near enough.
pub(super) struct Near {
    pub tolerance: f64,
    /// Of quaternions, the sine of half of it, squared.
    sine2: f64,
}

impl Near {
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, sine2: (0.5 * tolerance.min(std::f64::consts::PI)).sin().powi(2) }
    }

    fn holds(&self, piece: &Straight, u: f64, value: &[f32]) -> bool {
        match piece.kind {
            Kind::Rotation => self.holds_turn(piece.arc(u), value),
            _ => piece.off(u, value) <= self.tolerance,
        }
    }

    /// A quaternion of any length against another.
    pub fn holds_turn(&self, q: [f64; 4], value: &[f32]) -> bool {
        let (sine2, unit) = sine2(q, value);
        sine2 <= self.sine2 * unit && unit > 0.0
    }
}
