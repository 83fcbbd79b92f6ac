//! The nearest point of a surface: best first, by the distance to boxes, then to triangles themselves.

use super::Accel;
use super::tree::{LEAF, Node};
use super::triangle::{EMPTY, Pack};
use glam::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A point of a surface: `(1−u−v)·p₀ + u·p₁ + v·p₂` of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// From where it was asked, metres.
    pub distance: f64,
    /// Where it is.
    pub point: DVec3,
    /// On which triangle.
    pub triangle: u32,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner.
    pub v: f64,
}

impl Accel {
    /// The nearest point that is no farther than `within`; of equals, the one on the lowest triangle.
    ///
    /// ```
    /// use glam::{DVec3, Vec3};
    /// use sinew::render::accel::{Accel, Kind};
    /// let a = Accel::new(Kind::Tree, &[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]], 1);
    /// let c = a.closest(DVec3::new(2.0, 0.0, 1.0), f64::INFINITY).unwrap();
    /// assert_eq!((c.distance, c.point), (2f64.sqrt(), DVec3::X));
    /// ```
    pub fn closest(&self, point: DVec3, within: f64) -> Option<Closest> {
        self.k_closest(point, 1, within).pop()
    }

    /// The nearest points of the `k` nearest triangles that are no farther than `within`, nearest first; of equals, the lowest
    /// triangle first.
    pub fn k_closest(&self, point: DVec3, k: usize, within: f64) -> Vec<Closest> {
        let mut found: Vec<Closest> = Vec::new();
        if k == 0 || !point.is_finite() || within.is_nan() {
            return found;
        }
        if self.nodes.is_empty() {
            self.packs.iter().for_each(|p| keep(&mut found, p, point, k, within));
            return found;
        }
        // Distances are positive, so that their bits are ordered as they are.
        let mut queue = BinaryHeap::from([Reverse((0u64, 0u32))]);
        while let Some(Reverse((distance, at))) = queue.pop() {
            let distance = f64::from_bits(distance);
            // Boxes are rounded by less than this; those that are farther are not looked into.
            let worst = if found.len() < k { within } else { found[k - 1].distance };
            if distance * (1.0 - 1e-12) > worst {
                break;
            }
            if at & LEAF != 0 {
                keep(&mut found, &self.packs[(at & !LEAF) as usize], point, k, within);
                continue;
            }
            let node: &Node = &self.nodes[at as usize];
            for lane in (0..8).filter(|&l| !node.is_empty(l)) {
                let span = node.get(lane);
                let (lo, hi) = (Vec3::from(span.lo).as_dvec3(), Vec3::from(span.hi).as_dvec3());
                let away = (lo - point).max(point - hi).max(DVec3::ZERO).length();
                queue.push(Reverse((away.to_bits(), node.children[lane])));
            }
        }
        found
    }
}

/// Put the triangles of a leaf among the best `k`.
fn keep(found: &mut Vec<Closest>, pack: &Pack, point: DVec3, k: usize, within: f64) {
    for lane in (0..4).filter(|&l| pack.ids[l] != EMPTY) {
        let corners = pack.corners_of(lane).map(|c| Vec3::from(c).as_dvec3());
        let (on, u, v) = on_triangle(point, corners);
        let one = Closest { distance: on.distance(point), point: on, triangle: pack.ids[lane], u, v };
        let key = |c: &Closest| (c.distance, c.triangle);
        let at = found.partition_point(|c| key(c) < key(&one));
        let known = found.get(at).is_some_and(|c| c.triangle == one.triangle);
        if one.distance <= within && at < k && !known {
            found.insert(at, one);
            found.truncate(k);
        }
    }
}

/// The nearest point of a triangle and the weights of its second and third corner: above its inside that of its plane, else on
/// an edge. A triangle without area is its edges.
fn on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> (DVec3, f64, f64) {
    let (ab, ac, d) = (b - a, c - a, p - a);
    let n = ab.cross(ac);
    let n2 = n.length_squared();
    let (u, v) = (d.cross(ac).dot(n) / n2, ab.cross(d).dot(n) / n2);
    if n2 > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
        return (a + ab * u + ac * v, u, v);
    }
    let along = |from: DVec3, to: DVec3| {
        let (e, l2) = (to - from, (to - from).length_squared());
        let s = if l2 > 0.0 { ((p - from).dot(e) / l2).clamp(0.0, 1.0) } else { 0.0 };
        (if s == 1.0 { to } else { from + e * s }, s)
    };
    let ((x, s), (y, t), (z, r)) = (along(a, b), along(b, c), along(c, a));
    let all = [(x, s, 0.0), (y, 1.0 - t, t), (z, 0.0, 1.0 - r)];
    let nearer = |a: (DVec3, f64, f64), b: (DVec3, f64, f64)| {
        if b.0.distance_squared(p) < a.0.distance_squared(p) { b } else { a }
    };
    nearer(nearer(all[0], all[1]), all[2])
}
