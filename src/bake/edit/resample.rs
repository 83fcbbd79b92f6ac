//! So many keys a second.

use super::EditError;
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::time::Range;

/// Keys that a resampled clip may have in all.
const MOST: usize = 1 << 24;

/// Keys at whole frames only: at `k / fps` for whole `k` within the clip, and at its two ends.
///
/// Steps stay steps and cuts stay cuts, moved to the frame at or after them; everything else becomes straight pieces (arcs for
/// rotations). A track of one key stays.
///
/// ```
/// use sinew::bake::edit;
/// use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
/// use sinew::skeleton::BoneId;
/// let curve = Curve::new(vec![0.0, 1.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 3, Interpolation::Linear).unwrap();
/// let clip = Clip { name: "slide".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] };
/// let frames = edit::resample(&clip, 4.0).unwrap();
/// assert_eq!(frames.tracks[0].curve.times(), [0.0, 0.25, 0.5, 0.75, 1.0]);
/// ```
///
/// # Errors
/// [`EditError::TooManyKeys`] and [`EditError::Times`]: a last key at 10³⁰ s is a mistake and not an allocation.
///
/// # Panics
/// If the rate is not above 0.
pub fn resample(clip: &Clip, fps: f64) -> Result<Clip, EditError> {
    assert!(fps > 0.0 && fps.is_finite(), "a rate of {fps}; expected more than 0");
    let Range { start, end } = clip.range();
    let moving = clip.tracks.iter().filter(|t| t.curve.times().len() > 1).count();
    let step = spacing(start.abs().max(end.abs()));
    if step > 0.5 / fps && moving > 0 {
        return Err(EditError::Times { clip: clip.name.clone(), time: end, step, fps });
    }
    let keys = ((end - start) * fps + 2.0) * moving as f64;
    if keys > MOST as f64 {
        let (clip, seconds) = (clip.name.clone(), end - start);
        return Err(EditError::TooManyKeys { clip, fps, tracks: moving, seconds, keys, limit: MOST });
    }
    let inner = ((start * fps).floor() as i64 + 1..(end * fps).ceil() as i64).map(|k| k as f64 / fps);
    let frames: Vec<f64> =
        std::iter::once(start).chain(inner).chain(Some(end).filter(|e| *e > start)).collect();
    let tracks = clip.tracks.iter().map(|t| match t.curve.times().len() {
        1 => t.clone(),
        _ => Track { target: t.target.clone(), curve: at_frames(t, &frames) },
    });
    Ok(Clip { name: clip.name.clone(), tracks: tracks.collect() })
}

/// Seconds from a time to the next one in single precision.
pub fn spacing(t: f64) -> f64 {
    let t = (t.min(f32::MAX as f64 / 2.0)) as f32;
    (t.next_up() - t) as f64
}

fn at_frames(track: &Track, frames: &[f64]) -> Curve {
    let (curve, keys) = (&track.curve, track.curve.times());
    let width = curve.width();
    let held = curve.interpolation() == Interpolation::Hold;
    let (mut times, mut values): (Vec<f64>, Vec<f32>) = (vec![], vec![]);
    let mut next = 0;
    for &frame in frames {
        // A key that was meant to be on the frame is: files round times to single precision.
        let t =
            nearest(keys, frame).filter(|k| (k - frame).abs() <= spacing(frame).max(1e-6)).unwrap_or(frame);
        // A cut since the last frame: what was there before it, then what is there after it.
        let cut = (next..keys.partition_point(|&k| k <= t)).find(|&k| k > 0 && keys[k - 1] == keys[k]);
        next = keys.partition_point(|&k| k <= t);
        if let Some(k) = cut.filter(|_| !held && !times.is_empty()) {
            let first = keys.partition_point(|&x| x < keys[k]);
            times.push(t);
            values.extend(curve.value(first));
        }
        times.push(t);
        let from = values.len();
        values.resize(from + width, 0.0);
        match track.target {
            Target::Rotation(_) => values[from..].copy_from_slice(&curve.sample_rotation(t).to_array()),
            _ => curve.sample(t, &mut values[from..]),
        }
    }
    let way = if held { Interpolation::Hold } else { Interpolation::Linear };
    Curve::new(times, values, width, way).expect("frames in order")
}

fn nearest(keys: &[f64], t: f64) -> Option<f64> {
    let k = keys.partition_point(|&k| k <= t);
    let around = [k.checked_sub(1), Some(k)].into_iter().flatten().filter_map(|k| keys.get(k).copied());
    around.min_by(|a, b| (a - t).abs().total_cmp(&(b - t).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::BoneId;

    fn clip(times: Vec<f64>, way: Interpolation) -> Clip {
        let values = (0..times.len()).flat_map(|k| [k as f32, 0.0, 1.0]).collect();
        let curve = Curve::new(times, values, 3, way).unwrap();
        Clip { name: "c".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] }
    }

    #[test]
    fn steps_cuts_and_ends_stay() {
        // Times as a file has them: rounded to single precision.
        let file = |frame: f64| (frame / 24.0) as f32 as f64;
        let steps = clip(vec![0.0, file(1.0), file(7.0)], Interpolation::Hold);
        let frames = resample(&steps, 24.0).unwrap();
        let x: Vec<f32> = frames.tracks[0].curve.values().chunks(3).map(|v| v[0]).collect();
        assert_eq!(x, [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0]);
        let cut = clip(vec![0.0, 0.5, 0.5, 0.9], Interpolation::Linear);
        let frames = resample(&cut, 4.0).unwrap();
        assert_eq!(frames.tracks[0].curve.times(), [0.0, 0.25, 0.5, 0.5, 0.75, 0.9]);
        assert_eq!(frames.range(), cut.range());
    }

    #[test]
    fn what_nobody_can_mean_is_an_error() {
        let far = clip(vec![0.0, 1e30], Interpolation::Linear);
        assert!(matches!(resample(&far, 30.0), Err(EditError::Times { .. })));
        let long = clip(vec![0.0, 1e5], Interpolation::Linear);
        assert!(resample(&long, 30.0).is_ok());
        assert!(matches!(resample(&long, 240.0), Err(EditError::Times { .. })));
    }
}
