//! One track as cubics: the fewest keys with slopes of their own, or with slopes by a rule.

use super::fit::{Kind, Near, Samples, Straight};
use crate::clip::{Curve, Interpolation};
use crate::math::spline::{Tangents, hermite, tangent};
use glam::Quat;
use std::ops::Range;

/// The rule of fitted Catmull-Rom curves.
const RULE: Tangents = Tangents::Notes;

/// Gaps between samples that do not hold a cubic's four numbers down everywhere.
const FEW: usize = 8;

/// How strongly slopes that no sample decides are drawn to the chord's.
const CHORD: f64 = 1e-6;

/// Two keys and the slopes between them, component by component.
struct Piece<'s> {
    h: f64,
    ends: [&'s [f32]; 2],
    slopes: [Vec<f64>; 2],
}

impl<'s> Piece<'s> {
    fn at(&self, u: f64, c: usize) -> f64 {
        let [a, b] = self.ends.map(|v| v[c] as f64);
        hermite(a, self.slopes[0][c], b, self.slopes[1][c], self.h, u)
    }

    /// How far it is from a sample.
    fn off(&self, s: &Samples, i: usize, from: f64) -> f64 {
        let u = (s.times[i] - from) / self.h;
        let (at, value) = (|c: usize| self.at(u, c) as f32, s.value(i));
        match s.kind {
            Kind::Rotation => {
                let q = crate::math::rotation::unit(Quat::from_array(std::array::from_fn(at)));
                s.distance(&q.to_array(), value)
            }
            Kind::Weights => (0..s.width).map(|c| (at(c) - value[c]).abs() as f64).fold(0.0, f64::max),
            Kind::Vector | Kind::Angles => s.distance(&std::array::from_fn::<_, 3, _>(at), value),
        }
    }

    /// The slopes with the least squares of errors at the samples between two.
    fn settled(s: &'s Samples, [a, b]: [usize; 2]) -> Self {
        let h = s.times[b] - s.times[a];
        let ends = [a, b].map(|i| s.value(i));
        let chord = |c: usize| (ends[1][c] as f64 - ends[0][c] as f64) / h;
        let mut m = [CHORD, 0.0, CHORD];
        let mut right = vec![[0.0; 2]; s.width];
        for i in a + 1..b {
            let u = (s.times[i] - s.times[a]) / h;
            // What a unit of each slope, times h, adds here.
            let [p, q] = [u * (1.0 - u) * (1.0 - u), u * u * (u - 1.0)];
            m = [m[0] + p * p, m[1] + p * q, m[2] + q * q];
            for (c, (right, v)) in right.iter_mut().zip(s.value(i)).enumerate() {
                let r = *v as f64 - (ends[0][c] as f64 + chord(c) * h * u);
                *right = [right[0] + p * r, right[1] + q * r];
            }
        }
        let d = m[0] * m[2] - m[1] * m[1];
        let slope = |c: usize, k: usize| {
            let [x, y] = right[c];
            let more = if k == 0 { m[2] * x - m[1] * y } else { m[0] * y - m[1] * x };
            // As a file holds it.
            (chord(c) + more / (d * h)) as f32 as f64
        };
        let slopes = [0, 1].map(|k| (0..s.width).map(|c| slope(c, k)).collect());
        Self { h, ends, slopes }
    }

    fn holds(&self, s: &Samples, inner: Range<usize>, from: f64, near: &Near) -> bool {
        let mut inner = inner;
        if s.kind == Kind::Rotation {
            let turn = |i: usize| std::array::from_fn(|c| self.at((s.times[i] - from) / self.h, c));
            return inner.all(|i| near.holds_turn(turn(i), s.value(i)));
        }
        inner.all(|i| self.off(s, i, from) <= near.tolerance)
    }
}

impl Piece<'_> {
    /// Whether it leaves the straight way between two neighbouring samples, where few samples hold it.
    fn swings(&self, s: &Samples, [a, b]: [usize; 2], tolerance: f64) -> bool {
        let span = |i: usize| {
            let straight = Straight::new(s.kind, s.value(i), s.value(i + 1));
            [0.25, 0.5, 0.75].into_iter().any(|part| {
                let u = (s.times[i] + part * (s.times[i + 1] - s.times[i]) - s.times[a]) / self.h;
                let value: Vec<f32> = (0..s.width).map(|c| self.at(u, c) as f32).collect();
                straight.off(part, &value) > tolerance
            })
        };
        b - a < FEW && (a..b).any(span)
    }
}

/// Parts of a track between its jumps: first and last sample.
fn runs(s: &Samples) -> Vec<[usize; 2]> {
    let ends: Vec<usize> = (0..s.len()).filter(|&i| s.jumps(i)).chain([s.len() - 1]).collect();
    let starts = std::iter::once(0).chain(ends.iter().map(|e| e + 1));
    starts.zip(&ends).map(|(a, b)| [a, *b]).collect()
}

/// Few cubic pieces that stay within `tolerance` of every sample, with slopes of their own on both sides of a key.
pub(super) fn own_slopes(s: &Samples, tolerance: f64) -> Curve {
    let (mut times, mut values) = (vec![], vec![]);
    for [first, last] in runs(s) {
        let mut into = vec![0.0; s.width];
        let mut from = first;
        while from < last {
            let (to, piece) = reach(s, from, last, tolerance);
            push(s, from, &into, &piece.slopes[0], &mut times, &mut values);
            into = piece.slopes[1].clone();
            from = to;
        }
        push(s, last, &into, &vec![0.0; s.width], &mut times, &mut values);
    }
    Curve::new(times, values, s.width, Interpolation::Hermite).expect("samples of a curve, in order")
}

fn push(s: &Samples, i: usize, into: &[f64], out: &[f64], times: &mut Vec<f64>, values: &mut Vec<f32>) {
    times.push(s.times[i]);
    values.extend(into.iter().map(|v| *v as f32));
    values.extend(s.value(i));
    values.extend(out.iter().map(|v| *v as f32));
}

/// The last sample that a piece from `from` may end at: doubling steps, then bisection.
fn reach(s: &Samples, from: usize, last: usize, tolerance: f64) -> (usize, Piece<'_>) {
    let near = Near::new(tolerance);
    let fits = |to: usize| {
        let piece = Piece::settled(s, [from, to]);
        let holds = piece.holds(s, from + 1..to, s.times[from], &near);
        (holds && !piece.swings(s, [from, to], tolerance)).then_some(piece)
    };
    let mut good = (from + 1, Piece::settled(s, [from, from + 1]));
    let (mut step, mut bad) = (1, last + 1);
    while good.0 + step <= last {
        let to = good.0 + step;
        let Some(piece) = fits(to) else {
            bad = to;
            break;
        };
        good = (to, piece);
        step *= 2;
    }
    while bad - good.0 > 1 {
        let middle = good.0 + (bad - good.0) / 2;
        match fits(middle) {
            Some(piece) => good = (middle, piece),
            None => bad = middle,
        }
    }
    good
}

/// Few keys whose Catmull-Rom curve stays within `tolerance` of every sample: keys are put where the error is largest, and then those left out that
/// are not needed. None where a slope beside a much shorter gap would swing out between two samples.
pub(super) fn by_rule(s: &Samples, tolerance: f64) -> Option<Curve> {
    let mut keys = vec![];
    for [first, last] in runs(s) {
        let run = ruled(s, first, last, tolerance);
        let swings = |k: usize| piece_by_rule(s, &run, k).swings(s, [run[k], run[k + 1]], tolerance);
        if (0..run.len() - 1).any(swings) {
            return None;
        }
        keys.extend(run);
    }
    let times = keys.iter().map(|&k| s.times[k]).collect();
    let values = keys.iter().flat_map(|&k| s.value(k).iter().copied()).collect();
    let curve = Curve::new(times, values, s.width, Interpolation::CatmullRom(RULE));
    Some(curve.expect("samples of a curve, in order"))
}

fn ruled(s: &Samples, first: usize, last: usize, tolerance: f64) -> Vec<usize> {
    let mut keys = vec![first, last];
    keys.dedup();
    loop {
        let worst = |k: usize| {
            let piece = piece_by_rule(s, &keys, k);
            let off = (keys[k] + 1..keys[k + 1]).map(|i| (piece.off(s, i, s.times[keys[k]]), i));
            let most = off.fold((tolerance, None), |m, (e, i)| if e > m.0 { (e, Some(i)) } else { m });
            most.1
        };
        let more: Vec<usize> = (0..keys.len() - 1).filter_map(worst).collect();
        if more.is_empty() {
            break;
        }
        keys.extend(more);
        keys.sort_unstable();
    }
    let near_enough = Near::new(tolerance);
    let mut k = 1;
    while k + 1 < keys.len() {
        let gone = keys.remove(k);
        // Slopes change one key further than the gap.
        let near = k.saturating_sub(2)..(k + 1).min(keys.len() - 2) + 1;
        let holds = |k: usize| {
            piece_by_rule(s, &keys, k).holds(s, keys[k] + 1..keys[k + 1], s.times[keys[k]], &near_enough)
        };
        if !near.clone().all(holds) {
            keys.insert(k, gone);
            k += 1;
        }
    }
    keys
}

/// The piece from key `k` to the next.
fn piece_by_rule<'s>(s: &'s Samples, keys: &[usize], k: usize) -> Piece<'s> {
    let at = |k: usize, c: usize| (s.times[keys[k]], s.value(keys[k])[c] as f64);
    let slope = |k: usize, c: usize| {
        let previous = k.checked_sub(1).map(|k| at(k, c));
        tangent(RULE, previous, at(k, c), (k + 1 < keys.len()).then(|| at(k + 1, c)))
    };
    Piece {
        h: s.times[keys[k + 1]] - s.times[keys[k]],
        ends: [k, k + 1].map(|k| s.value(keys[k])),
        slopes: [k, k + 1].map(|k| (0..s.width).map(|c| slope(k, c)).collect()),
    }
}
