//! Fewer levels than light has: dithering, so that smooth shading does not band (notes §1.3).
//!
//! A light between two levels becomes a mixture of both whose *mean light* is right: with the lower level's light `a`, the upper
//! one's `b` and the share `s = (c − a)/(b − a)`, the upper one is shown in a share `s` of the pixels. [`Dither`] says in which.
//!
//! Colour is dithered as it is without alpha, which is what the file stores. Alpha is coverage, not light: it is rounded to nearest, so
//! what is opaque stays opaque and what is empty stays empty.

use super::gamma::Transfer;
use super::{Image, Rgba8};

/// Which pixels show the upper of two levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Dither {
    /// The nearest level: smooth ramps band.
    #[default]
    None,
    /// Bayer 1973: a threshold a pixel from a matrix of 8 × 8. Fine and regular; the same picture gives the same pattern in every
    /// frame, and what stands still does not flicker.
    Ordered,
    /// Jimenez 2014, interleaved gradient noise: a threshold a pixel, `frac(52.98 frac(0.067x + 0.0058y))`. As steady as the matrix,
    /// without its crosses, and a little coarser.
    Noise,
    /// Floyd and Steinberg 1976: the error goes to the neighbours that come next, rows in alternating directions. The least error,
    /// but a change anywhere moves every dot after it, so films flicker.
    FloydSteinberg,
}

impl Dither {
    /// Every way, simplest first.
    pub const ALL: [Self; 4] = [Self::None, Self::Ordered, Self::Noise, Self::FloydSteinberg];

    /// The name for messages and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Ordered => "ordered",
            Self::Noise => "noise",
            Self::FloydSteinberg => "floyd-steinberg",
        }
    }

    /// The way of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|d| d.name() == name)
    }

    /// The share above which pixel `(x, y)`, rows from the top, shows the upper level, within 0…1; `None` where it does not depend on
    /// the place alone.
    #[inline]
    pub fn threshold(self, x: usize, y: usize) -> Option<f32> {
        match self {
            Self::Ordered => Some((f32::from(BAYER[y % 8][x % 8]) + 0.5) / 64.0),
            Self::Noise => Some(noise(x, y)),
            Self::None | Self::FloydSteinberg => None,
        }
    }
}

/// Bayer's matrix: the bits of `x ⊕ y` and `y`, interleaved and reversed.
const BAYER: [[u8; 8]; 8] = {
    let mut m = [[0; 8]; 8];
    let mut i = 0;
    while i < 64 {
        let (x, y) = (i % 8, i / 8);
        let mut bit = 0;
        while bit < 3 {
            let (a, b) = ((x ^ y) >> bit & 1, y >> bit & 1);
            m[y][x] |= ((a << 1 | b) << (2 * (2 - bit))) as u8;
            bit += 1;
        }
        i += 1;
    }
    m
};

fn noise(x: usize, y: usize) -> f32 {
    // In f64, so that wide pictures keep their fractions; a period of 2¹⁶ is more than any picture has.
    let fine = 0.06711056 * (x & 0xffff) as f64 + 0.00583715 * (y & 0xffff) as f64;
    fraction(52.9829189 * fraction(fine)) as f32
}

/// `x − ⌊x⌋` of what is neither negative nor large: as an integer it is one instruction everywhere.
#[inline]
fn fraction(x: f64) -> f64 {
    x - f64::from(x as i32)
}

/// Steps of √light in the table of first guesses.
const STEPS: usize = 1024;

/// The levels of a channel: their 8-bit codes and the light that each stands for.
///
/// ```
/// use sinew::image::{dither::Levels, gamma::Transfer};
/// let four = Levels::new(4, Transfer::Srgb);
/// assert_eq!(four.codes(), [0, 85, 170, 255]);
/// // 0.2 of the light is the code 123.5, nearer to 85 than to 170.
/// assert_eq!(four.nearest(0.2), 85);
/// // In light it is a third of the way between them.
/// let (lower, share) = four.below(0.2);
/// assert!(lower == 1 && (share - 0.35).abs() < 0.05, "{share}");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    codes: Vec<u8>,
    lights: Vec<f32>,
    /// The light from which on the next level is nearer, as signals.
    borders: Vec<f32>,
    /// The light from which on the next level is nearer, as light.
    middles: Vec<f32>,
    /// The level below, the one nearest as a signal and the one nearest as light at the start of each step.
    guess: Vec<[u8; 3]>,
}

impl Levels {
    /// `n` levels, 2…256, evenly over the codes: level `k` is `round(255k / (n−1))`.
    pub fn new(n: usize, transfer: Transfer) -> Self {
        let n = n.clamp(2, 256);
        let codes: Vec<u8> = (0..n).map(|k| ((510 * k + n - 1) / (2 * (n - 1))) as u8).collect();
        let signal = |c: u8| f32::from(c);
        let lights: Vec<f32> = codes.iter().map(|&c| transfer.light(signal(c) / 255.0)).collect();
        let borders: Vec<f32> =
            codes.windows(2).map(|c| transfer.light((signal(c[0]) + signal(c[1])) * 0.5 / 255.0)).collect();
        let middles: Vec<f32> = lights.windows(2).map(|l| (l[0] + l[1]) * 0.5).collect();
        let start = |i: usize| {
            let light = (i as f32 / STEPS as f32).powi(2);
            let above = |lights: &[f32]| lights.partition_point(|&l| l <= light);
            let below = above(&lights).saturating_sub(1).min(n - 2);
            [below, above(&borders), above(&middles)].map(|k| k as u8)
        };
        let guess = (0..=STEPS).map(start).collect();
        Self { codes, lights, borders, middles, guess }
    }

    /// The 8-bit code of each level.
    pub fn codes(&self) -> &[u8] {
        &self.codes
    }

    /// The light of each level.
    pub fn lights(&self) -> &[f32] {
        &self.lights
    }

    #[inline]
    fn guess(&self, light: f32) -> [usize; 3] {
        self.guess[(light.sqrt() * STEPS as f32) as usize].map(usize::from)
    }

    /// The code whose *signal* is nearest, as without dithering; NaN is 0, what is outside 0…1 is clipped.
    #[inline]
    pub fn nearest(&self, light: f32) -> u8 {
        let light = clip(light);
        let mut k = self.guess(light)[1];
        while k < self.borders.len() && self.borders[k] <= light {
            k += 1;
        }
        self.codes[k]
    }

    /// The level whose *light* is nearest, of light within 0…1.
    #[inline]
    fn settle(&self, light: f32) -> usize {
        let mut k = self.guess(light)[2];
        while k < self.middles.len() && self.middles[k] <= light {
            k += 1;
        }
        k
    }

    /// The lower of the two levels around some light, and the share of the upper one in the mixture that has this light.
    #[inline]
    pub fn below(&self, light: f32) -> (usize, f32) {
        let light = clip(light);
        let mut k = self.guess(light)[0];
        while k + 2 < self.lights.len() && self.lights[k + 1] <= light {
            k += 1;
        }
        let (a, b) = (self.lights[k], self.lights[k + 1]);
        (k, (light - a) / (b - a))
    }
}

#[inline]
fn clip(light: f32) -> f32 {
    if light > 0.0 { light.min(1.0) } else { 0.0 }
}

/// A picture's light, clipped to 0…1, in `levels` of a channel; alpha in 256.
///
/// Pixel by pixel the result depends on the picture and the place alone, for [`Dither::FloydSteinberg`] on the rows above too; never
/// on threads.
///
/// ```
/// use sinew::image::{Image, Rgba8, dither::{Dither, Levels, dither}, gamma::Transfer};
/// // A quarter of the light in two levels: every fourth pixel is white.
/// let gray = Image::filled(8, 8, [0.25, 0.25, 0.25, 1.0]);
/// let mut out = Rgba8::default();
/// dither(&gray, &Levels::new(2, Transfer::Srgb), Dither::Ordered, &mut out);
/// assert_eq!(out.data.chunks(4).filter(|p| p[0] == 255).count(), 16);
/// ```
pub fn dither(image: &Image, levels: &Levels, how: Dither, out: &mut Rgba8) {
    dither_of(image, levels, how, out, |[r, g, b, a]| {
        let k = if a > 0.0 && a < 1.0 { 1.0 / a } else { 1.0 };
        [r * k, g * k, b * k]
    });
}

/// The same with straight colours that `color` makes of premultiplied pixels.
pub(super) fn dither_of(
    image: &Image,
    levels: &Levels,
    how: Dither,
    out: &mut Rgba8,
    color: impl Fn([f32; 4]) -> [f32; 3],
) {
    (out.width, out.height) = (image.width, image.height);
    out.data.resize(4 * image.pixels.len(), 0);
    let bytes = out.data.as_chunks_mut::<4>().0;
    let rows = image.pixels.chunks(image.width.max(1)).zip(bytes.chunks_mut(image.width.max(1)));
    match how {
        Dither::None => rows.for_each(|(from, to)| nearest_row(from, to, levels, &color)),
        Dither::Ordered => rows.enumerate().for_each(|(y, (from, to))| {
            let thresholds = &ORDERED[y % 8];
            threshold_row(from, to, levels, &color, |x| thresholds[x % 8]);
        }),
        Dither::Noise => rows
            .enumerate()
            .for_each(|(y, (from, to))| threshold_row(from, to, levels, &color, |x| noise(x, y))),
        Dither::FloydSteinberg => diffuse(rows, image.width, levels, &color),
    }
}

/// Bayer's matrix as thresholds.
static ORDERED: [[f32; 8]; 8] = {
    let mut t = [[0.0; 8]; 8];
    let mut i = 0;
    while i < 64 {
        t[i / 8][i % 8] = (BAYER[i / 8][i % 8] as f32 + 0.5) / 64.0;
        i += 1;
    }
    t
};

/// Alpha as a code.
#[inline]
fn alpha(a: f32) -> u8 {
    // As `color::encode_srgb8` has it; NaN is 0.
    (a.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn nearest_row(
    from: &[[f32; 4]],
    to: &mut [[u8; 4]],
    levels: &Levels,
    color: &impl Fn([f32; 4]) -> [f32; 3],
) {
    let mut last = ([0.0; 4], [0; 4]);
    for (p, out) in from.iter().zip(to) {
        // Runs of one colour are looked up once.
        if *p != last.0 {
            let [r, g, b] = color(*p).map(|c| levels.nearest(c));
            last = (*p, if alpha(p[3]) == 0 { [0; 4] } else { [r, g, b, alpha(p[3])] });
        }
        *out = last.1;
    }
}

fn threshold_row(
    from: &[[f32; 4]],
    to: &mut [[u8; 4]],
    levels: &Levels,
    color: &impl Fn([f32; 4]) -> [f32; 3],
    threshold: impl Fn(usize) -> f32,
) {
    let mut last = ([0.0; 4], [(0, 0.0); 3], 0);
    for (x, (p, out)) in from.iter().zip(to).enumerate() {
        if *p != last.0 {
            last = (*p, color(*p).map(|c| levels.below(c)), alpha(p[3]));
        }
        let (_, channels, a) = last;
        let t = threshold(x);
        let [r, g, b] = channels.map(|(k, share)| levels.codes[k + usize::from(share > t)]);
        *out = if a == 0 { [0; 4] } else { [r, g, b, a] };
    }
}

/// Light, multiplied by alpha, that a pixel receives from those before it.
type Error = [f32; 3];

fn diffuse<'a>(
    rows: impl Iterator<Item = (&'a [[f32; 4]], &'a mut [[u8; 4]])>,
    width: usize,
    levels: &Levels,
    color: &impl Fn([f32; 4]) -> [f32; 3],
) {
    // Errors that this row and the next receive from above.
    let (mut now, mut next) = (vec![[0.0; 3]; width], vec![[0.0; 3]; width]);
    for (y, (from, to)) in rows.enumerate() {
        if y % 2 == 0 {
            diffuse_row(from, to, &now, &mut next, levels, color, |k| k);
        } else {
            diffuse_row(from, to, &now, &mut next, levels, color, |k| width - 1 - k);
        }
        std::mem::swap(&mut now, &mut next);
    }
}

/// One row, in the order that `at` gives; `below` is overwritten with what the next row receives.
#[inline]
fn diffuse_row(
    from: &[[f32; 4]],
    to: &mut [[u8; 4]],
    above: &[Error],
    below: &mut [Error],
    levels: &Levels,
    color: &impl Fn([f32; 4]) -> [f32; 3],
    at: impl Fn(usize) -> usize,
) {
    // Sums for the pixel ahead, and for those below it and behind it, stay in registers until they are complete.
    let [mut ahead, mut under, mut behind] = [[0.0; 3]; 3];
    for k in 0..from.len() {
        let x = at(k);
        let (p, a) = (from[x], alpha(from[x][3]));
        let mut error = [0.0; 3];
        if a == 0 {
            to[x] = [0; 4];
        } else {
            let received = sum(ahead, above[x]);
            let codes;
            (codes, error) = settle(color(p), received, p[3].min(1.0), levels);
            to[x] = [codes[0], codes[1], codes[2], a];
        }
        // 7/16 ahead, 3/16 below behind, 5/16 below, 1/16 below ahead.
        ahead = error.map(|e| e * (7.0 / 16.0));
        if k > 0 {
            below[at(k - 1)] = sum(behind, error.map(|e| e * (3.0 / 16.0)));
        }
        behind = sum(under, error.map(|e| e * (5.0 / 16.0)));
        under = error.map(|e| e * (1.0 / 16.0));
    }
    if let Some(k) = from.len().checked_sub(1) {
        below[at(k)] = behind;
    }
}

#[inline]
fn sum(a: Error, b: Error) -> Error {
    std::array::from_fn(|c| a[c] + b[c])
}

/// The codes of a colour that received some error, and the error that it leaves.
#[inline]
fn settle(color: [f32; 3], received: Error, a: f32, levels: &Levels) -> ([u8; 3], Error) {
    let mut codes = [0; 3];
    let per_alpha = 1.0 / a;
    // What a thin pixel is wrong by matters as much as it covers.
    let error = std::array::from_fn(|c| {
        let wish = clip(clip(color[c]) + received[c] * per_alpha);
        let k = levels.settle(wish);
        codes[c] = levels.codes[k];
        (wish - levels.lights[k]) * a
    });
    (codes, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
    use crate::image::gamma::Gamma;

    /// A ramp from one light to another, the same in every row.
    fn ramp(width: usize, height: usize, from: f32, to: f32) -> Image {
        let light = |i: usize| from + (to - from) * (i % width) as f32 / (width - 1) as f32;
        let pixel = |i: usize| [light(i), light(i), light(i), 1.0];
        Image { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    fn dithered(image: &Image, levels: &Levels, how: Dither) -> Rgba8 {
        let mut out = Rgba8::default();
        dither(image, levels, how, &mut out);
        out
    }

    fn lights(picture: &Rgba8) -> Vec<f64> {
        picture.data.chunks(4).map(|p| f64::from(LINEAR_OF_SRGB8[usize::from(p[0])])).collect()
    }

    fn mean(v: &[f64]) -> f64 {
        v.iter().sum::<f64>() / v.len() as f64
    }

    #[test]
    fn two_hundred_and_fifty_six_levels_are_the_codes_of_srgb() {
        let levels = Levels::new(256, Transfer::Srgb);
        assert!(levels.codes().iter().enumerate().all(|(i, &c)| c as usize == i));
        for i in -10..=200_010 {
            let c = i as f32 / 200_000.0;
            assert_eq!(levels.nearest(c), srgb8(c), "{c}");
            let (k, share) = levels.below(c);
            assert!((0.0..=1.0).contains(&share) && levels.lights()[k] <= clip(c), "{c}: {k} {share}");
        }
        assert_eq!((levels.nearest(f32::NAN), levels.below(f32::NAN)), (0, (0, 0.0)));
        assert_eq!((levels.nearest(f32::INFINITY), levels.below(f32::INFINITY)), (255, (254, 1.0)));
    }

    #[test]
    fn levels_of_any_number_and_curve_are_found_again() {
        for transfer in [
            Transfer::Srgb,
            Transfer::Power(Gamma::new(10.0).unwrap()),
            Transfer::Power(Gamma::new(0.1).unwrap()),
        ] {
            for n in [2, 3, 7, 16, 255, 256] {
                let levels = Levels::new(n, transfer);
                for k in 0..n {
                    let light = levels.lights()[k];
                    // Curves as steep as these have several codes of one light.
                    let same = |c: u8| {
                        levels.lights()[levels.codes().iter().position(|&x| x == c).unwrap()] == light
                    };
                    assert!(same(levels.nearest(light)), "{transfer:?} {n} {k}");
                    let (b, share) = levels.below(light);
                    let shown = b + usize::from(share > 0.5);
                    assert!(levels.lights()[shown] == light, "{transfer:?} {n} {k}: {b} {share}");
                }
            }
        }
    }

    #[test]
    fn the_mean_light_of_a_ramp_stays() {
        let image = ramp(256, 64, 0.0, 1.0);
        let want: Vec<f64> = image.pixels.iter().map(|p| f64::from(p[0])).collect();
        for n in [2, 4, 256] {
            let levels = Levels::new(n, Transfer::Srgb);
            for how in [Dither::Ordered, Dither::Noise, Dither::FloydSteinberg] {
                let off = mean(&lights(&dithered(&image, &levels, how))) - mean(&want);
                assert!(off.abs() < 2e-3, "{how:?} to {n} levels: {off:.1e}");
            }
        }
        // The nearest of two levels is not the mean: half of the signal is a fifth of the light.
        let off =
            mean(&lights(&dithered(&image, &Levels::new(2, Transfer::Srgb), Dither::None))) - mean(&want);
        assert!(off > 0.2, "{off}");
    }

    #[test]
    fn every_block_of_the_matrix_has_its_mean() {
        let levels = Levels::new(2, Transfer::Srgb);
        for k in 0..=64 {
            let light = k as f32 / 64.0;
            let out = dithered(&Image::filled(8, 8, [light, light, light, 1.0]), &levels, Dither::Ordered);
            assert_eq!(mean(&lights(&out)), f64::from(light), "{k}");
        }
    }

    /// Most pixels in a row, in any row, between two changes.
    fn widest(picture: &Rgba8) -> usize {
        let run = |row: &[u8]| {
            let codes: Vec<u8> = row.chunks(4).map(|p| p[0]).collect();
            codes.chunk_by(|a, b| a == b).map(<[u8]>::len).max().unwrap_or(0)
        };
        picture.data.chunks(4 * picture.width).map(run).max().unwrap_or(0)
    }

    #[test]
    fn a_ramp_of_a_tenth_of_a_code_a_pixel_has_no_bands() {
        let levels = Levels::new(256, Transfer::Srgb);
        // From code 100 to code 110 within 101 pixels.
        let image = ramp(101, 64, LINEAR_OF_SRGB8[100], LINEAR_OF_SRGB8[110]);
        let rows = |how| {
            let out = dithered(&image, &levels, how);
            // Columns of eight rows have nine shades between two codes: the eye sees steps of 1/8 code.
            let column = |x: usize, y: usize| {
                (0..8).map(|k| u32::from(out.data[4 * ((y + k) * 101 + x)])).sum::<u32>()
            };
            (0..101)
                .map(|x| column(x, 8))
                .collect::<Vec<u32>>()
                .chunk_by(|a, b| a == b)
                .map(<[u32]>::len)
                .max()
                .unwrap()
        };
        // Rounded: bands of ten pixels. Dithered: no column of the matrix repeats over more than its width.
        assert!(rows(Dither::None) >= 9, "{}", rows(Dither::None));
        for how in [Dither::Ordered, Dither::Noise, Dither::FloydSteinberg] {
            assert!(rows(how) <= 4, "{how:?}: {}", rows(how));
        }
        assert!(widest(&dithered(&image, &levels, Dither::None)) >= 9);
        for how in [Dither::Noise, Dither::FloydSteinberg] {
            assert!(widest(&dithered(&image, &levels, how)) < 15, "{how:?}");
        }
    }

    #[test]
    fn thresholds_are_even_and_inside() {
        for how in [Dither::Ordered, Dither::Noise] {
            let all: Vec<f32> = (0..64 * 64).map(|i| how.threshold(i % 64, i / 64).unwrap()).collect();
            assert!(all.iter().all(|t| (0.0..1.0).contains(t)), "{how:?}");
            for t in [0.125, 0.25, 0.5, 0.75] {
                let below = all.iter().filter(|&&v| v < t).count() as f32 / all.len() as f32;
                assert!((below - t).abs() < 0.01, "{how:?} {t}: {below}");
            }
        }
        let mut seen: Vec<u8> = BAYER.concat();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(i, &v)| i == usize::from(v)));
        assert_eq!(BAYER[0][..4], [0, 32, 8, 40]);
    }

    #[test]
    fn what_is_a_level_and_what_is_empty_is_left_alone() {
        let levels = Levels::new(256, Transfer::Srgb);
        let pixel = |i: usize| {
            let (l, a) = (LINEAR_OF_SRGB8[i % 256], [0.0, 1.0, 0.5][i % 3]);
            [l * a, l * a, l * a, a]
        };
        let image = Image { width: 16, height: 48, pixels: (0..768).map(pixel).collect() };
        let plain = image.to_rgba8();
        for how in Dither::ALL {
            assert_eq!(Dither::from_name(how.name()), Some(how));
            let out = dithered(&image, &levels, how);
            // Multiplied by ½ and divided again, levels are themselves in binary arithmetic.
            assert_eq!(out, plain, "{how:?}");
        }
    }

    #[test]
    fn thin_edges_composite_to_the_light_that_they_had() {
        // A quarter of the light everywhere, coverage falling off: over black it must keep its mean.
        let pixel = |i: usize| {
            let a = (i % 64) as f32 / 63.0;
            [0.25 * a, 0.25 * a, 0.25 * a, a]
        };
        let image = Image { width: 64, height: 64, pixels: (0..4096).map(pixel).collect() };
        let want = image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 4096.0;
        for how in [Dither::Ordered, Dither::Noise, Dither::FloydSteinberg] {
            let out = dithered(&image, &Levels::new(4, Transfer::Srgb), how);
            let light = |p: &[u8]| f64::from(LINEAR_OF_SRGB8[usize::from(p[0])]) * f64::from(p[3]) / 255.0;
            let found = out.data.chunks(4).map(light).sum::<f64>() / 4096.0;
            assert!((found - want).abs() < 2e-3, "{how:?}: {found} {want}");
        }
    }
}
