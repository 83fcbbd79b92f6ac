//! The way of a bone through the whole clip, drawn over the picture.

use super::fit::Span;
use super::overlay::PathDesc;
use super::stroke::{self, Ink, Pad};
use super::worker::Worker;
use super::{Shot, ShotDesc};
use crate::clip::{Clip, Target};
use crate::fk::Posed;
use crate::image::Image;
use crate::image::composite::Operator;
use crate::scene::Camera;
use crate::skeleton::{BoneId, Skeleton};
use crate::time::{Range, wrap};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Places between two dots, so that the line is round.
const BETWEEN: usize = 4;

/// Places on a path at most.
const MOST_PLACES: f64 = 40_000.0;

/// How much of the line is left at the time that is farthest from now.
const FADED: f32 = 0.35;

/// What surrounds the line and its dots, so that they are seen on any ground.
const HALO: Ink = Ink { color: [0.0; 3], alpha: 0.4 };
const HALO_PX: f64 = 1.0;

/// Radii of dots in widths of the line.
const DOT: f64 = 1.0;
const KEY: f64 = 1.6;
const NOW: f64 = 2.2;

/// A path that is ready to be drawn.
#[derive(Clone, Debug)]
pub(super) struct Trail {
    desc: PathDesc,
    /// Times and places, scene space.
    places: Vec<(f64, DVec3)>,
    /// Places of keys, if they are few.
    keys: Vec<(f64, DVec3)>,
    range: Range,
}

impl Trail {
    pub fn new(span: &Span, desc: &PathDesc, worker: &mut Worker) -> Self {
        let range = span.range();
        let steps = (range.duration() / desc.step * BETWEEN as f64 + 1e-6).floor().min(MOST_PLACES) as usize;
        let skeleton = span.asset.character.skeleton();
        let mut place = |t: f64| {
            worker.evaluate(span.asset, span.clip, t);
            (t, end(skeleton, desc, &worker.posed, span.center))
        };
        let mut times: Vec<f64> =
            (0..=steps).map(|i| range.start + desc.step * i as f64 / BETWEEN as f64).collect();
        if range.end > times[steps] && (steps as f64) < MOST_PLACES {
            times.push(range.end);
        }
        let places: Vec<(f64, DVec3)> = times.into_iter().map(&mut place).collect();

        // Keys of motion that was baked are no news.
        let keys = span.clip.map_or(vec![], |c| keys(&span.asset.character.clips()[c], skeleton, desc.bone));
        let few = keys.len() * 2 <= places.len() / BETWEEN;
        let keys = if few { keys.into_iter().map(place).collect() } else { vec![] };
        Self { desc: *desc, places, keys, range }
    }

    /// Draw the path on a picture that begins at pixel `corner` of the whole, as it is seen at a time.
    pub fn draw(
        &self,
        shot: &Shot,
        time: f64,
        camera: &Camera,
        posed: &Posed,
        [layer, out]: [&mut Image; 2],
        corner: [usize; 2],
    ) {
        let lens = Lens::new(camera, shot.aspect(), &shot.desc);
        let now = wrap(time, self.range, shot.desc.wrap);
        let width = f64::from(self.desc.width_px);
        let colors = shot.desc.overlays.colors;
        let ink = |t: f64| {
            let far = ((t - now).abs() / self.range.duration().max(1e-9)).min(1.0) as f32;
            Ink { color: colors[usize::from(t > now)], alpha: 1.0 - (1.0 - FADED) * far }
        };

        // The line on its halo, each as one layer.
        for halo in [true, false] {
            (layer.width, layer.height) = (out.width, out.height);
            layer.pixels.clear();
            layer.pixels.resize(out.pixels.len(), [0.0; 4]);
            for two in self.places.windows(2) {
                let Some(ends) = lens.line(two[0].1, two[1].1) else { continue };
                let i = ink(0.5 * (two[0].0 + two[1].0));
                let thick = if halo { width + 2.0 * HALO_PX } else { width };
                stroke::line(
                    &mut Pad { image: layer, corner },
                    ends,
                    thick,
                    if halo { Ink { alpha: HALO.alpha * i.alpha, ..HALO } } else { i },
                );
            }
            Operator::OVER.apply(layer, 1.0, out);
        }

        // Dots of frames, of keys, and of now.
        let dot = |out: &mut Image, p: DVec3, radius: f64, ink: Ink| {
            if let Some(at) = lens.point(p) {
                stroke::dot(&mut Pad { image: out, corner }, at, radius * width + HALO_PX, HALO);
                stroke::dot(&mut Pad { image: out, corner }, at, radius * width, ink);
            }
        };
        for (t, p) in self.places.iter().step_by(BETWEEN) {
            dot(out, *p, DOT, ink(*t));
        }
        for (t, p) in &self.keys {
            dot(out, *p, KEY, ink(*t));
        }
        let skeleton = shot.asset.character.skeleton();
        let here = end(skeleton, &self.desc, posed, shot.center);
        dot(out, here, NOW, Ink { color: [1.0; 3], alpha: 1.0 });
    }
}

/// Where the end of the bone is, scene space.
fn end(skeleton: &Skeleton, desc: &PathDesc, posed: &Posed, center: DVec3) -> DVec3 {
    let tip = if desc.head { DVec3::ZERO } else { skeleton.tip(desc.bone).as_dvec3() };
    posed.world_from_bone(desc.bone).transform_point3(tip) - center
}

/// Times of the keys that move the bone, or of the nearest bone above it that has any.
fn keys(clip: &Clip, skeleton: &Skeleton, bone: BoneId) -> Vec<f64> {
    let moves = |of: BoneId, target: &Target| match *target {
        Target::Xzx(b) | Target::Rotation(b) | Target::Translation(b) | Target::Scale(b) => b == of,
        Target::Weights { .. } => false,
    };
    let mut at = Some(bone);
    while let Some(b) = at {
        let tracks = clip.tracks.iter().filter(|t| moves(b, &t.target));
        let mut times: Vec<f64> = tracks.flat_map(|t| t.curve.times().iter().map(|&t| t.into())).collect();
        if !times.is_empty() {
            times.sort_by(f64::total_cmp);
            times.dedup();
            return times;
        }
        at = skeleton.parent(b);
    }
    Vec::new()
}

/// From the scene to pixels.
struct Lens {
    clip_from_scene: DMat4,
    /// Of the whole picture.
    size: DVec2,
    /// The least `w` that is in front of the eye.
    near: f64,
}

impl Lens {
    fn new(camera: &Camera, aspect: f32, desc: &ShotDesc) -> Self {
        let clip_from_scene = camera.clip_from_scene(aspect).as_dmat4();
        let near = f64::from(camera.near).min(1.0);
        let pixels = |x: usize, y: usize| DVec2::new(x as f64, y as f64);
        Self { clip_from_scene, size: pixels(desc.settings.width, desc.settings.height), near }
    }

    fn clip(&self, p: DVec3) -> DVec4 {
        self.clip_from_scene * p.extend(1.0)
    }

    fn pixel(&self, c: DVec4) -> DVec2 {
        (DVec2::new(0.5, 0.5) + DVec2::new(0.5, -0.5) * c.truncate().truncate() / c.w) * self.size
    }

    fn point(&self, p: DVec3) -> Option<DVec2> {
        let c = self.clip(p);
        (c.w >= self.near).then(|| self.pixel(c))
    }

    /// The part of a line that is before the eye.
    fn line(&self, a: DVec3, b: DVec3) -> Option<[DVec2; 2]> {
        let (a, b) = (self.clip(a), self.clip(b));
        let cut = |from: DVec4, to: DVec4| from + (to - from) * ((self.near - from.w) / (to.w - from.w));
        match (a.w >= self.near, b.w >= self.near) {
            (true, true) => Some([self.pixel(a), self.pixel(b)]),
            (true, false) => Some([self.pixel(a), self.pixel(cut(a, b))]),
            (false, true) => Some([self.pixel(cut(a, b)), self.pixel(b)]),
            (false, false) => None,
        }
    }
}
