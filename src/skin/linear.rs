//! Linear blend skinning: `v' = Σ_j w_j T_j v` (notes §7.9; Magnenat-Thalmann et al. 1988).

use super::{Deformed, Rest, Weights};
use crate::math::{normal_from, unit_or};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// `V` vertices, each blended from `weights.per_vertex()` matrices of the palette.
pub(super) fn deform(rest: Rest, weights: &Weights, palette: &[Affine3A], out: &mut Deformed) {
    let mut inside_out = 0;
    for (i, (p, influences)) in rest.positions.iter().zip(weights.rows()).enumerate() {
        // Blend the matrices, then apply one: the same sum as blending the results.
        let m = blend(influences, palette);
        out.positions[i] = m.transform_point3(*p);

        let det = m.matrix3.determinant();
        inside_out += usize::from(det < 0.0);
        if let Some(n) = rest.normals.get(i) {
            out.normals[i] = unit_or((normal_from(&m.matrix3) * Vec3A::from(*n)).into(), *n);
        }
        if let Some(t) = rest.tangents.get(i) {
            let w = if det < 0.0 { -t.w } else { t.w };
            out.tangents[i] = unit_or(m.transform_vector3(t.truncate()), t.truncate()).extend(w);
        }
    }
    out.mirrored = 2 * inside_out > rest.positions.len();
}

/// Positions alone.
pub(super) fn positions(rest: &[Vec3], weights: &Weights, palette: &[Affine3A], out: &mut Vec<Vec3>) {
    let moved = |(p, influences): (&Vec3, _)| blend(influences, palette).transform_point3(*p);
    out.extend(rest.iter().zip(weights.rows()).map(moved));
}

/// The strongest influence comes first: alone it needs no sum, and after one of nothing there is no other.
#[inline]
fn blend((bones, weights): (&[u16], &[f32]), palette: &[Affine3A]) -> Affine3A {
    if weights[0] == 1.0 {
        return palette[usize::from(bones[0])];
    }
    let mut sum = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
    for (bone, w) in bones.iter().zip(weights).take_while(|(_, w)| **w != 0.0) {
        let t = &palette[usize::from(*bone)];
        sum.matrix3 += t.matrix3 * *w;
        sum.translation += t.translation * *w;
    }
    sum
}
