//! A curve taken apart, edited, and put together again.

use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::time::Range;

/// Every track edited alike.
pub(super) fn each(clip: &Clip, edit: impl Fn(Keys) -> Keys) -> Clip {
    let track = |t: &Track| Track { target: t.target.clone(), curve: edit(Keys::of(t)).curve() };
    Clip { name: clip.name.clone(), tracks: clip.tracks.iter().map(track).collect() }
}

/// A curve taken apart. Cubics have their slopes stored.
pub(super) struct Keys {
    pub times: Vec<f64>,
    pub values: Vec<f32>,
    pub width: usize,
    pub interpolation: Interpolation,
    /// Quaternions: what is linear goes along arcs.
    pub turns: bool,
}

impl Keys {
    pub fn of(track: &Track) -> Self {
        let c = track.curve.with_slopes();
        let (times, values) = (c.times().to_vec(), c.values().to_vec());
        let turns = matches!(track.target, Target::Rotation(_));
        Self { times, values, width: c.width(), interpolation: c.interpolation(), turns }
    }

    /// The value at key `k`, without slopes.
    pub fn value(&self, k: usize) -> &[f32] {
        let (each, w) = (self.each(), self.width);
        let from = k * each + if each > w { w } else { 0 };
        &self.values[from..from + w]
    }

    pub fn curve(self) -> Curve {
        Curve::new(self.times, self.values, self.width, self.interpolation)
            .expect("keys of a curve, in order")
    }

    /// Numbers a key.
    pub fn each(&self) -> usize {
        self.values.len() / self.times.len()
    }

    /// What a key at `t` holds if it is to change nothing.
    pub fn at(&self, t: f64) -> Vec<f32> {
        let curve = Curve::new(self.times.clone(), self.values.clone(), self.width, self.interpolation);
        let curve = curve.expect("keys of a curve, in order");
        let mut v = vec![0.0; self.width];
        if self.turns && self.interpolation == Interpolation::Linear {
            return curve.sample_rotation(t).to_array().to_vec();
        }
        curve.sample(t, &mut v);
        if self.interpolation != Interpolation::Hermite {
            return v;
        }
        let slope = curve.slope_at(t);
        [slope.clone(), v, slope].concat()
    }

    pub fn cut(self, range: Range) -> Self {
        let (each, n) = (self.each(), self.times.len());
        // Beyond its keys a curve holds its ends by itself.
        let from = range.start.clamp(self.times[0], self.times[n - 1]);
        let to = range.end.clamp(from, self.times[n - 1]);
        let (mut times, mut values) = (vec![from.clamp(range.start, range.end)], self.at(from));
        for k in 0..n {
            if from < self.times[k] && self.times[k] < to {
                times.push(self.times[k]);
                values.extend(&self.values[k * each..(k + 1) * each]);
            }
        }
        if to > from {
            times.push(to);
            values.extend(self.at(to));
        }
        Self { times, values, ..self }
    }

    pub fn reversed(self, range: Range) -> Self {
        let (each, w, n) = (self.each(), self.width, self.times.len());
        let back = |t: f64| range.start + (range.end - t);
        let key = |k: usize| &self.values[k * each..(k + 1) * each];
        let (mut times, mut values) = (vec![], vec![]);
        if self.interpolation == Interpolation::Hold {
            // A value that held from its key on now holds up to it.
            times.push(range.start);
            values.extend(key(n - 1));
            for k in (0..n - 1).rev() {
                times.push(back(self.times[k + 1]));
                values.extend(key(k));
            }
            return Self { times, values, ..self };
        }
        for k in (0..n).rev() {
            times.push(back(self.times[k]));
            if self.interpolation == Interpolation::Hermite {
                let v = key(k);
                values.extend(v[2 * w..].iter().map(|s| -s));
                values.extend(&v[w..2 * w]);
                values.extend(v[..w].iter().map(|s| -s));
            } else {
                values.extend(key(k));
            }
        }
        Self { times, values, ..self }
    }

    /// These keys, held until those begin, then those.
    pub fn followed_by(self, other: Self) -> Self {
        let (mut a, mut b) = match self.interpolation == other.interpolation {
            true => (self, other),
            false => (self.stepped(), other.stepped()),
        };
        if a.interpolation != b.interpolation {
            (a, b) = (a.cubic(), b.cubic());
        }
        a = a.held_until(b.times[0]);
        a.times.append(&mut b.times);
        a.values.append(&mut b.values);
        a
    }

    /// With a key that says that the last value holds until `t`.
    pub fn held_until(mut self, t: f64) -> Self {
        let (each, w, n) = (self.each(), self.width, self.values.len());
        if t <= self.times[self.times.len() - 1] {
            return self;
        }
        let mut last = self.values[n - each..].to_vec();
        if self.interpolation == Interpolation::Hermite {
            self.values[n - w..].fill(0.0);
            (0..w).for_each(|c| (last[c], last[2 * w + c]) = (0.0, 0.0));
        }
        self.times.push(t);
        self.values.extend(last);
        self
    }

    /// Steps as straight pieces: two keys at each time of a step.
    fn stepped(self) -> Self {
        if self.interpolation != Interpolation::Hold {
            return self;
        }
        let w = self.width;
        let (mut times, mut values) = (vec![], vec![]);
        for (k, &t) in self.times.iter().enumerate() {
            if k > 0 {
                times.push(t);
                values.extend(&self.values[(k - 1) * w..k * w]);
            }
            times.push(t);
            values.extend(&self.values[k * w..(k + 1) * w]);
        }
        Self { times, values, interpolation: Interpolation::Linear, ..self }
    }

    /// Straight pieces as cubics with stored slopes; between rotations the arc becomes a chord.
    pub fn cubic(self) -> Self {
        if self.interpolation == Interpolation::Hermite {
            return self;
        }
        let (n, w) = (self.times.len(), self.width);
        let slope = |k: usize, c: usize| {
            let h = self.times[k + 1] - self.times[k];
            let moved = self.values[(k + 1) * w + c] - self.values[k * w + c];
            if h > 0.0 { (moved as f64 / h) as f32 } else { 0.0 }
        };
        let mut values = vec![];
        for k in 0..n {
            values.extend((0..w).map(|c| if k > 0 { slope(k - 1, c) } else { 0.0 }));
            values.extend(&self.values[k * w..(k + 1) * w]);
            values.extend((0..w).map(|c| if k + 1 < n { slope(k, c) } else { 0.0 }));
        }
        Self { values, interpolation: Interpolation::Hermite, ..self }
    }
}
