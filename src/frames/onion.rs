//! Ghosts of other moments.

use super::overlay::Onion;
use super::{FrameStats, Shot, Worker};
use crate::image::Image;
use crate::image::composite::{Operator, tinted};
use crate::scene::Camera;
use crate::time::Wrap;

/// Put all ghosts of a moment on `out`, from far to near.
pub(super) fn ghosts(
    shot: &Shot,
    onion: &Onion,
    now: f64,
    camera: &Camera,
    worker: &mut Worker,
    out: &mut Image,
    stats: &mut FrameStats,
) {
    let (mut past, mut future) = (Image::default(), Image::default());
    let colors = shot.desc.overlays.colors;
    for k in (1..=onion.before.max(onion.after)).rev() {
        let offset = onion.step * f64::from(k);
        let mut side = |of: u32, t: f64, color: [f32; 3], image: &mut Image| {
            if k > of || !shown(shot, t) {
                return false;
            }
            shot.pose(t, worker, stats);
            shot.character(camera, [0.0; 4], worker, image, stats);
            let opacity = onion.opacity * (of + 1 - k) as f32 / of as f32;
            for p in &mut image.pixels {
                *p = tinted(*p, color, onion.tint).map(|c| c * opacity);
            }
            true
        };
        let before = side(onion.before, now - offset, colors[0], &mut past);
        let after = side(onion.after, now + offset, colors[1], &mut future);
        match (before, after) {
            (true, true) => {
                for ((p, f), o) in past.pixels.iter().zip(&future.pixels).zip(&mut out.pixels) {
                    *o = Operator::OVER.pixel(mixed(*p, *f), *o);
                }
            }
            (true, false) => Operator::OVER.apply(&past, 1.0, out),
            (false, true) => Operator::OVER.apply(&future, 1.0, out),
            (false, false) => {}
        }
    }
}

/// Whether there is anything to see at a time: a clip that is not repeated holds its ends, which are seen but once.
fn shown(shot: &Shot, t: f64) -> bool {
    shot.desc.wrap != Wrap::Clamp || (shot.range.start..=shot.range.end).contains(&t)
}

/// Two premultiplied pixels of one rank: `A_src·P + A_dst·F + A_both·(P + F)/2`.
///
/// `P` is shown in `αp(1 − αf) + αp·αf/2`, a share of `1 − αf/2` of its own coverage; `F` alike.
fn mixed(p: [f32; 4], f: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| p[c] * (1.0 - 0.5 * f[3]) + f[c] * (1.0 - 0.5 * p[3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::composite::Regions;

    #[test]
    fn past_and_future_of_one_distance_share_what_both_cover() {
        let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        for (a, b) in [(0.25, 0.5), (1.0, 1.0), (0.0, 0.75)] {
            let found = mixed([a, 0.0, 0.0, a], [0.0, 0.0, b, b]);
            let want = Regions::new(a, b).paint(Some(red), Some(blue), Some([0.5, 0.0, 0.5]));
            assert!((0..4).all(|c| (found[c] - want[c]).abs() < 1e-6), "{found:?} {want:?}");
            assert_eq!(mixed([a, 0.0, 0.0, a], [0.0; 4]), [a, 0.0, 0.0, a]);
        }
    }
}
