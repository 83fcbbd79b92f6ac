//! Triangles that reach behind the near plane or out of the fixed-point range, cut in homogeneous coordinates.
//!
//! Cuts are computed from the inner end of an edge to the outer one, so two triangles that share the edge get the same point.

use super::frame::{Draw, Frame};
use super::setup::{Bins, oriented};
use super::vertex::{GUARD, UNITS};
use glam::{Vec3, Vec4};

/// Pixels from the picture's centre that survive the cut: a little beyond the guard band, so that an edge whose ends both
/// lie within the band is never cut, and stays the very edge that the neighbour has.
const LIMIT: f32 = GUARD / UNITS * SLACK;
const SLACK: f32 = 1.0 + 1.0 / 1024.0;

/// Cut a triangle and put what is left into the bins.
pub(super) fn clipped(bins: &mut Bins, frame: &Frame, draw: &Draw, d: u32, id: u32, p: [Vec3; 3]) {
    let corners = p.map(|p| frame.project.point(p));
    if !corners.iter().all(|c| c.is_finite()) {
        bins.stats.skipped += 1;
        return;
    }
    let mut polygon = corners.to_vec();
    for plane in planes() {
        polygon = cut(&polygon, plane);
    }
    if polygon.len() < 3 {
        bins.stats.missed += 1;
        return;
    }

    // Draw what is left as a fan.
    let placed: Vec<(i32, i32, f32)> = polygon.iter().map(|c| fixed(frame, *c)).collect();
    let (mut faces_us, mut met) = (false, false);
    for k in 1..placed.len() - 1 {
        let t = [placed[0], placed[k], placed[k + 1]];
        if let Some(s) = oriented(draw, t.map(|c| c.0), t.map(|c| c.1), t.map(|c| c.2), id, d) {
            faces_us = true;
            met |= bins.bin(frame, draw.class, s);
        }
    }
    let stats = &mut bins.stats;
    stats.culled += !faces_us as u64;
    stats.missed += (faces_us && !met) as u64;
    stats.clipped += met as u64;
}

/// Planes whose inner side is positive: near, a least distance, and the four sides of the guard band.
fn planes() -> [Vec4; 6] {
    [
        Vec4::new(0.0, 0.0, -1.0, 1.0),
        Vec4::new(0.0, 0.0, 0.0, 1.0),
        Vec4::new(1.0, 0.0, 0.0, LIMIT),
        Vec4::new(-1.0, 0.0, 0.0, LIMIT),
        Vec4::new(0.0, 1.0, 0.0, LIMIT),
        Vec4::new(0.0, -1.0, 0.0, LIMIT),
    ]
}

/// The part of a convex polygon on the inner side of a plane (Sutherland and Hodgman 1974).
fn cut(polygon: &[Vec4], plane: Vec4) -> Vec<Vec4> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (plane.dot(a), plane.dot(b));
        if da >= 0.0 {
            out.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            let (inner, outer, di, d_o) = if da >= 0.0 { (a, b, da, db) } else { (b, a, db, da) };
            let t = di as f64 / (di as f64 - d_o as f64);
            out.push((inner.as_dvec4() + (outer.as_dvec4() - inner.as_dvec4()) * t).as_vec4());
        }
    }
    out
}

/// To fixed point and depth, by the same operations as for vertices that need no cut.
fn fixed(frame: &Frame, c: Vec4) -> (i32, i32, f32) {
    let scale = 1.0 / c.w.max(f32::MIN_POSITIVE);
    let units = scale * UNITS;
    let range = GUARD * SLACK;
    let unit = |v: f32, size: i32| {
        let v = (v * units).clamp(-range, range);
        v.round_ties_even() as i32 + size * 128
    };
    (unit(c.x, frame.width), unit(c.y, frame.height), c.z * scale)
}
