//! Points of one triangle of clay: a material that is the same all over, with nothing but lamps to light it.
//!
//! Most of a picture's work is here or could be, so it has a kernel of its own that asks nothing at every point, and that is as wide as
//! the machine: sixteen points at once take half the instructions of twice eight.

use super::TILE;
use super::frame::{Draw, Frame};
use super::resolve::{self, Shades};
use super::scan::{self, Key};
use crate::math::lanes::V3;
use crate::math::simd::{self, F, I, WideKernel};
use crate::render::shade::{self, Surface};
use crate::render::varying;
use glam::{Vec3, Vec4};

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
    pub out: &'a mut Shades,
}

impl Clay<'_> {
    /// Fill `out`.
    pub fn colors(self) {
        simd::run_wide(self.frame.isa, self);
    }
}

impl WideKernel for Clay<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize>(self) {
        let Self { frame, draw, id, known, keys, n, corner, out } = self;
        let (scene, m) = (frame.scene, draw.material);
        let edges = Edges::new(known, corner, keys[0]);
        let t = draw.object.mesh.triangles[id as usize];
        let positions = Attribute::new(draw.object.positions, t);
        let normals = Attribute::new(draw.object.normals, t);
        let k_d = m.diffuse.truncate();
        let still = m.emissive + m.ambient.unwrap_or(k_d) * scene.ambient;
        let [red, green, blue, alpha] = &mut out.0;
        let rgb = red
            .as_chunks_mut::<N>()
            .0
            .iter_mut()
            .zip(green.as_chunks_mut::<N>().0)
            .zip(blue.as_chunks_mut::<N>().0);
        let out = rgb.zip(alpha.as_chunks_mut::<N>().0);
        for (keys, (((red, green), blue), alpha)) in keys.as_chunks::<N>().0[..n.div_ceil(N)].iter().zip(out)
        {
            let b = edges.at(&I(*keys));
            let position = positions.at(&b);
            let s = Surface {
                position,
                normal: normals.at(&b).unit(),
                view: varying::view(&scene.camera, position),
                ambient: V3::ZERO,
                diffuse: V3::splat(k_d),
                specular: V3::splat(m.specular),
                shininess: F::splat(m.shininess),
                openness: F::ONE,
                emissive: V3::ZERO,
            };
            let mut light = V3::splat(still);
            for lamp in &frame.lamps {
                let a = shade::arrival(lamp, s.position);
                light = light + a.intensity * shade::reflected(&s, a.towards, true);
            }
            (*red, *green, *blue, *alpha) = (light.x.0, light.y.0, light.z.0, [1.0; N]);
        }
    }
}

/// What a triangle's corners have.
struct Attribute([Vec3; 3]);

impl Attribute {
    #[inline(always)]
    fn new(list: &[Vec3], t: [u32; 3]) -> Self {
        Self([list[t[0] as usize], list[t[1] as usize], list[t[2] as usize]])
    }

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

    /// Barycentric coordinates; points just outside are pulled in.
    #[inline(always)]
    fn at<const N: usize>(&self, keys: &I<N>) -> [F<N>; 3] {
        let [x, y] = resolve::points([-self.pixel[0], -self.pixel[1]], keys);
        let e = &self.e;
        let e0 = (x * e[0][1] + y * e[0][2] + e[0][0]).max(F::ZERO);
        let e1 = (x * e[1][1] + y * e[1][2] + e[1][0]).max(F::ZERO);
        let e2 = (x * e[2][1] + y * e[2][2] + e[2][0]).max(F::ZERO);
        let norm = F::ONE / (e0 + e1 + e2).max(F::splat(1e-30));
        [e0 * norm, e1 * norm, e2 * norm]
    }
}

/// `a × b` at the pixel, and its slopes.
#[inline(always)]
fn plane(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[0] * b[1] - a[1] * b[0], a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]]
}
