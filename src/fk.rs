//! Forward kinematics: from a pose to where every bone stands in the world.

use crate::math::Trs;
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Mat3A};

/// `world_from_bone` of every bone: linear parts in f32, origins in f64.
///
/// Turning and scaling is composed bone-local in f32; origins are added up in f64. Whatever two bones have in common
/// above them, a placement 10,000 km away included, enters both alike and cancels when they are compared.
#[derive(Clone, Debug, Default)]
pub struct Posed {
    linear: Vec<Mat3A>,
    origin: Vec<DVec3>,
}

impl Posed {
    /// Number of bones.
    pub fn len(&self) -> usize {
        self.linear.len()
    }

    /// There are no bones.
    pub fn is_empty(&self) -> bool {
        self.linear.is_empty()
    }

    /// `world_from_bone`, whole.
    pub fn world_from_bone(&self, bone: BoneId) -> DAffine3 {
        let m = self.linear[bone.index()];
        DAffine3 {
            matrix3: DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3()),
            translation: self.origin[bone.index()],
        }
    }

    /// Where the bone's origin stands in the world, metres.
    pub fn origin(&self, bone: BoneId) -> DVec3 {
        self.origin[bone.index()]
    }

    /// `local_from_bone`, where `local` has the world's axes and its origin at `center`.
    ///
    /// Deforming and drawing happen near a centre of the character's own choice, so f32 suffices there.
    #[inline]
    pub fn near(&self, bone: BoneId, center: DVec3) -> Affine3A {
        let i = bone.index();
        Affine3A { matrix3: self.linear[i], translation: (self.origin[i] - center).as_vec3a() }
    }
}

/// Evaluate all bones: `world_from_bone[i] = world_from_bone[parent] · parent_from_bone[i]`, roots from the placement.
///
/// Error of a chain of `n` bones and length `L` against exact arithmetic: at most `2εL√n` at the tip, `ε = 2⁻²³`.
///
/// ```
/// use sinew::{fk, pose::Pose, skeleton::{BoneDesc, Skeleton}};
/// use glam::{DVec3, Vec3};
/// // shoulder ──1 m──► elbow, the shoulder bent by 90° (x turns to y).
/// let mut elbow = BoneDesc { parent: Some(0), ..BoneDesc::new("elbow") };
/// elbow.rest.translation = Vec3::X;
/// let (skeleton, of) = Skeleton::new(vec![BoneDesc::new("shoulder"), elbow]).unwrap();
/// let mut pose = Pose::rest(&skeleton);
/// pose.set_xzx(&skeleton, of[0], Vec3::new(0.0, std::f32::consts::FRAC_PI_2, 0.0));
/// let mut posed = fk::Posed::default();
/// fk::forward(&skeleton, &pose, &mut posed);
/// assert!((posed.origin(of[1]) - DVec3::Y).length() < 1e-6);
/// ```
///
/// # Panics
/// If `pose` has not one transform a bone.
pub fn forward(skeleton: &Skeleton, pose: &Pose, posed: &mut Posed) {
    posed.linear.resize(skeleton.len(), Mat3A::IDENTITY);
    posed.origin.resize(skeleton.len(), DVec3::ZERO);
    run(skeleton, pose, posed, 0..skeleton.len());
}

/// Evaluate a bone and those below it again, after the pose of `bone` changed; the others are taken as they are.
///
/// # Panics
/// If `posed` was not made by [`forward`] for this skeleton.
pub fn forward_subtree(skeleton: &Skeleton, pose: &Pose, bone: BoneId, posed: &mut Posed) {
    assert_eq!(posed.len(), skeleton.len(), "forward() must have run before");
    run(skeleton, pose, posed, skeleton.subtree(bone));
}

fn run(skeleton: &Skeleton, pose: &Pose, posed: &mut Posed, range: std::ops::Range<usize>) {
    assert_eq!(pose.locals.len(), skeleton.len(), "a pose needs one transform a bone");
    for i in range {
        let bone = BoneId(i as u32);
        let (linear, translation) = match skeleton.fixed(bone) {
            Some(m) => (m.matrix3, m.translation),
            None => (pose.locals[i].linear(), pose.locals[i].translation.into()),
        };
        match skeleton.parent(bone) {
            Some(p) => {
                let parent = posed.linear[p.index()];
                posed.linear[i] = parent * linear;
                posed.origin[i] = posed.origin[p.index()] + (parent * translation).as_dvec3();
            }
            None => {
                let place = &pose.placement;
                let axes = place.matrix3;
                posed.linear[i] =
                    Mat3A::from_cols(axes.x_axis.as_vec3a(), axes.y_axis.as_vec3a(), axes.z_axis.as_vec3a())
                        * linear;
                posed.origin[i] = place.transform_point3(translation.as_dvec3());
            }
        }
    }
}

/// The same in f64 throughout: the slow reference that [`forward`] is measured against.
pub fn forward_f64(skeleton: &Skeleton, pose: &Pose) -> Vec<DAffine3> {
    let mut out: Vec<DAffine3> = Vec::with_capacity(skeleton.len());
    for bone in skeleton.ids() {
        let local = match skeleton.fixed(bone) {
            Some(m) => widen(m),
            None => widen_trs(&pose.locals[bone.index()]),
        };
        let parent = skeleton.parent(bone).map_or(pose.placement, |p| out[p.index()]);
        out.push(parent * local);
    }
    out
}

/// The same matrix in f64.
pub(crate) fn widen(m: &Affine3A) -> DAffine3 {
    let a = m.matrix3;
    DAffine3 {
        matrix3: DMat3::from_cols(a.x_axis.as_dvec3(), a.y_axis.as_dvec3(), a.z_axis.as_dvec3()),
        translation: m.translation.as_dvec3(),
    }
}

fn widen_trs(t: &Trs) -> DAffine3 {
    let q = t.rotation.as_dquat().normalize();
    DAffine3::from_scale_rotation_translation(t.scale.as_dvec3(), q, t.translation.as_dvec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::BoneDesc;
    use glam::Vec3;

    /// ```text
    ///  y
    ///  │        2 (tip, 1 m on)
    ///  │        │
    ///  0 ──1m── 1      bone 1 bent by 90°
    ///  └──────────► x
    /// ```
    fn elbow() -> (Skeleton, Pose) {
        let mut list = vec![BoneDesc::new("0")];
        for k in 1..3 {
            let mut b = BoneDesc { parent: Some(k - 1), ..BoneDesc::new(k.to_string()) };
            b.rest.translation = Vec3::X;
            list.push(b);
        }
        let (s, of) = Skeleton::new(list).unwrap();
        let mut pose = Pose::rest(&s);
        pose.set_xzx(&s, of[1], Vec3::new(0.0, std::f32::consts::FRAC_PI_2, 0.0));
        (s, pose)
    }

    #[test]
    fn the_drawn_elbow() {
        let (s, pose) = elbow();
        let mut posed = Posed::default();
        forward(&s, &pose, &mut posed);
        // 2εL√n for two bones of 1 m.
        let bound = 2.0 * f32::EPSILON as f64 * 2.0 * 2.0_f64.sqrt();
        assert!((posed.origin(BoneId(2)) - DVec3::new(1.0, 1.0, 0.0)).length() < bound);
        assert!((posed.world_from_bone(BoneId(1)).matrix3.x_axis - DVec3::Y).length() < bound);
    }

    #[test]
    fn a_subtree_update_equals_a_whole_one() {
        let (s, mut pose) = elbow();
        let mut part = Posed::default();
        forward(&s, &pose, &mut part);
        pose.set_xzx(&s, BoneId(1), Vec3::new(0.3, -0.7, 1.0));
        forward_subtree(&s, &pose, BoneId(1), &mut part);
        let mut whole = Posed::default();
        forward(&s, &pose, &mut whole);
        for b in s.ids() {
            assert_eq!(part.world_from_bone(b), whole.world_from_bone(b));
        }
    }

    #[test]
    fn ten_thousand_kilometres_away_nothing_changes() {
        let (s, mut pose) = elbow();
        let mut home = Posed::default();
        forward(&s, &pose, &mut home);
        let far = DVec3::new(1e7, -1e7, 3e6);
        pose.placement = DAffine3::from_translation(far);
        let mut away = Posed::default();
        forward(&s, &pose, &mut away);
        for b in s.ids() {
            assert!((away.origin(b) - far - home.origin(b)).length() < 1e-8);
        }
    }
}
