//! When to look: at keys, at frames, and between them.

use super::bound::Bound;
use super::gauge::{Gauge, Worst};
use crate::clip::{Clip, Curve};
use std::borrow::Cow;

/// Two motions of the same points.
pub(super) trait Motions: Sync {
    /// How far they are apart at each of these times; what is below this share of the limit may be told as that.
    fn apart(&self, times: &[f64], floor: f64) -> Vec<Worst>;
    /// How far at any of them, where that is less work than to tell each.
    fn worst(&self, _times: &[f64]) -> Worst {
        Worst::default()
    }
    /// The largest second derivative of the way from one to the other between two moments, as a part of the limit.
    fn bend(&self, times: [f64; 2]) -> f64;
    /// The end of a span as seen from within it: just before, where something jumps there.
    fn end_before(&self, t: f64) -> f64;
}

/// One character moved by two clips.
struct Clips<'a> {
    gauge: &'a Gauge<'a>,
    bound: Bound<'a>,
    clips: [&'a Clip; 2],
}

impl Motions for Clips<'_> {
    fn apart(&self, times: &[f64], floor: f64) -> Vec<Worst> {
        self.gauge.profile(self.clips[0], self.clips[1], times, floor)
    }

    fn worst(&self, times: &[f64]) -> Worst {
        self.gauge.worst(self.clips[0], self.clips[1], times)
    }

    fn bend(&self, times: [f64; 2]) -> f64 {
        self.bound.bend(self.clips, times)
    }

    fn end_before(&self, t: f64) -> f64 {
        self.bound.end_before(t)
    }
}

/// Gaps between keys that are worked on together, so that memory does not grow with a clip's length.
const GAPS: usize = 2048;

/// How close the bound is brought to what was measured, as a part of it.
const BRACKET: f64 = 1.02;

/// Rounds of halving that only bring the bound closer, and gaps in each.
const CLOSER: [usize; 2] = [12, 64];

/// Every so many moments are looked at first, for what the worst will be near.
const FIRST: usize = 16;

/// Shares below this part of the worst are not told apart.
const SHOWN: f64 = 0.6;

/// Moments over the limit that are told of.
const OVER: usize = 64;

/// Halvings of a gap before it is given up: 2⁻³⁰ of it.
const DEEPEST: u32 = 30;

/// All key times of clips, once each, ascending.
pub(super) fn knots(clips: &[&Clip]) -> Vec<f64> {
    let mut t: Vec<f64> =
        clips.iter().flat_map(|c| &c.tracks).flat_map(|t| t.curve.times().iter().copied()).collect();
    t.sort_by(f64::total_cmp);
    t.dedup();
    t
}

/// A time as files hold it.
pub(super) fn single(t: f64) -> f64 {
    t as f32 as f64
}

/// The same clip with times as files hold them, for the tracks that are asked for.
pub(super) fn in_single<'c>(clip: &'c Clip, asked: impl Fn(&Curve) -> bool) -> Cow<'c, Clip> {
    let off = |c: &Curve| asked(c) && c.times().iter().any(|t| single(*t) != *t);
    if !clip.tracks.iter().any(|t| off(&t.curve)) {
        return Cow::Borrowed(clip);
    }
    let mut out = clip.clone();
    for track in out.tracks.iter_mut().filter(|t| off(&t.curve)) {
        let c = &track.curve;
        let times = c.times().iter().map(|t| single(*t)).collect();
        track.curve = Curve::new(times, c.values().to_vec(), c.width(), c.interpolation())
            .expect("rounding keeps times in order");
    }
    Cow::Owned(out)
}

/// At most so many moments for the search: keys and the middles between them.
pub(super) fn coarse(clip: &Clip, most: usize) -> Vec<f64> {
    let knots = knots(&[clip]);
    let all = knots.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).chain(knots.last().copied());
    let all: Vec<f64> = all.collect();
    let step = all.len().div_ceil(most.max(1)).max(1);
    all.into_iter().step_by(step).collect()
}

/// What two clips do, between two bounds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Verdict {
    /// The worst that was measured.
    pub worst: Worst,
    /// What nothing exceeds at any time, as a part of what is allowed.
    pub ceiling: f64,
    /// Moments at which vertices were compared.
    pub moments: usize,
    /// Those at which the limit is exceeded by most.
    pub over: Vec<f64>,
}

/// Two moments and what is known between them.
#[derive(Clone, Copy)]
struct Gap {
    times: [f64; 2],
    shares: [f64; 2],
    ceiling: f64,
    depth: u32,
}

/// Compare two clips at all keys, and between them.
pub(super) fn verify(gauge: &Gauge, a: &Clip, b: &Clip) -> Verdict {
    bracket(gauge, &knots(&[a, b]), &Clips { gauge, bound: Bound::new(gauge, [a, b]), clips: [a, b] })
}

/// Compare two motions at all knots, and between them wherever more than is allowed could hide: gaps are halved until their second derivatives
/// say that nothing does, or until a moment is found at which the limit is exceeded.
pub(super) fn bracket(gauge: &Gauge, knots: &[f64], motions: &impl Motions) -> Verdict {
    let mut verdict = Verdict::default();
    if knots.len() < 2 {
        verdict.look(motions, &[knots.first().copied().unwrap_or(0.0)]);
        verdict.ceiling = verdict.worst.share();
    }
    for part in 0..knots.len().saturating_sub(1).div_ceil(GAPS) {
        let knots = &knots[part * GAPS..((part + 1) * GAPS + 1).min(knots.len())];
        let ceiling = verdict.cover(gauge, motions, knots);
        verdict.ceiling = verdict.ceiling.max(ceiling);
        if verdict.worst.share() > 1.0 {
            break;
        }
    }
    verdict
}

impl Verdict {
    /// What the shares at these moments do not exceed.
    fn look(&mut self, motions: &impl Motions, times: &[f64]) -> Vec<f64> {
        if self.moments == 0 {
            let first: Vec<f64> = times.iter().copied().step_by(FIRST).collect();
            self.worst = motions.worst(&first);
        }
        // Shares far below the worst need not be known exactly.
        let floor = SHOWN * self.worst.share();
        let found = motions.apart(times, floor);
        self.moments += times.len();
        self.worst = found.iter().copied().fold(self.worst, Worst::worse);
        let mut over: Vec<&Worst> = found.iter().filter(|w| w.share() > 1.0).collect();
        over.sort_by(|a, b| b.share().total_cmp(&a.share()).then(a.time.total_cmp(&b.time)));
        self.over.extend(over.iter().take(OVER).map(|w| w.time));
        found.iter().map(|w| w.share().max(floor)).collect()
    }

    /// A bound for all of the time between the first and the last knot.
    fn cover(&mut self, gauge: &Gauge, motions: &impl Motions, knots: &[f64]) -> f64 {
        let ends: Vec<f64> = knots
            .windows(2)
            .flat_map(|w| [w[0], motions.end_before(w[1])])
            .chain(knots.last().copied())
            .collect();
        let mut moments = ends.clone();
        moments.dedup();
        let shares = self.look(motions, &moments);
        let share = |t: f64| shares[moments.partition_point(|m| *m < t)];
        let gaps = ends.chunks_exact(2).map(|e| [e[0], e[1]]).filter(|e| e[0] < e[1]);
        let open: Vec<Gap> =
            gaps.map(|times| Gap { times, shares: times.map(share), ceiling: f64::NAN, depth: 0 }).collect();
        let last = share(ends[ends.len() - 1]);
        // Gaps whose ceiling is known; the fresh ones' is not.
        let (mut known, mut fresh) = (vec![], open);
        let mut rounds = 0;
        loop {
            let spans: Vec<_> = fresh.iter().map(|g| g.times).collect();
            let bends = gauge.map(&spans, |times| motions.bend(times));
            for (gap, bend) in fresh.iter_mut().zip(bends) {
                let h = gap.times[1] - gap.times[0];
                gap.ceiling = gap.shares[0].max(gap.shares[1]) + h * h / 8.0 * bend;
            }
            known.append(&mut fresh);
            known.sort_by(|a, b| b.ceiling.total_cmp(&a.ceiling).then(a.times[0].total_cmp(&b.times[0])));
            let ceiling = known.first().map_or(last, |g| g.ceiling.max(last));
            let worst = self.worst.share();
            let above = |limit: f64| known.partition_point(|g| g.ceiling > limit);
            let mut wide = above(1.0);
            if wide == 0 {
                // All is within what is allowed: say more closely by how much.
                rounds += 1;
                wide = above(BRACKET * worst).min(CLOSER[1]);
            }
            let spent = rounds > CLOSER[0] || known.iter().take(wide).any(|g| g.depth >= DEEPEST);
            if worst > 1.0 || wide == 0 || spent {
                return ceiling;
            }
            fresh = self.halve(motions, &known[..wide]);
            known.drain(..wide);
        }
    }

    fn halve(&mut self, motions: &impl Motions, gaps: &[Gap]) -> Vec<Gap> {
        let middles: Vec<f64> = gaps.iter().map(|g| 0.5 * (g.times[0] + g.times[1])).collect();
        let shares = self.look(motions, &middles);
        let halves = |((gap, &t), &share): ((&Gap, &f64), &f64)| {
            let half = |times, shares| Gap { times, shares, ceiling: f64::NAN, depth: gap.depth + 1 };
            [half([gap.times[0], t], [gap.shares[0], share]), half([t, gap.times[1]], [share, gap.shares[1]])]
        };
        gaps.iter().zip(&middles).zip(&shares).flat_map(halves).collect()
    }
}
