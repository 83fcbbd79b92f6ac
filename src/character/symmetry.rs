//! The pose that a character was skinned in, and its mirror.

use super::{Binding, Character};
use crate::fk;
use crate::math::Trs;
use crate::pose::{Pose, mirror::Mirror};
use glam::DAffine3;

impl Character {
    /// The pose in which skins leave their meshes as they were modelled: `world_from_bone = bone_from_mesh⁻¹`, hung up by the rest
    /// pose's first bones. Bones of no skin are at rest.
    pub fn bind_pose(&self) -> Pose {
        let skeleton = self.skeleton();
        let mut bound: Vec<Option<DAffine3>> = vec![None; skeleton.len()];
        for i in &self.instances {
            let Binding::Skin { palette, .. } = &i.binding else { continue };
            for (b, bone_from_mesh) in palette {
                let mesh_from_bone = fk::widen(bone_from_mesh).inverse();
                let slot = &mut bound[b.index()];
                *slot = slot.or(Some(mesh_from_bone).filter(|m| m.is_finite()));
            }
        }
        let mut pose = self.rest_pose();
        for b in skeleton.ids() {
            let rest = pose.locals[b.index()].to_affine();
            let Some(parent) = skeleton.parent(b).and_then(|p| bound[p.index()]) else { continue };
            let Some(own) = bound[b.index()] else {
                bound[b.index()] = Some(parent * fk::widen(skeleton.fixed(b).unwrap_or(&rest)));
                continue;
            };
            let (scale, rotation, translation) = (parent.inverse() * own).to_scale_rotation_translation();
            let local = Trs {
                translation: translation.as_vec3(),
                rotation: rotation.normalize().as_quat(),
                scale: scale.as_vec3(),
            };
            if local.is_finite() {
                pose.locals[b.index()] = local;
            }
        }
        pose
    }

    /// Left and right of this character, which is taken to be symmetric as it was skinned.
    pub fn mirror(&self) -> Mirror {
        Mirror::about(self.skeleton(), &self.bind_pose(), None)
    }
}
