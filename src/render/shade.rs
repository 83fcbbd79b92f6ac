//! Blinn-Phong, once, for every renderer: eight points at a time, in `f32` or `f64`.

use crate::math::lanes::{Lanes, Mask, Number, Real, V3};
use crate::math::simd::{F8, I8, V8};
use crate::scene::{Light, LightKind};
use glam::Vec3;

/// Eight points of a surface, all in scene space and linear light.
#[derive(Clone, Copy)]
pub(crate) struct Surface<L> {
    pub position: V3<L>,
    /// Unit, on the eye's side.
    pub normal: V3<L>,
    /// Unit, towards the eye.
    pub view: V3<L>,
    /// `k_a`.
    pub ambient: V3<L>,
    /// `k_d`.
    pub diffuse: V3<L>,
    /// `k_s`.
    pub specular: V3<L>,
    /// `p`.
    pub shininess: L,
    /// What is left of the ambient light, 0…1.
    pub openness: L,
    /// Light of its own.
    pub emissive: V3<L>,
}

/// A [`Light`] in either precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp<R> {
    pub kind: LampKind<R>,
    pub color: V3<R>,
    pub radius: R,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum LampKind<R> {
    /// Unit, towards the lamp.
    Directional {
        towards: V3<R>,
    },
    Point {
        position: V3<R>,
        falloff: Option<R>,
    },
    Spot {
        position: V3<R>,
        towards: V3<R>,
        falloff: Option<R>,
        cos_inner: R,
        cos_outer: R,
    },
}

impl<R: Real> From<&Light> for Lamp<R> {
    #[inline(always)]
    fn from(light: &Light) -> Self {
        let v = V3::<R>::from_f32;
        let of = |x: f32| R::of(f64::from(x));
        let kind = match light.kind {
            LightKind::Directional { direction } => LampKind::Directional { towards: v(-direction) },
            LightKind::Point { position, falloff } => {
                LampKind::Point { position: v(position), falloff: falloff.map(of) }
            }
            LightKind::Spot { position, direction, falloff, cos_inner, cos_outer } => LampKind::Spot {
                position: v(position),
                towards: v(-direction),
                falloff: falloff.map(of),
                cos_inner: of(cos_inner),
                cos_outer: of(cos_outer),
            },
        };
        Self { kind, color: v(light.color), radius: of(light.radius) }
    }
}

/// Direction towards a lamp and what arrives from it, before the surface has its say.
#[derive(Clone, Copy)]
pub(crate) struct Arrival<L> {
    /// Unit, towards the lamp.
    pub towards: V3<L>,
    /// `I`, linear RGB.
    pub intensity: V3<L>,
}

/// Light that arrives at points, unshadowed.
///
/// A point light shines with `I` at any distance `d`, or with `I/d² · max(0, 1 − (d/range)⁴)` if it has a range; a spot is
/// a point light times `clamp((cos θ − cos_outer) / (cos_inner − cos_outer))²` (KHR_lights_punctual).
#[inline(always)]
pub(crate) fn arrival<L: Lanes>(lamp: &Lamp<L::Real>, position: V3<L>) -> Arrival<L> {
    let color = V3::all(lamp.color);
    match lamp.kind {
        LampKind::Directional { towards } => Arrival { towards: V3::all(towards), intensity: color },
        LampKind::Point { position: p, falloff } => {
            let (towards, gain) = from_point(p, falloff, position);
            Arrival { towards, intensity: color * gain }
        }
        LampKind::Spot { position: p, towards: axis, falloff, cos_inner, cos_outer } => {
            let (towards, gain) = from_point(p, falloff, position);
            let cos = V3::all(axis).dot(towards);
            let scale = L::Real::ONE / (cos_inner - cos_outer).max(L::Real::of(1e-4));
            let cone = ((cos + L::splat(-cos_outer)) * L::splat(scale)).clamp01();
            Arrival { towards, intensity: color * (gain * cone * cone) }
        }
    }
}

/// Direction towards a point light, and its fall-off.
#[inline(always)]
fn from_point<L: Lanes>(lamp: V3<L::Real>, falloff: Option<L::Real>, position: V3<L>) -> (V3<L>, L) {
    let offset = V3::all(lamp) - position;
    let d2 = offset.dot(offset).max(L::all(1e-30));
    let towards = offset * (L::ONE / d2.sqrt());
    let Some(range) = falloff else { return (towards, L::ONE) };
    let r2 = d2 * L::splat(L::Real::ONE / (range * range));
    let fade = (L::ONE - r2 * r2).clamp01();
    // An infinite range does not fade; a range of zero lights nothing.
    (towards, fade / d2)
}

/// `k_d max(0, n·l) + k_s max(0, n·h)^p` for unit `n`, `l` and `v`, with `h = (v+l)/‖v+l‖` (notes §3.4–3.6); if `gated`, nothing
/// where `n·l ≤ 0`.
///
/// `(n·h)² = (n·v + n·l)² / (2 + 2 v·l)`, so the half vector is never made: its power is taken to `p/2`, and a square root and
/// two thirds of the products are saved.
#[inline(always)]
pub(crate) fn reflected<L: Lanes>(s: &Surface<L>, towards: V3<L>, gated: bool) -> V3<L> {
    let n_l = s.normal.dot(towards);
    let lit = n_l.gt(L::ZERO);
    if gated && !lit.any() {
        return V3::ZERO;
    }
    let shiny = s.specular.x.gt(L::ZERO) | s.specular.y.gt(L::ZERO) | s.specular.z.gt(L::ZERO);
    if !shiny.any() {
        return V3::select(lit, s.diffuse * n_l, V3::ZERO);
    }
    let sum = (s.normal.dot(s.view) + n_l).max(L::ZERO);
    let length = (s.view.dot(towards) + L::ONE) * L::all(2.0);
    let cos2 = (sum * sum / length.max(L::all(1e-6))).min(L::ONE);
    let highlight = s.specular * cos2.pow(s.shininess * L::all(0.5));
    if gated {
        V3::select(lit, s.diffuse * n_l + highlight, V3::ZERO)
    } else {
        s.diffuse * n_l.max(L::ZERO) + highlight
    }
}

/// `emissive + k_a·I_a·openness`.
#[inline(always)]
pub(crate) fn unlit<L: Lanes>(s: &Surface<L>, ambient: V3<L>) -> V3<L> {
    s.emissive + s.ambient * ambient * s.openness
}

/// `emissive + k_a·I_a·openness + Σ I·reflected`.
#[inline(always)]
pub(crate) fn blinn_phong(s: &Surface<F8>, ambient: Vec3, lights: &[Light]) -> V8 {
    let mut sum = unlit(s, V8::splat(ambient));
    for light in lights {
        let a = arrival(&light.into(), s.position);
        sum = sum + a.intensity * reflected(s, a.towards, true);
    }
    sum
}

/// The same in either precision, with the share of each lamp's light that arrives: all of it where nothing is said.
#[inline(always)]
pub(crate) fn shadowed<L: Lanes>(
    s: &Surface<L>,
    ambient: V3<L>,
    lamps: &[Lamp<L::Real>],
    reached: &[V3<L>],
    gated: bool,
) -> V3<L> {
    let mut sum = unlit(s, ambient);
    for (i, lamp) in lamps.iter().enumerate() {
        let a = arrival(lamp, s.position);
        let light = a.intensity * reflected(s, a.towards, gated);
        sum = sum + reached.get(i).map_or(light, |&share| light * share);
    }
    sum
}

/// Turn normals to the side of the eye.
#[inline(always)]
pub(crate) fn facing(normal: V8, away: I8) -> V8 {
    V8::select(away, V8::ZERO - normal, normal)
}
