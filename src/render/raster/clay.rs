//! Points of one triangle of clay: lit by nothing but lamps, and of a material that is the same all over but for its colour.
//!
//! Most of a picture is made of it, so it has a kernel of its own, which asks nothing at every point that the triangle can answer, and which
//! is as wide as the machine: sixteen points at once take half the instructions of twice eight.

use super::TILE;
use super::encode;
use super::frame::{Draw, Frame};
use super::resolve::{self, Shades};
use super::scan::{self, Key};
use crate::math::lanes::V3;
use crate::math::simd::{self, F, I, WideKernel};
use crate::render::sample::{self, Uv};
use crate::render::shade::{self, Surface};
use crate::render::varying;
use crate::scene::{Camera, Projection};
use glam::{Vec2, Vec3, Vec4};

/// Points to be shaded.
pub(super) struct Clay<'a> {
    pub frame: &'a Frame<'a>,
    pub draw: &'a Draw<'a>,
    /// The triangle, counted in the draw.
    pub id: u32,
    /// Its corners, by [`super::surface::corners_of`].
    pub known: &'a [Vec4; 3],
    /// Where in the tile; beyond the last that counts, any that are there fill the lanes.
    pub keys: &'a [Key],
    /// How many count.
    pub n: usize,
    /// The tile's first pixel, from the picture's centre.
    pub corner: [f32; 2],
    /// Whether `out` takes codes.
    pub coded: bool,
    pub out: &'a mut Shades,
}

impl Clay<'_> {
    /// Fill `out`; lanes that nobody needs would fetch texels all the same.
    pub fn colors(self) {
        match self.n {
            0..=8 => simd::run_narrow(self.frame.isa, self),
            _ => simd::run_wide(self.frame.isa, self),
        }
    }
}

impl WideKernel for Clay<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize>(self) {
        let Self { frame, draw, id, known, keys, n, corner, coded, out } = self;
        let (scene, m) = (frame.scene, draw.material);
        let edges = Edges::new(known, corner, keys[0]);
        let t = draw.object.mesh.triangles[id as usize];
        let positions = Attribute(corners(draw.object.positions, t));
        let normals = Attribute(side(draw, &scene.camera, &positions.0, corners(draw.object.normals, t)));
        let skin = draw.skin.map(|(texture, map)| {
            let uvs = corners(&draw.object.mesh.uvs[(map.uv_set & 1) as usize], t);
            (texture, uvs.map(|uv| map.transform.transform_point2(uv)))
        });
        for (i, keys) in keys.as_chunks::<N>().0[..n.div_ceil(N)].iter().enumerate() {
            let (b, scale) = edges.at(&I(*keys));
            let position = positions.at(&b);
            let mut k_d = V3::splat(m.diffuse.truncate());
            if let Some((texture, uvs)) = &skin {
                let [r, g, b, _] = sample::sample(frame.isa, texture, &edges.uv(uvs, &b, scale));
                k_d = k_d * V3::new(r, g, b);
            }
            let s = Surface {
                position,
                normal: normals.at(&b).unit(),
                view: varying::view(&scene.camera, position),
                ambient: m.ambient.map_or(k_d, V3::splat),
                diffuse: k_d,
                specular: V3::splat(m.specular),
                shininess: F::splat(m.shininess),
                openness: F::ONE,
                emissive: V3::splat(m.emissive),
            };
            let light = shade::shadowed(&s, V3::splat(scene.ambient), &frame.lamps, &[], true);
            let rgb = [light.x, light.y, light.z];
            if coded {
                out.codes.as_chunks_mut::<N>().0[i] = encode::encode_opaque(rgb).0;
                continue;
            }
            for (plane, channel) in out.light.iter_mut().zip([rgb[0], rgb[1], rgb[2], F::ONE]) {
                plane.as_chunks_mut::<N>().0[i] = channel.0;
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
    let face = (p[1] - p[0]).cross(p[2] - p[0]);
    let view = match camera.projection {
        Projection::Perspective { .. } => camera.eye() - p[0],
        Projection::Orthographic { .. } => camera.scene_from_view.matrix3.z_axis.into(),
    };
    let away = (face.dot(view) < 0.0) != draw.object.mirrored;
    if draw.material.double_sided && away { [-n[0], -n[1], -n[2]] } else { n }
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
