//! The mapping from metallic-roughness to Blinn-Phong, at one point of a surface.
//!
//! With base colour `b`, metallic `m` and roughness `r`, all linear:
//!
//! - `α = r²`; exponent `p = clamp(2/α² − 2, 4, 1024)` (Karis 2013: the Blinn-Phong lobe as wide as GGX's);
//! - `F₀ = lerp(0.04, b, m)`; `k = F₀ · (p + 8)/8 · (1 − α)`: the normalised lobe (Akenine-Möller et al. 2018, §9.8), less the
//!   share `α` that is so wide that it looks matt;
//! - `k_s = k / (1 + max k)`: a lamp's mirror image is thousands of times brighter than a screen can be, so highlights are
//!   compressed, hue kept, instead of clipped to white;
//! - `k_d = b(1 − m) + F₀ · m · (0.4 + 0.4α)`: there is no environment for metals to mirror, so they keep a share of their
//!   colour as if they mirrored a grey one, the more the rougher they are.
//!
//! Specular-glossiness is the same with `k_d = diffuse + F₀·m·(0.4 + 0.4α)`, `F₀ = specular`, `r = 1 − glossiness` and
//! `m = (max F₀ − 0.04)/0.96`.

use glam::Vec3;

/// Largest exponent: a highlight about 4° wide.
pub(super) const SHARPEST: f32 = 1024.0;
/// Smallest exponent: below it a lobe would end in a visible edge where the light sets.
const WIDEST: f32 = 4.0;
/// `F₀` of everything that is no metal.
const DIELECTRIC: f32 = 0.04;

/// Blinn-Phong coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Phong {
    /// `k_d`.
    pub diffuse: Vec3,
    /// `k_s`.
    pub specular: Vec3,
    /// `p`.
    pub shininess: f32,
}

/// What a roughness means, independent of colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gloss {
    /// `p`.
    pub shininess: f32,
    /// `k / F₀`.
    gain: f32,
    /// Share of a metal's colour that is drawn as matt.
    matt: f32,
}

impl Gloss {
    /// Of a roughness in 0…1.
    pub fn new(roughness: f32) -> Self {
        let alpha = roughness.clamp(0.0, 1.0).powi(2);
        let shininess = (2.0 / (alpha * alpha).max(1e-6) - 2.0).clamp(WIDEST, SHARPEST);
        Self { shininess, gain: (shininess + 8.0) / 8.0 * (1.0 - alpha), matt: 0.4 + 0.4 * alpha }
    }

    /// A surface of base colour `base`.
    pub fn metallic(&self, base: Vec3, metallic: f32) -> Phong {
        let m = metallic.clamp(0.0, 1.0);
        let f0 = Vec3::splat(DIELECTRIC).lerp(base, m);
        self.finish(base * (1.0 - m), f0, m)
    }

    /// A surface given by its diffuse and specular colours.
    pub fn specular(&self, diffuse: Vec3, f0: Vec3) -> Phong {
        let m = (f0.max_element() - DIELECTRIC) / (1.0 - DIELECTRIC);
        self.finish(diffuse, f0, m.clamp(0.0, 1.0))
    }

    fn finish(&self, diffuse: Vec3, f0: Vec3, m: f32) -> Phong {
        let k = f0 * self.gain;
        Phong {
            diffuse: diffuse + f0 * (m * self.matt),
            specular: k / (1.0 + k.max_element()),
            shininess: self.shininess,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn highlights_stay_on_the_screen_and_metals_do_not_go_black() {
        let gold = Vec3::new(1.0, 0.77, 0.34);
        for i in 0..=20 {
            let gloss = Gloss::new(i as f32 / 20.0);
            for m in [0.0, 0.3, 1.0] {
                let s = gloss.metallic(gold, m);
                assert!(s.specular.max_element() < 1.0 && s.diffuse.max_element() >= 0.4, "{s:?}");
                assert!((WIDEST..=SHARPEST).contains(&s.shininess));
            }
        }
    }

    #[test]
    fn rough_matt_surfaces_are_their_base_colour() {
        let s = Gloss::new(1.0).metallic(Vec3::new(0.2, 0.4, 0.6), 0.0);
        assert_eq!((s.diffuse, s.specular), (Vec3::new(0.2, 0.4, 0.6), Vec3::ZERO));
    }

    #[test]
    fn smoother_is_sharper_and_brighter() {
        let at = |r: f32| Gloss::new(r).metallic(Vec3::ONE, 0.0);
        assert!(at(0.3).shininess > at(0.5).shininess && at(0.3).specular.x > at(0.5).specular.x);
        assert!((at(0.5).shininess - 30.0).abs() < 1e-3);
    }
}
