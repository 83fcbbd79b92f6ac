//! The other way round: left does what right did.
//!
//! With `W` the world rotations of a reference pose in which the character is symmetric, `M` the reflection in its plane of symmetry,
//! and `b'` the partner of bone `b`, a posed bone's turn `D_b = P_b W_b⁻¹` becomes `D_b' = M D_b M`. Parents turn alike, so all of it
//! is local: `r_b' = W_p'⁻¹ · M(W_p r_b W_b⁻¹)M · W_b'`, `p` the parent. This is linear in `r_b`, so that a curve is mirrored by its
//! keys; and mirrored twice it is what it was.

use super::{Pose, sides};
use crate::math::{Trs, euler};
use crate::skeleton::{BoneId, Skeleton};
use glam::{Affine3A, DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// How a character is mirrored: pairs of bones by their names, and a plane through the origin.
#[derive(Clone, Debug)]
pub struct Mirror {
    normal: DVec3,
    parts: Vec<Part>,
    alone: Vec<BoneId>,
}

/// What becomes of one bone.
#[derive(Clone, Debug)]
struct Part {
    pair: BoneId,
    /// World rotations of the parent and of its partner in the reference.
    parent: [DQuat; 2],
    /// `rotation' = around[0] · M rotation M · around[1]`.
    around: [DQuat; 2],
    /// Translation of the bone and of its partner in the reference.
    home: [Vec3; 2],
    /// Which axis of the bone each axis of its partner is.
    axes: [usize; 3],
    /// `R(θ') = turn[0] · R(−θ₁, θ₂, −θ₃) · turn[1]`.
    turn: [DQuat; 2],
    /// The same in angles, where the bone runs along the mirror image of its partner.
    twist: Option<Twist>,
}

/// `θ' = (b − θ₁, ±θ₂, a − θ₃)`.
#[derive(Clone, Copy, Debug)]
struct Twist {
    add: Vec3,
    sign: Vec3,
}

impl Mirror {
    /// Mirror about the rest pose.
    ///
    /// ```
    /// use glam::Vec3;
    /// use sinew::{pose::{Pose, mirror::Mirror}, skeleton::{BoneDesc, Skeleton}};
    /// let arm = |name: &str, x: f32| {
    ///     let mut bone = BoneDesc { parent: Some(0), ..BoneDesc::new(name) };
    ///     bone.rest.translation.x = x;
    ///     bone
    /// };
    /// let (skeleton, of) = Skeleton::new(vec![BoneDesc::new("chest"), arm("arm.L", 0.2), arm("arm.R", -0.2)]).unwrap();
    /// let mut pose = Pose::rest(&skeleton);
    /// pose.locals[of[1].index()].translation = Vec3::new(0.5, 0.1, 0.0);
    /// let mirrored = Mirror::new(&skeleton).pose(&pose);
    /// assert_eq!(mirrored.locals[of[2].index()].translation, Vec3::new(-0.5, 0.1, 0.0));
    /// ```
    pub fn new(skeleton: &Skeleton) -> Self {
        Self::about(skeleton, &Pose::rest(skeleton), None)
    }

    /// Mirror about a pose in which the character is symmetric, in the plane through the origin with that normal. Without one it is
    /// the mean direction from the right bones to the left ones, taken as an axis of the world if it is within 8° of it, and x
    /// where there are no pairs.
    ///
    /// # Panics
    /// If the pose has not one transform a bone.
    pub fn about(skeleton: &Skeleton, reference: &Pose, normal: Option<Vec3>) -> Self {
        let (pairs, alone) = sides::pairs(skeleton);
        let world = worlds(skeleton, reference);
        let normal = normal.and_then(|n| n.as_dvec3().try_normalize());
        let normal = normal.unwrap_or_else(|| across(skeleton, &pairs, &world));
        let build = |b: BoneId| part(skeleton, reference, &world, b, pairs[b.index()], normal);
        Self { normal, parts: skeleton.ids().map(build).collect(), alone }
    }

    /// Unit normal of the plane of symmetry, world space.
    pub fn normal(&self) -> Vec3 {
        self.normal.as_vec3()
    }

    /// The bone on the other side; itself for a bone in the middle.
    pub fn pair(&self, bone: BoneId) -> BoneId {
        self.parts[bone.index()].pair
    }

    /// Bones whose names say a side and that have no partner: they are mirrored in place.
    pub fn alone(&self) -> &[BoneId] {
        &self.alone
    }

    /// What the partner's local rotation becomes; linear, so that slopes may be given as well.
    pub fn rotation(&self, bone: BoneId, rotation: Quat) -> Quat {
        let p = &self.parts[bone.index()];
        (p.around[0] * flipped(rotation.as_dquat(), self.normal) * p.around[1]).as_quat()
    }

    /// What the partner's local translation becomes.
    pub fn translation(&self, bone: BoneId, translation: Vec3) -> Vec3 {
        let [own, other] = self.parts[bone.index()].home;
        other + self.vector(bone, translation - own)
    }

    /// What a difference or slope of the bone's translations becomes.
    pub fn vector(&self, bone: BoneId, v: Vec3) -> Vec3 {
        let [own, other] = self.parts[bone.index()].parent;
        let v = own * v.as_dvec3();
        (other.conjugate() * (v - 2.0 * v.dot(self.normal) * self.normal)).as_vec3()
    }

    /// What the partner's local scale becomes.
    pub fn scale(&self, bone: BoneId, scale: Vec3) -> Vec3 {
        Vec3::from_array(self.parts[bone.index()].axes.map(|k| scale[k]))
    }

    /// What the partner's XZX angles become. Exact and linear where the bones of the pair are mirror images of each other
    /// ([`is_plain`](Self::is_plain)), else the solution nearest to `previous`.
    pub fn xzx(&self, bone: BoneId, theta: Vec3, previous: Option<Vec3>) -> Vec3 {
        let p = &self.parts[bone.index()];
        if let Some(t) = p.twist {
            return t.add + t.sign * theta;
        }
        let t = theta.as_dvec3();
        let turn = p.turn[0] * euler::rotation_from_xzx_f64([-t.x, t.y, -t.z]) * p.turn[1];
        let previous = previous.map(|t| t.as_dvec3().to_array());
        let found = euler::xzx_from_rotation_f64(turn, previous);
        DVec3::from(previous.map_or(found, |p| euler::unwrap_xzx(found, p))).as_vec3()
    }

    /// What a slope of the bone's XZX angles becomes; `None` where that depends on the angles.
    pub fn xzx_slope(&self, bone: BoneId, slope: Vec3) -> Option<Vec3> {
        self.parts[bone.index()].twist.map(|t| t.sign * slope)
    }

    /// Whether XZX curves of the bone are mirrored by their keys, exactly.
    pub fn is_plain(&self, bone: BoneId) -> bool {
        self.parts[bone.index()].twist.is_some()
    }

    /// The pose the other way round; morph weights stay.
    ///
    /// # Panics
    /// If the pose is of another skeleton.
    pub fn pose(&self, pose: &Pose) -> Pose {
        assert_eq!(pose.locals.len(), self.parts.len(), "a pose of another skeleton");
        let mut out = pose.clone();
        for (i, local) in pose.locals.iter().enumerate() {
            let bone = BoneId(i as u32);
            out.locals[self.pair(bone).index()] = Trs {
                translation: self.translation(bone, local.translation),
                rotation: self.rotation(bone, local.rotation).normalize(),
                scale: self.scale(bone, local.scale),
            };
        }
        let n = self.normal;
        let m = DAffine3::from_mat3(DMat3::IDENTITY - 2.0 * DMat3::from_cols(n * n.x, n * n.y, n * n.z));
        out.placement = m * pose.placement * m;
        out
    }
}

/// Rotation and origin of every bone in the world; scales are left out.
fn worlds(skeleton: &Skeleton, pose: &Pose) -> Vec<(DQuat, DVec3)> {
    let mut out: Vec<(DQuat, DVec3)> = Vec::with_capacity(skeleton.len());
    for b in skeleton.ids() {
        let (turn, at) = match skeleton.fixed(b) {
            Some(m) => fixed(m),
            None => (pose.locals[b.index()].rotation, pose.locals[b.index()].translation),
        };
        let (up, origin) = skeleton.parent(b).map_or((DQuat::IDENTITY, DVec3::ZERO), |p| out[p.index()]);
        out.push(((up * turn.as_dquat()).normalize(), origin + up * at.as_dvec3()));
    }
    out
}

fn fixed(m: &Affine3A) -> (Quat, Vec3) {
    let turn = m.to_scale_rotation_translation().1;
    (if turn.is_finite() { turn } else { Quat::IDENTITY }, m.translation.into())
}

/// The direction from right to left.
fn across(skeleton: &Skeleton, pairs: &[BoneId], world: &[(DQuat, DVec3)]) -> DVec3 {
    let left = |b: &BoneId| sides::side_of(skeleton.name(*b)).is_some_and(|s| s.0 == sides::Side::Left);
    let apart = |b: BoneId| world[b.index()].1 - world[pairs[b.index()].index()].1;
    let sum: DVec3 = skeleton.ids().filter(left).map(apart).sum();
    let n = sum.try_normalize().unwrap_or(DVec3::X);
    DVec3::AXES.into_iter().find(|a| n.dot(*a).abs() > 0.99).unwrap_or(n)
}

/// `M q M`: the axis is reflected and the angle negated.
fn flipped(q: DQuat, n: DVec3) -> DQuat {
    let v = q.xyz();
    let v = 2.0 * v.dot(n) * n - v;
    DQuat::from_xyzw(v.x, v.y, v.z, q.w)
}

fn part(
    skeleton: &Skeleton,
    reference: &Pose,
    world: &[(DQuat, DVec3)],
    bone: BoneId,
    pair: BoneId,
    n: DVec3,
) -> Part {
    let above = |b: BoneId| skeleton.parent(b).map_or(DQuat::IDENTITY, |p| world[p.index()].0);
    let (parent, own) = ([above(bone), above(pair)], [bone, pair].map(|b| world[b.index()].0));
    let around = [parent[1].conjugate() * flipped(parent[0], n), flipped(own[0], n).conjugate() * own[1]];

    // rest' aim' R(θ') aim'⁻¹ = around[0] · M(rest aim R(θ) aim⁻¹)M · around[1], and M = h Mz with a rotation h.
    let rest = [bone, pair].map(|b| skeleton.rest(b).rotation.as_dquat().normalize());
    let aim = [bone, pair].map(|b| skeleton.aim(b).as_dquat().normalize());
    let g = DQuat::from_rotation_arc(DVec3::Z, n);
    let h = g * flipped(g, DVec3::Z).conjugate();
    let before = (rest[1] * aim[1]).conjugate() * around[0] * flipped(rest[0] * aim[0], n) * h;
    let after = h.conjugate() * flipped(aim[0], n).conjugate() * around[1] * aim[1];
    let home = [bone, pair].map(|b| reference.locals[b.index()].translation);
    let turn = [before, after];
    Part { pair, parent, around, home, axes: axes(own, n), turn, twist: twist(turn) }
}

/// The angles by which two turns about x stand for the turns themselves.
fn twist([before, after]: [DQuat; 2]) -> Option<Twist> {
    let about_x = |q: DQuat| (q.y.hypot(q.z) < 1e-5).then(|| 2.0 * (q.x / q.w).atan());
    let (a, b) = (about_x(before)?, about_x(after)?);
    // (θ₁ + π, −θ₂, θ₃ + π) is the same rotation: the nearer to the old angles is taken.
    let half = |t: f64| t - PI * t.signum();
    let (a, b, bend) = if a.abs() > FRAC_PI_2 + 1e-4 { (half(a), half(b), -1.0) } else { (a, b, 1.0) };
    let small = |t: f64| if t.abs() < 1e-6 { 0.0 } else { t as f32 };
    Some(Twist { add: Vec3::new(small(b), 0.0, small(a)), sign: Vec3::new(-1.0, bend, -1.0) })
}

/// Which axis of a bone is which of its partner; as they are where none is near another.
fn axes(own: [DQuat; 2], n: DVec3) -> [usize; 3] {
    let near = |k: usize| {
        let image = own[1] * DVec3::AXES[k];
        let image = own[0].conjugate() * (image - 2.0 * image.dot(n) * n);
        (0..3).find(|&i| image[i] * image[i] > 0.5)
    };
    match [near(0), near(1), near(2)] {
        [Some(x), Some(y), Some(z)] if x != y && y != z && x != z => [x, y, z],
        _ => [0, 1, 2],
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::math::rotation::angle_between;
    use crate::skeleton::BoneDesc;
    use crate::test_rng::Rng;

    pub(crate) fn turn(rng: &mut Rng) -> Quat {
        let v = rng.point(1.0).normalize_or(Vec3::X);
        Quat::from_axis_angle(v, rng.unit() * 3.0)
    }

    /// Hips, a spine, two legs and two arms of two bones: symmetric in x, every frame turned as it likes; with `plain`, bones
    /// run along each other's images.
    pub(crate) fn body(rng: &mut Rng, plain: bool) -> Skeleton {
        type Row = (Option<usize>, &'static str, [f32; 3], [f32; 3]);
        let heads: [Row; 10] = [
            (None, "hips", [0.0, 1.0, 0.0], [0.0, 1.2, 0.0]),
            (Some(0), "spine", [0.0, 1.2, 0.0], [0.0, 1.5, 0.1]),
            (Some(1), "arm.L", [0.2, 1.5, 0.0], [0.5, 1.4, 0.1]),
            (Some(2), "hand.L", [0.5, 1.4, 0.1], [0.7, 1.3, 0.0]),
            (Some(1), "arm.R", [-0.2, 1.5, 0.0], [-0.5, 1.4, 0.1]),
            (Some(4), "hand.R", [-0.5, 1.4, 0.1], [-0.7, 1.3, 0.0]),
            (Some(0), "leg.L", [0.1, 1.0, 0.0], [0.1, 0.5, 0.1]),
            (Some(6), "shin.L", [0.1, 0.5, 0.1], [0.1, 0.0, 0.0]),
            (Some(0), "leg.R", [-0.1, 1.0, 0.0], [-0.1, 0.5, 0.1]),
            (Some(8), "shin.R", [-0.1, 0.5, 0.1], [-0.1, 0.0, 0.0]),
        ];
        let world: Vec<(Quat, Vec3)> = heads.iter().map(|h| (turn(rng), Vec3::from(h.2))).collect();
        let bone = |(i, h): (usize, &Row)| {
            let (turned, at) = world[i];
            let (up, origin) = h.0.map_or((Quat::IDENTITY, Vec3::ZERO), |p| world[p]);
            let along = Vec3::from(h.3) - at;
            let frame = Quat::from_rotation_arc(Vec3::X, along.normalize());
            let aim = turned.conjugate() * frame * Quat::from_rotation_x(rng.unit() * 3.0);
            let rest = Trs {
                translation: up.conjugate() * (at - origin),
                rotation: up.conjugate() * turned,
                scale: Vec3::ONE,
            };
            let aim = if plain { aim } else { turn(rng) };
            BoneDesc { parent: h.0, rest, aim, length: along.length(), ..BoneDesc::new(h.1) }
        };
        Skeleton::new(heads.iter().enumerate().map(bone).collect()).unwrap().0
    }

    fn posed(s: &Skeleton, rng: &mut Rng) -> Pose {
        let mut pose = Pose::rest(s);
        for l in &mut pose.locals {
            l.rotation = turn(rng);
            l.translation += rng.point(0.1);
        }
        pose.placement = DAffine3::from_rotation_translation(turn(rng).as_dquat(), rng.point(5.0).as_dvec3());
        pose
    }

    /// Every joint stands where the mirror image of its partner's stood, and twice is the identity.
    #[test]
    fn joints_are_mirror_images_whatever_the_frames() {
        let mut rng = Rng::new(1);
        for k in 0..50 {
            let s = body(&mut rng, k % 2 == 0);
            let m = Mirror::new(&s);
            assert_eq!(m.normal(), Vec3::X);
            let pose = posed(&s, &mut rng);
            let other = m.pose(&pose);
            let place = |p: &Pose, b: BoneId| p.placement.transform_point3(worlds(&s, p)[b.index()].1);
            for b in s.ids() {
                let (p, q) = (place(&pose, b), place(&other, m.pair(b)));
                assert!((p * DVec3::new(-1.0, 1.0, 1.0) - q).length() < 2e-6, "{}: {p} {q}", s.name(b));
            }
            let back = m.pose(&other);
            for (a, b) in pose.locals.iter().zip(&back.locals) {
                assert!(angle_between(a.rotation, b.rotation) < 2e-6);
                assert!((a.translation - b.translation).length() < 1e-6);
            }
        }
    }

    #[test]
    fn angles_are_mirrored_as_rotations_are() {
        let mut rng = Rng::new(2);
        for k in 0..50 {
            let plain = k % 2 == 0;
            let s = body(&mut rng, plain);
            let m = Mirror::new(&s);
            for b in s.ids() {
                let sided = m.pair(b) != b;
                assert!(!plain || !sided || m.is_plain(b), "{}", s.name(b));
                let theta = rng.point(3.0);
                let mut pose = Pose::rest(&s);
                pose.set_xzx(&s, b, theta);
                let want = m.rotation(b, pose.locals[b.index()].rotation);
                let found = m.xzx(b, theta, None);
                pose.set_xzx(&s, m.pair(b), found);
                let e = angle_between(want, pose.locals[m.pair(b).index()].rotation);
                assert!(e < 4e-6, "{} {e}", s.name(b));
            }
        }
    }

    #[test]
    fn scales_change_places_with_the_axes() {
        let mut list = vec![BoneDesc::new("a.L"), BoneDesc::new("a.R")];
        list[0].rest.translation.x = 1.0;
        list[1].rest.translation.x = -1.0;
        list[1].rest.rotation = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let (s, of) = Skeleton::new(list).unwrap();
        let m = Mirror::new(&s);
        assert_eq!(m.scale(of[0], Vec3::new(2.0, 3.0, 4.0)), Vec3::new(3.0, 2.0, 4.0));
        assert_eq!(m.scale(of[1], Vec3::new(3.0, 2.0, 4.0)), Vec3::new(2.0, 3.0, 4.0));
    }
}
