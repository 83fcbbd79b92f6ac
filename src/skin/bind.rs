//! Binding without weights: each part of a mesh follows the bone that most of its surface is nearest to.

use super::{Weights, WeightsError};
use crate::mesh::topology::components;
use glam::Vec3;

/// A bone as binding sees it: from base to tip, in the frame of the rest positions.
pub type Segment = [Vec3; 2];

/// Rigid weights: every vertex votes for its closest segment with the area of its triangles, and each connected component
/// follows the majority, so that no part tears (notes §7.8; distance is to the *segment*, not to its line or ends).
///
/// Vertices without a triangle go to their own closest segment. The result is one-hot. Time is vertices × segments, memory
/// vertices + triangles + segments.
///
/// # Errors
/// [`WeightsError::Bone`] if there is no segment.
pub fn bind_closest(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    segments: &[Segment],
) -> Result<Weights, WeightsError> {
    if segments.is_empty() {
        return Err(WeightsError::Bone { vertex: 0, slot: 0, bone: 0, count: 0 });
    }
    let nearest = |p: Vec3| {
        let d = segments.iter().map(|s| distance_squared(p, *s));
        d.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
    };
    let mut bones: Vec<u32> = positions.iter().map(|p| nearest(*p) as u32).collect();

    let label = components(triangles);
    let winner = majorities(positions, triangles, &label, &bones, segments.len());
    for (bone, &part) in bones.iter_mut().zip(&label) {
        if part != u32::MAX {
            *bone = winner[part as usize];
        }
    }
    Ok(Weights::new(1, &bones, &vec![1.0; positions.len()], segments.len(), 0)?.0)
}

/// The bone that most of each part's area votes for; on a tie the first of them.
fn majorities(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    label: &[u32],
    bones: &[u32],
    bone_count: usize,
) -> Vec<u32> {
    // Take part by part, each in the order of its triangles, so that one row of votes serves all.
    let part = |t: u32| label[triangles[t as usize][0] as usize];
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    order.sort_by_key(|&t| part(t));
    let mut votes = vec![0.0_f64; bone_count];
    let mut named: Vec<u32> = Vec::new();
    let one = |run: &[u32]| {
        for t in run.iter().map(|&t| triangles[t as usize]) {
            let p = t.map(|i| positions[i as usize]);
            let area = (p[1] - p[0]).cross(p[2] - p[0]).length() as f64;
            for bone in t.map(|i| bones[i as usize]) {
                votes[bone as usize] += area;
                named.push(bone);
            }
        }
        // Clear only what was used: a thousand parts of one triangle cost no thousand rows.
        named.sort_unstable();
        named.dedup();
        let mut best = (0, f64::NEG_INFINITY);
        for bone in named.drain(..) {
            let sum = std::mem::take(&mut votes[bone as usize]);
            best = if sum > best.1 { (bone, sum) } else { best };
        }
        best.0
    };
    order.chunk_by(|&a, &b| part(a) == part(b)).map(one).collect()
}

fn distance_squared(p: Vec3, [a, b]: Segment) -> f32 {
    let d = b - a;
    let l2 = d.length_squared();
    let t = if l2 > 0.0 { ((p - a).dot(d) / l2).clamp(0.0, 1.0) } else { 0.0 };
    (a + d * t).distance_squared(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_follows_the_majority_of_its_area() {
        // Two triangles, each in one piece; the left one sticks a corner over to the right bone.
        let p = [[0., 0., 0.], [0., 1., 0.], [1.2, 0., 0.], [2., 0., 0.], [2., 1., 0.], [3., 0., 0.]];
        let p: Vec<Vec3> = p.iter().map(|p| Vec3::from_array(*p)).collect();
        let segments = [[Vec3::ZERO, Vec3::Y], [Vec3::X * 2.0, Vec3::new(2.0, 1.0, 0.0)]];
        let w = bind_closest(&p, &[[0, 1, 2], [3, 4, 5]], &segments).unwrap();
        let bones: Vec<usize> = (0..6).map(|i| w.of(i).next().unwrap().0).collect();
        assert_eq!(bones, [0, 0, 0, 1, 1, 1]);
    }

    #[test]
    fn parts_are_told_apart_whatever_the_order_of_triangles() {
        // Squares of two triangles, every other one ten metres off.
        let corners = |i: usize| {
            let at = Vec3::X * (i % 2) as f32 * 10.0;
            [at, at + Vec3::X * 0.1, at + Vec3::ONE * 0.1, at + Vec3::Y * 0.1]
        };
        let p: Vec<Vec3> = (0..1000).flat_map(corners).collect();
        let half = |a: u32, b: u32| (0..1000).map(move |i| [4 * i, 4 * i + a, 4 * i + b]);
        let triangles: Vec<[u32; 3]> = half(1, 2).chain(half(2, 3)).collect();
        let segments = [[Vec3::X * 10.0; 2], [Vec3::ZERO; 2]];
        let w = bind_closest(&p, &triangles, &segments).unwrap();
        for v in 0..p.len() {
            assert_eq!(w.of(v).next().unwrap().0, 1 - v / 4 % 2, "vertex {v}");
        }
    }

    #[test]
    fn distance_is_to_the_segment() {
        assert_eq!(distance_squared(Vec3::X * 3.0, [Vec3::ZERO, Vec3::X]), 4.0);
        assert_eq!(distance_squared(Vec3::Y, [Vec3::ZERO, Vec3::ZERO]), 1.0);
    }
}
