//! Clips cut, turned round, sped up and joined. Every curve goes on exactly as it went: nothing is sampled again.

use crate::clip::{Clip, Curve, Interpolation, Track};
use crate::time::Range;

/// The part of a clip within `range`, moved to begin at 0. Keys are added where a curve is cut.
///
/// ```
/// use sinew::bake::edit;
/// use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
/// use sinew::skeleton::BoneId;
/// use sinew::time::Range;
/// let curve = Curve::new(vec![0.0, 2.0], vec![0.0, 0.0, 0.0, 4.0, 0.0, 0.0], 3, Interpolation::Linear).unwrap();
/// let clip = Clip { name: "slide".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] };
/// let part = edit::trim(&clip, Range { start: 0.5, end: 1.0 });
/// assert_eq!(part.tracks[0].curve.times(), [0.0, 0.5]);
/// assert_eq!(part.tracks[0].curve.values(), [1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
/// ```
pub fn trim(clip: &Clip, range: Range) -> Clip {
    each(clip, |keys| {
        let mut keys = keys.cut(range);
        keys.times.iter_mut().for_each(|t| *t -= range.start);
        keys
    })
}

/// Backwards: what was at the end of the clip is at its start.
pub fn reverse(clip: &Clip) -> Clip {
    let range = clip.playback();
    each(clip, |keys| keys.reversed(range).held_until(range.end))
}

/// Faster by `factor`: 2 lasts half as long.
///
/// # Panics
/// If the factor is not above 0.
pub fn speed(clip: &Clip, factor: f64) -> Clip {
    assert!(factor > 0.0 && factor.is_finite(), "a speed of {factor}; expected more than 0");
    each(clip, |mut keys| {
        keys.times.iter_mut().for_each(|t| *t /= factor);
        if keys.interpolation == Interpolation::Hermite {
            let w = keys.width;
            for (i, v) in keys.values.iter_mut().enumerate() {
                *v *= if i % (3 * w) / w == 1 { 1.0 } else { factor as f32 };
            }
        }
        keys
    })
}

/// One clip after the other. A channel that only some of them move keeps its last value through the others; before its first it has
/// its first.
pub fn concat(name: &str, clips: &[&Clip]) -> Clip {
    let mut out = Clip { name: name.into(), tracks: vec![] };
    let mut start = 0.0;
    for clip in clips {
        let range = clip.playback();
        for track in &clip.tracks {
            let mut keys = Keys::of(&track.curve);
            keys.times.iter_mut().for_each(|t| *t += start - range.start);
            match out.tracks.iter_mut().find(|t| t.target == track.target) {
                Some(before) => before.curve = Keys::of(&before.curve).followed_by(keys).curve(),
                None => out.tracks.push(Track { target: track.target.clone(), curve: keys.curve() }),
            }
        }
        start += range.duration();
    }
    out
}

fn each(clip: &Clip, edit: impl Fn(Keys) -> Keys) -> Clip {
    let track = |t: &Track| Track { target: t.target.clone(), curve: edit(Keys::of(&t.curve)).curve() };
    Clip { name: clip.name.clone(), tracks: clip.tracks.iter().map(track).collect() }
}

/// A curve taken apart. Cubics have their slopes stored.
struct Keys {
    times: Vec<f64>,
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

impl Keys {
    fn of(curve: &Curve) -> Self {
        let c = curve.with_slopes();
        let (times, values) = (c.times().to_vec(), c.values().to_vec());
        Self { times, values, width: c.width(), interpolation: c.interpolation() }
    }

    fn curve(self) -> Curve {
        Curve::new(self.times, self.values, self.width, self.interpolation)
            .expect("keys of a curve, in order")
    }

    /// Numbers a key.
    fn each(&self) -> usize {
        self.values.len() / self.times.len()
    }

    /// What a key at `t` holds if it is to change nothing.
    fn at(&self, t: f64) -> Vec<f32> {
        let curve = Curve::new(self.times.clone(), self.values.clone(), self.width, self.interpolation);
        let curve = curve.expect("keys of a curve, in order");
        let mut v = vec![0.0; self.width];
        if self.width == 4 && self.interpolation == Interpolation::Linear {
            return curve.sample_rotation(t).to_array().to_vec();
        }
        curve.sample(t, &mut v);
        if self.interpolation != Interpolation::Hermite {
            return v;
        }
        let slope = curve.slope_at(t);
        [slope.clone(), v, slope].concat()
    }

    fn cut(self, range: Range) -> Self {
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

    fn reversed(self, range: Range) -> Self {
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
    fn followed_by(self, other: Self) -> Self {
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
    fn held_until(mut self, t: f64) -> Self {
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
    fn cubic(self) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::Target;
    use crate::math::spline::Tangents;
    use crate::skeleton::BoneId;

    /// A curve of every kind over 0.25…2 s, of one bone each.
    fn clip() -> Clip {
        let kinds = [
            Interpolation::Hold,
            Interpolation::Linear,
            Interpolation::CatmullRom(Tangents::Notes),
            Interpolation::Hermite,
        ];
        let track = |(b, kind): (usize, Interpolation)| {
            let each = if kind == Interpolation::Hermite { 9 } else { 3 };
            let values = (0..4 * each).map(|i| ((i * i) as f32 * 0.7).sin()).collect();
            let curve = Curve::new(vec![0.25, 0.75, 1.0, 2.0], values, 3, kind).unwrap();
            Track { target: Target::Translation(BoneId(b as u32)), curve }
        };
        Clip { name: "all".into(), tracks: kinds.into_iter().enumerate().map(track).collect() }
    }

    /// The largest difference between two clips at times that they show the same at; `of` carries those of `b` to those of `a`.
    fn apart(a: &Clip, b: &Clip, times: impl Iterator<Item = f64>, of: impl Fn(f64) -> f64) -> f32 {
        let at = |t: &Track, time| {
            let mut v = [0.0; 3];
            t.curve.sample(time, &mut v);
            v
        };
        let mut worst = 0.0_f32;
        for t in times {
            for (x, y) in a.tracks.iter().zip(&b.tracks) {
                let (p, q) = (at(x, of(t)), at(y, t));
                worst = (0..3).map(|c| (p[c] - q[c]).abs()).fold(worst, f32::max);
            }
        }
        worst
    }

    /// Moments in the middle of nothing: never a key's own time, where steps have two sides.
    fn moments(end: f64) -> impl Iterator<Item = f64> {
        (0..500).map(move |k| (k as f64 + 0.377) / 500.0 * end)
    }

    #[test]
    fn curves_go_on_as_they_went() {
        let clip = clip();
        let part = trim(&clip, Range { start: 0.5, end: 1.75 });
        assert!(apart(&clip, &part, moments(1.25), |t| t + 0.5) < 2e-6);
        assert_eq!(part.range(), Range { start: 0.0, end: 1.25 });
        assert!(apart(&clip, &reverse(&clip), moments(2.0), |t| 2.0 - t) < 2e-6);
        assert!(apart(&clip, &speed(&clip, 4.0), moments(0.5), |t| 4.0 * t) < 2e-6);
        let beyond = trim(&clip, Range { start: 1.5, end: 3.0 });
        assert!(apart(&clip, &beyond, moments(1.5), |t| t + 1.5) < 2e-6);
    }

    #[test]
    fn joined_clips_show_one_after_the_other() {
        let (a, mut b) = (clip(), clip());
        b.tracks.rotate_left(1);
        for (i, t) in b.tracks.iter_mut().enumerate() {
            t.target = Target::Translation(BoneId(i as u32));
        }
        let both = concat("both", &[&a, &b]);
        assert!(apart(&a, &both, moments(2.0), |t| t) < 2e-6);
        // The second begins where its first keys are.
        assert!(apart(&b, &both, moments(1.75).map(|t| t + 2.25), |t| t - 2.0) < 2e-6);
    }
}
