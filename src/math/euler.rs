//! XZX Euler angles: the only file that knows their order.
//!
//! `R(θ) = Rx(θ₃) · Rz(θ₂) · Rx(θ₁)`: twist about the bone by θ₁, bend by θ₂, twist again by θ₃ (notes §7.2, 7.7).
//! A triple is a `Vec3` holding `(θ₁, θ₂, θ₃)` in radians. The map is singular where θ₂ = 0 or π (at θ₂ = 0, the rest
//! pose, only θ₁ + θ₃ matters), so rotations are compared, never triples.

use glam::{DQuat, DVec2, Quat, Vec3};
use std::f64::consts::TAU;

/// The rotation of an XZX triple, computed in f64 after reducing the angles, so that 10⁹ turns cost no accuracy.
///
/// ```
/// use glam::{Quat, Vec3};
/// use sinew::math::{euler, rotation::angle_between};
/// // Twist 90°, bend 40°, twist back: a bend about y (notes §7.7).
/// let q = euler::rotation_from_xzx(Vec3::new(90_f32, 40.0, -90.0).map(f32::to_radians));
/// assert!(angle_between(q, Quat::from_rotation_y(40_f32.to_radians())) < 1e-6);
/// ```
pub fn rotation_from_xzx(theta: Vec3) -> Quat {
    rotation_from_xzx_f64([theta.x as f64, theta.y as f64, theta.z as f64]).as_quat()
}

/// [`rotation_from_xzx`] in f64; angles of any size are reduced modulo 2π first.
///
/// With `σ = (θ₃+θ₁)/2` and `δ = (θ₃−θ₁)/2` the product of the three half-angle quaternions is
/// `w = cos(θ₂/2)·cos σ`, `x = cos(θ₂/2)·sin σ`, `y = −sin(θ₂/2)·sin δ`, `z = sin(θ₂/2)·cos δ`.
pub fn rotation_from_xzx_f64(theta: [f64; 3]) -> DQuat {
    let [t1, t2, t3] = theta.map(|a| a % TAU);
    let (s, c) = (0.5 * t2).sin_cos();
    let (ss, cs) = (0.5 * (t3 + t1)).sin_cos();
    let (sd, cd) = (0.5 * (t3 - t1)).sin_cos();
    // Rx(t3)·Rz(t2)·Rx(t1) as a quaternion: i·k = −j turns the mixed terms into δ.
    DQuat::from_xyzw(c * ss, -s * sd, s * cd, c * cs)
}

/// An XZX triple of a unit quaternion, with θ₂ in 0…π.
///
/// Where the bend is too small (or too near π) to tell the twists apart, θ₃ is taken from `previous` (zero by
/// default) and θ₁ takes up the rest, so a rest pose stays at rest. Rebuilding the rotation errs by at most 1e-6 rad for
/// every θ₂, 0 and π included.
pub fn xzx_from_rotation(q: Quat, previous: Option<Vec3>) -> Vec3 {
    let prev = previous.map(|p| [p.x as f64, p.y as f64, p.z as f64]);
    let t = xzx_from_rotation_f64(q.as_dquat(), prev);
    Vec3::new(t[0] as f32, t[1] as f32, t[2] as f32)
}

/// [`xzx_from_rotation`] in f64.
pub fn xzx_from_rotation_f64(q: DQuat, previous: Option<[f64; 3]>) -> [f64; 3] {
    let q = q.normalize();
    // (w, x) carries cos(θ₂/2) and σ; (z, −y) carries sin(θ₂/2) and δ. hypot keeps both accurate at 0 and π.
    let (c, s) = (q.w.hypot(q.x), q.z.hypot(q.y));
    let t2 = 2.0 * s.atan2(c);
    // Below 1e-7 a direction is noise of the f32 input: keep θ₃ and let θ₁ follow from the half that is known.
    const TINY: f64 = 1e-7;
    let keep = previous.map_or(0.0, |p| p[2]);
    let sigma = 2.0 * q.x.atan2(q.w);
    let delta = 2.0 * (-q.y).atan2(q.z);
    let (t1, t3) = if s < TINY {
        (sigma - keep, keep)
    } else if c < TINY {
        (keep - delta, keep)
    } else {
        ((sigma - delta) * 0.5, (sigma + delta) * 0.5)
    };
    [near(t1, 0.0), t2, if s < TINY || c < TINY { t3 } else { near(t3, 0.0) }]
}

/// The triple of the same rotation that lies nearest to `previous`: whole turns are added, and the other solution
/// `(θ₁+π, −θ₂, θ₃+π)` is taken where it is nearer.
///
/// Near the rest pose the twists trade freely against each other, so the sum σ = θ₁+θ₃ and the difference δ = θ₃−θ₁ are
/// unwrapped, not the angles: unwrapping each angle alone flips a bone by 180° between frames.
pub fn unwrap_xzx(theta: [f64; 3], previous: [f64; 3]) -> [f64; 3] {
    let [p1, p2, p3] = previous;
    let sigma = near(theta[0] + theta[2], p1 + p3);
    let delta = near(theta[2] - theta[0], p3 - p1);

    // θ₁ and θ₃ moved by π·(shift of σ ± shift of δ): an odd sum is the other solution, whose bend is negated.
    let turns = (sigma - theta[0] - theta[2]) / TAU + (delta - theta[2] + theta[0]) / TAU;
    let bend = if (turns.round() as i64).rem_euclid(2) == 1 { -theta[1] } else { theta[1] };
    [(sigma - delta) * 0.5, near(bend, p2), (sigma + delta) * 0.5]
}

/// The four triples of a unit quaternion that lie nearest to `previous`, the nearest over all three angles first: whole turns and
/// the other solution `(θ₁+π, −θ₂, θ₃−π)` are tried together.
///
/// Where the bend is at most `slack` radians, all four are one: `previous` says how the twist is split, the bend is what lies in
/// its plane, and the rotation is off by at most `slack`. So noise about a rest pose does not swing the twists. Likewise near π.
///
/// ```
/// use sinew::math::euler::{nearest_xzx, rotation_from_xzx_f64};
/// // A bend that went through rest and on: the angle changes its sign, not its plane.
/// let q = rotation_from_xzx_f64([0.3, -0.2, 0.1]);
/// let t = nearest_xzx(q, [0.3, 0.2, 0.1], 1e-6)[0];
/// assert!((t[1] + 0.2).abs() < 1e-12 && (t[0] - 0.3).abs() < 1e-12);
/// ```
pub fn nearest_xzx(q: DQuat, previous: [f64; 3], slack: f64) -> [[f64; 3]; 4] {
    let [p1, p2, p3] = previous;
    // As in `xzx_from_rotation_f64`: two plane vectors, whose directions are σ/2 and δ/2.
    let (twist, bend) = (DVec2::new(q.w, q.x), DVec2::new(q.z, -q.y));
    let (c, s) = (twist.length(), bend.length());
    let (sigma, delta) = (2.0 * q.x.atan2(q.w), 2.0 * (-q.y).atan2(q.z));
    let triple =
        |sigma: f64, t2: f64, delta: f64| [(sigma - delta) * 0.5, near(t2, p2), (sigma + delta) * 0.5];
    let odd = |turned: f64, angle: f64| (((turned - angle) / TAU).round() as i64).rem_euclid(2) == 1;
    if 2.0 * s.atan2(c) <= slack {
        let near_sigma = near(sigma, p1 + p3);
        let along = bend.dot(DVec2::from_angle(0.5 * (p3 - p1)));
        let along = if odd(near_sigma, sigma) { -along } else { along };
        return [triple(near_sigma, 2.0 * along.atan2(c), p3 - p1); 4];
    }
    if 2.0 * c.atan2(s) <= slack {
        let near_delta = near(delta, p3 - p1);
        let along = twist.dot(DVec2::from_angle(0.5 * (p1 + p3)));
        let along = if odd(near_delta, delta) { -along } else { along };
        return [triple(p1 + p3, 2.0 * s.atan2(along), near_delta); 4];
    }
    let either = |angle: f64, reference: f64| {
        let first = near(angle, reference);
        [first, if first > reference { first - TAU } else { first + TAU }]
    };
    let (sigmas, deltas) = (either(sigma, p1 + p3), either(delta, p3 - p1));
    let mut all = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| {
        let flipped = odd(sigmas[i], sigma) != odd(deltas[j], delta);
        let t2 = 2.0 * s.atan2(c);
        triple(sigmas[i], if flipped { -t2 } else { t2 }, deltas[j])
    });
    let far = |t: &[f64; 3]| (0..3).map(|k| (t[k] - previous[k]).powi(2)).sum::<f64>();
    all.sort_by(|a, b| far(a).total_cmp(&far(b)));
    all
}

/// How far a bone turns between two triples, radians, to first order in their difference: whole turns count.
///
/// With σ = θ₁+θ₃ and δ = θ₃−θ₁ the speed of a turn is `ω² = σ'²·cos²(θ₂/2) + δ'²·sin²(θ₂/2) + θ₂'²`: near rest δ costs nothing.
pub fn xzx_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [d1, d2, d3] = [0, 1, 2].map(|k| b[k] - a[k]);
    let (s, c) = (0.25 * (a[1] + b[1])).sin_cos();
    ((d1 + d3).powi(2) * c * c + (d3 - d1).powi(2) * s * s + d2 * d2).sqrt()
}

/// `angle` plus the whole turns that bring it within half a turn of `reference`.
fn near(angle: f64, reference: f64) -> f64 {
    angle - TAU * ((angle - reference) / TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::angle_between;
    use std::f64::consts::PI;

    fn angle64(a: DQuat, b: DQuat) -> f64 {
        let d = a.conjugate() * b;
        2.0 * d.xyz().length().atan2(d.w.abs())
    }

    #[test]
    fn the_quaternion_is_the_product_of_three_rotations() {
        let mut rng = crate::test_rng::Rng::new(1);
        for _ in 0..1000 {
            let t = [rng.range(-4.0, 4.0), rng.range(-4.0, 4.0), rng.range(-4.0, 4.0)];
            let want =
                DQuat::from_rotation_x(t[2]) * DQuat::from_rotation_z(t[1]) * DQuat::from_rotation_x(t[0]);
            assert!(angle64(rotation_from_xzx_f64(t), want) < 1e-14);
        }
    }

    #[test]
    fn round_trips_hold_at_every_bend() {
        let bends = [0.0, 1e-9, 1e-7, 1e-6, 1e-4, 1e-3, 0.1, 1.0, 1.57, 3.0, PI - 6e-4, PI - 3e-6, PI];
        let mut rng = crate::test_rng::Rng::new(2);
        let mut worst = 0.0_f32;
        for bend in bends {
            for _ in 0..2000 {
                let t = Vec3::new(rng.range(-7.0, 7.0) as f32, bend as f32, rng.range(-7.0, 7.0) as f32);
                let q = rotation_from_xzx(t);
                worst = worst.max(angle_between(q, rotation_from_xzx(xzx_from_rotation(q, None))));
            }
        }
        assert!(worst <= 1e-6, "{worst}");
    }

    #[test]
    fn a_rest_pose_stays_at_rest() {
        assert_eq!(xzx_from_rotation(Quat::IDENTITY, None), Vec3::ZERO);
        let kept = xzx_from_rotation(Quat::IDENTITY, Some(Vec3::new(0.0, 0.0, 0.7)));
        assert!((kept - Vec3::new(-0.7, 0.0, 0.7)).length() < 1e-6, "{kept}");
    }

    #[test]
    fn unwrapping_keeps_the_rotation_and_stays_near() {
        // A jitter around rest: mid-frame angles must stay near the mid-frame rotation.
        let mut rng = crate::test_rng::Rng::new(3);
        let mut prev = [0.0; 3];
        let mut prev_q = DQuat::IDENTITY;
        for _ in 0..20_000 {
            let axis = glam::DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            let q = DQuat::from_axis_angle(axis.normalize(), rng.range(-0.1, 0.1));
            let t = unwrap_xzx(xzx_from_rotation_f64(q, Some(prev)), prev);
            assert!(angle64(rotation_from_xzx_f64(t), q) < 1e-9);
            let mid = rotation_from_xzx_f64([0, 1, 2].map(|k| 0.5 * (t[k] + prev[k])));
            assert!(angle64(mid, prev_q.slerp(q, 0.5)) < 0.5, "flip between {prev:?} and {t:?}");
            (prev, prev_q) = (t, q);
        }
    }

    #[test]
    fn the_nearest_triples_are_of_the_rotation_and_none_is_nearer() {
        let mut rng = crate::test_rng::Rng::new(4);
        for _ in 0..5000 {
            let (q, prev) = ([0; 3].map(|_| rng.range(-4.0, 4.0)), [0; 3].map(|_| rng.range(-9.0, 9.0)));
            let q = rotation_from_xzx_f64(q);
            let far = |t: [f64; 3]| (0..3).map(|k| (t[k] - prev[k]).powi(2)).sum::<f64>();
            let all = nearest_xzx(q, prev, 1e-9);
            assert!(all.iter().all(|t| angle64(rotation_from_xzx_f64(*t), q) < 1e-12));
            // Every solution within three turns.
            let t = xzx_from_rotation_f64(q, None);
            for i in 0..7 * 7 * 7 * 2 {
                let turn = |k: usize| ((i / 2 / 7usize.pow(k as u32)) % 7) as f64 * TAU - 3.0 * TAU;
                let other = if i % 2 == 0 { t } else { [t[0] + PI, -t[1], t[2] - PI] };
                let other = [0, 1, 2].map(|k| other[k] + turn(k));
                assert!(far(other) > far(all[0]) - 1e-9, "{other:?} is nearer to {prev:?} than {:?}", all[0]);
            }
        }
    }

    #[test]
    fn where_twists_trade_freely_they_are_split_as_before() {
        let mut rng = crate::test_rng::Rng::new(5);
        for _ in 0..5000 {
            let prev = [0; 3].map(|_| rng.range(-9.0, 9.0));
            let bend = if rng.range(0.0, 1.0) < 0.5 { 0.0 } else { PI } + rng.range(-0.01, 0.01);
            let q = rotation_from_xzx_f64([rng.range(-9.0, 9.0), bend, rng.range(-9.0, 9.0)]);
            let t = nearest_xzx(q, prev, 0.011)[0];
            assert!(angle64(rotation_from_xzx_f64(t), q) < 0.011);
            let [d, s] = [t[2] - t[0] - prev[2] + prev[0], t[2] + t[0] - prev[2] - prev[0]];
            assert!(d.abs().min(s.abs()) < 1e-9, "{t:?} after {prev:?}");
        }
    }

    #[test]
    fn the_distance_is_the_angle_where_triples_are_near() {
        let mut rng = crate::test_rng::Rng::new(6);
        for _ in 0..5000 {
            let a = [0; 3].map(|_| rng.range(-4.0, 4.0));
            let b = a.map(|x| x + rng.range(-1e-4, 1e-4));
            let d = angle64(rotation_from_xzx_f64(a), rotation_from_xzx_f64(b));
            assert!((xzx_distance(a, b) - d).abs() < 1e-8, "{} {d}", xzx_distance(a, b));
        }
        assert!(xzx_distance([0.0; 3], [TAU, 0.0, 0.0]) > 6.0);
    }

    #[test]
    fn a_billion_turns_cost_nothing() {
        let turned = [1e9 * TAU + 0.3, 0.8, -1e9 * TAU - 0.1];
        assert!(angle64(rotation_from_xzx_f64(turned), rotation_from_xzx_f64([0.3, 0.8, -0.1])) < 1e-6);
    }
}
