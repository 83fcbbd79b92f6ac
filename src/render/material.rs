//! Materials at eight points: what the textures say, and the light that comes from there.

use super::sample::{self, Uv};
use super::shade::{self, Surface};
use super::styled;
use crate::math::power;
use crate::math::simd::{F8, I8, Isa, V8};
use crate::scene::{AlphaMode, Material, Scene, TextureRef};
use glam::Affine2;

/// Eight points of a surface, as a renderer finds them.
pub(crate) trait Points {
    /// Where they are, scene space.
    fn position(&self) -> V8;
    /// Unit, towards the eye.
    fn view(&self) -> V8;
    /// Interpolated or flat, unit, on the side where triangles wind counter-clockwise.
    fn normal(&self) -> V8;
    /// Mask of points that are seen from behind.
    fn away(&self) -> I8;
    /// Texture coordinates of a set.
    fn uv(&self, set: u8) -> Uv;
    /// Interpolated vertex colours, if the mesh has any.
    fn color(&self) -> Option<[F8; 4]>;
    /// Unit tangent and bitangent of a set of coordinates under a transform.
    fn tangent_frame(&self, normal: V8, map: &TextureRef) -> (V8, V8);
}

/// The scene's textures at eight points, or nothing where a material has none: of that case the compiler leaves no trace of textures.
struct Maps<'a, const ANY: bool> {
    isa: Isa,
    scene: &'a Scene<'a>,
    uv: [Uv; 2],
}

/// All maps of a material.
#[inline(always)]
fn maps(m: &Material) -> impl Iterator<Item = &TextureRef> {
    let maps = [&m.diffuse_map, &m.specular_map, &m.emissive_map, &m.normal_map, &m.occlusion_map];
    maps.into_iter().flatten()
}

impl<'a, const ANY: bool> Maps<'a, ANY> {
    #[inline(always)]
    fn new(isa: Isa, scene: &'a Scene, m: &Material, p: &impl Points) -> Self {
        let mut used = [false; 2];
        if ANY {
            maps(m).for_each(|m| used[(m.uv_set & 1) as usize] = true);
        }
        let mut uv = [Uv::ZERO; 2];
        for set in 0..2 {
            if used[set] {
                uv[set] = p.uv(set as u8);
            }
        }
        Self { isa, scene, uv }
    }

    /// `None` where there is no such map, or the scene has no such texture.
    #[inline(always)]
    fn texel(&self, map: &Option<TextureRef>) -> Option<[F8; 4]> {
        if ANY { self.look_up(map.as_ref()?) } else { None }
    }

    #[inline(never)]
    fn look_up(&self, map: &TextureRef) -> Option<[F8; 4]> {
        let texture = self.scene.textures.get(map.texture.0 as usize)?;
        let uv = &self.uv[(map.uv_set & 1) as usize];
        if map.transform == Affine2::IDENTITY {
            return Some(sample::sample(self.isa, texture, uv));
        }
        Some(sample::sample(self.isa, texture, &transformed(uv, &map.transform)))
    }
}

#[inline(always)]
fn transformed(uv: &Uv, by: &Affine2) -> Uv {
    let (x, y, t) = (by.matrix2.x_axis, by.matrix2.y_axis, by.translation);
    let turn = |a: F8, b: F8| [a * x.x + b * y.x, a * x.y + b * y.y];
    let [u, v] = turn(uv.u, uv.v);
    Uv { u: u + t.x, v: v + t.y, right: turn(uv.right[0], uv.right[1]), down: turn(uv.down[0], uv.down[1]) }
}

/// `k_d` and alpha.
#[inline(always)]
fn diffuse<const ANY: bool>(maps: &Maps<ANY>, m: &Material, p: &impl Points) -> (V8, F8) {
    let d = m.diffuse;
    let (mut rgb, mut alpha) = (V8::splat(d.truncate()), F8::splat(d.w));
    if let Some(c) = p.color() {
        rgb = rgb * V8 { x: c[0], y: c[1], z: c[2] };
        alpha = alpha * c[3];
    }
    if let Some(t) = maps.texel(&m.diffuse_map) {
        rgb = rgb * V8 { x: t[0], y: t[1], z: t[2] };
        alpha = alpha * t[3];
    }
    (rgb, alpha)
}

/// Mask of points where a surface with a cut-off is there.
#[inline(always)]
pub(crate) fn present(isa: Isa, scene: &Scene, m: &Material, p: &impl Points) -> I8 {
    match m.alpha {
        AlphaMode::Mask(cut_off) => {
            diffuse(&Maps::<true>::new(isa, scene, m, p), m, p).1.ge(F8::splat(cut_off))
        }
        _ => I8::splat(-1),
    }
}

/// Alpha of what has any, 0…1.
#[inline(always)]
pub(crate) fn alpha(isa: Isa, scene: &Scene, m: &Material, p: &impl Points) -> F8 {
    diffuse(&Maps::<true>::new(isa, scene, m, p), m, p).1.clamp01()
}

/// What is to be lit, and alpha as in [`light`]; what is unlit shines by itself.
#[inline(always)]
pub(crate) fn surface(isa: Isa, scene: &Scene, m: &Material, p: &impl Points) -> (Surface<F8>, F8) {
    let maps = &Maps::<true>::new(isa, scene, m, p);
    let (k_d, alpha) = diffuse(maps, m, p);
    let alpha = if m.alpha == AlphaMode::Blend { alpha.clamp01() } else { F8::ONE };
    let surface = lit(maps, m, p, k_d);
    if m.unlit {
        let (ambient, diffuse, specular) = (V8::ZERO, V8::ZERO, V8::ZERO);
        return (Surface { ambient, diffuse, specular, emissive: k_d, ..surface }, alpha);
    }
    (surface, alpha)
}

/// Linear light, and alpha: 1 unless the material blends. Not multiplied.
#[inline(always)]
pub(crate) fn light(isa: Isa, scene: &Scene, m: &Material, p: &impl Points) -> (V8, F8) {
    if maps(m).next().is_some() {
        return shine(&Maps::<true>::new(isa, scene, m, p), m, p);
    }
    shine(&Maps::<false>::new(isa, scene, m, p), m, p)
}

#[inline(always)]
fn shine<const ANY: bool>(maps: &Maps<ANY>, m: &Material, p: &impl Points) -> (V8, F8) {
    let scene = maps.scene;
    let (k_d, alpha) = diffuse(maps, m, p);
    let alpha = if m.alpha == AlphaMode::Blend { alpha.clamp01() } else { F8::ONE };
    if m.unlit {
        return (k_d, alpha);
    }
    let surface = lit(maps, m, p, k_d);
    if !scene.style.is_plain() {
        // What a call gets has to be in memory; with a copy of its own, the other way's surface stays in registers.
        let copy = surface;
        return (styled::light(maps.isa, &copy, scene, &[]), alpha);
    }
    (shade::blinn_phong(&surface, scene.ambient, &scene.lights), alpha)
}

/// What the textures make of the coefficients.
#[inline(always)]
fn lit<const ANY: bool>(maps: &Maps<ANY>, m: &Material, p: &impl Points, k_d: V8) -> Surface<F8> {
    let (specular, shininess) = highlight(maps, m);
    let mut emissive = V8::splat(m.emissive);
    if let Some(t) = maps.texel(&m.emissive_map) {
        emissive = emissive * V8 { x: t[0], y: t[1], z: t[2] };
    }
    let openness = match maps.texel(&m.occlusion_map) {
        Some(t) => (t[0] + -1.0) * m.occlusion_strength + 1.0,
        None => F8::ONE,
    };
    Surface {
        position: p.position(),
        normal: normal(maps, m, p),
        view: p.view(),
        ambient: m.ambient.map_or(k_d, V8::splat),
        diffuse: k_d,
        specular,
        shininess,
        openness,
        emissive,
    }
}

/// `k_s` and `p`.
#[inline(always)]
fn highlight<const ANY: bool>(maps: &Maps<ANY>, m: &Material) -> (V8, F8) {
    let (k_s, shininess) = (V8::splat(m.specular), F8::splat(m.shininess));
    match maps.texel(&m.specular_map) {
        Some(t) => (k_s * V8 { x: t[0], y: t[1], z: t[2] }, power::pow(shininess, t[3])),
        None => (k_s, shininess),
    }
}

/// The shading normal, normal map included, scene space.
#[inline(always)]
pub(crate) fn shading_normal(isa: Isa, scene: &Scene, m: &Material, p: &impl Points) -> V8 {
    normal(&Maps::<true>::new(isa, scene, m, p), m, p)
}

/// The shading normal, on the eye's side.
#[inline(always)]
fn normal<const ANY: bool>(maps: &Maps<ANY>, m: &Material, p: &impl Points) -> V8 {
    let mut n = p.normal();
    if let (Some(map), Some(t)) = (&m.normal_map, maps.texel(&m.normal_map)) {
        let (tangent, bitangent) = p.tangent_frame(n, map);
        let x = (t[0] * 2.0 + -1.0) * m.normal_scale;
        let y = (t[1] * 2.0 + -1.0) * m.normal_scale;
        n = (tangent * x + bitangent * y + n * (t[2] * 2.0 + -1.0)).unit();
    }
    if m.double_sided { shade::facing(n, p.away()) } else { n }
}
