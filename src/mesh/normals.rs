//! Normals of faces, vertices and corners (notes §5.9–5.10), and tangents along u.

use glam::{Vec2, Vec3, Vec4};

use crate::math;

/// How much each face counts in a vertex's normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// By area: cheap, biased towards large faces.
    Area,
    /// By the angle at the vertex: independent of how a face is cut into triangles.
    Angle,
}

/// Unit normal of a triangle, counter-clockwise in front; zero for a degenerate one.
pub fn face(p: [Vec3; 3]) -> Vec3 {
    math_unit((p[1] - p[0]).cross(p[2] - p[0]))
}

/// One unit normal a vertex, shared by all its faces. Vertices without a proper face get +z.
///
/// ```
/// use glam::Vec3;
/// use sinew::mesh::normals::{Weighting, vertex};
/// let p = [Vec3::ZERO, Vec3::X, Vec3::Y];
/// assert_eq!(vertex(&p, &[[0, 1, 2]], Weighting::Angle), [Vec3::Z; 3]);
/// ```
pub fn vertex(positions: &[Vec3], triangles: &[[u32; 3]], weighting: Weighting) -> Vec<Vec3> {
    let mut sum = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let p = t.map(|i| positions[i as usize]);
        let cross = (p[1] - p[0]).cross(p[2] - p[0]);
        for k in 0..3 {
            sum[t[k] as usize] += match weighting {
                Weighting::Area => cross,
                Weighting::Angle => math_unit(cross) * corner_angle(p, k),
            };
        }
    }
    sum.into_iter().map(|n| if n == Vec3::ZERO { Vec3::Z } else { math_unit(n) }).collect()
}

/// One unit normal a corner: faces around the vertex count only if they lean less than `crease` radians from the
/// corner's own face, so that a cube keeps its edges.
pub fn corner(positions: &[Vec3], triangles: &[[u32; 3]], crease: f32) -> Vec<[Vec3; 3]> {
    let faces: Vec<Vec3> = triangles.iter().map(|t| face(t.map(|i| positions[i as usize]))).collect();

    // Faces around each vertex, as one array with offsets.
    let mut start = vec![0u32; positions.len() + 1];
    triangles.iter().flatten().for_each(|&i| start[i as usize + 1] += 1);
    for i in 0..positions.len() {
        start[i + 1] += start[i];
    }
    let mut fill = start.clone();
    let mut around = vec![(0u32, 0u8); triangles.len() * 3];
    for (f, t) in triangles.iter().enumerate() {
        for (k, &i) in t.iter().enumerate() {
            around[fill[i as usize] as usize] = (f as u32, k as u8);
            fill[i as usize] += 1;
        }
    }

    // Add up the neighbours within the crease angle, weighted by their angle at the vertex.
    let limit = crease.cos();
    let one = |f: usize, i: u32| {
        let range = start[i as usize] as usize..start[i as usize + 1] as usize;
        let sum = around[range].iter().filter(|(g, _)| faces[*g as usize].dot(faces[f]) >= limit);
        let sum = sum.map(|&(g, k)| {
            let p = triangles[g as usize].map(|i| positions[i as usize]);
            faces[g as usize] * corner_angle(p, k as usize)
        });
        let n = sum.sum::<Vec3>();
        if n == Vec3::ZERO { faces[f] } else { math_unit(n) }
    };
    triangles.iter().enumerate().map(|(f, t)| t.map(|i| one(f, i))).collect()
}

/// Tangents along +u, averaged over the triangles around a vertex and made orthogonal to its normal (Lengyel 2001).
///
/// Vertices without usable texture coordinates get any tangent orthogonal to the normal.
pub fn tangents(positions: &[Vec3], normals: &[Vec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> Vec<Vec4> {
    let mut along_u = vec![Vec3::ZERO; positions.len()];
    let mut along_v = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let p = t.map(|i| positions[i as usize]);
        let w = t.map(|i| uvs[i as usize]);
        let (e1, e2, d1, d2) = (p[1] - p[0], p[2] - p[0], w[1] - w[0], w[2] - w[0]);
        let det = d1.perp_dot(d2);
        if det == 0.0 {
            continue;
        }
        let (tu, tv) = ((e1 * d2.y - e2 * d1.y) * det.signum(), (e2 * d1.x - e1 * d2.x) * det.signum());
        for &i in t {
            along_u[i as usize] += tu;
            along_v[i as usize] += tv;
        }
    }
    let one = |i: usize| {
        let n = normals[i];
        let t = along_u[i] - n * n.dot(along_u[i]);
        let t = math::unit_or_any(t, n);
        let w = if n.cross(t).dot(along_v[i]) < 0.0 { -1.0 } else { 1.0 };
        t.extend(w)
    };
    (0..positions.len()).map(one).collect()
}

fn math_unit(v: Vec3) -> Vec3 {
    math::unit_or(v, Vec3::ZERO)
}

fn corner_angle(p: [Vec3; 3], k: usize) -> f32 {
    let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let p = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (p.collect(), quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
    }

    #[test]
    fn a_cube_keeps_face_normals_at_its_corners_and_diagonals_at_its_vertices() {
        let (p, t) = cube();
        for (n, tri) in corner(&p, &t, 0.5).iter().zip(&t) {
            let f = face(tri.map(|i| p[i as usize]));
            assert!(n.iter().all(|n| (*n - f).length() < 1e-6));
        }
        for (n, p) in vertex(&p, &t, Weighting::Angle).iter().zip(&p) {
            assert!((*n - p.normalize()).length() < 1e-6);
        }
    }

    #[test]
    fn tangents_follow_u() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let uv = [Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::ZERO];
        let t = tangents(&p, &[Vec3::Z; 3], &uv, &[[0, 1, 2]]);
        assert!((t[0] - Vec4::new(1.0, 0.0, 0.0, -1.0)).length() < 1e-6, "{:?}", t[0]);
    }
}
