//! Distinct key times of a whole clip, kept up by what changed: an edit of one track costs that track.

use super::axis::Axis;
use crate::state::EditClip;
use sinew::clip::Track;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Times, in whole microseconds, and how many keys stand at each.
#[derive(Default)]
pub struct Summary {
    seen: Vec<Arc<Track>>,
    counts: BTreeMap<i64, u32>,
}

fn micros(t: f64) -> i64 {
    (t * 1e6).round() as i64
}

impl Summary {
    /// As the clip is now.
    pub fn update(&mut self, clip: &EditClip) {
        for i in 0..self.seen.len().max(clip.tracks.len()) {
            let (old, new) = (self.seen.get(i), clip.tracks.get(i));
            if let (Some(a), Some(b)) = (old, new)
                && Arc::ptr_eq(a, b)
            {
                continue;
            }
            for &t in old.map_or(&[][..], |t| t.curve.times()) {
                let at = micros(t);
                if let Some(n) = self.counts.get_mut(&at) {
                    *n -= 1;
                    if *n == 0 {
                        self.counts.remove(&at);
                    }
                }
            }
            for &t in new.map_or(&[][..], |t| t.curve.times()) {
                *self.counts.entry(micros(t)).or_insert(0) += 1;
            }
        }
        self.seen.truncate(clip.tracks.len());
        for (i, track) in clip.tracks.iter().enumerate() {
            match self.seen.get_mut(i) {
                Some(old) if Arc::ptr_eq(old, track) => {}
                Some(old) => *old = track.clone(),
                None => self.seen.push(track.clone()),
            }
        }
    }

    /// The time nearest to `t`, no further than `within`.
    pub fn near(&self, t: f64, within: f64) -> Option<f64> {
        let at = micros(t);
        let before = self.counts.range(..at).next_back();
        let after = self.counts.range(at..).next();
        let times = [before, after].into_iter().flatten().map(|(&k, _)| k as f64 * 1e-6);
        times.min_by(|a, b| (a - t).abs().total_cmp(&(b - t).abs())).filter(|k| (k - t).abs() <= within)
    }

    /// Times that can be seen, no two nearer than `apart` points.
    pub fn seen(&self, axis: &Axis, apart: f64) -> Vec<f64> {
        let (first, last) = (axis.t(axis.rect.left() - 8.0), micros(axis.t(axis.rect.right() + 8.0)));
        let step = micros(apart * axis.scale).max(1);
        let (mut out, mut from) = (Vec::new(), micros(first));
        while let Some((&at, _)) = self.counts.range(from..=last.max(from)).next() {
            out.push(at as f64 * 1e-6);
            from = at.saturating_add(step);
            if from > last {
                break;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew::clip::{Curve, Interpolation, Target};
    use sinew::skeleton::BoneId;

    fn track(times: &[f64]) -> Arc<Track> {
        let values = vec![0.0; 3 * times.len()];
        let curve = Curve::new(times.to_vec(), values, 3, Interpolation::Linear).unwrap();
        Arc::new(Track { target: Target::Xzx(BoneId(0)), curve })
    }

    #[test]
    fn what_changes_is_counted_out_and_in() {
        let mut clip = EditClip::empty("c");
        clip.tracks = vec![track(&[0.0, 1.0]), track(&[1.0, 2.0])];
        let mut s = Summary::default();
        s.update(&clip);
        assert_eq!(s.counts, BTreeMap::from([(0, 1), (1_000_000, 2), (2_000_000, 1)]));
        clip.tracks[0] = track(&[1.0, 5.0]);
        s.update(&clip);
        assert_eq!(s.near(0.2, 0.5), None);
        clip.tracks.pop();
        s.update(&clip);
        assert_eq!(s.counts, BTreeMap::from([(1_000_000, 1), (5_000_000, 1)]));
    }
}
