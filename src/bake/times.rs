//! When to look: at keys, at frames, and between them.

use super::gauge::{Gauge, Worst};
use crate::clip::Clip;

/// Looks a second of a verified clip, at least.
const RATE: f64 = 240.0;

/// Looks between two keys of either clip, at least.
const BETWEEN: usize = 4;

/// Gaps around the worst moments that are looked at more closely.
const CLOSER: usize = 8;

/// The most looks at a clip: beyond that, gaps between frames grow.
const MOST: usize = 200_000;

/// All key times of clips, once each, ascending.
pub(super) fn knots(clips: &[&Clip]) -> Vec<f64> {
    let mut t: Vec<f64> =
        clips.iter().flat_map(|c| &c.tracks).flat_map(|t| t.curve.times().iter().copied()).collect();
    t.sort_by(f64::total_cmp);
    t.dedup();
    t
}

/// At most so many moments for the search: keys and the middles between them.
pub(super) fn coarse(clip: &Clip, most: usize) -> Vec<f64> {
    let knots = knots(&[clip]);
    let all = knots.windows(2).flat_map(|w| [w[0], 0.5 * (w[0] + w[1])]).chain(knots.last().copied());
    let all: Vec<f64> = all.collect();
    let step = all.len().div_ceil(most.max(1)).max(1);
    all.into_iter().step_by(step).collect()
}

/// Compare two clips: the worst that was found, an estimate of what was not as a share of what is allowed, and the number of moments.
///
/// Between two knots the distance of a vertex is smooth. A maximum of a smooth curve that was sampled at distance `h` hides at most
/// `h²/8` times its second derivative, which the samples' second differences estimate; twice that is added.
pub(super) fn verify(gauge: &Gauge, a: &Clip, b: &Clip) -> (Worst, f64, usize) {
    let times = dense(&knots(&[a, b]));
    let found = gauge.profile(a, b, &times);
    let mut moments = times.len();
    let worst = |list: &[Worst]| list.iter().copied().fold(Worst::default(), Worst::worse);
    let mut top = worst(&found);

    // Look eight times as closely around the worst moments.
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|&i, &j| found[j].share().total_cmp(&found[i].share()).then(i.cmp(&j)));
    order.truncate(CLOSER);
    let around = |i: usize| [times[i.saturating_sub(1)], times[(i + 1).min(times.len() - 1)]];
    let closer: Vec<f64> = order
        .iter()
        .flat_map(|&i| {
            let [from, to] = around(i);
            (1..16).map(move |k| from + (to - from) * k as f64 / 16.0)
        })
        .collect();
    let more = gauge.profile(a, b, &closer);
    moments += more.len();
    let best = worst(&more);
    top = top.worse(best);
    let bend = |w: &[Worst]| (w[0].share() - 2.0 * w[1].share() + w[2].share()).abs();
    let near = |w: &&[Worst]| w[1].share() > 0.8 * top.share();
    let hidden = more.chunks(15).flat_map(|c| c.windows(3)).filter(near).map(bend).fold(0.0, f64::max);
    (top, top.share() + 2.0 * hidden / 8.0, moments)
}

/// Knots, and moments between them.
fn dense(knots: &[f64]) -> Vec<f64> {
    let Some((first, last)) = knots.first().zip(knots.last()) else { return vec![0.0] };
    let step = (1.0 / RATE).max((last - first) / MOST as f64);
    let mut out = Vec::new();
    for w in knots.windows(2) {
        let n = (((w[1] - w[0]) / step).ceil() as usize).max(BETWEEN);
        out.extend((0..n).map(|k| w[0] + (w[1] - w[0]) * k as f64 / n as f64));
    }
    out.push(*last);
    out
}
