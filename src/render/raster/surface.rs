//! What a triangle's corners give at a pixel: perspective-correct varyings, then the material.

use super::frame::{Draw, Frame, Projector};
use crate::math::simd::{F8, V8};
use crate::render::shade::{self, Surface};
use crate::scene::Projection;
use glam::Vec3;

/// Eight points on triangles of one draw.
pub(super) struct Point {
    /// Corner indices, corner by corner.
    pub corner: [[u32; 8]; 3],
    /// Barycentric coordinates in scene space.
    pub b: [F8; 3],
    /// Not normalised: twice the area, counter-clockwise.
    pub face: V8,
    pub position: V8,
}

impl Point {
    /// The points of triangles `ids` that pixels show; `px`, `py` from the picture's centre.
    ///
    /// With `cᵢ = (xᵢ − px·wᵢ, yᵢ − py·wᵢ)`, `bᵢ ∝ cⱼ × cₖ` (Olano and Greer 1997): no division by `w`, so corners behind the
    /// eye do no harm, and no clipped corner is ever needed.
    #[inline(always)]
    pub fn new(frame: &Frame, draw: &Draw, ids: [u32; 8], px: F8, py: F8) -> Self {
        let triangles = &draw.object.mesh.triangles;
        let mut corner = [[0; 8]; 3];
        for k in 0..8 {
            let t = triangles[ids[k] as usize];
            (corner[0][k], corner[1][k], corner[2][k]) = (t[0], t[1], t[2]);
        }
        let p = corner.map(|c| vectors(draw.object.positions, c));
        let m = &frame.project;
        let c = p.map(|p| {
            let w = Projector::row8(m.w, p);
            [Projector::row8(m.x, p) - px * w, Projector::row8(m.y, p) - py * w]
        });
        let cross = |a: [F8; 2], b: [F8; 2]| a[0] * b[1] - a[1] * b[0];
        let e = [cross(c[1], c[2]), cross(c[2], c[0]), cross(c[0], c[1])];

        // Rounding and snapping may put a point just outside: pull it in.
        let sum = e[0] + e[1] + e[2];
        let scale = F8::ONE / sum;
        let b = e.map(|e| (e * scale).clamp01());
        let scale = F8::ONE / (b[0] + b[1] + b[2]).max(F8::splat(1e-30));
        let b = b.map(|b| b * scale);
        let face = (p[1] - p[0]).cross(p[2] - p[0]);
        Self { corner, b, face, position: mix(b, p) }
    }
}

/// `Σ bᵢ vᵢ`.
#[inline(always)]
fn mix(b: [F8; 3], v: [V8; 3]) -> V8 {
    v[0] * b[0] + v[1] * b[1] + v[2] * b[2]
}

#[inline(always)]
fn vectors(list: &[Vec3], at: [u32; 8]) -> V8 {
    let mut v = [Vec3::ZERO; 8];
    for k in 0..8 {
        v[k] = list[at[k] as usize];
    }
    V8::gather(v)
}

/// Linear light of eight points.
#[inline(always)]
pub(super) fn color(frame: &Frame, draw: &Draw, ids: [u32; 8], px: F8, py: F8) -> V8 {
    let p = Point::new(frame, draw, ids, px, py);
    let m = draw.material;
    let diffuse = V8::splat(m.diffuse.truncate());
    if m.unlit {
        return diffuse;
    }
    let camera = &frame.scene.camera;
    let view = match camera.projection {
        Projection::Perspective { .. } => (V8::splat(camera.eye()) - p.position).unit(),
        Projection::Orthographic { .. } => V8::splat(camera.scene_from_view.matrix3.z_axis.into()),
    };
    let face = if draw.object.mirrored { V8::ZERO - p.face } else { p.face };
    let normal = if draw.object.normals.is_empty() {
        face
    } else {
        mix(p.b, p.corner.map(|c| vectors(draw.object.normals, c)))
    };
    let mut normal = normal.unit();
    if m.double_sided {
        normal = shade::facing(normal, F8::ZERO.gt(face.dot(view)));
    }
    let s = Surface {
        position: p.position,
        normal,
        view,
        diffuse,
        specular: V8::splat(m.specular),
        shininess: F8::splat(m.shininess),
        openness: F8::ONE,
        emissive: V8::splat(m.emissive),
    };
    shade::blinn_phong(&s, frame.scene.ambient, &frame.scene.lights)
}
