//! Blinn-Phong, once, for every renderer: eight points at a time.

use crate::math::simd::{self, F8, I8, V8};
use crate::scene::{Light, LightKind};
use glam::Vec3;

/// Eight points of a surface, all in scene space and linear light.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    pub position: V8,
    /// Unit, on the eye's side.
    pub normal: V8,
    /// Unit, towards the eye.
    pub view: V8,
    /// `k_d`.
    pub diffuse: V8,
    /// `k_s`.
    pub specular: V8,
    /// `p`.
    pub shininess: F8,
    /// What is left of the ambient light, 0…1.
    pub openness: F8,
    /// Light of its own.
    pub emissive: V8,
}

/// Direction towards a lamp and what arrives from it, before the surface has its say.
#[derive(Clone, Copy)]
pub(crate) struct Arrival {
    /// Unit, towards the lamp.
    pub towards: V8,
    /// `I`, linear RGB.
    pub intensity: V8,
}

/// Light that arrives at points, unshadowed.
///
/// A point light shines with `I` at any distance `d`, or with `I/d² · max(0, 1 − (d/range)⁴)` if it has a range; a spot is
/// a point light times `clamp((cos θ − cos_outer) / (cos_inner − cos_outer))²` (KHR_lights_punctual).
#[inline(always)]
pub(crate) fn arrival(light: &Light, position: V8) -> Arrival {
    let color = V8::splat(light.color);
    match light.kind {
        LightKind::Directional { direction } => Arrival { towards: V8::splat(-direction), intensity: color },
        LightKind::Point { position: p, falloff } => {
            let (towards, gain) = from_point(p, falloff, position);
            Arrival { towards, intensity: color * gain }
        }
        LightKind::Spot { position: p, direction, falloff, cos_inner, cos_outer } => {
            let (towards, gain) = from_point(p, falloff, position);
            let cos = V8::splat(-direction).dot(towards);
            let scale = 1.0 / (cos_inner - cos_outer).max(1e-4);
            let cone = ((cos + -cos_outer) * scale).clamp01();
            Arrival { towards, intensity: color * (gain * cone * cone) }
        }
    }
}

/// Direction towards a point light, and its fall-off.
#[inline(always)]
fn from_point(lamp: Vec3, falloff: Option<f32>, position: V8) -> (V8, F8) {
    let offset = V8::splat(lamp) - position;
    let d2 = offset.dot(offset).max(F8::splat(1e-30));
    let towards = offset * (F8::ONE / d2.sqrt());
    let Some(range) = falloff else { return (towards, F8::ONE) };
    let r2 = d2 * (1.0 / (range * range));
    let fade = (F8::ONE - r2 * r2).clamp01();
    // An infinite range does not fade; a range of zero lights nothing.
    (towards, fade / d2)
}

/// `k_d max(0, n·l) + k_s max(0, n·h)^p` for unit `n`, `l` and `v`, with `h = (v+l)/‖v+l‖`; nothing where `n·l ≤ 0`
/// (notes §3.4–3.6).
///
/// `(n·h)² = (n·v + n·l)² / (2 + 2 v·l)`, so the half vector is never made: its power is taken to `p/2`, and a square root and
/// two thirds of the products are saved.
#[inline(always)]
pub(crate) fn reflected(s: &Surface, towards: V8) -> V8 {
    let n_l = s.normal.dot(towards);
    let lit = n_l.gt(F8::ZERO);
    if !lit.any() {
        return V8::ZERO;
    }
    let shiny = s.specular.x.gt(F8::ZERO) | s.specular.y.gt(F8::ZERO) | s.specular.z.gt(F8::ZERO);
    if !shiny.any() {
        return V8::select(lit, s.diffuse * n_l, V8::ZERO);
    }
    let sum = (s.normal.dot(s.view) + n_l).max(F8::ZERO);
    let length = (s.view.dot(towards) + 1.0) * 2.0;
    let cos2 = (sum * sum / length.max(F8::splat(1e-6))).min(F8::ONE);
    let sum = s.diffuse * n_l + s.specular * simd::pow(cos2, s.shininess * 0.5);
    V8::select(lit, sum, V8::ZERO)
}

/// `emissive + k_d·I_a·openness + Σ I·reflected`.
#[inline(always)]
pub(crate) fn blinn_phong(s: &Surface, ambient: Vec3, lights: &[Light]) -> V8 {
    let mut sum = s.emissive + s.diffuse * V8::splat(ambient) * s.openness;
    for light in lights {
        let a = arrival(light, s.position);
        sum = sum + a.intensity * reflected(s, a.towards);
    }
    sum
}

/// Turn normals to the side of the eye.
#[inline(always)]
pub(crate) fn facing(normal: V8, away: I8) -> V8 {
    V8::select(away, V8::ZERO - normal, normal)
}
