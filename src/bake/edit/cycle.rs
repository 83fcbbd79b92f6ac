//! Clips that begin where they end.

use super::keys::{Keys, each};
use crate::clip::{Clip, Interpolation};
use crate::math::rotation::{angle_between, slerp};
use crate::time::Range;
use glam::Quat;

/// Turns between keys that are taken for straight, radians: chord and arc are 4e-8 rad apart.
const STRAIGHT: f32 = 0.02;

/// Ends that agree, made equal bit for bit: each track spans the clip, its last value is its first, and where a cubic's two end slopes
/// agree as well, they become one.
///
/// Ends agree that are apart by no more than `slack` times the largest value or slope of their track (radians for rotations).
/// Quaternions of a cubic that come back as their opposites, after an odd number of full turns, end as the opposite of the first.
pub fn close(clip: &Clip, slack: f64) -> Clip {
    let range = clip.range();
    each(clip, |keys| if keys.times.len() < 2 { keys } else { closed(keys.spanning(range), slack) })
}

fn closed(mut keys: Keys, slack: f64) -> Keys {
    let (each, w, n) = (keys.each(), keys.width, keys.times.len());
    let first = keys.value(0).to_vec();
    let last = keys.value(n - 1).to_vec();
    let flipped = keys.turns && first.iter().zip(&last).map(|(a, b)| a * b).sum::<f32>() < 0.0;
    let apart = match keys.turns {
        true => angle_between(Quat::from_slice(&first), Quat::from_slice(&last)) as f64,
        false => {
            largest(first.iter().zip(&last).map(|(a, b)| a - b))
                / largest((0..n).flat_map(|k| keys.value(k).iter().copied())).max(1e-9)
        }
    };
    let cubic = each > w;
    if apart > slack || (keys.turns && !cubic && turns_back(keys.value(n - 2), &first, &last)) {
        return keys;
    }
    let sign = if flipped && cubic { -1.0 } else { 1.0 };
    let at = (n - 1) * each + if cubic { w } else { 0 };
    (0..w).for_each(|c| keys.values[at + c] = sign * first[c]);
    if cubic {
        let steepest =
            largest((0..n).flat_map(|k| keys.values[k * each + 2 * w..(k + 1) * each].iter().copied()));
        let slope = |c: usize| sign * keys.values[2 * w + c];
        let bend = largest((0..w).map(|c| slope(c) - keys.values[at - w + c]));
        if bend <= slack.max(0.05) * steepest {
            (0..w).for_each(|c| keys.values[at - w + c] = sign * keys.values[2 * w + c]);
        }
    }
    keys
}

/// Whether an arc of half a turn would go the other way round if it ended in `first` instead of in `last`, which is all but the same.
fn turns_back(from: &[f32], first: &[f32], last: &[f32]) -> bool {
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    let side = dot(from, last) * dot(last, first);
    side * dot(from, first) < 0.0
}

fn largest(values: impl Iterator<Item = f32>) -> f64 {
    values.fold(0.0, |m, v| m.max(v.abs() as f64))
}

/// A loop out of any clip: its last `seconds` bend into its start, and everything before them stays.
///
/// With `T` the end, `d` the seconds and `u = (t − (T − d)) / d` in 0…1, each component becomes
/// `f(t) + (3u² − 2u³)·(f(0) − f(T)) + (u³ − u²)·d·(f′(0) − f′(T))`:
/// at `T − d` value and slope are those of `f`, at `T` those of its start. Quaternions go by component on the nearer side and are
/// normalised by the player. Curves become cubics with stored slopes; steps stay, and their last is their first.
///
/// ```
/// use sinew::bake::edit;
/// use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
/// use sinew::skeleton::BoneId;
/// let curve = Curve::new(vec![0.0, 1.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 3, Interpolation::Linear).unwrap();
/// let clip = Clip { name: "slide".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] };
/// let cycle = edit::blend(&clip, 0.5);
/// let curve = &cycle.tracks[0].curve;
/// assert_eq!((curve.times(), curve.value(2)), (&[0.0, 0.5, 1.0][..], curve.value(0)));
/// ```
///
/// # Panics
/// If the seconds are not above 0.
pub fn blend(clip: &Clip, seconds: f64) -> Clip {
    assert!(seconds > 0.0, "a blend of {seconds} s; expected more than 0");
    let range = clip.range();
    let from = (range.end - seconds).max(range.start);
    let bent = each(clip, |keys| {
        if keys.times.len() < 2 || range.duration() <= 0.0 {
            return keys;
        }
        let keys = keys.spanning(range);
        if keys.interpolation == Interpolation::Hold {
            keys
        } else {
            bend(keys.on_chords(STRAIGHT).cubic().keyed(from), from)
        }
    });
    close(&bent, f64::INFINITY)
}

/// Add the cubic that takes the end to the start.
fn bend(mut keys: Keys, from: f64) -> Keys {
    let (each, w, n) = (keys.each(), keys.width, keys.times.len());
    let d = keys.times[n - 1] - from;
    if d <= 0.0 {
        return keys;
    }
    let end = (n - 1) * each;
    let same = (0..w).map(|c| keys.values[w + c] * keys.values[end + w + c]).sum::<f32>() >= 0.0;
    let sign = if keys.turns && !same { -1.0 } else { 1.0 };
    let value: Vec<f64> =
        (0..w).map(|c| (sign * keys.values[w + c] - keys.values[end + w + c]) as f64).collect();
    let slope: Vec<f64> =
        (0..w).map(|c| (sign * keys.values[2 * w + c] - keys.values[end + c]) as f64).collect();
    for k in 0..n {
        let u = (keys.times[k] - from) / d;
        if u <= 0.0 {
            continue;
        }
        for c in 0..w {
            let moved = (3.0 - 2.0 * u) * u * u * value[c] + (u - 1.0) * u * u * d * slope[c];
            let steeper = 6.0 * u * (1.0 - u) * value[c] / d + (3.0 * u - 2.0) * u * slope[c];
            keys.values[k * each + w + c] += moved as f32;
            keys.values[k * each + c] += steeper as f32;
            keys.values[k * each + 2 * w + c] += steeper as f32;
        }
    }
    if keys.turns {
        // Files hold quaternions of unit length; a player's own normalising makes that the same turn.
        for key in keys.values.chunks_mut(each) {
            let length = key[w..2 * w].iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-6);
            key.iter_mut().for_each(|v| *v /= length);
        }
    }
    // What the start arrives by is what the end leaves by.
    for c in 0..w {
        keys.values[end + 2 * w + c] = sign * keys.values[2 * w + c];
        keys.values[c] = keys.values[2 * w + c];
    }
    keys
}

impl Keys {
    /// With keys at both ends of a range that holds its own.
    fn spanning(mut self, range: Range) -> Self {
        if self.times[0] > range.start {
            let (each, w) = (self.each(), self.width);
            let mut first = self.values[..each].to_vec();
            if each > w {
                // The curve was held up to its first key.
                self.values[..w].fill(0.0);
                first[..w].fill(0.0);
                first[2 * w..].fill(0.0);
            }
            self.times.insert(0, range.start);
            self.values.splice(0..0, first);
        }
        self.held_until(range.end)
    }

    /// Arcs cut into pieces short enough for chords, all on one side of the sphere.
    fn on_chords(self, longest: f32) -> Self {
        if !self.turns || self.interpolation != Interpolation::Linear {
            return self;
        }
        let key = |k: usize| Quat::from_slice(self.value(k)).normalize();
        let (mut times, mut values) = (vec![self.times[0]], key(0).to_array().to_vec());
        let mut last = key(0);
        for k in 1..self.times.len() {
            let (a, b) = (key(k - 1), key(k));
            let h = self.times[k] - self.times[k - 1];
            let pieces = if h > 0.0 { (angle_between(a, b) / longest).ceil().max(1.0) as usize } else { 1 };
            for i in 1..=pieces {
                let u = i as f64 / pieces as f64;
                let q = if i == pieces { b } else { slerp(a, b, u as f32) };
                last = if q.dot(last) < 0.0 { -q } else { q };
                times.push(if i == pieces { self.times[k] } else { self.times[k - 1] + h * u });
                values.extend(last.to_array());
            }
        }
        Self { times, values, ..self }
    }

    /// A cubic with a key at `t` within it.
    fn keyed(mut self, t: f64) -> Self {
        let k = self.times.partition_point(|&k| k < t);
        if self.times.get(k).is_some_and(|&k| k > t) {
            let (each, key) = (self.each(), self.at(t));
            self.times.insert(k, t);
            self.values.splice(k * each..k * each, key);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Curve, Target, Track};
    use crate::skeleton::BoneId;

    fn clip() -> Clip {
        let times: Vec<f64> = (0..=30).map(|k| k as f64 / 30.0).collect();
        let turn = |t: &f64| {
            (Quat::from_rotation_z(*t as f32) * Quat::from_rotation_x((*t as f32 * 3.0).sin())).to_array()
        };
        let slide = |t: &f64| [(3.0 * t).sin() as f32, *t as f32, 1.0];
        let tracks = vec![
            Track {
                target: Target::Rotation(BoneId(0)),
                curve: Curve::new(
                    times.clone(),
                    times.iter().flat_map(turn).collect(),
                    4,
                    Interpolation::Linear,
                )
                .unwrap(),
            },
            Track {
                target: Target::Translation(BoneId(0)),
                curve: Curve::new(
                    times[3..25].to_vec(),
                    times[3..25].iter().flat_map(slide).collect(),
                    3,
                    Interpolation::Linear,
                )
                .unwrap(),
            },
        ];
        Clip { name: "c".into(), tracks }
    }

    /// Both channels at a time.
    fn at(clip: &Clip, t: f64) -> (Quat, glam::Vec3) {
        let mut v = [0.0; 3];
        clip.tracks[1].curve.sample(t, &mut v);
        (clip.tracks[0].curve.sample_rotation(t), v.into())
    }

    #[test]
    fn blended_clips_are_loops_in_value_and_slope_and_stay_before() {
        let (clip, cycle) = (clip(), blend(&clip(), 0.25));
        for t in &cycle.tracks {
            let n = t.curve.times().len();
            assert_eq!((t.curve.value(0), t.curve.range()), (t.curve.value(n - 1), Some(clip.range())));
        }
        for k in 0..=750 {
            let (a, b) = (at(&clip, k as f64 * 1e-3), at(&cycle, k as f64 * 1e-3));
            assert!(angle_between(a.0, b.0) < 1e-6 && a.1.distance(b.1) < 1e-6, "{k}");
        }
        // Slopes on both sides of the seam, and of where the blend begins.
        let h = 1e-4;
        for (before, after) in [(1.0 - h, 0.0), (0.75 - h, 0.75)] {
            let step = |t: f64| {
                let (a, b) = (at(&cycle, t), at(&cycle, t + h));
                ((b.0 * a.0.conjugate()).to_scaled_axis() / h as f32, (b.1 - a.1) / h as f32)
            };
            let (a, b) = (step(before), step(after));
            // A source of straight pieces has kinks of its own, by about 0.3 rad/s; the jump back was 30 rad/s.
            assert!(a.0.distance(b.0) < 0.35 && a.1.distance(b.1) < 0.35, "{a:?} {b:?}");
        }
    }

    #[test]
    fn ends_that_agree_are_closed_and_others_are_left() {
        let nearly = |end: f32, way| {
            let values = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, end, 0.0, 0.0];
            let curve = Curve::new(vec![0.0, 0.5, 1.0], values, 3, way).unwrap();
            Clip { name: "c".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] }
        };
        let last = |c: &Clip| c.tracks[0].curve.value(2)[0];
        assert_eq!(last(&close(&nearly(1e-5, Interpolation::Linear), 1e-4)), 0.0);
        assert_eq!(last(&close(&nearly(1e-2, Interpolation::Hold), 1e-4)), 1e-2);
    }
}
