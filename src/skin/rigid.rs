//! Every vertex follows one bone.

use super::{Deformed, Rest};
use crate::math::{normal_from, unit_or};
use glam::{Affine3A, Vec3A};

/// `v' = T v` for all `V` vertices.
pub(super) fn deform(rest: Rest, m: &Affine3A, out: &mut Deformed) {
    for (o, p) in out.positions.iter_mut().zip(rest.positions) {
        *o = m.transform_point3(*p);
    }
    let cof = normal_from(&m.matrix3);
    for (o, n) in out.normals.iter_mut().zip(rest.normals) {
        *o = unit_or((cof * Vec3A::from(*n)).into(), *n);
    }
    let det = m.matrix3.determinant();
    for (o, t) in out.tangents.iter_mut().zip(rest.tangents) {
        // A mirror turns the handedness of the frame over.
        let w = if det < 0.0 { -t.w } else { t.w };
        *o = unit_or(m.transform_vector3(t.truncate()), t.truncate()).extend(w);
    }
    out.mirrored = det < 0.0;
}
