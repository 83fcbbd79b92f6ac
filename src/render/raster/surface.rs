//! What a triangle's corners give at a pixel: perspective-correct varyings.

use super::frame::{Class, Draw, Frame, Projector};
use super::resolve::{self, Shades};
use super::scan::Key;
use crate::math::simd::{self, F8, I, I8, Kernel, V8};
use crate::render::material::{self, Points};
use crate::render::sample::Uv;
use crate::render::varying::{self, Slopes, Varying, corners, mix, vectors};
use crate::scene::Object;
use glam::Vec4;

/// Points of triangles, as pixels show them.
type Seen<'a, const ONE: bool> = Varying<'a, ONE, Clip>;

/// Corners relative to the pixels.
struct Clip {
    /// x, y and w of each.
    corners: [[F8; 3]; 3],
    /// `1 / Σ eᵢ`, of the point that was pulled in.
    scale: F8,
}

/// Corners of the triangles that eight points lie on, looked up beforehand: through memory, as what is computed right from single
/// numbers becomes vector instructions in parts only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    at: [[u32; 8]; 3],
    p: [V8; 3],
    normals: [V8; 3],
}

impl Corners {
    pub const NONE: Self = Self { at: [[0; 8]; 3], p: [V8::ZERO; 3], normals: [V8::ZERO; 3] };

    /// Fill lists of the same length. A call, so that its few numbers stay in registers.
    #[inline(never)]
    fn look_up(object: &Object, ids: &[[u32; 8]], out: &mut [Self]) {
        let normals = if object.normals.is_empty() { object.positions } else { object.normals };
        for (ids, out) in ids.iter().zip(out) {
            for k in 0..8 {
                let t = object.mesh.triangles[ids[k] as usize];
                for c in 0..3 {
                    let (p, n) = (object.positions[t[c] as usize], normals[t[c] as usize]);
                    out.at[c][k] = t[c];
                    (out.p[c].x.0[k], out.p[c].y.0[k], out.p[c].z.0[k]) = (p.x, p.y, p.z);
                    let to = &mut out.normals[c];
                    (to.x.0[k], to.y.0[k], to.z.0[k]) = (n.x, n.y, n.z);
                }
            }
        }
    }
}

/// The points of triangles that pixels show; `px`, `py` from the picture's centre. If there is `ONE`, it is `id`, and `known` are the
/// picture coordinates of its corners; if not, `found` is what has been looked up.
///
/// With `cᵢ = (xᵢ − px·wᵢ, yᵢ − py·wᵢ)`, `bᵢ ∝ eᵢ = cⱼ × cₖ` (Olano and Greer 1997): no division by `w`, so corners
/// behind the eye do no harm, and no clipped corner is ever needed.
#[inline(always)]
fn seen<'a, const ONE: bool>(
    frame: &Frame,
    draw: &'a Draw,
    id: u32,
    known: &[Vec4; 3],
    found: &Corners,
    px: F8,
    py: F8,
) -> Seen<'a, ONE> {
    let object = draw.object;
    let corner = if ONE { corners::<true>(object, &[id; 8]) } else { found.at };
    let normals = if ONE || object.normals.is_empty() { None } else { Some(found.normals) };
    let (mut p, mut clip) = (found.p, [[F8::ZERO; 3]; 3]);
    for i in 0..3 {
        let [x, y, w] = if ONE {
            p[i] = vectors::<true>(object.positions, &corner[i]);
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
    let view = varying::view(&frame.scene.camera, position);
    Varying { object, corner, b, p, normals, position, view, slopes: Clip { corners: clip, scale } }
}

impl Slopes for Clip {
    /// `∂bᵢ = (∂eᵢ − bᵢ Σ ∂eⱼ) / Σ eⱼ`.
    #[inline(always)]
    fn slopes(&self, b: &[F8; 3], _: &[V8; 3]) -> [[F8; 3]; 2] {
        let c = &self.corners;
        let mut d = [[F8::ZERO; 3]; 2];
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            d[0][i] = c[j][1] * c[k][2] - c[j][2] * c[k][1];
            d[1][i] = c[j][2] * c[k][0] - c[j][0] * c[k][2];
        }
        for d in &mut d {
            let sum = d[0] + d[1] + d[2];
            for i in 0..3 {
                d[i] = (d[i] - b[i] * sum) * self.scale;
            }
        }
        d
    }
}

#[inline(always)]
fn cross(a: &[F8; 3], b: &[F8; 3]) -> F8 {
    a[0] * b[1] - a[1] * b[0]
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
    /// Working memory as long as `ids`, if it is more than one.
    pub found: &'a mut [Corners],
    /// Where in the tile.
    pub keys: &'a [[Key; 8]],
    /// The tile's first pixel, from the picture's centre.
    pub corner: [f32; 2],
    /// Linear light, premultiplied, and alpha.
    pub out: &'a mut Shades,
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
        let Self { frame, draw, ids, known, found, keys, corner, out } = self;
        if !ONE {
            Corners::look_up(draw.object, ids, found);
        }
        for (i, keys) in keys.iter().enumerate() {
            let [px, py] = resolve::points(corner, &I(*keys));
            let found = if ONE { &Corners::NONE } else { &found[i] };
            let seen = seen::<ONE>(frame, draw, ids[0][0], known, found, px, py);
            let (c, alpha) = material::light(frame.isa, frame.scene, draw.material, &seen);
            let rgba = match draw.class {
                Class::Blend => [c.x * alpha, c.y * alpha, c.z * alpha, alpha],
                _ => [c.x, c.y, c.z, alpha],
            };
            out.set(i, &rgba);
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
        let mut found = [Corners::NONE];
        Corners::look_up(draw.object, &[*ids], &mut found);
        let seen = seen::<false>(frame, draw, ids[0], &[Vec4::ZERO; 3], &found[0], px, py);
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
        let (frame, draw, found) = (self.frame, self.draw, &Corners::NONE);
        let seen = seen::<true>(frame, draw, self.id, &known, found, self.px, self.py);
        material::present(self.frame.isa, self.frame.scene, self.draw.material, &seen)
    }
}
