//! Which triangles of a pixel are one surface, so that one evaluation stands for all of them.
//!
//! Four samples cost shading on outlines and creases only: a pixel in the middle of a mesh of small triangles is shaded once,
//! not four times. What is covered stays exact, sample by sample.

use super::fill::NONE;
use super::frame::{Draw, Frame};
use super::resolve::LastDraw;
use crate::scene::Projection;
use glam::Vec3;

/// Least cosine between normals of one smooth surface: 18°.
const SMOOTH: f32 = 0.95;

/// Depth that a smooth surface may span in a pixel, in pixels: a slope of 76°.
const STEEP: f32 = 4.0;

/// How much depth values may differ within a smooth surface: relative to the larger, and absolute.
pub(super) fn depth_step(frame_height: usize, camera: &crate::scene::Camera) -> [f32; 2] {
    let pixels = frame_height.max(1) as f32;
    match camera.projection {
        Projection::Perspective { fov_y } => [STEEP * 2.0 * (0.5 * fov_y).tan() / pixels, 0.0],
        Projection::Orthographic { height } => {
            [0.0, STEEP * height / pixels / (camera.far - camera.near).max(f32::MIN_POSITIVE)]
        }
    }
}

/// Samples that one evaluation stands for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    pub id: u32,
    pub covers: u32,
}

/// Evaluations for a pixel whose samples show `ids` at depths `z`, and their number.
///
/// Triangles join the one with the most samples (the first of these) if they are of its draw and continue it: they share a
/// vertex, where all that shading reads is the same, or they lie within a step of depth and their normals are alike. The
/// colour is the leader's, at a point of it near the centroid of all samples: barycentric coordinates below 0 count as 0, which along
/// the edge of a sliver may be some pixels away. Flat faces have a colour each
/// and never join.
#[inline(always)]
pub(super) fn groups(
    frame: &Frame,
    ids: &[u32; 4],
    z: &[f32; 4],
    last: &mut LastDraw,
) -> ([Group; 4], usize) {
    let same = |id: u32| {
        let bit = |s: usize| ((ids[s] == id) as u32) << s;
        bit(0) | bit(1) | bit(2) | bit(3)
    };
    // One before nothing: that is most of them.
    let first = same(ids[0]);
    let other = ids[(!first & 0xf).trailing_zeros() as usize & 3];
    let (second, mut out) = (same(other), [Group::default(); 4]);
    if first | second == 0xf && (ids[0] == NONE || other == NONE) {
        let (id, covers) = if other == NONE { (ids[0], first) } else { (other, second) };
        out[0] = Group { id, covers };
        return (out, 1);
    }
    let mut left = 0xf & !same(NONE);

    // The one with the most samples leads.
    let (mut lead, mut most) = (left.trailing_zeros(), 0);
    for s in 0..4 {
        let count = if left >> s & 1 != 0 { same(ids[s]).count_ones() } else { 0 };
        (lead, most) = if count > most { (s as u32, count) } else { (lead, most) };
    }
    let mut n = 0;
    while left != 0 {
        let id = ids[lead as usize & 3];
        let mut covers = same(id);
        left &= !covers;
        if left != 0 {
            let draw = last.find(frame, id);
            if draw.continuous {
                covers |= joined(frame, draw, ids, z, lead as usize & 3, left);
                left &= !covers;
            }
        }
        out[n & 3] = Group { id, covers };
        n += 1;
        lead = left.trailing_zeros();
    }
    (out, n)
}

/// Those of the samples `left` whose triangles continue that of sample `lead`.
#[inline(always)]
fn joined(frame: &Frame, draw: &Draw, ids: &[u32; 4], z: &[f32; 4], lead: usize, left: u32) -> u32 {
    let triangles = &draw.object.mesh.triangles;
    let range = draw.ids();
    let corners = triangles[(ids[lead] - range.start) as usize];
    let mut joined = 0;
    let (mut last, mut good) = (NONE, false);
    for s in 0..4 {
        if left >> s & 1 == 0 || !range.contains(&ids[s]) {
            continue;
        }
        if ids[s] != last {
            let other = triangles[(ids[s] - range.start) as usize];
            last = ids[s];
            good =
                share_a_vertex(corners, other) || alike(frame, draw, [z[lead], z[s]], [corners[0], other[0]]);
        }
        joined |= (good as u32) << s;
    }
    joined
}

#[inline(always)]
pub(super) fn share_a_vertex(a: [u32; 3], b: [u32; 3]) -> bool {
    let with = |v: u32| (v == b[0]) | (v == b[1]) | (v == b[2]);
    with(a[0]) | with(a[1]) | with(a[2])
}

#[inline(always)]
fn alike(frame: &Frame, draw: &Draw, z: [f32; 2], v: [u32; 2]) -> bool {
    let [relative, absolute] = frame.depth_step;
    if (z[0] - z[1]).abs() > relative * z[0].max(z[1]) + absolute {
        return false;
    }
    let normal = |v: u32| draw.object.normals.get(v as usize).copied().unwrap_or(Vec3::ZERO);
    normal(v[0]).dot(normal(v[1])) >= SMOOTH
}
