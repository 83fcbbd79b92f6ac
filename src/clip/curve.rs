//! One curve: times, values of some width, and how to get from key to key.

use super::quat;
use crate::math::rotation;
use crate::math::spline::{Tangents, hermite, hermite_slope, tangent};
use crate::time::Range;
use glam::Quat;

/// How values run between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier key (glTF STEP).
    Hold,
    /// Straight; rotations on the arc (glTF LINEAR).
    Linear,
    /// Cubic through the keys, slopes by the rule.
    CatmullRom(Tangents),
    /// Cubic with stored slopes: each key holds in-slope, value, out-slope (glTF CUBICSPLINE).
    Hermite,
}

/// `K` keys of `width` numbers each.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    pub(super) times: Vec<f64>,
    pub(super) values: Vec<f32>,
    pub(super) width: usize,
    pub(super) interpolation: Interpolation,
}

/// Why keys make no curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// Times and values do not fit together.
    #[error("{times} key times need {expected} numbers of width {width}, found {found}")]
    Count {
        /// Number of keys.
        times: usize,
        /// Numbers a key.
        width: usize,
        /// Numbers that the keys need.
        expected: usize,
        /// Numbers that there are.
        found: usize,
    },
    /// A curve needs a key.
    #[error("there are no keys")]
    Empty,
    /// NaN or infinity.
    #[error("key {key}: its {what} is not finite")]
    NotFinite {
        /// Which key.
        key: usize,
        /// Time or value.
        what: &'static str,
    },
    /// Times that run backwards.
    #[error("key {key}: its time {time} s is before the key ahead of it at {previous} s")]
    Unsorted {
        /// Which key.
        key: usize,
        /// Its time, seconds.
        time: f64,
        /// The time before it, seconds.
        previous: f64,
    },
}

/// Integers that stand for parts of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integers {
    /// 8 or 16.
    pub bits: usize,
    /// Down to −1, or from 0.
    pub signed: bool,
}

impl Integers {
    /// The integer that means 1.
    pub fn unit(self) -> f32 {
        ((1u32 << (self.bits - usize::from(self.signed))) - 1) as f32
    }
}

impl Curve {
    /// Check keys and freeze them. `values` holds `width` numbers a key (three times that for
    /// [`Interpolation::Hermite`]: in-slope, value, out-slope). Of keys at one time the last wins.
    ///
    /// ```
    /// use sinew::clip::{Curve, Interpolation};
    /// let c = Curve::new(vec![0.0, 2.0], vec![1.0, 5.0], 1, Interpolation::Linear).unwrap();
    /// let mut v = [0.0];
    /// c.sample(0.5, &mut v);
    /// assert_eq!(v, [2.0]);
    /// ```
    ///
    /// # Errors
    /// [`CurveError`]: no keys, counts that do not fit, unsorted times, numbers that are not finite.
    pub fn new(
        times: Vec<f64>,
        values: Vec<f32>,
        width: usize,
        interpolation: Interpolation,
    ) -> Result<Self, CurveError> {
        if times.is_empty() {
            return Err(CurveError::Empty);
        }
        let each = if interpolation == Interpolation::Hermite { 3 * width } else { width };
        let expected = times.len().saturating_mul(each);
        if width == 0 || values.len() != expected {
            return Err(CurveError::Count { times: times.len(), width, expected, found: values.len() });
        }
        if let Some(key) = times.iter().position(|t| !t.is_finite()) {
            return Err(CurveError::NotFinite { key, what: "time" });
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(CurveError::NotFinite { key: at / each, what: "value" });
        }
        if let Some(k) = (1..times.len()).find(|&k| times[k] < times[k - 1]) {
            return Err(CurveError::Unsorted { key: k, time: times[k], previous: times[k - 1] });
        }
        Ok(Self { times, values, width, interpolation })
    }

    /// Key times in seconds, ascending; never empty.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The stored numbers, key by key.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The smallest normalised integers that hold every value exactly, if any do.
    pub fn integers(&self) -> Option<Integers> {
        let forms = [(8, false), (8, true), (16, false), (16, true)];
        forms.into_iter().map(|(bits, signed)| Integers { bits, signed }).find(|form| {
            let (unit, least) = (form.unit(), if form.signed { -1.0 } else { 0.0 });
            let exact = |v: &f32| (least..=1.0).contains(v) && (v * unit).round() / unit == *v;
            self.values.iter().all(exact)
        })
    }

    /// Numbers a key.
    pub fn width(&self) -> usize {
        self.width
    }

    /// How values run between keys.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// First and last key time.
    pub fn range(&self) -> Option<Range> {
        Some(Range { start: *self.times.first()?, end: *self.times.last()? })
    }

    /// The value at key `k`.
    pub fn value(&self, k: usize) -> &[f32] {
        let w = self.width;
        match self.interpolation {
            Interpolation::Hermite => &self.values[3 * w * k + w..3 * w * k + 2 * w],
            _ => &self.values[w * k..w * k + w],
        }
    }

    /// The curve at `t`, component by component, into `out` (`width` numbers). Outside the keys its ends hold.
    pub fn sample(&self, t: f64, out: &mut [f32]) {
        match self.locate(t) {
            Place::Key(k) => out.copy_from_slice(self.value(k)),
            Place::Between(k, u) => self.between(k, u, out),
        }
    }

    /// The curve at `t` as a unit quaternion (width 4): on the arc where it is linear, else by component and normalised
    /// (glTF 2.0, appendix C).
    ///
    /// Keys that are not quite of unit length (written with three digits, or as 16-bit integers) are interpolated as they
    /// are and normalised last, as players do; normalising them first would move a frame by up to 5e-5.
    pub fn sample_rotation(&self, t: f64) -> Quat {
        match (self.locate(t), self.interpolation) {
            (Place::Key(k), _) => rotation::unit(quat(self.value(k))),
            (Place::Between(k, u), Interpolation::Linear) => arc(self.value(k), self.value(k + 1), u),
            (Place::Between(k, u), _) => {
                let mut v = [0.0; 4];
                self.between(k, u, &mut v);
                rotation::unit(quat(&v))
            }
        }
    }

    /// The same curve with stored slopes where a rule gave them: [`Interpolation::CatmullRom`] becomes [`Interpolation::Hermite`].
    pub fn with_slopes(&self) -> Self {
        let Interpolation::CatmullRom(rule) = self.interpolation else { return self.clone() };
        let mut values = Vec::with_capacity(3 * self.values.len());
        for k in 0..self.times.len() {
            let slopes: Vec<f32> = (0..self.width).map(|c| self.slope(rule, k, c) as f32).collect();
            values.extend(&slopes);
            values.extend(self.value(k));
            values.extend(&slopes);
        }
        Self { times: self.times.clone(), values, width: self.width, interpolation: Interpolation::Hermite }
    }

    /// Change a second of each component of an [`Interpolation::Hermite`] curve at `t`; zero outside its keys.
    pub(crate) fn slope_at(&self, t: f64) -> Vec<f32> {
        let w = self.width;
        match self.locate(t) {
            Place::Between(k, u) => (0..w)
                .map(|c| {
                    let h = self.times[k + 1] - self.times[k];
                    let (p, q) = (self.value(k)[c] as f64, self.value(k + 1)[c] as f64);
                    let out_slope = self.values[3 * w * k + 2 * w + c] as f64;
                    let in_slope = self.values[3 * w * (k + 1) + c] as f64;
                    hermite_slope(p, out_slope, q, in_slope, h, u) as f32
                })
                .collect(),
            // Within the keys the slope on the way out is the one that a cut is followed by.
            Place::Key(k) if t <= self.times[k] && k + 1 < self.times.len() => {
                self.values[3 * w * k + 2 * w..3 * w * (k + 1)].to_vec()
            }
            Place::Key(k) if t == self.times[k] => self.values[3 * w * k..3 * w * k + w].to_vec(),
            Place::Key(_) => vec![0.0; w],
        }
    }

    /// The second derivative of component `c` by time at `t`, within the piece that begins at or before it: zero for straight pieces and
    /// outside the keys.
    pub(crate) fn bend_at(&self, t: f64, c: usize) -> f64 {
        if matches!(self.interpolation, Interpolation::Hold | Interpolation::Linear) {
            return 0.0;
        }
        let k = self.after(t);
        if k == 0 || k == self.times.len() {
            return 0.0;
        }
        let [a, b] = [k - 1, k];
        let (h, w) = (self.times[b] - self.times[a], self.width);
        let [m0, m1] = match self.interpolation {
            Interpolation::CatmullRom(rule) => [self.slope(rule, a, c), self.slope(rule, b, c)],
            _ => [self.values[3 * w * a + 2 * w + c] as f64, self.values[3 * w * b + c] as f64],
        };
        let rise = self.value(b)[c] as f64 - self.value(a)[c] as f64;
        let u = (t - self.times[a]) / h;
        ((6.0 - 12.0 * u) * rise / h + (6.0 * u - 4.0) * m0 + (6.0 * u - 2.0) * m1) / h
    }

    /// The first key after `t`, or the number of keys.
    fn after(&self, t: f64) -> usize {
        let keys = &self.times[..];
        let [first, last] = [keys[0], keys[keys.len() - 1]];
        // Most keys are equally far apart.
        let guess = ((t - first) / (last - first) * (keys.len() - 1) as f64) as usize;
        let guess = guess.saturating_add(1);
        let hit = guess < keys.len() && keys[guess - 1] <= t && t < keys[guess];
        if hit { guess } else { keys.partition_point(|&k| k <= t) }
    }

    fn locate(&self, t: f64) -> Place {
        // The last key at or before t: of keys at one time the last wins.
        let after = self.after(t);
        if after == 0 {
            return Place::Key(self.times.partition_point(|&k| k <= self.times[0]) - 1);
        }
        let k = after - 1;
        if after == self.times.len() || self.times[k] == t || self.interpolation == Interpolation::Hold {
            return Place::Key(k);
        }
        Place::Between(k, (t - self.times[k]) / (self.times[k + 1] - self.times[k]))
    }

    fn between(&self, k: usize, u: f64, out: &mut [f32]) {
        let w = self.width;
        let h = self.times[k + 1] - self.times[k];
        let (a, b) = (self.value(k), self.value(k + 1));
        for c in 0..w {
            let (p0, p1) = (a[c] as f64, b[c] as f64);
            out[c] = match self.interpolation {
                Interpolation::Hold => a[c],
                Interpolation::Linear => (p0 + (p1 - p0) * u) as f32,
                Interpolation::Hermite => {
                    let out_slope = self.values[3 * w * k + 2 * w + c] as f64;
                    let in_slope = self.values[3 * w * (k + 1) + c] as f64;
                    hermite(p0, out_slope, p1, in_slope, h, u) as f32
                }
                Interpolation::CatmullRom(rule) => {
                    let (m0, m1) = (self.slope(rule, k, c), self.slope(rule, k + 1, c));
                    hermite(p0, m0, p1, m1, h, u) as f32
                }
            };
        }
    }

    /// Slope of component `c` at key `k`; a neighbour at the same time counts as missing.
    fn slope(&self, rule: Tangents, k: usize, c: usize) -> f64 {
        let at = |i: usize| (self.times[i], self.value(i)[c] as f64);
        let distinct = |i: usize| self.times.get(i).is_some_and(|&t| t != self.times[k]);
        let prev = k.checked_sub(1).filter(|&i| distinct(i)).map(at);
        let next = Some(k + 1).filter(|&i| distinct(i)).map(at);
        tangent(rule, prev, at(k), next)
    }
}

/// Shoemake's slerp of two keys as they stand, in f64, on the short arc; the result is normalised.
fn arc(a: &[f32], b: &[f32], u: f64) -> Quat {
    let (a, b) = (quat(a).as_dquat(), quat(b).as_dquat());
    let dot = a.dot(b);
    let (dot, b) = if dot < 0.0 { (-dot, -b) } else { (dot, b) };

    // Nearer than 1e-5 rad the chord and the arc agree to 1e-11.
    if dot > 1.0 - 5e-11 {
        return rotation::unit((a * (1.0 - u) + b * u).as_quat());
    }
    let theta = dot.acos();
    rotation::unit((a * ((1.0 - u) * theta).sin() + b * (u * theta).sin()).as_quat())
}

enum Place {
    Key(usize),
    Between(usize, f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(c: &Curve, t: f64) -> f32 {
        let mut v = [0.0];
        c.sample(t, &mut v);
        v[0]
    }

    #[test]
    fn keys_at_one_time_hold_and_the_last_wins() {
        for i in [
            Interpolation::Hold,
            Interpolation::Linear,
            Interpolation::CatmullRom(Tangents::Notes),
            Interpolation::CatmullRom(Tangents::Monotone),
        ] {
            let c = Curve::new(vec![0.0, 1.0, 1.0, 2.0], vec![0.0, 1.0, 5.0, 6.0], 1, i).unwrap();
            assert_eq!(at(&c, 1.0), 5.0);
            assert!(at(&c, 0.999_999) <= 1.01 && at(&c, 1.000_001).is_finite());
            let c = Curve::new(vec![1.0, 1.0], vec![3.0, 4.0], 1, i).unwrap();
            assert_eq!((at(&c, 0.0), at(&c, 1.0), at(&c, 9.0)), (4.0, 4.0, 4.0));
        }
    }

    #[test]
    fn bad_keys_are_named() {
        let new =
            |t: Vec<f64>, v: Vec<f32>| Curve::new(t, v, 1, Interpolation::Linear).unwrap_err().to_string();
        assert_eq!(new(vec![], vec![]), "there are no keys");
        assert_eq!(new(vec![0.0, 1.0], vec![1.0]), "2 key times need 2 numbers of width 1, found 1");
        assert_eq!(new(vec![0.0, f64::NAN], vec![1.0, 2.0]), "key 1: its time is not finite");
        assert_eq!(new(vec![0.0, 1.0], vec![1.0, f32::INFINITY]), "key 1: its value is not finite");
        assert!(new(vec![1.0, 0.5], vec![1.0, 2.0]).contains("key 1: its time 0.5 s is before"));
    }

    #[test]
    fn reconstruction_errors_follow_their_laws() {
        // Max error over amplitude for sin(ωt), key spacing h: linear (ωh)²/8, Catmull-Rom 0.0160(ωh)³, fitted Hermite (ωh)⁴/384.
        let (h, n) = (0.1, 200);
        let t: Vec<f64> = (0..n).map(|k| k as f64 * h).collect();
        let v: Vec<f32> = t.iter().map(|t| t.sin() as f32).collect();
        let triple: Vec<f32> =
            t.iter().flat_map(|t| [t.cos() as f32, t.sin() as f32, t.cos() as f32]).collect();
        let worst = |c: Curve| {
            (100..1800)
                .map(|k| k as f64 * 0.01)
                .map(|t| (at(&c, t) as f64 - t.sin()).abs())
                .fold(0.0, f64::max)
        };
        let lin = worst(Curve::new(t.clone(), v.clone(), 1, Interpolation::Linear).unwrap());
        let cat = worst(Curve::new(t.clone(), v, 1, Interpolation::CatmullRom(Tangents::Notes)).unwrap());
        let her = worst(Curve::new(t, triple, 1, Interpolation::Hermite).unwrap());
        assert!((lin / (h * h / 8.0) - 1.0).abs() < 0.05, "{lin}");
        assert!((cat / (0.0160 * h * h * h) - 1.0).abs() < 0.1, "{cat}");
        assert!(her < 1.1 * h.powi(4) / 384.0 + 1.5e-7, "{her}");
    }
}
