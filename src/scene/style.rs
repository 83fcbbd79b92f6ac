//! How light is turned into colour, beyond the plain equation.

use super::ShadowMap;
use glam::Vec3;

/// Departures from even ambient light and smooth, unshadowed lamps. The default is none, and costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style<'a> {
    /// Ambient light on what faces down, if it is not `Scene::ambient`: `I_a(n) = ½(1+n_y)·ambient + ½(1−n_y)·below`.
    pub below: Option<Vec3>,
    /// How many tones a surface has, from 2 on, if it is drawn like a cartoon.
    ///
    /// With the lamps' light `E = Σ I max(0, n·l)` and the brightest lamp's colour `K`, the diffuse term is `k_d·K·(¼ + ¾q(Y))`,
    /// where `Y` is `E`'s largest channel in terms of `K`'s and `q(Y) = min(⌊Y·n⌋, n−1)/(n−1)`: the darkest tone stands for the
    /// lamps that would fill it. The key light alone makes a highlight: `k_s·I` where `(n·h)^p > ½`, nothing elsewhere.
    pub toon: Option<u32>,
    /// What the key light, `Scene::lights[0]`, does not reach.
    pub shadow: Option<&'a ShadowMap>,
    /// What mirrored and refracted rays see where they meet nothing, linear RGB: straight above and straight below, mixed in between;
    /// the scene's background for `None`.
    pub sky: Option<[Vec3; 2]>,
}

impl Style<'_> {
    /// Whether it departs in nothing.
    #[inline(always)]
    pub fn is_plain(&self) -> bool {
        self.below.is_none() && self.toon.is_none() && self.shadow.is_none()
    }
}
