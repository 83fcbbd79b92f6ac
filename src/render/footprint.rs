//! How dark a character makes the ground it stands on.

use crate::scene::ShadowMap;
use glam::{Affine3A, Vec3};

/// Share of the light that is missing, 0…1, on a grid of `size²` texels; none beyond it.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Footprint {
    /// Scene space to texels: x right, y down, texel centres at halves; z is not used.
    pub texel_from_scene: Affine3A,
    /// Texels along a side.
    pub size: usize,
    /// `size²` shares.
    pub dark: Vec<f32>,
    layer: Vec<f32>,
    scratch: Vec<f32>,
}

impl Footprint {
    /// A contact shadow: what lies near the ground hides the sky from it. `map` is seen from the ground, straight up, its near
    /// plane at the ground, so that its depths `h` are heights.
    ///
    /// `1 − Π (1 − sₖ·blur(max(0, 1 − h/Hₖ)², rₖ))` over a tight and a wide shadow `[H, r, s]`, metres and a share: nothing
    /// higher than `Hₖ` leaves a mark.
    pub fn contact(&mut self, map: &ShadowMap, parts: &[[f32; 3]]) {
        self.clear(map);
        for &[reach, radius, strength] in parts {
            let scale = 1.0 / reach.max(1e-30);
            self.layer.clear();
            self.layer.extend(map.depth.iter().map(|h| (1.0 - h.max(0.0) * scale).max(0.0).powi(2)));
            self.blur(radius / map.texel);
            for (d, l) in self.dark.iter_mut().zip(&self.layer) {
                *d = 1.0 - (1.0 - *d) * (1.0 - strength * l);
            }
        }
    }

    /// The shadow that the lamp of `map` throws on the ground at `height`, softer the higher what throws it is: an edge at height
    /// `h` blurs over `spread·h` metres of the lamp's plane.
    ///
    /// The darkest of some nested shadows: of what lies below some height, blurred as far as that height calls for. What is nested
    /// leaves no light seams between its parts, which a sum of slices would.
    pub fn cast(&mut self, map: &ShadowMap, height: f32, spread: f32) {
        self.clear(map);
        let scene_from_texel = map.texel_from_scene.inverse();
        let up = |v: Vec3| v.y;
        let (du, dv) = (up(scene_from_texel.x_axis.into()), up(scene_from_texel.y_axis.into()));
        let dz = up(scene_from_texel.z_axis.into());
        let base = up(scene_from_texel.translation.into()) - height;
        let at = |i: usize, z: f32| {
            let (u, v) = ((i % map.size) as f32 + 0.5, (i / map.size) as f32 + 0.5);
            base + du * u + dv * v + dz * z
        };
        let top = map.depth.iter().enumerate().filter(|(_, z)| z.is_finite()).map(|(i, z)| at(i, *z));
        let top = top.fold(0.0, f32::max);
        for share in [0.06, 0.2, 0.5, 1.0] {
            // All of it must be in the last one, however sums are rounded.
            let limit = if share == 1.0 { f32::MAX } else { share * top };
            self.layer.clear();
            let below = |(i, z): (usize, &f32)| f32::from(u8::from(z.is_finite() && at(i, *z) <= limit));
            self.layer.extend(map.depth.iter().enumerate().map(below));
            self.blur((spread * share * top / map.texel).max(0.7));
            for (d, l) in self.dark.iter_mut().zip(&self.layer) {
                *d = d.max(*l);
            }
        }
    }

    fn clear(&mut self, map: &ShadowMap) {
        (self.texel_from_scene, self.size) = (map.texel_from_scene, map.size);
        self.dark.clear();
        self.dark.resize(map.size * map.size, 0.0);
    }

    /// Two box filters along each axis, together a smooth hat that ends `radius` texels away.
    fn blur(&mut self, radius: f32) {
        // Two boxes of 2n+1 texels reach 2n texels.
        let n = (radius * 0.5).round() as usize;
        if n == 0 || self.size == 0 {
            return;
        }
        for _ in 0..2 {
            for pass in 0..2 {
                if pass == 0 {
                    rows(&self.layer, self.size, n, &mut self.scratch);
                } else {
                    columns(&self.layer, self.size, n, &mut self.scratch);
                }
                std::mem::swap(&mut self.layer, &mut self.scratch);
            }
        }
    }

    /// Darkness at a place of the scene, between texels linearly.
    #[inline]
    pub fn at(&self, place: Vec3) -> f32 {
        let t = self.texel_from_scene.transform_point3(place);
        let (x, y) = (t.x - 0.5, t.y - 0.5);
        let last = self.size as f32 - 1.0;
        let inside = x >= 0.0 && y >= 0.0 && x < last && y < last;
        if !inside {
            return 0.0;
        }
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = (x - i as f32, y - j as f32);
        let row = |j: usize| {
            let r = &self.dark[j * self.size + i..][..2];
            r[0] + (r[1] - r[0]) * fx
        };
        let (a, b) = (row(j), row(j + 1));
        a + (b - a) * fy
    }
}

/// Means of `2n+1` neighbours along rows; beyond the edge is nothing.
fn rows(from: &[f32], size: usize, n: usize, to: &mut Vec<f32>) {
    let scale = 1.0 / (2 * n + 1) as f64;
    to.clear();
    for row in from.chunks_exact(size) {
        // In f64, so that what comes in leaves nothing behind when it goes out.
        let mut sum: f64 = row[..n.min(size)].iter().map(|v| f64::from(*v)).sum();
        for x in 0..size {
            sum += row.get(x + n).map_or(0.0, |v| f64::from(*v));
            to.push((sum * scale) as f32);
            sum -= if x >= n { f64::from(row[x - n]) } else { 0.0 };
        }
    }
}

/// The same along columns, a whole row of sums at a time.
fn columns(from: &[f32], size: usize, n: usize, to: &mut Vec<f32>) {
    let scale = 1.0 / (2 * n + 1) as f64;
    to.clear();
    let mut sums = vec![0.0_f64; size];
    let row = |y: usize| &from[y * size..][..size];
    let add = |sums: &mut [f64], y: usize| sums.iter_mut().zip(row(y)).for_each(|(s, v)| *s += f64::from(*v));
    (0..n.min(size)).for_each(|y| add(&mut sums, y));
    for y in 0..size {
        if y + n < size {
            add(&mut sums, y + n);
        }
        to.extend(sums.iter().map(|s| (s * scale) as f32));
        if y >= n {
            sums.iter_mut().zip(row(y - n)).for_each(|(s, v)| *s -= f64::from(*v));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_keeps_the_sum_and_ends_at_its_radius() {
        let mut f = Footprint { size: 41, layer: vec![0.0; 41 * 41], ..Default::default() };
        f.layer[20 * 41 + 20] = 1.0;
        f.blur(8.0);
        let sum: f32 = f.layer.iter().sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        assert!(f.layer[20 * 41 + 28] > 0.0);
        assert!(f.layer[20 * 41 + 29].abs() < 1e-6 && f.layer[11 * 41 + 20].abs() < 1e-6);
        // The same along both axes.
        assert!((0..41).all(|i| (f.layer[20 * 41 + i] - f.layer[i * 41 + 20]).abs() < 1e-6));
    }

    #[test]
    fn between_texels_darkness_is_linear_and_outside_there_is_none() {
        let f = Footprint { size: 2, dark: vec![0.0, 1.0, 0.0, 1.0], ..Default::default() };
        assert_eq!(f.at(Vec3::new(0.75, 1.0, 9.0)), 0.25);
        assert_eq!(f.at(Vec3::new(0.25, 1.0, 0.0)), 0.0);
        assert_eq!(f.at(Vec3::NAN), 0.0);
    }
}
