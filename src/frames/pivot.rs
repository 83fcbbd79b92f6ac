//! Where the character stands in its pictures, and whether its clip comes back to where it began.

use super::{Moment, Shot, Worker};
use crate::render::raster::Stats;
use crate::scene::Camera;
use crate::time;
use glam::{DAffine3, Vec3};

/// Moments at which the lowest point is looked for.
const MOMENTS: usize = 33;

/// Relative to the character's size, and to one for directions: what the eye takes for the same pose.
const SAME: f64 = 2e-3;

impl Shot<'_> {
    /// The point of the ground that the character turns around, scene space: the axis of [`Moment::turn`] at the height of the lowest
    /// vertex of the clip.
    pub fn ground(&self, worker: &mut Worker) -> Vec3 {
        let character = &self.asset.character;
        let (mut lowest, mut points) = (f32::INFINITY, Vec::new());
        for k in 0..MOMENTS {
            let t = self.range.start + self.range.duration() * k as f64 / (MOMENTS - 1) as f64;
            worker.evaluate(self.asset, self.desc.clip, t);
            let Worker { pose, posed, scratch, .. } = &mut *worker;
            for i in 0..character.instances().len() {
                character.positions(i, pose, posed, self.center, scratch, &mut points);
                lowest = points.iter().map(|p| p.y).filter(|y| y.is_finite()).fold(lowest, f32::min);
            }
            if self.range.duration() == 0.0 {
                break;
            }
        }
        Vec3::new(0.0, if lowest.is_finite() { lowest } else { 0.0 }, 0.0)
    }

    /// Where a point of scene space is in the picture of a moment: fractions of its width and height from the top left, possibly
    /// outside. `None` behind the eye.
    pub fn project(&self, moment: impl Into<Moment>, point: Vec3, worker: &mut Worker) -> Option<[f64; 2]> {
        let mut camera: Option<Camera> = None;
        self.with_scene(moment.into(), worker, |scene, _| {
            camera = Some(scene.camera);
            Stats::default()
        });
        let settings = &self.desc.settings;
        let aspect = settings.width as f32 / settings.height.max(1) as f32;
        let p = camera?.clip_from_scene(aspect).as_dmat4() * point.as_dvec3().extend(1.0);
        (p.w > 0.0).then(|| [0.5 + 0.5 * p.x / p.w, 0.5 - 0.5 * p.y / p.w])
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
