//! Levers: what errors of a bone's channels cost on the skin.

use super::{Bench, Gauge, Metric};
use crate::clip::Clip;
use crate::skeleton::BoneId;
use glam::{DVec3, Vec3};

/// What errors of a bone's channels cost.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Lever {
    /// Metres a radian: the distance from its origin to the farthest vertex that it or a bone below it moves; zero where it moves
    /// nothing.
    pub turn: f64,
    /// Metres a unit of translation: the scale of the frame that it stands in.
    pub shift: f64,
}

impl Gauge<'_> {
    /// The lever of each bone over these times of a clip.
    pub fn levers(&self, clip: &Clip, times: &[f64]) -> Vec<Lever> {
        let mut longest = vec![Lever::default(); self.character.skeleton().len()];
        let parts = self.chunks(times.len(), |bench, range| {
            range.map(|i| self.levers_at(clip, times[i], bench)).collect::<Vec<_>>()
        });
        for at in parts.into_iter().flatten() {
            for (l, now) in longest.iter_mut().zip(at) {
                *l = Lever { turn: l.turn.max(now.turn), shift: l.shift.max(now.shift) };
            }
        }
        longest
    }

    fn levers_at(&self, clip: &Clip, t: f64, bench: &mut Bench) -> Vec<Lever> {
        let c = self.character;
        let skeleton = c.skeleton();
        self.show(clip, t, &mut bench.shown[0]);
        let Bench { shown: [shown, _], scratch, positions: [p, _], .. } = bench;
        let (pose, posed) = (&shown.pose, &shown.posed);
        let center = c.center(posed);
        let mut boxes = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; skeleton.len()];
        if let Metric::Shell(radius) = self.metric {
            for bone in skeleton.ids() {
                let origin: Vec3 = posed.near(bone, center).translation.into();
                boxes[bone.index()] =
                    [Vec3::splat(-radius as f32), Vec3::splat(radius as f32)].map(|r| r + origin);
            }
        }
        for &(bone, _) in self.pins {
            let origin: Vec3 = posed.near(bone, center).translation.into();
            let b = &mut boxes[bone.index()];
            *b = [b[0].min(origin), b[1].max(origin)];
        }
        // The box around all that a bone moves holds those of its children.
        for instance in 0..c.instances().len() {
            c.positions(instance, pose, posed, center, scratch, p);
            for (v, p) in p.iter().enumerate() {
                for bone in c.bones_of(instance, v) {
                    let b = &mut boxes[bone.index()];
                    *b = [b[0].min(*p), b[1].max(*p)];
                }
            }
        }
        for bone in skeleton.ids().rev() {
            if let Some(parent) = skeleton.parent(bone) {
                let [lo, hi] = boxes[bone.index()];
                let b = &mut boxes[parent.index()];
                *b = [b[0].min(lo), b[1].max(hi)];
            }
        }
        let reach = |bone: BoneId| {
            let [lo, hi] = boxes[bone.index()];
            if lo.x > hi.x {
                return Lever::default();
            }
            let origin: DVec3 = posed.origin(bone) - center;
            let far = (lo.as_dvec3() - origin).abs().max((hi.as_dvec3() - origin).abs());
            let parent = skeleton.parent(bone).map(|p| posed.world_from_bone(p).matrix3);
            let stretch = |m: glam::DMat3| m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
            Lever { turn: far.length(), shift: parent.map_or(1.0, stretch) }
        };
        skeleton.ids().map(reach).collect()
    }
}
