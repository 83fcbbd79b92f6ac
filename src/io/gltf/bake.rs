//! Two pictures baked into Blinn-Phong maps, pixel by pixel.

use super::surface::{Gloss, Phong, SHARPEST};
use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
use crate::scene::WrapMode;
use glam::Vec3;

/// What the second texture of a baked pair holds, and the constants beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Workflow {
    /// Green: roughness; blue: metallic.
    Metallic { metallic: f32, roughness: f32 },
    /// RGB: specular colour (sRGB); alpha: glossiness.
    Specular { specular: Vec3, glossiness: f32 },
}

impl Workflow {
    /// Coefficients for a diffuse or base colour, and a pixel of the second texture (white without one).
    pub fn phong(&self, color: Vec3, pixel: [u8; 4]) -> Phong {
        self.shade(&Gloss::new(self.roughness(pixel)), color, pixel)
    }

    /// The constants and the factor of the colour, bit by bit.
    pub fn bits(&self, factor: Vec3) -> Vec<u32> {
        let (kind, own) = match *self {
            Self::Metallic { metallic, roughness } => (0, vec![metallic, roughness]),
            Self::Specular { specular, glossiness } => {
                (1, vec![specular.x, specular.y, specular.z, glossiness])
            }
        };
        let numbers = factor.to_array().into_iter().chain(own).map(f32::to_bits);
        std::iter::once(kind).chain(numbers).collect()
    }

    fn roughness(&self, pixel: [u8; 4]) -> f32 {
        match *self {
            Self::Metallic { roughness, .. } => roughness * pixel[1] as f32 / 255.0,
            Self::Specular { glossiness, .. } => 1.0 - glossiness * pixel[3] as f32 / 255.0,
        }
    }

    /// The byte that alone decides the roughness.
    fn gloss_byte(&self, pixel: [u8; 4]) -> usize {
        match self {
            Self::Metallic { .. } => pixel[1] as usize,
            Self::Specular { .. } => pixel[3] as usize,
        }
    }

    fn shade(&self, gloss: &Gloss, color: Vec3, pixel: [u8; 4]) -> Phong {
        match *self {
            Self::Metallic { metallic, .. } => gloss.metallic(color, metallic * pixel[2] as f32 / 255.0),
            Self::Specular { specular, .. } => gloss.specular(color, specular * linear(pixel)),
        }
    }
}

/// Width and height.
pub(super) type Size = (usize, usize);

/// Pixels that are looked up at the places of another grid.
pub(super) struct Grid<'p> {
    pub size: Size,
    /// RGB or RGBA.
    pub bytes: &'p [u8],
    pub wrap: [WrapMode; 2],
    /// RGB are sRGB codes, to be mixed in linear light.
    pub srgb: bool,
}

/// A place between two pixels: their indices, and the part of the second.
type Between = ([usize; 2], f32);

impl Grid<'_> {
    fn pixel(&self, x: usize, y: usize) -> [u8; 4] {
        let n = self.channels();
        let p = &self.bytes[(y * self.size.0 + x) * n..][..n];
        [p[0], p[1], p[2], p.get(3).copied().unwrap_or(255)]
    }

    fn channels(&self) -> usize {
        self.bytes.len() / (self.size.0 * self.size.1).max(1)
    }

    /// What lies under the centre of a pixel of another grid: bilinear.
    fn at(&self, (x, y): Size, size: Size) -> [u8; 4] {
        if self.size == size {
            return self.pixel(x, y);
        }
        let (columns, u) = between(x, size.0, self.size.0, self.wrap[0]);
        let (rows, v) = between(y, size.1, self.size.1, self.wrap[1]);
        let row = |y: usize| [self.pixel(columns[0], y), self.pixel(columns[1], y)];
        let (upper, lower) = (row(rows[0]), row(rows[1]));
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        std::array::from_fn(|k| {
            let coded = self.srgb && k < 3;
            let value = |c: [u8; 4]| if coded { LINEAR_OF_SRGB8[c[k] as usize] } else { c[k] as f32 };
            let across = |r: [[u8; 4]; 2]| mix(value(r[0]), value(r[1]), u);
            let mean = mix(across(upper), across(lower), v);
            if coded { srgb8(mean) } else { (mean + 0.5) as u8 }
        })
    }

    fn mean(&self) -> [u8; 4] {
        let n = self.channels();
        let count = (self.bytes.len() / n).max(1) as u64;
        let sum = |k: usize| self.bytes.iter().skip(k).step_by(n).map(|&b| b as u64).sum::<u64>();
        std::array::from_fn(|k| if k < n { (sum(k) / count) as u8 } else { 255 })
    }
}

/// The centre of pixel `i` of `count`, between the pixels of a row of `own`: `(i + ½) own / count − ½`.
fn between(i: usize, count: usize, own: usize, wrap: WrapMode) -> Between {
    let (place, unit) = ((2 * i as i64 + 1) * own as i64 - count as i64, 2 * count as i64);
    let first = place.div_euclid(unit);
    // A mirrored picture repeats its edge, as a clamped one does.
    let inside = |i: i64| match wrap {
        WrapMode::Repeat => i.rem_euclid(own as i64) as usize,
        _ => i.clamp(0, own as i64 - 1) as usize,
    };
    ([inside(first), inside(first + 1)], place.rem_euclid(unit) as f32 / unit as f32)
}

/// Sizes of the diffuse and the specular map: the finer of both grids where they lie alike, else each its own.
pub(super) fn sizes(a: Size, b: Size, alike: bool) -> [Size; 2] {
    let finer = (a.0.max(b.0), a.1.max(b.1));
    if alike { [finer; 2] } else { [a, b] }
}

/// RGBA of the diffuse and the specular map. Grids that lie differently each see the other's mean.
pub(super) fn bake(a: &Grid, b: &Grid, alike: bool, factor: Vec3, workflow: Workflow) -> [Vec<u8>; 2] {
    let table: Vec<Gloss> = (0..=255).map(|i| Gloss::new(workflow.roughness([i; 4]))).collect();
    let shade = |first: [u8; 4], second: [u8; 4]| {
        workflow.shade(&table[workflow.gloss_byte(second)], factor * linear(first), second)
    };
    let sizes = sizes(a.size, b.size, alike);
    let mut out = sizes.map(|(width, height)| Vec::with_capacity(4 * width * height));
    if alike {
        for place in places(sizes[0]) {
            let (first, second) = (a.at(place, sizes[0]), b.at(place, sizes[0]));
            let look = shade(first, second);
            out[0].extend(diffuse_texel(&look, first[3]));
            out[1].extend(specular_texel(&look));
        }
        return out;
    }
    let means = (a.mean(), b.mean());
    for (x, y) in places(a.size) {
        let first = a.pixel(x, y);
        out[0].extend(diffuse_texel(&shade(first, means.1), first[3]));
    }
    for (x, y) in places(b.size) {
        out[1].extend(specular_texel(&shade(means.0, b.pixel(x, y))));
    }
    out
}

fn places((width, height): Size) -> impl Iterator<Item = Size> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

fn linear(pixel: [u8; 4]) -> Vec3 {
    Vec3::new(
        LINEAR_OF_SRGB8[pixel[0] as usize],
        LINEAR_OF_SRGB8[pixel[1] as usize],
        LINEAR_OF_SRGB8[pixel[2] as usize],
    )
}

fn diffuse_texel(p: &Phong, alpha: u8) -> [u8; 4] {
    [srgb8(p.diffuse.x), srgb8(p.diffuse.y), srgb8(p.diffuse.z), alpha]
}

/// RGB: `k_s`; alpha: the power of [`SHARPEST`] that is `p`.
fn specular_texel(p: &Phong) -> [u8; 4] {
    let power = p.shininess.ln() / SHARPEST.ln();
    [srgb8(p.specular.x), srgb8(p.specular.y), srgb8(p.specular.z), (power * 255.0 + 0.5) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarser_pictures_are_magnified_smoothly() {
        let rgba = [[0, 0, 0, 0], [255; 4]].concat();
        let mut grid = Grid { size: (2, 1), bytes: &rgba, wrap: [WrapMode::Clamp; 2], srgb: false };
        let row = |g: &Grid| (0..8).map(|x| g.at((x, 0), (8, 1))[1]).collect::<Vec<u8>>();
        assert_eq!(row(&grid), [0, 0, 32, 96, 159, 223, 255, 255]);
        grid.srgb = true;
        assert_eq!(row(&grid)[4], srgb8(0.625));
        grid.wrap[0] = WrapMode::Repeat;
        assert_eq!(grid.at((0, 0), (8, 1))[3], 96);
    }
}
