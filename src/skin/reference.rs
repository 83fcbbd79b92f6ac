//! Every deformer in f64: slow, and what the fast ones are measured against.

use super::Method;
use glam::{DAffine3, DVec3};

/// `V` positions deformed as [`deform`](super::deform) does it, in f64 throughout.
///
/// ```
/// use glam::{DAffine3, DVec3};
/// use sinew::skin::{Method, deform_f64};
/// let moved = deform_f64(Method::Rigid(0), &[DVec3::X], &[DAffine3::from_translation(DVec3::splat(1e9))]);
/// assert_eq!(moved, [DVec3::new(1e9 + 1.0, 1e9, 1e9)]);
/// ```
///
/// # Panics
/// If a bone index lies beyond the palette, or the weights are of another number of vertices.
pub fn deform_f64(method: Method, positions: &[DVec3], palette: &[DAffine3]) -> Vec<DVec3> {
    match method {
        Method::Rigid(bone) => positions.iter().map(|p| palette[bone].transform_point3(*p)).collect(),
        Method::Linear(weights) => {
            assert_eq!(weights.vertex_count(), positions.len(), "weights of another mesh");
            let one = |(i, p): (usize, &DVec3)| {
                weights.of(i).map(|(b, w)| palette[b].transform_point3(*p) * w as f64).sum()
            };
            positions.iter().enumerate().map(one).collect()
        }
    }
}
