//! Where the character stands in its pictures, and whether its clip comes back to where it began.

use super::fit::{self, Span};
use super::{Moment, Pivot, Shot, ShotDesc, Turns, Worker};
use crate::asset::Asset;
use crate::render::raster::Stats;
use crate::scene::Camera;
use crate::time;
use glam::{DAffine3, DVec3};

/// Relative to the character's size, and to one for directions: what the eye takes for the same pose.
const SAME: f64 = 2e-3;

/// The point of the world where the character stands: what a game puts on its ground.
///
/// It is as high as the lowest vertex of the clip (of the rest pose for `None`), and lies below the world's origin if that is within the
/// character's bounds over the clip or up to a tenth of their size beside them; else below their middle.
///
/// # Panics
/// If the asset has no such clip.
pub fn ground_point(asset: &Asset, clip: Option<usize>) -> DVec3 {
    let mut worker = Worker::default();
    worker.evaluate(asset, clip, clip.map_or(0.0, |c| asset.character.clips()[c].playback().start));
    let center = asset.character.center(&worker.posed);
    let [low, high] = fit::bounds(&Span { asset, clip, center, shapes: None }, None, &mut worker);
    if !low.is_finite() {
        return DVec3::ZERO;
    }
    let (low, high) = (low.as_dvec3() + center, high.as_dvec3() + center);
    let beside = (high - low).max_element() * 0.1;
    let near = |low: f64, high: f64| (low - beside..=high + beside).contains(&0.0);
    let stands = near(low.x, high.x) && near(low.z, high.z);
    let below = if stands { DVec3::ZERO } else { (low + high) * 0.5 };
    DVec3::new(below.x, low.y, below.z)
}

impl ShotDesc {
    /// The same, with a framing that holds the character from each of `sides` directions, unless it holds some already.
    ///
    /// # Panics
    /// If the asset has no such clip.
    pub fn from_sides(mut self, asset: &Asset, sides: u32) -> Self {
        if sides > 1 && self.framing.turns == Turns::None {
            self.framing.turns = Turns::Each(sides);
            self.framing.pivot = Pivot::At(ground_point(asset, self.clip));
        }
        self
    }
}

impl Shot<'_> {
    /// Where a point of the world is in the picture of a moment, as it is cropped: fractions of its width and height from the top left,
    /// possibly outside. `None` behind the eye.
    pub fn project(&self, moment: impl Into<Moment>, point: DVec3, worker: &mut Worker) -> Option<[f64; 2]> {
        let mut camera: Option<Camera> = None;
        self.with_scene(moment.into(), worker, |scene, _| {
            camera = Some(scene.camera);
            Stats::default()
        });
        let settings = &self.desc.settings;
        let aspect = settings.width as f32 / settings.height.max(1) as f32;
        let p = camera?.clip_from_scene(aspect).as_dmat4() * (point - self.center).extend(1.0);
        let part = self.part(self.desc.crop);
        let within = |whole: usize, first: usize, n: usize, x: f64| {
            (x * whole as f64 - first as f64) / n.max(1) as f64
        };
        let [x, y] = [0.5 + 0.5 * p.x / p.w, 0.5 - 0.5 * p.y / p.w];
        let across = within(settings.width, part.x, part.width, x);
        (p.w > 0.0).then(|| [across, within(settings.height, part.y, part.height, y)])
    }

    /// Whether the clip's end looks like its start, so that it may be shown again and again.
    ///
    /// Bones may differ by two thousandths of the character's size, and of one in direction. The rest pose does not move, and is no loop.
    pub fn loops(&self, worker: &mut Worker) -> bool {
        let Some(clip) = self.desc.clip else { return false };
        if self.desc.wrap == time::Wrap::Loop {
            return true;
        }
        let mut at = |t: f64| {
            worker.evaluate(self.asset, Some(clip), t);
            let bones = self.asset.character.skeleton().ids();
            (bones.map(|b| worker.posed.world_from_bone(b)).collect::<Vec<_>>(), worker.pose.weights.clone())
        };
        let (start, end) = (at(self.range.start), at(self.range.end));
        let size = extent(&start.0);
        let still = start.1.iter().zip(&end.1).all(|(a, b)| (a - b).abs() <= SAME as f32);
        still && start.0.iter().zip(&end.0).all(|(a, b)| same(a, b, size))
    }
}

/// The longest side of the box around the bones, metres; one for a lone bone.
fn extent(bones: &[DAffine3]) -> f64 {
    let low = bones.iter().map(|b| b.translation).reduce(|a, b| a.min(b)).unwrap_or_default();
    let high = bones.iter().map(|b| b.translation).reduce(|a, b| a.max(b)).unwrap_or_default();
    let size = (high - low).max_element();
    if size > 0.0 { size } else { 1.0 }
}

fn same(a: &DAffine3, b: &DAffine3, size: f64) -> bool {
    let scale = a.matrix3.x_axis.length().max(1e-12);
    let turned = (0..3).all(|i| (a.matrix3.col(i) - b.matrix3.col(i)).length() <= SAME * scale);
    turned && (a.translation - b.translation).length() <= SAME * size
}
