//! Interpolating and comparing unit quaternions.

use glam::Quat;

/// Constant-speed interpolation on the short arc (Shoemake 1985), `t` in 0…1.
///
/// The angle comes from `atan2` of chord lengths, so it keeps its accuracy near 0 and π where `acos` of the
/// dot product loses half its digits.
///
/// ```
/// use glam::Quat;
/// let (a, b) = (Quat::IDENTITY, Quat::from_rotation_z(1.0));
/// let m = sinew::math::rotation::slerp(a, b, 0.25);
/// assert!(sinew::math::rotation::angle_between(m, Quat::from_rotation_z(0.25)) < 1e-6);
/// ```
pub fn slerp(a: Quat, b: Quat, t: f32) -> Quat {
    // Take the nearer of b and −b: both are the same rotation.
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let theta = 2.0 * (a - b).length().atan2((a + b).length());

    // Below 1e-3 rad the chord and the arc agree to 1e-7.
    let s = theta.sin();
    if theta < 1e-3 || s < 1e-6 {
        return unit(a * (1.0 - t) + b * t);
    }
    unit((a * ((1.0 - t) * theta).sin() + b * (t * theta).sin()) * (1.0 / s))
}

/// Normalised linear interpolation on the short arc; differs from [`slerp`] by about `α³/249` rad over an angle `α`.
pub fn nlerp(a: Quat, b: Quat, t: f32) -> Quat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    unit(a * (1.0 - t) + b * t)
}

/// The angle in radians of the rotation that takes `a` to `b`, 0…π, by `atan2` (never `2·acos|a·b|`, whose noise
/// floor is 0.04° in f32).
pub fn angle_between(a: Quat, b: Quat) -> f32 {
    let d = a.conjugate() * b;
    2.0 * d.xyz().length().atan2(d.w.abs())
}

/// `q / ‖q‖`; the identity where `q` has no direction.
pub fn unit(q: Quat) -> Quat {
    let l = q.length();
    if l > 1e-20 && l.is_finite() { q * (1.0 / l) } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn slerp_has_constant_speed_at_every_angle() {
        for deg in [1e-3_f32, 0.05, 1.0, 30.0, 90.0, 170.0, 179.9] {
            let full = deg.to_radians();
            let b = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), full);
            for k in 0..=8 {
                let t = k as f32 / 8.0;
                let got = angle_between(Quat::IDENTITY, slerp(Quat::IDENTITY, b, t));
                assert!((got - t * full).abs() < 5e-7 + 1e-6 * full, "{deg}° at {t}: {got}");
            }
        }
    }

    #[test]
    fn nlerp_strays_from_slerp_by_the_cube_of_the_angle() {
        for deg in [10.0_f32, 30.0, 60.0, 90.0] {
            let full = deg.to_radians();
            let b = -Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), full);
            let off = |t: f32| angle_between(nlerp(Quat::IDENTITY, b, t), slerp(Quat::IDENTITY, b, t));
            let worst = (0..=100).map(|k| off(k as f32 / 100.0)).fold(0.0, f32::max);
            assert!((worst / (full.powi(3) / 249.0) - 1.0).abs() < 0.05, "{deg}°: {worst}");
        }
    }

    #[test]
    fn the_short_arc_is_taken() {
        let b = -Quat::from_rotation_y(0.4);
        assert!(angle_between(slerp(Quat::IDENTITY, b, 0.5), Quat::from_rotation_y(0.2)) < 1e-6);
    }
}
