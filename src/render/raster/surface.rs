//! What a triangle's corners give at a pixel: perspective-correct varyings.

use super::frame::{Class, Draw, Frame, Projector};
use super::resolve;
use crate::math::simd::{self, F8, I8, Kernel, V8};
use crate::render::material::{self, Points};
use crate::render::sample::Uv;
use crate::scene::{Projection, TextureRef};
use glam::{Vec2, Vec3, Vec4};

/// Eight points on triangles of one draw; `ONE`: all of the same triangle.
struct Seen<'a, const ONE: bool> {
    draw: &'a Draw<'a>,
    corner: [[u32; 8]; 3],
    /// Corners relative to the pixels: x, y and w of each.
    clip: [[F8; 3]; 3],
    /// `1 / Σ eᵢ`, of the point that was pulled in.
    scale: F8,
    /// Barycentric coordinates in scene space.
    b: [F8; 3],
    p: [V8; 3],
    position: V8,
    view: V8,
}

impl<'a, const ONE: bool> Seen<'a, ONE> {
    /// The points of triangles `ids` that pixels show; `px`, `py` from the picture's centre. `known` are the picture
    /// coordinates of the corners if there is one triangle only.
    ///
    /// With `cᵢ = (xᵢ − px·wᵢ, yᵢ − py·wᵢ)`, `bᵢ ∝ eᵢ = cⱼ × cₖ` (Olano and Greer 1997): no division by `w`, so corners
    /// behind the eye do no harm, and no clipped corner is ever needed.
    #[inline(always)]
    fn new(frame: &Frame, draw: &'a Draw, ids: &[u32; 8], known: &[Vec4; 3], px: F8, py: F8) -> Self {
        let triangles = &draw.object.mesh.triangles;
        let mut corner = [[0; 8]; 3];
        for k in 0..if ONE { 1 } else { 8 } {
            let t = triangles[ids[k] as usize];
            (corner[0][k], corner[1][k], corner[2][k]) = (t[0], t[1], t[2]);
        }
        let (mut p, mut clip) = ([V8::ZERO; 3], [[F8::ZERO; 3]; 3]);
        for i in 0..3 {
            p[i] = vectors::<ONE>(draw.object.positions, &corner[i]);
            let [x, y, w] = if ONE {
                [F8::splat(known[i].x), F8::splat(known[i].y), F8::splat(known[i].w)]
            } else {
                let m = &frame.project;
                [Projector::row8(m.x, p[i]), Projector::row8(m.y, p[i]), Projector::row8(m.w, p[i])]
            };
            clip[i] = [x - px * w, y - py * w, w];
        }
        let e = [cross(&clip[1], &clip[2]), cross(&clip[2], &clip[0]), cross(&clip[0], &clip[1])];

        // Rounding, snapping and centroids of several triangles may put a point just outside: pull it in.
        let sum = e[0] + e[1] + e[2];
        let turned = F8::ZERO.gt(sum);
        let inside = |k: usize| turned.select(-e[k], e[k]).max(F8::ZERO);
        let (e0, e1, e2) = (inside(0), inside(1), inside(2));
        let norm = F8::ONE / (e0 + e1 + e2).max(F8::splat(1e-30));
        let b = [e0 * norm, e1 * norm, e2 * norm];
        let scale = turned.select(-norm, norm);
        let position = mix(&b, &p);
        let camera = &frame.scene.camera;
        let view = match camera.projection {
            Projection::Perspective { .. } => (V8::splat(camera.eye()) - position).unit(),
            Projection::Orthographic { .. } => V8::splat(camera.scene_from_view.matrix3.z_axis.into()),
        };
        Self { draw, corner, clip, scale, b, p, position, view }
    }

    /// Geometric normal, not unit, on the side where triangles wind counter-clockwise.
    #[inline(always)]
    fn face(&self) -> V8 {
        let n = (self.p[1] - self.p[0]).cross(self.p[2] - self.p[0]);
        if self.draw.object.mirrored { V8::ZERO - n } else { n }
    }

    /// Texture coordinates of the corners.
    #[inline(always)]
    fn corner_uvs(&self, set: u8) -> Option<[[F8; 2]; 3]> {
        let list = &self.draw.object.mesh.uvs[(set & 1) as usize];
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

    /// How `b` changes along the picture: `∂bᵢ = (∂eᵢ − bᵢ Σ ∂eⱼ) / Σ eⱼ`, for x and for y.
    #[inline(always)]
    fn slopes(&self) -> [[F8; 3]; 2] {
        let c = &self.clip;
        let mut d = [[F8::ZERO; 3]; 2];
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            d[0][i] = c[j][1] * c[k][2] - c[j][2] * c[k][1];
            d[1][i] = c[j][2] * c[k][0] - c[j][0] * c[k][2];
        }
        for d in &mut d {
            let sum = d[0] + d[1] + d[2];
            for i in 0..3 {
                d[i] = (d[i] - self.b[i] * sum) * self.scale;
            }
        }
        d
    }
}

impl<const ONE: bool> Points for Seen<'_, ONE> {
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
        let list = self.draw.object.normals;
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
        let [x, y] = self.slopes();
        Uv {
            u: at(&self.b, 0),
            v: at(&self.b, 1),
            right: [at(&x, 0), at(&x, 1)],
            down: [at(&y, 0), at(&y, 1)],
        }
    }

    #[inline(always)]
    fn color(&self) -> Option<[F8; 4]> {
        let list: &[Vec4] = &self.draw.object.mesh.colors;
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
        let list = self.draw.object.tangents;
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

impl<const ONE: bool> Seen<'_, ONE> {
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

#[inline(always)]
fn cross(a: &[F8; 3], b: &[F8; 3]) -> F8 {
    a[0] * b[1] - a[1] * b[0]
}

/// `Σ bᵢ vᵢ`.
#[inline(always)]
fn mix(b: &[F8; 3], v: &[V8; 3]) -> V8 {
    v[0] * b[0] + v[1] * b[1] + v[2] * b[2]
}

#[inline(always)]
fn vectors<const ONE: bool>(list: &[Vec3], at: &[u32; 8]) -> V8 {
    if ONE {
        return V8::splat(list[at[0] as usize]);
    }
    let mut v = [Vec3::ZERO; 8];
    for k in 0..8 {
        v[k] = list[at[k] as usize];
    }
    V8::gather(v)
}

/// Homogeneous picture coordinates of a triangle's corners.
#[inline(always)]
pub(super) fn corners_of(frame: &Frame, draw: &Draw, id: u32) -> [Vec4; 3] {
    let [a, b, c] = draw.object.mesh.triangles[id as usize];
    let at = |v: u32| frame.project.point(draw.object.positions[v as usize]);
    [at(a), at(b), at(c)]
}

/// Points to be shaded, eight by eight.
pub(super) struct Shade<'a, const ONE: bool> {
    pub frame: &'a Frame<'a>,
    pub draw: &'a Draw<'a>,
    /// Triangles, counted in the draw; if it is one triangle, once for all.
    pub ids: &'a [[u32; 8]],
    /// Its corners, by [`corners_of`], if it is one triangle.
    pub known: &'a [Vec4; 3],
    /// Where in the tile.
    pub keys: &'a [I8],
    /// The tile's first pixel, from the picture's centre.
    pub corner: [f32; 2],
    /// Linear light, premultiplied, and alpha.
    pub out: &'a mut [[F8; 4]],
}

impl<const ONE: bool> Shade<'_, ONE> {
    /// Fill `out`.
    ///
    /// A call and not inlined: this is the largest kernel, and it is needed in several places.
    pub fn colors(self) {
        simd::run(self.frame.isa, self);
    }
}

impl<const ONE: bool> Kernel for Shade<'_, ONE> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { frame, draw, ids, known, keys, corner, out } = self;
        for (i, (keys, out)) in keys.iter().zip(out).enumerate() {
            let [px, py] = resolve::points(corner, keys);
            let seen = Seen::<ONE>::new(frame, draw, &ids[if ONE { 0 } else { i }], known, px, py);
            let (c, alpha) = material::light(frame.isa, frame.scene, draw.material, &seen);
            *out = match draw.class {
                Class::Blend => [c.x * alpha, c.y * alpha, c.z * alpha, alpha],
                _ => [c.x, c.y, c.z, alpha],
            };
        }
    }
}

/// Eight points that are asked what is there, beside its light.
pub(super) struct Look<'a> {
    pub frame: &'a Frame<'a>,
    pub draw: &'a Draw<'a>,
    /// Triangles, counted in the draw.
    pub ids: &'a [u32; 8],
    /// Where, pixels from the picture's centre.
    pub px: F8,
    pub py: F8,
}

/// What [`Look`] finds.
pub(super) struct Found {
    /// Unit shading normals, scene space.
    pub normal: V8,
    /// Scene space.
    pub position: V8,
    /// Coordinates of the first set; zero where there is none.
    pub uv: [F8; 2],
    /// The corners' vertices, and the points' barycentric coordinates.
    pub corner: [[u32; 8]; 3],
    pub b: [F8; 3],
}

impl Look<'_> {
    pub fn find(self) -> Found {
        simd::run(self.frame.isa, self)
    }
}

impl Kernel for Look<'_> {
    type Output = Found;

    #[inline(always)]
    fn run(self) -> Found {
        let Self { frame, draw, ids, px, py } = self;
        let seen = Seen::<false>::new(frame, draw, ids, &[Vec4::ZERO; 3], px, py);
        let normal = material::shading_normal(frame.isa, frame.scene, draw.material, &seen);
        let Uv { u, v, .. } = seen.uv(0);
        Found { normal, position: seen.position, uv: [u, v], corner: seen.corner, b: seen.b }
    }
}

/// Eight points of one triangle to be held against the material's cut-off.
pub(super) struct Present<'a> {
    pub frame: &'a Frame<'a>,
    pub draw: &'a Draw<'a>,
    pub id: u32,
    pub px: F8,
    pub py: F8,
}

impl Present<'_> {
    /// Mask of the points where the surface is there.
    pub fn mask(self) -> I8 {
        simd::run(self.frame.isa, self)
    }
}

impl Kernel for Present<'_> {
    type Output = I8;

    #[inline(always)]
    fn run(self) -> I8 {
        let known = corners_of(self.frame, self.draw, self.id);
        let seen = Seen::<true>::new(self.frame, self.draw, &[self.id; 8], &known, self.px, self.py);
        material::present(self.frame.isa, self.frame.scene, self.draw.material, &seen)
    }
}
