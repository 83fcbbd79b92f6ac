//! Frames as indices into a palette.

use super::film::Film;
use super::nearest::{Nearest, WEIGHT};
use super::palette::Palette;
use crate::image::Rgba8;
use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
use std::sync::LazyLock;

/// How colours between those of the palette are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Dither {
    /// The nearest colour.
    #[default]
    None,
    /// Two colours mixed by a fixed threshold a pixel: the same in every frame where the picture is the same.
    Ordered,
    /// Floyd–Steinberg: the error goes to the neighbours that come next, in linear light.
    FloydSteinberg,
}

impl Dither {
    /// Every way, simplest first.
    pub const ALL: [Self; 3] = [Self::None, Self::Ordered, Self::FloydSteinberg];

    /// The name for messages and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Ordered => "ordered",
            Self::FloydSteinberg => "floyd-steinberg",
        }
    }
}

/// A frame as indices into a [`Palette`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Indexed {
    /// Pixels a row, and rows.
    pub size: [usize; 2],
    /// An index a pixel, row by row from the top left.
    pub indices: Vec<u8>,
}

/// Turns frames into indices; it remembers what it looked up, so keep one a thread.
///
/// A pixel of less than half coverage becomes a hole where the film is transparent; every other one is laid over the
/// matte. The nearest colour is exact in a metric that stands for Oklab's: `5·ΔR² + 14·ΔG² + 4·ΔB²` in sRGB codes.
#[derive(Clone, Debug)]
pub struct Mapper {
    palette: Palette,
    film: Film,
    nearest: Nearest,
    linear: Vec<[i32; 4]>,
    pairs: Vec<Pair>,
}

/// Two colours that mix to a third.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// The third, packed; `u32::MAX` where nothing is remembered.
    color: u32,
    indices: [u8; 2],
    /// The share of the second, in 1/256.
    share: u16,
}

/// Light of the 8-bit codes in steps of 1/65535.
static LIGHT: LazyLock<[i32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| (LINEAR_OF_SRGB8[i] * 65535.0).round() as i32));

/// Codes of light in steps of 16/65535: finer than a code everywhere.
static CODE: LazyLock<[u8; 4096]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb8((i as f32 + 0.5) * 16.0 / 65535.0)));

/// Colours whose pairs are remembered.
const PAIRS: usize = 1 << 12;

impl Mapper {
    /// For the frames of a film.
    pub fn new(palette: &Palette, film: &Film) -> Self {
        let light = |c: &[u8; 3]| c.map(|c| LIGHT[usize::from(c)]);
        let linear = palette.colors().iter().map(light).map(|[r, g, b]| [r, g, b, 0]).collect();
        let none = Pair { color: u32::MAX, indices: [0; 2], share: 0 };
        let nearest = Nearest::new(palette.colors());
        Self { palette: palette.clone(), film: *film, nearest, linear, pairs: vec![none; PAIRS] }
    }

    /// The palette that indices point into.
    pub fn palette(&self) -> &Palette {
        &self.palette
    }

    /// The colour that stands behind holes.
    pub(super) fn matte(&self) -> [u8; 3] {
        self.film.matte
    }

    /// The indices of a frame.
    ///
    /// # Panics
    /// Where the frame's buffer does not hold `4 · width · height` bytes.
    pub fn map(&mut self, frame: &Rgba8, dither: Dither) -> Indexed {
        assert_eq!(frame.data.len(), 4 * frame.width * frame.height, "bytes of the frame");
        let indices = match dither {
            Dither::None => self.plain(frame),
            Dither::Ordered => self.ordered(frame),
            Dither::FloydSteinberg => self.diffused(frame),
        };
        Indexed { size: [frame.width, frame.height], indices }
    }

    fn plain(&mut self, frame: &Rgba8) -> Vec<u8> {
        let hole = self.palette.transparent();
        let (mut last, mut index) = ([0; 4], hole);
        let mut known = false;
        let pixels = frame.data.as_chunks::<4>().0.iter();
        pixels
            .map(|p| {
                // Runs of one colour are looked up once.
                if !known || *p != last {
                    index = if self.film.is_hole(p[3]) {
                        hole
                    } else {
                        self.nearest.of(self.film.over_matte(*p))
                    };
                    (last, known) = (*p, true);
                }
                index
            })
            .collect()
    }

    fn ordered(&mut self, frame: &Rgba8) -> Vec<u8> {
        let mut indices = Vec::with_capacity(frame.width * frame.height);
        for (y, row) in frame.data.as_chunks::<4>().0.chunks(frame.width.max(1)).enumerate() {
            for (x, p) in row.iter().enumerate() {
                if self.film.is_hole(p[3]) {
                    indices.push(self.palette.transparent());
                    continue;
                }
                let pair = self.pair(self.film.over_matte(*p));
                indices.push(pair.indices[usize::from(threshold(x, y) < pair.share)]);
            }
        }
        indices
    }

    /// The nearest colour, the one across, and the mixture of both that is nearest in linear light.
    #[inline]
    fn pair(&mut self, color: [u8; 3]) -> Pair {
        let key = u32::from_be_bytes([0, color[0], color[1], color[2]]);
        let slot = (key.wrapping_mul(0x9e37_79b1) >> 20) as usize % PAIRS;
        if self.pairs[slot].color != key {
            self.pairs[slot] = self.find_pair(key, color);
        }
        self.pairs[slot]
    }

    #[cold]
    fn find_pair(&mut self, key: u32, color: [u8; 3]) -> Pair {
        let a = self.nearest.of(color);
        let near = self.palette.colors()[usize::from(a)];
        // The colour on the other side is as far from the wish as the nearest one.
        let across =
            std::array::from_fn(|i| (2 * i32::from(color[i]) - i32::from(near[i])).clamp(0, 255) as u8);
        let b = self.nearest.of(across);
        let [from, to] = [a, b].map(|i| self.linear[usize::from(i)]);
        let dot = |p: [i32; 4], q: [i32; 4]| -> f64 {
            (0..3).map(|i| f64::from(WEIGHT[i]) * f64::from(p[i] - from[i]) * f64::from(q[i] - from[i])).sum()
        };
        let [red, green, blue] = color.map(|c| LIGHT[usize::from(c)]);
        // The share that projects the wish onto the segment from one to the other.
        let share = if a == b { 0.0 } else { dot([red, green, blue, 0], to) / dot(to, to).max(1.0) };
        Pair { color: key, indices: [a, b], share: (share * 256.0).clamp(0.0, 256.0) as u16 }
    }

    /// Floyd and Steinberg 1976, rows alternately from the left and from the right.
    fn diffused(&mut self, frame: &Rgba8) -> Vec<u8> {
        let (w, h) = (frame.width, frame.height);
        let mut indices = vec![self.palette.transparent(); w * h];
        // Errors that this row and the next receive from above.
        let (mut now, mut next) = (vec![[0i32; 4]; w], vec![[0i32; 4]; w]);
        for (y, row) in frame.data.as_chunks::<4>().0.chunks(w.max(1)).enumerate() {
            let out = &mut indices[y * w..][..w];
            if y % 2 == 0 {
                self.diffuse_row(row, out, &now, &mut next, |k| k);
            } else {
                self.diffuse_row(row, out, &now, &mut next, |k| w - 1 - k);
            }
            std::mem::swap(&mut now, &mut next);
        }
        indices
    }

    /// One row, in the order that `at` gives; `below` is overwritten with what the next row receives.
    #[inline]
    fn diffuse_row(
        &mut self,
        row: &[[u8; 4]],
        out: &mut [u8],
        above: &[[i32; 4]],
        below: &mut [[i32; 4]],
        at: impl Fn(usize) -> usize,
    ) {
        let (light, code) = (&*LIGHT, &*CODE);
        // Sums for the pixel ahead, and for those below it and behind it, stay in registers until they are complete.
        let [mut ahead, mut under, mut behind] = [[0i32; 4]; 3];
        let mut last = ([0i32; 4], None);
        for k in 0..row.len() {
            let x = at(k);
            let mut error = [0; 4];
            if !self.film.is_hole(row[x][3]) {
                let [r, g, b] = self.film.over_matte(row[x]).map(|c| light[usize::from(c)]);
                let wish = sum([r, g, b, 0], sum(ahead, above[x])).map(|l| l.clamp(0, 65535));
                // Flat parts wish for the same again.
                let index = match last {
                    (before, Some(index)) if before == wish => index,
                    _ => self.nearest.of([wish[0], wish[1], wish[2]].map(|l| code[(l >> 4) as usize])),
                };
                (out[x], last) = (index, (wish, Some(index)));
                let got = self.linear[usize::from(index)];
                error = std::array::from_fn(|i| wish[i] - got[i]);
            }
            // 7/16 ahead, 3/16 below behind, 5/16 below, 1/16 below ahead.
            ahead = error.map(|e| e * 7 / 16);
            if k > 0 {
                below[at(k - 1)] = sum(behind, error.map(|e| e * 3 / 16));
            }
            behind = sum(under, error.map(|e| e * 5 / 16));
            under = error.map(|e| e / 16);
        }
        if let Some(k) = row.len().checked_sub(1) {
            below[at(k)] = behind;
        }
    }
}

#[inline]
fn sum(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// A threshold of 0…255 a pixel, spread evenly over the plane and over every neighbourhood.
///
/// Roberts 2018, the R2 sequence: `frac(x/φ + y/φ²)` with the plastic number `φ³ = φ + 1`.
#[inline]
fn threshold(x: usize, y: usize) -> u16 {
    let t = (x as u32).wrapping_mul(0xc13f_a9a9).wrapping_add((y as u32).wrapping_mul(0x91e1_0da5));
    (t >> 24) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_the_way_through_light() {
        assert!((0..256).all(|i| CODE[(LIGHT[i] >> 4) as usize] == i as u8));
    }

    #[test]
    fn thresholds_are_even() {
        let below = |t| (0..64 * 64).filter(|i| threshold(i % 64, i / 64) < t).count() as f64 / 4096.0;
        for t in [32, 64, 128, 192] {
            assert!((below(t) - f64::from(t) / 256.0).abs() < 0.01, "{t}: {}", below(t));
        }
    }
}
