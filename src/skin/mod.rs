//! Skinning: rest vertices and a palette of bone matrices in, deformed vertices out.
//!
//! Knows neither skeleton nor pose: whatever has matrices can drive a mesh.

mod bind;
mod linear;
mod reference;
mod rigid;
mod weights;

pub use bind::{Segment, bind_closest};
pub use reference::deform_f64;
pub use weights::{Weights, WeightsError, WeightsReport};

use glam::{Affine3A, Vec3, Vec4};

/// Rest vertices: what a deformer reads. Normals and tangents are empty or have `V` entries.
#[derive(Clone, Copy, Debug)]
pub struct Rest<'a> {
    /// `V` positions, in the frame that the palette reads from.
    pub positions: &'a [Vec3],
    /// Unit normals.
    pub normals: &'a [Vec3],
    /// Unit tangents and handedness.
    pub tangents: &'a [Vec4],
}

/// Deformed vertices; buffers are used again from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deformed {
    /// `V` positions in the palette's target frame.
    pub positions: Vec<Vec3>,
    /// Unit normals, outward also under mirroring; empty if the rest has none.
    pub normals: Vec<Vec3>,
    /// Unit tangents and handedness; empty if the rest has none.
    pub tangents: Vec<Vec4>,
    /// More vertices were turned inside out than not: triangles wind the other way round.
    pub mirrored: bool,
}

/// How vertices follow bones.
#[derive(Clone, Copy, Debug)]
pub enum Method<'a> {
    /// All vertices follow one matrix of the palette: `v = T_i v` (notes §7.8).
    Rigid(usize),
    /// `v = Σ w_ij T_j v` (notes §7.9).
    Linear(&'a Weights),
}

/// Deform `rest` by `palette` into `out`.
///
/// Positions by the matrices, tangents by their linear parts, normals by `sign(det) · cof` of the *blended* matrix, so that
/// a scale that differs by axis and a mirror are right. Where the blended matrix flattens everything, the rest normal stays.
///
/// ```
/// use glam::{Affine3A, Vec3};
/// use sinew::skin::{Deformed, Method, Rest, deform};
/// let rest = Rest { positions: &[Vec3::X], normals: &[Vec3::X], tangents: &[] };
/// let mut out = Deformed::default();
/// deform(Method::Rigid(0), rest, &[Affine3A::from_scale(Vec3::new(-2.0, 1.0, 1.0))], &mut out);
/// assert_eq!((out.positions[0], out.normals[0], out.mirrored), (Vec3::NEG_X * 2.0, Vec3::NEG_X, true));
/// ```
///
/// # Panics
/// If a bone index lies beyond the palette, or the weights are of another number of vertices.
pub fn deform(method: Method, rest: Rest, palette: &[Affine3A], out: &mut Deformed) {
    let v = rest.positions.len();
    out.positions.resize(v, Vec3::ZERO);
    out.normals.resize(rest.normals.len(), Vec3::ZERO);
    out.tangents.resize(rest.tangents.len(), Vec4::ZERO);
    match method {
        Method::Rigid(bone) => rigid::deform(rest, &palette[bone], out),
        Method::Linear(weights) => {
            assert_eq!(weights.vertex_count(), v, "weights of another mesh");
            linear::deform(rest, weights, palette, out);
        }
    }
}

/// Deform positions alone: the same numbers as [`deform`] gives, without what normals need.
///
/// # Panics
/// As [`deform`].
pub fn deform_positions(method: Method, rest: &[Vec3], palette: &[Affine3A], out: &mut Vec<Vec3>) {
    out.clear();
    match method {
        Method::Rigid(bone) => {
            let m = &palette[bone];
            out.extend(rest.iter().map(|p| m.transform_point3(*p)));
        }
        Method::Linear(weights) => {
            assert_eq!(weights.vertex_count(), rest.len(), "weights of another mesh");
            linear::positions(rest, weights, palette, out);
        }
    }
}
