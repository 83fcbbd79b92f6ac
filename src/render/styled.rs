//! The shading equation with what a scene's style adds: ambient light from two sides, tones, shadows.
//!
//! A kernel of its own, called and not inlined, so that plain scenes pay one branch for eight points.

use super::shade::{self, Surface};
use crate::math::power;
use crate::math::simd::{self, F8, Isa, Kernel, V8};
use crate::scene::{Light, Scene, ShadowMap};
use glam::Vec3;

/// `emissive + k_a·I_a(n)·openness + Σ` what the lamps add. `reached` is the share of each lamp's light that arrives; where it
/// says nothing, the scene's map does.
#[inline(never)]
pub(crate) fn light(isa: Isa, surface: &Surface<F8>, scene: &Scene, reached: &[V8]) -> V8 {
    simd::run(isa, Styled { surface, scene, reached })
}

struct Styled<'a> {
    surface: &'a Surface<F8>,
    scene: &'a Scene<'a>,
    reached: &'a [V8],
}

impl Kernel for Styled<'_> {
    type Output = V8;

    #[inline(always)]
    fn run(self) -> V8 {
        let Self { surface: s, scene, reached } = self;
        let above = V8::splat(scene.ambient);
        let ambient = match scene.style.below {
            Some(below) => {
                let below = V8::splat(below);
                below + (above - below) * (s.normal.y * 0.5 + 0.5)
            }
            None => above,
        };
        let base = shade::unlit(s, ambient);
        match scene.style.toon {
            Some(steps) => base + toon(s, scene, reached, steps),
            None => base + smooth(s, scene, reached),
        }
    }
}

/// `Σ I·reflected`, the key light where it arrives.
#[inline(always)]
fn smooth(s: &Surface<F8>, scene: &Scene, reached: &[V8]) -> V8 {
    let mut sum = V8::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let a = shade::arrival(&light.into(), s.position);
        sum = sum
            + a.intensity * (shade::reflected(s, a.towards, true) * reach(s, scene, reached, i, a.towards));
    }
    sum
}

/// The darkest tone's share of the brightest lamp.
const LIFT: f32 = 0.25;

/// The diffuse term in steps, and highlights with an edge (see [`crate::scene::Style::toon`]).
#[inline(always)]
fn toon(s: &Surface<F8>, scene: &Scene, reached: &[V8], steps: u32) -> V8 {
    let (mut irradiance, mut highlight) = (V8::ZERO, V8::ZERO);
    for (i, light) in scene.lights.iter().enumerate() {
        let a = shade::arrival(&light.into(), s.position);
        let n_l = reach(s, scene, reached, i, a.towards) * s.normal.dot(a.towards).max(F8::ZERO);
        irradiance = irradiance + a.intensity * n_l;
        if i > 0 {
            continue;
        }
        let n_h = s.normal.dot((s.view + a.towards).unit()).max(F8::ZERO).min(F8::ONE);
        let bright = power::pow(n_h, s.shininess).gt(F8::splat(0.5)) & n_l.y.gt(F8::ZERO);
        highlight = V8::select(bright, a.intensity * s.specular, V8::ZERO);
    }
    let key = brightest(&scene.lights);
    let scale = 1.0 / key.max_element().max(1e-30);
    let y = irradiance.x.max(irradiance.y).max(irradiance.z) * scale;
    let top = (steps.max(2) - 1) as f32;
    let step = (y.min(F8::ONE) * (top + 1.0)).floor().to_f32().min(F8::splat(top));
    s.diffuse * V8::splat(key) * (step * ((1.0 - LIFT) / top) + LIFT) + highlight
}

/// The colour of the lamp whose largest channel is largest; of several, the first.
#[inline(always)]
fn brightest(lights: &[Light]) -> Vec3 {
    let mut best = Vec3::ZERO;
    for l in lights {
        if l.color.max_element() > best.max_element() {
            best = l.color;
        }
    }
    best
}

/// The share of a lamp's light that arrives, 0…1.
#[inline(always)]
fn reach(s: &Surface<F8>, scene: &Scene, reached: &[V8], lamp: usize, towards: V8) -> V8 {
    match (reached.get(lamp), scene.style.shadow) {
        (Some(share), _) => *share,
        (None, Some(map)) if lamp == 0 => {
            let share = unshadowed(map, s.position, s.normal.dot(towards));
            V8 { x: share, y: share, z: share }
        }
        _ => V8::splat(Vec3::ONE),
    }
}

/// The mean, over a square of `2·radius` texels, of what is not farther from the lamp than the map's surface.
///
/// A surface that is tilted by θ recedes from the lamp by `tan θ` a texel, and a texel of the map holds the depth of its
/// centre. So a texel that the square touches, up to `radius + ½` away along each axis, may hold a surface that is nearer to the lamp by
/// `(radius + ½)·√2·tan θ` texels although it is the same plane: this much is allowed, beside a constant for curved and
/// rounded ones. Beyond 80° the tangent is held, since what is left of the light there does not show.
#[inline(always)]
fn unshadowed(map: &ShadowMap, position: V8, cos: F8) -> F8 {
    if !cos.gt(F8::ZERO).any() {
        return F8::ONE;
    }
    let m = &map.texel_from_scene;
    let row = |x: f32, y: f32, z: f32, t: f32| position.x * x + position.y * y + position.z * z + t;
    let (a, b, c, t) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation);
    let (x, y, z) = (row(a.x, b.x, c.x, t.x), row(a.y, b.y, c.y, t.y), row(a.z, b.z, c.z, t.z));
    let cos = cos.max(F8::splat(0.17)).min(F8::ONE);
    let tan = (F8::ONE - cos * cos).sqrt() / cos;
    let z = z - (tan * (map.texel * std::f32::consts::SQRT_2 * (map.radius + 0.5)) + map.bias);
    let mut out = F8::ONE;
    for k in 0..8 {
        out.0[k] = share(map, x.0[k], y.0[k], z.0[k]);
    }
    out
}

/// [`unshadowed`] at one place in the map.
fn share(map: &ShadowMap, x: f32, y: f32, z: f32) -> f32 {
    let (r, n) = (map.radius, map.size as f32);
    let inside = x > r && y > r && x < n - r && y < n - r;
    if !inside {
        return 1.0;
    }
    let (x0, y0) = ((x - r).floor(), (y - r).floor());
    let taps = (2.0 * r).ceil() as usize + 1;
    // The weights are summed as the light is, so that nothing dark in reach gives exactly 1.
    let (mut sum, mut whole) = (0.0, 0.0);
    for j in 0..taps {
        let top = y0 + j as f32;
        let high = ((y + r).min(top + 1.0) - (y - r).max(top)).max(0.0);
        let row = (top as usize).min(map.size - 1) * map.size;
        let (mut lit, mut all) = (0.0, 0.0);
        for i in 0..taps {
            let left = x0 + i as f32;
            let wide = ((x + r).min(left + 1.0) - (x - r).max(left)).max(0.0);
            let open = map.depth[row + (left as usize).min(map.size - 1)] >= z;
            lit += if open { wide } else { 0.0 };
            all += wide;
        }
        sum += high * lit;
        whole += high * all;
    }
    sum / whole
}
