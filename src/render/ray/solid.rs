//! Spheres, planes and lone triangles against rays, in `f64` whatever the rays are in (notes §2.7).

use crate::scene::Geometry;
use glam::DVec3;

/// Directions that rise less than this over a plane run along it.
const PARALLEL: f64 = 1e-14;

/// Where a ray `origin + t·direction` meets a shape within `range`, both ends included.
///
/// `left`: the ray starts on this very shape. Flat ones are not met again then, and a sphere only from the inside, at its other
/// side: no number has to say how near is too near.
pub(super) fn meet(g: &Geometry, [o, d]: [DVec3; 2], left: bool, range: [f64; 2]) -> Option<f64> {
    let within = |t: f64| (t >= range[0] && t <= range[1]).then_some(t);
    match *g {
        Geometry::Sphere { center, .. } if left => {
            within(-2.0 * (o - center).dot(d) / d.length_squared()).filter(|t| *t > 0.0)
        }
        _ if left => None,
        Geometry::Sphere { center, radius } => {
            sphere(o - center, d, radius).and_then(|t| t.into_iter().find_map(within))
        }
        Geometry::Plane { point, normal } => {
            let rise = normal.dot(d);
            let flat = rise.abs() <= PARALLEL * normal.length() * d.length();
            if flat { None } else { within((point - o).dot(normal) / rise) }
        }
        Geometry::Triangle(corners) => triangle(corners, o, d).and_then(within),
    }
}

/// Both roots of `‖e + t·d‖² = r²`, the nearer one first: `q = −(b + sgn(b)√Δ)`, `t = q/a` and `c/q`, where neither is a difference of
/// numbers that are nearly the same. `Δ/a = r² − ‖e − (e·d/d²)d‖²` does not cancel either when the sphere is far away.
fn sphere(e: DVec3, d: DVec3, radius: f64) -> Option<[f64; 2]> {
    let (a, b) = (d.length_squared(), e.dot(d));
    let beside = e - d * (b / a);
    let rest = radius * radius - beside.length_squared();
    if rest < 0.0 || a == 0.0 {
        return None;
    }
    let q = -(b + (a * rest).sqrt().copysign(b));
    let c = e.length_squared() - radius * radius;
    let roots = [q / a, if q == 0.0 { 0.0 } else { c / q }];
    Some(if roots[0] <= roots[1] { roots } else { [roots[1], roots[0]] })
}

/// Möller and Trumbore 1997, with the parallel test scaled by all three edges.
fn triangle([a, b, c]: [DVec3; 3], o: DVec3, d: DVec3) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let h = d.cross(e2);
    let det = e1.dot(h);
    if det.abs() <= PARALLEL * d.length() * e1.length() * e2.length() {
        return None;
    }
    let s = o - a;
    let u = s.dot(h) / det;
    let k = s.cross(e1);
    let v = d.dot(k) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(k) / det)
}

/// The point of a shape that is nearest to one that was computed, and the unit normal there.
pub(super) fn settle(g: &Geometry, at: DVec3) -> [DVec3; 2] {
    let onto = |point: DVec3, n: DVec3| [at - n * (at - point).dot(n), n];
    match *g {
        Geometry::Sphere { center, radius } => {
            let n = (at - center).normalize_or(DVec3::Y);
            [center + n * radius, n]
        }
        Geometry::Plane { point, normal } => onto(point, normal.normalize_or(DVec3::Y)),
        Geometry::Triangle([a, b, c]) => onto(a, (b - a).cross(c - a).normalize_or(DVec3::Y)),
    }
}

/// How large the numbers are that the place of a shape is said in.
pub(super) fn reach(g: &Geometry) -> f64 {
    match g {
        Geometry::Sphere { center, radius } => center.abs().max_element() + radius,
        Geometry::Plane { point, .. } => point.abs().max_element(),
        Geometry::Triangle(c) => c.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max),
    }
}
