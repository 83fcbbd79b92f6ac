//! One track on its way into bits.

use super::spline::{Degree, fit};
use crate::bake::fit::{self as pieces, Kind, Samples};
use crate::clip::packed::{self, Draft, DraftForm, Grid, base_of, step_of};
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::time::Range;
use glam::{DQuat, DVec3};
use std::collections::BTreeMap;

/// Bits a component of what a rotation is based on; its numbers say the rest.
const BASE_BITS: u32 = 6;

/// Nearer to half a turn away from its base than this cosine of half the angle, a rotation keeps four numbers.
const STEEP: f64 = 0.35;

/// A track, its samples as numbers, and what was made of them.
pub(super) struct Job {
    pub target: Target,
    source: Curve,
    samples: Samples,
    rest: Vec<f32>,
    /// Metres that a unit of its error may move a point by.
    pub lever: f64,
    /// Its share beside the others'.
    pub weight: f64,
    /// The draft and its bits; none if it only shows the rest.
    pub made: Option<(Draft, usize)>,
    /// Where each sample stands between both ends of the clip.
    x: Vec<f64>,
    /// Seconds between both ends of the clip.
    duration: f64,
    /// Rotations are relative to this.
    base: Option<(packed::Base, DQuat)>,
    numbers: Vec<f64>,
    width: usize,
    /// Fits that were made before: their coefficients and how far they are off.
    fits: BTreeMap<(Degree, usize), (Vec<f64>, f64)>,
}

impl Job {
    pub fn new(track: &Track, range: Range, rest: Vec<f32>, lever: f64) -> Self {
        let kind = match track.target {
            Target::Rotation(_) => Kind::Rotation,
            Target::Weights { .. } => Kind::Weights,
            _ => Kind::Vector,
        };
        let samples = spread(Samples::of(&track.curve, kind), &track.curve, range);
        let x =
            samples.times.iter().map(|t| ((t - range.start) / range.duration().max(1e-300)).clamp(0.0, 1.0));
        let mut job = Self {
            target: track.target.clone(),
            source: track.curve.clone(),
            rest,
            lever,
            weight: 1.0,
            made: None,
            x: x.collect(),
            duration: range.duration(),
            base: None,
            numbers: samples.values.iter().map(|v| *v as f64).collect(),
            width: samples.width,
            samples,
            fits: BTreeMap::new(),
        };
        if kind == Kind::Rotation {
            job.rebase();
        }
        job
    }

    /// Three numbers a rotation where none is too far from the middle of all.
    fn rebase(&mut self) {
        let quats: Vec<DQuat> = self.numbers.chunks(4).map(DQuat::from_slice).collect();
        let mean = quats.iter().fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |a, q| a + *q);
        if mean.length() < 1e-3 * quats.len() as f64 {
            return;
        }
        let (code, base) = base_of(mean.normalize(), BASE_BITS);
        let turns: Vec<DQuat> = quats.iter().map(|q| base.conjugate() * *q).collect();
        if turns.iter().all(|q| q.w > STEEP) || turns.iter().all(|q| q.w < -STEEP) {
            self.base = Some((code, base));
            self.width = 3;
            self.numbers = turns.iter().flat_map(|q| (q.xyz() / q.w).to_array()).collect();
        }
    }

    pub fn size(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.1)
    }

    /// Numbers that are stored.
    pub fn numbers(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.0.lanes.iter().map(Vec::len).sum())
    }

    /// Moments that numbers are stored for.
    pub fn keys(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.0.lanes.first().map_or(1, Vec::len))
    }

    /// The form of fewest bits within `allowed`.
    pub fn make(&mut self, allowed: f64) {
        self.made = None;
        if self.samples.is_constant(&self.rest, allowed) {
            return;
        }
        let mut best = self.still(allowed);
        if best.is_none() {
            let held = self.source.interpolation() == Interpolation::Hold;
            let jumps = (0..self.samples.len()).any(|i| self.samples.jumps(i));
            best = if held { self.steps(allowed) } else { self.pieces(allowed) };
            if !held && !jumps {
                for degree in [Degree::Linear, Degree::Cubic] {
                    self.even(degree, allowed, &mut best);
                }
            }
        }
        self.made = best;
    }

    /// One value for ever, if one serves.
    fn still(&self, allowed: f64) -> Option<(Draft, usize)> {
        let middle = self.middle();
        if !self.samples.is_constant(&middle, allowed) {
            return None;
        }
        self.constant(&middle, |v| self.samples.is_constant(v, allowed))
    }

    /// What a track shows that shows the rest.
    pub fn resting(&self) -> Draft {
        let near = |v: &[f32]| self.samples.distance(v, &self.rest) < 1e-6;
        let found = self.constant(&self.rest, near).or_else(|| self.constant(&self.rest, |_| true));
        found.expect("a value").0
    }

    /// A value in few bits, such that what is stored is `good`.
    fn constant(&self, value: &[f32], good: impl Fn(&[f32]) -> bool) -> Option<(Draft, usize)> {
        let draft = |base, step, lanes| Draft {
            target: self.target.clone(),
            form: DraftForm::Still,
            base,
            step,
            lanes,
        };
        if self.samples.kind == Kind::Rotation {
            let q = DQuat::from_array([0, 1, 2, 3].map(|c| value[c] as f64)).normalize();
            let of = |bits: u32| (bits, base_of(q, bits));
            let (bits, (base, _)) = (4..28).map(of).find(|b| good(&b.1.1.as_quat().to_array()))?;
            return Some((draft(Some(base), 0, vec![]), 8 + 3 * bits as usize));
        }
        let stored = |code: u8| value.iter().map(move |v| quantised(*v as f64, step_of(code)));
        let played =
            |code: u8| -> Vec<f32> { stored(code).map(|v| (v as f64 * step_of(code)) as f32).collect() };
        let step = (60..=255).rev().find(|&code| good(&played(code)))?;
        let lanes: Vec<Vec<i32>> = stored(step).map(|v| vec![v]).collect();
        let d = draft(None, step, lanes);
        packed::size(&d).map(|bits| (d, bits))
    }

    /// The middle of all values.
    fn middle(&self) -> Vec<f32> {
        let s = &self.samples;
        if s.kind == Kind::Rotation {
            let mean =
                s.values.chunks(4).fold(glam::DVec4::ZERO, |a, q| a + glam::Vec4::from_slice(q).as_dvec4());
            return mean.normalize_or(glam::DVec4::W).as_vec4().to_array().to_vec();
        }
        let ends = |c: usize| {
            let each = (0..s.len()).map(|i| s.value(i)[c]);
            each.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        (0..s.width).map(ends).map(|(l, h)| 0.5 * (l + h)).collect()
    }

    /// Values that change at once.
    fn steps(&self, allowed: f64) -> Option<(Draft, usize)> {
        let (mut times, mut keys) = (vec![], Vec::<usize>::new());
        for (k, &t) in self.source.times().iter().enumerate() {
            let v = self.source.value(k);
            if times.last() == Some(&t) {
                times.pop();
                keys.pop();
            }
            if keys.last().is_none_or(|&l| self.samples.distance(self.source.value(l), v) > 0.5 * allowed) {
                times.push(t);
                keys.push(k);
            }
        }
        let values: Vec<f64> = keys.iter().flat_map(|&k| self.coordinates(self.source.value(k))).collect();
        let error = |played: &[f64]| {
            let each = keys.iter().zip(played.chunks(self.width));
            each.map(|(&k, v)| self.samples.distance(self.source.value(k), &self.value(v)))
                .fold(0.0, f64::max)
        };
        self.quantised(DraftForm::Keys(times, true), &values, 0.45 * allowed, error)
    }

    /// Straight pieces between keys at times of their own.
    fn pieces(&self, allowed: f64) -> Option<(Draft, usize)> {
        let s = &self.samples;
        let (p, _) = pieces::fitted(s, 0.75 * allowed, &pieces::WIDER, <[f32]>::to_vec);
        let times: Vec<f64> = p.keys.iter().map(|&k| s.times[k]).collect();
        let values: Vec<f64> = p.values.chunks(s.width).flat_map(|v| self.coordinates(v)).collect();
        let error = |played: &[f64]| {
            let values: Vec<f32> = played.chunks(self.width).flat_map(|v| self.value(v)).collect();
            pieces::worst(s, &pieces::Pieces { keys: p.keys.clone(), values })
        };
        self.quantised(DraftForm::Keys(times, false), &values, allowed, error)
    }

    /// The numbers that are stored of a value.
    fn coordinates(&self, value: &[f32]) -> Vec<f64> {
        match self.base {
            Some((_, base)) => {
                let q = base.conjugate() * DQuat::from_array([0, 1, 2, 3].map(|c| value[c] as f64));
                (q.xyz() / q.w).to_array().to_vec()
            }
            None => value.iter().map(|v| *v as f64).collect(),
        }
    }

    /// The numbers of the source at `x` in 0…1.
    fn at(&self, x: f64) -> Vec<f64> {
        let s = &self.samples;
        let k = self.x.partition_point(|o| *o < x).min(s.len() - 1);
        // At a sample nothing is to be guessed.
        if let Some(k) =
            [k, k.saturating_sub(1)].into_iter().find(|&k| (self.x[k] - x).abs() < 1e-6 / s.len() as f64)
        {
            return self.numbers[k * self.width..(k + 1) * self.width].to_vec();
        }
        let t = s.times[0] + x * (s.times[s.len() - 1] - s.times[0]);
        if s.kind != Kind::Rotation {
            let mut v = vec![0.0; s.width];
            self.source.sample(t, &mut v);
            return self.coordinates(&v);
        }
        let (q, near) = (self.source.sample_rotation(t), glam::Quat::from_slice(s.value(k)));
        self.coordinates(&if q.dot(near) < 0.0 { -q } else { q }.to_array())
    }

    /// The value that numbers stand for.
    fn value(&self, numbers: &[f64]) -> Vec<f32> {
        if self.samples.kind == Kind::Rotation {
            return self.quaternion(numbers).as_quat().to_array().to_vec();
        }
        numbers.iter().map(|v| *v as f32).collect()
    }

    fn quaternion(&self, n: &[f64]) -> DQuat {
        match self.base {
            Some((_, base)) => (base * DQuat::from_xyzw(n[0], n[1], n[2], 1.0)).normalize(),
            None => DQuat::from_slice(n).normalize(),
        }
    }

    /// With the coarsest step whose error is allowed.
    fn quantised(
        &self,
        form: DraftForm,
        values: &[f64],
        allowed: f64,
        error: impl Fn(&[f64]) -> f64,
    ) -> Option<(Draft, usize)> {
        let coarsest = ((4.0 * (2.0 * allowed).log2() + 176.0).ceil()).clamp(0.0, 255.0) as u8;
        let lists = |code: u8| -> Vec<i32> { values.iter().map(|v| quantised(*v, step_of(code))).collect() };
        let fine = |code: &u8| {
            let played: Vec<f64> = lists(*code).iter().map(|v| *v as f64 * step_of(*code)).collect();
            error(&played) <= allowed
        };
        let step = (0..=coarsest).rev().find(fine)?;
        let list = lists(step);
        let lanes = (0..self.width).map(|c| list.iter().skip(c).step_by(self.width).copied().collect());
        let base = self.base.map(|b| b.0);
        let d = Draft { target: self.target.clone(), form, base, step, lanes: lanes.collect() };
        packed::size(&d).map(|bits| (d, bits))
    }

    /// Even pieces: as few as serve, and a few more, which may do with fewer bits each.
    fn even(&mut self, degree: Degree, allowed: f64, best: &mut Option<(Draft, usize)>) {
        // More samples than pieces, so that none is free to go where it likes.
        let samples = self.samples.len() - 1;
        let most = if degree == Degree::Linear { samples / 2 } else { samples * 2 / 3 }.max(1);
        let mut few = None;
        let (mut n, mut failed) = (1, 0);
        while failed < most {
            if self.fitted(degree, n).1 <= 0.85 * allowed {
                few = Some(n);
                break;
            }
            failed = n;
            n = (n * 5 / 4).max(n + 1).min(most);
        }
        let Some(mut few) = few else { return };
        while few - failed > 1 + few / 16 {
            let middle = (few + failed) / 2;
            if self.fitted(degree, middle).1 <= 0.85 * allowed { few = middle } else { failed = middle }
        }
        let own = self.samples.own.len().saturating_sub(1).clamp(1, most);
        let usual = (self.duration / spacing(self.source.times())).round();
        let usual = if usual.is_finite() { (usual as usize).clamp(1, most) } else { own };
        let mut tried = vec![usual, few, few * 17 / 16, few * 9 / 8, few * 5 / 4, few * 3 / 2, own];
        tried.sort();
        tried.dedup();
        for n in tried {
            if n > most || self.fitted(degree, n).1 > 0.97 * allowed {
                continue;
            }
            let form = if degree == Degree::Linear { DraftForm::Even(n) } else { DraftForm::Cubic(n) };
            let made = self.quantised(form, &self.fits[&(degree, n)].0, allowed, |c| self.off(degree, n, c));
            if let Some(made) = made.filter(|m| best.as_ref().is_none_or(|b| m.1 < b.1)) {
                *best = Some(made);
            }
        }
    }

    fn fitted(&mut self, degree: Degree, n: usize) -> &(Vec<f64>, f64) {
        if !self.fits.contains_key(&(degree, n)) {
            let c = fit(&self.x, &self.numbers, self.width, degree, n);
            let mut best = (self.off(degree, n, &c), c);
            if degree == Degree::Linear {
                // Where the source has its corners at even times its own values are the best.
                let c: Vec<f64> = (0..=n).flat_map(|k| self.at(k as f64 / n as f64)).collect();
                let off = self.off(degree, n, &c);
                best = if off < best.0 { (off, c) } else { best };
            }
            self.fits.insert((degree, n), (best.1, best.0));
        }
        &self.fits[&(degree, n)]
    }

    /// How far a spline is from the samples at most.
    fn off(&self, degree: Degree, n: usize, c: &[f64]) -> f64 {
        let (s, w) = (&self.samples, self.width);
        let mut worst = 0.0_f64;
        for (i, &x) in self.x.iter().enumerate() {
            let (k, weights) = degree.at(x, n);
            let mut v = [0.0; 4];
            let distance = match s.kind {
                Kind::Rotation if degree == Degree::Linear => {
                    let [a, b] = [k, k + 1].map(|k| self.quaternion(&c[k * w..(k + 1) * w]));
                    apart(a.slerp(b, weights[1]), &s.values[4 * i..])
                }
                Kind::Weights => {
                    let each = (0..w).map(|d| {
                        let v: f64 = (0..degree.taps()).map(|a| weights[a] * c[(k + a) * w + d]).sum();
                        (v - s.value(i)[d] as f64).abs()
                    });
                    each.fold(0.0, f64::max)
                }
                _ => {
                    for a in 0..degree.taps() {
                        (0..w).for_each(|d| v[d] += weights[a] * c[(k + a) * w + d]);
                    }
                    match s.kind {
                        Kind::Rotation => apart(self.quaternion(&v[..w]), &s.values[4 * i..]),
                        _ => {
                            let o = s.value(i);
                            let other = DVec3::new(o[0] as f64, o[1] as f64, o[2] as f64);
                            DVec3::new(v[0], v[1], v[2]).distance(other)
                        }
                    }
                }
            };
            worst = worst.max(distance);
        }
        worst
    }
}

/// The same samples, with more where keys are far apart or the clip goes on without them.
fn spread(mut s: Samples, curve: &Curve, range: Range) -> Samples {
    let step = range.duration() / (2 * s.own.len().max(2) - 2) as f64;
    let jumps = (0..s.len()).any(|i| s.jumps(i));
    if step <= 0.0 || jumps || curve.interpolation() == Interpolation::Hold {
        return s;
    }
    let (from, w) = (std::mem::take(&mut s.times), s.width);
    let old = std::mem::take(&mut s.values);
    let own = std::mem::take(&mut s.own);
    let put = |s: &mut Samples, t: f64, held: &[f32]| {
        let mut v = held.to_vec();
        if s.kind == Kind::Rotation {
            let q = curve.sample_rotation(t);
            let near = glam::Quat::from_slice(held).dot(q) >= 0.0;
            v = if near { q } else { -q }.to_array().to_vec();
        } else {
            curve.sample(t, &mut v);
        }
        s.times.push(t);
        s.values.extend(v);
    };
    let fill = |s: &mut Samples, a: f64, b: f64, held: &[f32]| {
        let n = (0.9 * (b - a) / step).ceil() as usize;
        (1..n).for_each(|k| put(s, a + (b - a) * k as f64 / n as f64, held));
    };
    let last = from.len() - 1;
    if range.start < from[0] {
        put(&mut s, range.start, &old[..w]);
        fill(&mut s, range.start, from[0], &old[..w]);
    }
    for (i, &t) in from.iter().enumerate() {
        let value = &old[i * w..(i + 1) * w];
        if own.binary_search(&i).is_ok() {
            s.own.push(s.times.len());
        }
        s.times.push(t);
        s.values.extend(value);
        if let Some(&next) = from.get(i + 1) {
            fill(&mut s, t, next, value);
        }
    }
    if range.end > from[last] {
        let held = &old[last * w..];
        fill(&mut s, from[last], range.end, held);
        put(&mut s, range.end, held);
    }
    s
}

/// Radians between two rotations.
fn apart(a: DQuat, b: &[f32]) -> f64 {
    let b = DQuat::from_xyzw(b[0] as f64, b[1] as f64, b[2] as f64, b[3] as f64);
    let chord = (a - b).length().min((a + b).length());
    4.0 * (0.5 * chord).min(1.0).asin()
}

fn quantised(v: f64, step: f64) -> i32 {
    const MOST: f64 = (1 << 26) as f64;
    (v / step).round().clamp(-MOST, MOST) as i32
}

/// The moments that most keys, and the middles between them, stand on.
pub(super) fn grid(clip: &Clip) -> Option<Grid> {
    let start = clip.range().start;
    let longest =
        clip.tracks.iter().map(|t| t.curve.times()).max_by_key(|t| t.len()).filter(|t| t.len() > 1)?;
    let even = (longest.len() - 1) as f64 / (longest[longest.len() - 1] - longest[0]);
    let rates = [24.0, 30.0, 60.0, 25.0, 48.0, 50.0, 120.0, even, 1.0 / spacing(longest)];
    let grids =
        rates.into_iter().flat_map(|r| [true, false].map(|single| Grid { start, rate: 2.0 * r, single }));
    let fit =
        |g: &Grid, exact| clip.tracks.iter().filter(|t| g.ticks(t.curve.times(), exact).is_some()).count();
    let scored =
        grids.filter(|g| g.rate.is_finite() && g.rate > 0.0).map(|g| (fit(&g, false), fit(&g, true), g));
    // The first of the best: rates that people use come first.
    let best = scored.reduce(|a, b| if (b.0, b.1) > (a.0, a.1) { b } else { a });
    best.filter(|b| 2 * b.0 > clip.tracks.len()).map(|b| b.2)
}

/// The usual distance between keys, seconds.
fn spacing(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}
