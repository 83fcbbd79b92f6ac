//! Points of clay: lit by nothing but lamps, and of a material that is the same all over but for its colour.
//!
//! Most of a picture is made of it, so it has kernels of its own, which ask nothing at every point that the triangle can answer, and which
//! are as wide as the machine. What a triangle gives is put down first, side by side with what others of the draw give; then all of
//! it is lit, then encoded. A point's operations wait for each other, from its edges to its code: three short loops let the processor
//! work at several points at once where one long one would not, and no lanes are left empty at a triangle's end.

use super::TILE;
use super::colors::{Colors, Sink};
use super::encode;
use super::frame::{Draw, Frame};
use super::resolve;
use super::scan::{self, Chain, Key, ROOM};
use crate::math::lanes::V3;
use crate::math::simd::{self, F, I, Kernel, WideKernel};
use crate::render::sample::{self, Uv};
use crate::render::shade::{self, Surface};
use crate::render::varying;
use crate::scene::{Camera, Projection};
use glam::{Vec2, Vec3, Vec4};

/// So many points wait at most: they and their light stay in the cache next to the processor.
const MOST: usize = 256;

/// Their places, and those that the last lanes reach beyond them.
const LEN: usize = MOST + ROOM;

/// Points of one draw that wait for their light, a plane a number.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct Points {
    keys: [Key; LEN],
    position: [[f32; LEN]; 3],
    /// Unit, on the eye's side.
    normal: [[f32; LEN]; 3],
    /// Where in the map of `k_d`, if the draw has one: coordinates, and their slopes to the right and down.
    uv: [[[f32; LEN]; 2]; 3],
    /// `k_d`, if the draw has a map of it.
    diffuse: [[f32; LEN]; 3],
    /// Unit, towards the eye.
    view: [[f32; LEN]; 3],
    light: [[f32; LEN]; 3],
    codes: [i32; LEN],
}

impl Default for Points {
    fn default() -> Self {
        let planes = [[0.0; LEN]; 3];
        let (position, normal, diffuse, view, light) = (planes, planes, planes, planes, planes);
        let uv = [[[0.0; LEN]; 2]; 3];
        Self { keys: [0; LEN], position, normal, uv, diffuse, view, light, codes: [0; LEN] }
    }
}

impl Points {
    /// Where some of them lie in the map.
    #[inline(always)]
    fn uv<const N: usize>(&self, at: usize) -> Uv<N> {
        let [along, right, down] = &self.uv;
        let load = |planes: &[[f32; LEN]; 2]| [F::load(&planes[0][at..]), F::load(&planes[1][at..])];
        let [u, v] = load(along);
        Uv { u, v, right: load(right), down: load(down) }
    }

    /// Let lanes beyond the last repeat it: they would fetch texels that nobody needs.
    #[inline(always)]
    fn repeat_last<const N: usize>(&mut self, n: usize) {
        for plane in self.uv.as_flattened_mut() {
            let last = plane[n - 1];
            plane[n..n.next_multiple_of(N)].fill(last);
        }
    }

    /// Some of them, side by side.
    #[inline(always)]
    fn surface<const N: usize>(&self, draw: &Draw, at: usize) -> Surface<F<N>> {
        let m = draw.material;
        let k_d = match draw.skin {
            Some(_) => load(&self.diffuse, at),
            None => V3::splat(m.diffuse.truncate()),
        };
        Surface {
            position: load(&self.position, at),
            normal: load(&self.normal, at),
            view: load(&self.view, at),
            ambient: m.ambient.map_or(k_d, V3::splat),
            diffuse: k_d,
            specular: V3::splat(m.specular),
            shininess: F::splat(m.shininess),
            openness: F::ONE,
            emissive: V3::splat(m.emissive),
        }
    }
}

/// Lanes of three planes.
#[inline(always)]
fn load<const N: usize>(planes: &[[f32; LEN]; 3], at: usize) -> V3<F<N>> {
    let [x, y, z] = planes;
    V3::new(F::load(&x[at..]), F::load(&y[at..]), F::load(&z[at..]))
}

#[inline(always)]
fn store<const N: usize>(planes: &mut [[f32; LEN]; 3], at: usize, v: V3<F<N>>) {
    let [x, y, z] = planes;
    v.x.store(&mut x[at..]);
    v.y.store(&mut y[at..]);
    v.z.store(&mut z[at..]);
}

/// Triangles of one draw to be shaded.
pub(super) struct Clay<'a> {
    pub frame: &'a Frame<'a>,
    pub draw: &'a Draw<'a>,
    /// What is seen of them, in `keys`; each has [`ROOM`] behind it.
    pub chains: &'a [Chain],
    pub keys: &'a mut [Key],
    /// The tile's first pixel, from the picture's centre.
    pub corner: [f32; 2],
    pub points: &'a mut Points,
    pub colors: &'a mut Colors,
}

impl Clay<'_> {
    /// Put their colours where they belong.
    pub fn shade(self) {
        simd::run_wide(self.frame.isa, self);
    }
}

impl WideKernel for Clay<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize>(self) {
        let Self { frame, draw, chains, keys, corner, points, colors } = self;
        let (mut triangles, mut n) = ([Triangle::NONE; 16], 0);
        for chains in chains.chunks(triangles.len()) {
            for (chain, triangle) in chains.iter().zip(&mut triangles) {
                let first = keys[chain.first as usize];
                *triangle = Triangle::new(frame, draw, chain.id - draw.first_triangle, corner, first);
            }
            for (chain, triangle) in chains.iter().zip(&triangles) {
                let count = chain.count as usize;
                let keys = &mut keys[chain.first as usize..][..count.next_multiple_of(N)];
                for k in count..keys.len() {
                    keys[k] = keys[0];
                }
                for (i, keys) in keys.as_chunks::<N>().0.iter().enumerate() {
                    if n + N > LEN {
                        simd::run_as::<N, _>(frame.isa, Lit::<N> { frame, draw, points, n, colors });
                        n = 0;
                    }
                    triangle.put_down(draw.skin.is_some(), &I(*keys), points, n);
                    n += (count - i * N).min(N);
                }
            }
        }
        simd::run_as::<N, _>(frame.isa, Lit::<N> { frame, draw, points, n, colors });
    }
}

/// Points that have been put down, to be lit and encoded.
struct Lit<'a, const N: usize> {
    frame: &'a Frame<'a>,
    draw: &'a Draw<'a>,
    points: &'a mut Points,
    n: usize,
    colors: &'a mut Colors,
}

impl<const N: usize> Kernel for Lit<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { frame, draw, points, n, colors } = self;
        let scene = frame.scene;
        if let Some((texture, _)) = draw.skin {
            points.repeat_last::<N>(n);
            let k_d = V3::splat(draw.material.diffuse.truncate());
            let (mut uvs, mut texels) = ([Uv::<N>::ZERO; sample::AT_ONCE], [[F::ZERO; 4]; sample::AT_ONCE]);
            for first in (0..n).step_by(N * sample::AT_ONCE) {
                let batches = (n - first).div_ceil(N).min(sample::AT_ONCE);
                for (i, uv) in uvs[..batches].iter_mut().enumerate() {
                    *uv = points.uv(first + N * i);
                }
                sample::sample_all(frame.isa, texture, &uvs[..batches], &mut texels[..batches]);
                for (i, [r, g, b, _]) in texels[..batches].iter().enumerate() {
                    store(&mut points.diffuse, first + N * i, k_d * V3::new(*r, *g, *b));
                }
            }
        }
        for at in (0..n).step_by(N) {
            store(&mut points.view, at, varying::view(&scene.camera, load::<N>(&points.position, at)));
            let light = shade::unlit(&points.surface::<N>(draw, at), V3::splat(scene.ambient));
            store(&mut points.light, at, light);
        }
        for lamp in &frame.lamps {
            for at in (0..n).step_by(N) {
                let s = points.surface::<N>(draw, at);
                let a = shade::arrival(lamp, s.position);
                let light = load(&points.light, at) + a.intensity * shade::reflected(&s, a.towards, true);
                store(&mut points.light, at, light);
            }
        }
        let Points { keys, light, codes, .. } = points;
        if colors.sink == Sink::Codes {
            for at in (0..n).step_by(N) {
                let V3 { x, y, z } = load::<N>(light, at);
                let words: &mut [i32; N] = (&mut codes[at..at + N]).try_into().expect("as many as lanes");
                *words = encode::encode_opaque([x, y, z]).0;
            }
        }
        colors.put_opaque(&keys[..n], light, codes);
    }
}

/// A triangle, ready to be asked at points.
struct Triangle {
    edges: Edges,
    positions: Attribute,
    normals: Attribute,
    /// Coordinates of the map, if the draw has one.
    uvs: [Vec2; 3],
}

impl Triangle {
    const NONE: Self = Self {
        edges: Edges { e: [[0.0; 3]; 3], pixel: [0.0; 2] },
        positions: Attribute([Vec3::ZERO; 3]),
        normals: Attribute([Vec3::ZERO; 3]),
        uvs: [Vec2::ZERO; 3],
    };

    #[inline(always)]
    fn new(frame: &Frame, draw: &Draw, id: u32, corner: [f32; 2], key: Key) -> Self {
        let t = draw.object.mesh.triangles[id as usize];
        let positions = corners(draw.object.positions, t);
        let edges = Edges::new(&positions.map(|p| frame.project.point(p)), corner, key);
        let normals = side(draw, &frame.scene.camera, &positions, corners(draw.object.normals, t));
        let uvs = draw.skin.map_or([Vec2::ZERO; 3], |(_, map)| {
            let uvs = corners(&draw.object.mesh.uvs[(map.uv_set & 1) as usize], t);
            uvs.map(|uv| map.transform.transform_point2(uv))
        });
        Self { edges, positions: Attribute(positions), normals: Attribute(normals), uvs }
    }

    /// What it gives at points.
    #[inline(always)]
    fn put_down<const N: usize>(&self, has_map: bool, keys: &I<N>, points: &mut Points, at: usize) {
        let (b, scale) = self.edges.at(keys);
        points.keys[at..at + N].copy_from_slice(&keys.0);
        store(&mut points.position, at, self.positions.at(&b));
        store(&mut points.normal, at, self.normals.at(&b).unit());
        if has_map {
            let Uv { u, v, right, down } = self.edges.uv(&self.uvs, &b, scale);
            for (planes, uv) in points.uv.iter_mut().zip([[u, v], right, down]) {
                uv[0].store(&mut planes[0][at..]);
                uv[1].store(&mut planes[1][at..]);
            }
        }
    }
}

/// What a triangle's corners have.
#[inline(always)]
fn corners<T: Copy>(list: &[T], t: [u32; 3]) -> [T; 3] {
    [list[t[0] as usize], list[t[1] as usize], list[t[2] as usize]]
}

/// Normals on the eye's side, if the material has two: the eye sees one side of a whole triangle.
#[inline(always)]
fn side(draw: &Draw, camera: &Camera, p: &[Vec3; 3], n: [Vec3; 3]) -> [Vec3; 3] {
    if !draw.material.double_sided {
        return n;
    }
    let face = (p[1] - p[0]).cross(p[2] - p[0]);
    let view = match camera.projection {
        Projection::Perspective { .. } => camera.eye() - p[0],
        Projection::Orthographic { .. } => camera.scene_from_view.matrix3.z_axis.into(),
    };
    let away = (face.dot(view) < 0.0) != draw.object.mirrored;
    if away { [-n[0], -n[1], -n[2]] } else { n }
}

/// What is mixed between corners.
struct Attribute([Vec3; 3]);

impl Attribute {
    #[inline(always)]
    fn at<const N: usize>(&self, b: &[F<N>; 3]) -> V3<F<N>> {
        let v = &self.0;
        V3::splat(v[0]) * b[0] + V3::splat(v[1]) * b[1] + V3::splat(v[2]) * b[2]
    }
}

/// The edge functions of a triangle, `eᵢ = cⱼ × cₖ` as [`super::surface`] has them, as planes over the pixels around one of them: what
/// is large in the picture's coordinates is small in these.
struct Edges {
    /// At the pixel, and what a pixel to the right and a pixel down add.
    e: [[f32; 3]; 3],
    /// The pixel, from the tile's first.
    pixel: [f32; 2],
}

impl Edges {
    #[inline(always)]
    fn new(known: &[Vec4; 3], corner: [f32; 2], key: Key) -> Self {
        let place = scan::place(key);
        let pixel = [(place % TILE) as f32, (place / TILE) as f32];
        let at = |v: &Vec4| [v.x - (corner[0] + pixel[0]) * v.w, v.y - (corner[1] + pixel[1]) * v.w, v.w];
        let (a, b, c) = (at(&known[0]), at(&known[1]), at(&known[2]));
        let (e0, e1, e2) = (plane(&b, &c), plane(&c, &a), plane(&a, &b));
        let turn = if e0[0] + e1[0] + e2[0] < 0.0 { -1.0 } else { 1.0 };
        let turned = |e: [f32; 3]| [turn * e[0], turn * e[1], turn * e[2]];
        Self { e: [turned(e0), turned(e1), turned(e2)], pixel }
    }

    /// Barycentric coordinates, and `1 / Σ eᵢ`; points just outside are pulled in.
    #[inline(always)]
    fn at<const N: usize>(&self, keys: &I<N>) -> ([F<N>; 3], F<N>) {
        let [x, y] = resolve::points([-self.pixel[0], -self.pixel[1]], keys);
        let e = &self.e;
        let e0 = (x * e[0][1] + y * e[0][2] + e[0][0]).max(F::ZERO);
        let e1 = (x * e[1][1] + y * e[1][2] + e[1][0]).max(F::ZERO);
        let e2 = (x * e[2][1] + y * e[2][2] + e[2][0]).max(F::ZERO);
        let scale = F::ONE / (e0 + e1 + e2).max(F::splat(1e-30));
        ([e0 * scale, e1 * scale, e2 * scale], scale)
    }

    /// Texture coordinates, and their slopes: `∂u = (Σ ∂eᵢ uᵢ − u Σ ∂eᵢ) / Σ eᵢ`.
    #[inline(always)]
    fn uv<const N: usize>(&self, at: &[Vec2; 3], b: &[F<N>; 3], scale: F<N>) -> Uv<N> {
        let mix = |u: [f32; 3]| b[0] * u[0] + b[1] * u[1] + b[2] * u[2];
        let [us, vs] = [[at[0].x, at[1].x, at[2].x], [at[0].y, at[1].y, at[2].y]];
        let (u, v) = (mix(us), mix(vs));
        let slope = |along: usize, us: [f32; 3], u: F<N>| {
            let d = [self.e[0][along], self.e[1][along], self.e[2][along]];
            // From one of the corners, so that coordinates far from zero lose nothing.
            let sum = d[1] * (us[1] - us[0]) + d[2] * (us[2] - us[0]);
            (F::splat(sum) - (u + -us[0]) * (d[0] + d[1] + d[2])) * scale
        };
        Uv { u, v, right: [slope(1, us, u), slope(1, vs, v)], down: [slope(2, us, u), slope(2, vs, v)] }
    }
}

/// `a × b` at the pixel, and its slopes.
#[inline(always)]
fn plane(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[0] * b[1] - a[1] * b[0], a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]]
}
