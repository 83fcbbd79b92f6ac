//! Binding without weights: each part of a mesh follows the bone that most of its surface is nearest to.

use super::{Weights, WeightsError};
use crate::mesh::topology::components;
use glam::Vec3;

/// A bone as binding sees it: from base to tip, in the frame of the rest positions.
pub type Segment = [Vec3; 2];

/// Rigid weights: the closest segment for every triangle, then the majority by area within each connected component, so
/// that no part tears (notes §7.8; distance is to the *segment*, not to its line or ends).
///
/// Vertices without a triangle go to their own closest segment. The result is one-hot.
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

    // Every vertex votes for its bone with a third of the area of its triangles.
    let label = components(triangles);
    let parts = label.iter().filter(|&&l| l != u32::MAX).max().map_or(0, |&m| m as usize + 1);
    let mut votes = vec![0.0_f64; parts * segments.len()];
    for t in triangles {
        let p = t.map(|i| positions[i as usize]);
        let area = (p[1] - p[0]).cross(p[2] - p[0]).length() as f64;
        for &i in t {
            votes[label[i as usize] as usize * segments.len() + bones[i as usize] as usize] += area;
        }
    }
    let winner = |part: u32| {
        let row = &votes[part as usize * segments.len()..][..segments.len()];
        // On a tie the first bone wins, so that the result does not depend on float noise in the order of bones.
        row.iter().enumerate().fold((0, f64::MIN), |best, (i, &v)| if v > best.1 { (i, v) } else { best }).0
            as u32
    };
    for (bone, &part) in bones.iter_mut().zip(&label) {
        if part != u32::MAX {
            *bone = winner(part);
        }
    }
    Ok(Weights::new(1, &bones, &vec![1.0; positions.len()], segments.len(), 0)?.0)
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
    fn distance_is_to_the_segment() {
        assert_eq!(distance_squared(Vec3::X * 3.0, [Vec3::ZERO, Vec3::X]), 4.0);
        assert_eq!(distance_squared(Vec3::Y, [Vec3::ZERO, Vec3::ZERO]), 1.0);
    }
}
