//! What a triangle's corners give at a point of it: varyings, eight at a time, for every renderer.

use super::material::Points;
use super::sample::Uv;
use crate::math::lanes::V3;
use crate::math::simd::{F, F8, I8, V8};
use crate::scene::{Camera, Object, Projection, TextureRef};
use glam::{Vec2, Vec3, Vec4};

/// How barycentric coordinates change from pixel to pixel.
pub(crate) trait Slopes {
    /// `∂b` a pixel to the right, and a pixel down.
    fn slopes(&self, b: &[F8; 3], corners: &[V8; 3]) -> [[F8; 3]; 2];
}

/// Eight points on triangles of one object; `ONE`: all of the same triangle.
pub(crate) struct Varying<'a, const ONE: bool, S> {
    pub object: &'a Object<'a>,
    pub corner: [[u32; 8]; 3],
    /// Barycentric coordinates in scene space.
    pub b: [F8; 3],
    pub p: [V8; 3],
    /// The corners' normals, if they were looked up before.
    pub normals: Option<[V8; 3]>,
    pub position: V8,
    pub view: V8,
    pub slopes: S,
}

impl<const ONE: bool, S: Slopes> Varying<'_, ONE, S> {
    /// Geometric normal, not unit, on the side where triangles wind counter-clockwise.
    #[inline(always)]
    fn face(&self) -> V8 {
        let n = (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]);
        if self.object.mirrored { V8::ZERO - n } else { n }
    }

    /// Texture coordinates of the corners.
    #[inline(always)]
    fn corner_uvs(&self, set: u8) -> Option<[[F8; 2]; 3]> {
        let list = &self.object.mesh.uvs[(set & 1) as usize];
        if list.is_empty() {
            return None;
        }
        let mut out = [[F8::ZERO; 2]; 3];
        for i in 0..3 {
            for k in 0..8 {
                let v: Vec2 = list[self.corner[i][if ONE { 0 } else { k }] as usize];
                (out[i][0].0[k], out[i][1].0[k]) = (v.x, v.y);
            }
        }
        Some(out)
    }
}

impl<const ONE: bool, S: Slopes> Points for Varying<'_, ONE, S> {
    #[inline(always)]
    fn position(&self) -> V8 {
        self.position
    }

    #[inline(always)]
    fn view(&self) -> V8 {
        self.view
    }

    #[inline(always)]
    fn normal(&self) -> V8 {
        if let Some(n) = &self.normals {
            return mix(&self.b, n).unit();
        }
        let list = self.object.normals;
        if list.is_empty() {
            return self.face().unit();
        }
        let n = [
            vectors::<ONE>(list, &self.corner[0]),
            vectors::<ONE>(list, &self.corner[1]),
            vectors::<ONE>(list, &self.corner[2]),
        ];
        mix(&self.b, &n).unit()
    }

    #[inline(always)]
    fn away(&self) -> I8 {
        F8::ZERO.gt(self.face().dot(self.view))
    }

    #[inline(always)]
    fn uv(&self, set: u8) -> Uv {
        let Some(c) = self.corner_uvs(set) else { return Uv::ZERO };
        let at = |w: &[F8; 3], n: usize| w[0] * c[0][n] + w[1] * c[1][n] + w[2] * c[2][n];
        let [x, y] = self.slopes.slopes(&self.b, &self.p);
        Uv {
            u: at(&self.b, 0),
            v: at(&self.b, 1),
            right: [at(&x, 0), at(&x, 1)],
            down: [at(&y, 0), at(&y, 1)],
        }
    }

    #[inline(always)]
    fn color(&self) -> Option<[F8; 4]> {
        let list: &[Vec4] = &self.object.mesh.colors;
        if list.is_empty() {
            return None;
        }
        let mut sum = [F8::ZERO; 4];
        for i in 0..3 {
            for n in 0..4 {
                let mut c = F8::ZERO;
                for k in 0..8 {
                    c.0[k] = list[self.corner[i][if ONE { 0 } else { k }] as usize][n];
                }
                sum[n] = sum[n] + self.b[i] * c;
            }
        }
        Some(sum)
    }

    #[inline(always)]
    fn tangent_frame(&self, normal: V8, map: &TextureRef) -> (V8, V8) {
        let list = self.object.tangents;
        if list.is_empty() {
            return self.derived_frame(normal, map);
        }
        let (mut t, mut sign) = (V8::ZERO, F8::ZERO);
        for i in 0..3 {
            let (mut v, mut w) = ([Vec3::ZERO; 8], F8::ZERO);
            for k in 0..8 {
                let tangent = list[self.corner[i][if ONE { 0 } else { k }] as usize];
                (v[k], w.0[k]) = (tangent.truncate(), tangent.w);
            }
            t = t + V8::gather(v) * self.b[i];
            sign = w;
        }
        let t = (t - normal * normal.dot(t)).unit();
        (t, normal.cross(t) * sign)
    }
}

impl<const ONE: bool, S: Slopes> Varying<'_, ONE, S> {
    /// Tangent and bitangent from the triangle's own texture coordinates (Lengyel 2001).
    #[inline(always)]
    fn derived_frame(&self, normal: V8, map: &TextureRef) -> (V8, V8) {
        let Some(mut c) = self.corner_uvs(map.uv_set) else { return (V8::ZERO, V8::ZERO) };
        let m = map.transform.matrix2;
        for c in &mut c {
            *c = [c[0] * m.x_axis.x + c[1] * m.y_axis.x, c[0] * m.x_axis.y + c[1] * m.y_axis.y];
        }
        let (e1, e2) = (self.p[1] - self.p[0], self.p[2] - self.p[0]);
        let (d1, d2) = ([c[1][0] - c[0][0], c[1][1] - c[0][1]], [c[2][0] - c[0][0], c[2][1] - c[0][1]]);
        let det = d1[0] * d2[1] - d1[1] * d2[0];
        let sign = F8::ZERO.gt(det).select(F8::splat(-1.0), F8::ONE);
        let along_u = (e1 * d2[1] - e2 * d1[1]) * sign;
        let along_v = (e2 * d1[0] - e1 * d2[0]) * sign;
        let t = (along_u - normal * normal.dot(along_u)).unit();
        let b = normal.cross(t);
        (t, V8::select(F8::ZERO.gt(b.dot(along_v)), V8::ZERO - b, b))
    }
}

/// Vertex numbers of triangles `ids`.
#[inline(always)]
pub(crate) fn corners<const ONE: bool>(object: &Object, ids: &[u32; 8]) -> [[u32; 8]; 3] {
    let mut corner = [[0; 8]; 3];
    for k in 0..if ONE { 1 } else { 8 } {
        let t = object.mesh.triangles[ids[k] as usize];
        (corner[0][k], corner[1][k], corner[2][k]) = (t[0], t[1], t[2]);
    }
    corner
}

/// Unit, from points towards the eye.
#[inline(always)]
pub(crate) fn view<const N: usize>(camera: &Camera, position: V3<F<N>>) -> V3<F<N>> {
    match camera.projection {
        Projection::Perspective { .. } => (V3::splat(camera.eye()) - position).unit(),
        Projection::Orthographic { .. } => V3::splat(camera.scene_from_view.matrix3.z_axis.into()),
    }
}

/// `Σ bᵢ vᵢ`.
#[inline(always)]
pub(crate) fn mix(b: &[F8; 3], v: &[V8; 3]) -> V8 {
    v[0] * b[0] + v[1] * b[1] + v[2] * b[2]
}

#[inline(always)]
pub(crate) fn vectors<const ONE: bool>(list: &[Vec3], at: &[u32; 8]) -> V8 {
    if ONE {
        return V8::splat(list[at[0] as usize]);
    }
    let mut v = [Vec3::ZERO; 8];
    for k in 0..8 {
        v[k] = list[at[k] as usize];
    }
    V8::gather(v)
}
