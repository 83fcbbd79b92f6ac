//! A pose: one set of channels a bone, and the weights of the morph targets.

pub mod mirror;
pub mod sides;

use crate::math::{Trs, euler};
use crate::skeleton::{BoneId, Skeleton};
use glam::{DAffine3, Quat, Vec3};

/// Where every bone stands against its parent at one moment.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Pose {
    /// `parent_from_bone`, `B` of them.
    pub locals: Vec<Trs>,
    /// Morph-target weights of all meshes, one run a mesh instance (see `Character::instances`).
    pub weights: Vec<f32>,
    /// `world_from_root`: where the whole character stands. f64, and applied last, so that a character 10,000 km from
    /// the origin deforms as it does at home.
    pub placement: DAffine3,
}

impl Pose {
    /// The rest pose of a skeleton, without morph weights.
    pub fn rest(skeleton: &Skeleton) -> Self {
        let locals = skeleton.ids().map(|b| *skeleton.rest(b)).collect();
        Self { locals, weights: Vec::new(), placement: DAffine3::IDENTITY }
    }

    /// Turn a bone by XZX angles (radians) about its aim frame, from rest:
    /// `rotation = rest · aim · R(θ) · aim⁻¹`.
    pub fn set_xzx(&mut self, skeleton: &Skeleton, bone: BoneId, theta: Vec3) {
        let aim = skeleton.aim(bone);
        let turn = euler::rotation_from_xzx(theta);
        let rest = skeleton.rest(bone).rotation;
        self.locals[bone.index()].rotation = (rest * (aim * turn * aim.conjugate())).normalize();
    }

    /// The XZX angles of a bone; `previous` decides where they are not unique (near rest).
    pub fn xzx(&self, skeleton: &Skeleton, bone: BoneId, previous: Option<Vec3>) -> Vec3 {
        let aim = skeleton.aim(bone);
        let rest = skeleton.rest(bone).rotation;
        let turn: Quat = aim.conjugate() * (rest.conjugate() * self.locals[bone.index()].rotation) * aim;
        euler::xzx_from_rotation(turn, previous)
    }

    /// Blend towards `other` by `t` in 0…1: bone by bone, weights linearly; the placement stays.
    ///
    /// # Panics
    /// If the poses are of different characters (unequal numbers of bones or weights).
    pub fn blend(&self, other: &Self, t: f32) -> Self {
        assert_eq!(self.locals.len(), other.locals.len(), "poses of different skeletons");
        assert_eq!(self.weights.len(), other.weights.len(), "poses of different characters");
        Self {
            locals: self.locals.iter().zip(&other.locals).map(|(a, b)| a.lerp(b, t)).collect(),
            weights: self.weights.iter().zip(&other.weights).map(|(a, b)| a + (b - a) * t).collect(),
            placement: self.placement,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::angle_between;
    use crate::skeleton::BoneDesc;

    #[test]
    fn zero_angles_are_the_rest_pose_and_angles_come_back() {
        let mut bone = BoneDesc::new("leg");
        bone.rest.rotation = Quat::from_rotation_y(0.7);
        bone.aim = Quat::from_rotation_z(-1.2);
        let (s, of) = Skeleton::new(vec![bone]).unwrap();
        let mut pose = Pose::rest(&s);
        pose.set_xzx(&s, of[0], Vec3::ZERO);
        assert!(angle_between(pose.locals[0].rotation, s.rest(of[0]).rotation) < 1e-6);
        let theta = Vec3::new(0.4, 1.1, -0.9);
        pose.set_xzx(&s, of[0], theta);
        assert!((pose.xzx(&s, of[0], None) - theta).length() < 2e-6);
    }
}
