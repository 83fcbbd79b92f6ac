//! How one bone turns: about any axis, or by three angles within limits.

use crate::math::euler::{rotation_from_xzx_f64, unwrap_xzx, xzx_from_rotation_f64};
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use glam::{DQuat, DVec3, Vec3};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) enum Joint {
    /// The rotation against the parent.
    Free(DQuat),
    Limited {
        theta: [f64; 3],
        min: [f64; 3],
        max: [f64; 3],
    },
}

/// Bends smaller than this leave the bend's direction open.
const UNBENT: f64 = 1e-4;

impl Joint {
    pub fn new(skeleton: &Skeleton, pose: &Pose, bone: BoneId) -> Self {
        let rotation = pose.locals[bone.index()].rotation.as_dquat().normalize();
        let Some(limits) = skeleton.limits(bone) else { return Self::Free(rotation) };
        let wide = |v: Vec3| v.as_dvec3().to_array();
        let (min, max) = (wide(limits.min.min(limits.max)), wide(limits.max.max(limits.min)));
        let frame = frame(skeleton, bone);
        let turn = frame.conjugate() * rotation * skeleton.aim(bone).as_dquat().normalize();
        Self::Limited { theta: fitting(turn, min, max), min, max }
    }

    pub fn rotation(&self, skeleton: &Skeleton, bone: BoneId) -> DQuat {
        match self {
            Self::Free(q) => *q,
            Self::Limited { theta, .. } => {
                let back = skeleton.aim(bone).as_dquat().normalize().conjugate();
                (frame(skeleton, bone) * rotation_from_xzx_f64(*theta) * back).normalize()
            }
        }
    }

    pub fn angles(&self) -> Option<Vec3> {
        match self {
            Self::Free(_) => None,
            // Rounding must not lead out of the limits.
            Self::Limited { theta, min, max } => {
                let narrow = |v: [f64; 3]| DVec3::from(v).as_vec3();
                Some(narrow(*theta).clamp(narrow(*min), narrow(*max)))
            }
        }
    }

    /// The axes that the three variables turn about, in the parent's frame.
    pub fn axes(&self, skeleton: &Skeleton, bone: BoneId) -> [DVec3; 3] {
        let Self::Limited { theta: [_, t2, t3], .. } = *self else { return DVec3::AXES };
        let frame = frame(skeleton, bone);
        let outer = frame * DQuat::from_rotation_x(t3);
        [outer * DQuat::from_rotation_z(t2) * DVec3::X, outer * DVec3::Z, frame * DVec3::X]
    }

    /// Whether a limit is in the way of that change.
    pub fn is_held(&self, variable: usize, change: f64) -> bool {
        match self {
            Self::Free(_) => false,
            Self::Limited { theta, min, max } => {
                let t = theta[variable];
                (change <= 0.0 && t <= min[variable]) || (change >= 0.0 && t >= max[variable])
            }
        }
    }

    pub fn turn(&mut self, by: DVec3) {
        match self {
            Self::Free(q) => *q = (DQuat::from_scaled_axis(by) * *q).normalize(),
            Self::Limited { theta, min, max } => {
                for k in 0..3 {
                    theta[k] = (theta[k] + by[k]).clamp(min[k], max[k]);
                }
            }
        }
    }

    pub fn is_locked(&self) -> bool {
        matches!(self, Self::Limited { theta, .. } if theta[1].sin().abs() < UNBENT)
    }

    /// Share the twist σ out between θ₁ and θ₃, as far as limits allow, so that the bend's axis `Rx(θ₃)·z` lies along the torque
    /// `pull` (parent's frame).
    pub fn unlock(&mut self, skeleton: &Skeleton, bone: BoneId, pull: DVec3) {
        let Self::Limited { theta, min, max } = self else { return };
        let pull = frame(skeleton, bone).conjugate() * pull;
        if theta[1].cos() < 0.0 || pull.y.hypot(pull.z) < 1e-12 {
            return;
        }
        let sum = theta[0] + theta[2];
        let (low, high) = (min[2].max(sum - max[0]), max[2].min(sum - min[0]));
        let along = f64::atan2(-pull.y, pull.z);
        // The same axis the other way round is bent about backwards.
        let score = |t: f64, bend: f64| (t - along).cos() * bend;
        let bends = [(1.0, max[1] > theta[1] + UNBENT), (-1.0, min[1] < theta[1] - UNBENT)];
        let mut best: Option<(f64, f64)> = None;
        for (bend, _) in bends.into_iter().filter(|b| b.1 && low <= high) {
            for k in -2..=2 {
                let wish = along + if bend < 0.0 { PI } else { 0.0 } + f64::from(k) * 2.0 * PI;
                let t = wish.clamp(low, high);
                let s = score(t, bend);
                let nearer = |b: (f64, f64)| {
                    s > b.0 + 1e-9 || (s > b.0 - 1e-9 && (t - theta[2]).abs() < (b.1 - theta[2]).abs())
                };
                if best.is_none_or(nearer) {
                    best = Some((s, t));
                }
            }
        }
        if let Some((_, t)) = best {
            (theta[0], theta[2]) = ((sum - t).clamp(min[0], max[0]), t);
        }
    }

    /// Bend a little, another way each `time`.
    pub fn nudge(&mut self, time: usize, place: usize) {
        let size = [0.3, -0.3, 0.9, -0.9][time % 4] * if place.is_multiple_of(2) { 1.0 } else { -2.0 };
        match self {
            Self::Free(_) => self.turn(if time.is_multiple_of(2) { DVec3::Z } else { DVec3::Y } * size),
            Self::Limited { theta, min, max } => {
                for k in 0..3 {
                    let (room, way) =
                        ((max[k] - min[k]).min(2.0 * PI), if k == 1 { size } else { -0.5 * size });
                    theta[k] = (theta[k] + way.clamp(-0.5 * room, 0.5 * room)).clamp(min[k], max[k]);
                }
            }
        }
    }
}

/// `parent_from_aim` at rest.
fn frame(skeleton: &Skeleton, bone: BoneId) -> DQuat {
    (skeleton.rest(bone).rotation.as_dquat() * skeleton.aim(bone).as_dquat()).normalize()
}

/// The angles of a rotation that limits change least, within them.
fn fitting(turn: DQuat, min: [f64; 3], max: [f64; 3]) -> [f64; 3] {
    let middle = [0, 1, 2].map(|k| 0.5 * (min[k].max(-10.0) + max[k].min(10.0)));
    let one = xzx_from_rotation_f64(turn, None);
    let other = [one[0] + PI, -one[1], one[2] + PI];
    let mut choices = vec![unwrap_xzx(one, [0.0; 3]), unwrap_xzx(one, middle), one];
    choices.extend([
        other,
        [other[0] - 2.0 * PI, other[1], other[2]],
        [other[0], other[1], other[2] - 2.0 * PI],
    ]);
    choices.push([other[0] - 2.0 * PI, other[1], other[2] - 2.0 * PI]);
    if one[1].abs() < UNBENT {
        // Without a bend only the sum of the twists counts.
        let sum = one[0] + one[2];
        choices.extend([sum, sum - 2.0 * PI, sum + 2.0 * PI].map(|sum| {
            let last = (sum - 0.0_f64.clamp(min[0], max[0])).clamp(min[2], max[2]);
            [sum - last, one[1], last]
        }));
    }
    let clamped = |t: [f64; 3]| [0, 1, 2].map(|k| t[k].clamp(min[k], max[k]));
    let off = |t: &[f64; 3]| {
        let q = rotation_from_xzx_f64(clamped(*t));
        let d = q.conjugate() * turn;
        d.xyz().length().atan2(d.w.abs())
    };
    let best = choices.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    clamped(best.unwrap_or(one))
}
