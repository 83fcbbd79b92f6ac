//! Eyes and mouths.

use super::bones::Bones;
use super::parts::{Machine, Solid, ball};
use glam::{DAffine3, DQuat, DVec3};
use std::f64::consts::TAU;

/// An eye that looks along `look`: white, iris, pupil and a glint, as materials `white`, `iris`, `pupil` and `glint`.
pub fn eye(m: &mut Machine, bones: &Bones, bone: &str, center: [f64; 3], radius: f64, look: DVec3) {
    let look = look.normalize();
    let center = DVec3::from(center);
    m.add(bones, bone, "white", ball(radius, 10, 16).along(look).at(center.to_array()));
    // Each disc is a flat ball that looks out of the one behind it.
    let disc = |size: f64, out: f64, toward: DVec3| {
        let flat = DAffine3::from_scale(DVec3::new(0.22, 1.0, 1.0));
        let place = center + toward * (radius * out);
        ball(radius * size, 6, 16).by(flat).along(toward).at(place.to_array())
    };
    m.add(bones, bone, "iris", disc(0.62, 0.83, look));
    m.add(bones, bone, "pupil", disc(0.4, 0.925, look));
    let glint = (look + DVec3::Y * 0.3 + look.cross(DVec3::Y) * -0.22).normalize();
    m.add(bones, bone, "glint", ball(radius * 0.13, 5, 8).at((center + glint * (radius * 1.02)).to_array()));
}

/// A round cord through points, thinner towards its ends.
pub fn cord(points: &[DVec3], radius: f64, sides: u32) -> Solid {
    let n = points.len();
    let mut s = Solid::default();
    let mut up = (points[1] - points[0]).any_orthonormal_vector();
    for k in 0..n {
        let along = (points[(k + 1).min(n - 1)] - points[k.saturating_sub(1)]).normalize();
        up = (up - along * up.dot(along)).normalize();
        let side = along.cross(up);
        // An end is a hemisphere's worth of taper.
        let end = (k.min(n - 1 - k) as f64 / 2.0).min(1.0);
        let r = radius * (0.25 + 0.75 * (end * TAU / 4.0).sin());
        for i in 0..sides {
            let a = TAU * i as f64 / sides as f64;
            s.positions.push(points[k] + (up * a.cos() + side * a.sin()) * r);
        }
    }
    let v = |ring: usize, i: u32| ring as u32 * sides + i % sides;
    for k in 0..n - 1 {
        for i in 0..sides {
            s.triangles.push([v(k, i), v(k, i + 1), v(k + 1, i + 1)]);
            s.triangles.push([v(k, i), v(k + 1, i + 1), v(k + 1, i)]);
        }
    }
    let caps = s.positions.len() as u32;
    s.positions.extend([points[0], points[n - 1]]);
    for i in 0..sides {
        s.triangles.push([caps, v(0, i + 1), v(0, i)]);
        s.triangles.push([caps + 1, v(n - 1, i), v(n - 1, i + 1)]);
    }
    s
}

/// Materials of eyes.
pub fn eye_materials(look: &mut super::Look, iris: u32) {
    look.material("white", 0xfafaf5, 0.3, 80.0);
    look.material("iris", iris, 0.3, 60.0);
    look.material("pupil", 0x0c0c12, 0.5, 120.0);
    look.material("glint", 0xffffff, 0.0, 1.0).unlit = true;
}

/// Points of an arc of `deg` degrees around `center`, in the plane of `right` and `down`.
pub fn arc(center: DVec3, right: DVec3, down: DVec3, deg: f64, n: usize) -> Vec<DVec3> {
    let at = |k: usize| {
        let a = (deg * (k as f64 / (n - 1) as f64 - 0.5)).to_radians();
        center + right * a.sin() + down * a.cos()
    };
    (0..n).map(at).collect()
}

/// A rotation by degrees about x.
pub fn tilt(deg: f64) -> DQuat {
    DQuat::from_rotation_x(deg.to_radians())
}
