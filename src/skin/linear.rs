//! Linear blend skinning: `v' = Σ_j w_j T_j v` (notes §7.9; Magnenat-Thalmann et al. 1988).

use super::{Deformed, Rest, Weights};
use crate::math::{normal_from, unit_or};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// `V` vertices, each blended from `weights.per_vertex()` matrices of the palette.
pub(super) fn deform(rest: Rest, weights: &Weights, palette: &[Affine3A], out: &mut Deformed) {
    let mut inside_out = 0;
    for (i, p) in rest.positions.iter().enumerate() {
        // Blend the matrices, then apply one: the same sum as blending the results.
        let m = blend(weights.of(i), palette);
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
    let moved = |(i, p): (usize, &Vec3)| blend(weights.of(i), palette).transform_point3(*p);
    out.extend(rest.iter().enumerate().map(moved));
}

#[inline]
fn blend(influences: impl Iterator<Item = (usize, f32)>, palette: &[Affine3A]) -> Affine3A {
    let mut sum = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
    for (bone, w) in influences {
        if w == 0.0 {
            continue;
        }
        let t = &palette[bone];
        if w == 1.0 {
            return *t;
        }
        sum.matrix3 += t.matrix3 * w;
        sum.translation += t.translation * w;
    }
    sum
}
