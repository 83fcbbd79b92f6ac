//! Clips cut, turned round, sped up and joined. Every curve goes on exactly as it went: nothing is sampled again.

use super::keys::{Keys, each};
use crate::clip::{Clip, Interpolation, Track};
use crate::time::Range;

/// The part of a clip within `range`, moved to begin at 0. Keys are added where a curve is cut. An end beyond the clip's own
/// playback is that of the clip: no stillness is added.
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
    let whole = clip.playback();
    let end = range.end.clamp(whole.start, whole.end);
    let range = Range { start: range.start.clamp(whole.start, end), end };
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
            let mut keys = Keys::of(track);
            keys.times.iter_mut().for_each(|t| *t += start - range.start);
            match out.tracks.iter_mut().find(|t| t.target == track.target) {
                Some(before) => before.curve = Keys::of(before).followed_by(keys).curve(),
                None => out.tracks.push(Track { target: track.target.clone(), curve: keys.curve() }),
            }
        }
        start += range.duration();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Curve, Target};
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
        // What lies beyond the clip is not made.
        assert_eq!(trim(&clip, Range { start: -3.0, end: 9.0 }), trim(&clip, Range { start: 0.0, end: 2.0 }));
        assert_eq!(beyond.range().end, 0.5);
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
