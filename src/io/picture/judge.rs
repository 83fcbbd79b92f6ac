//! Which dithering looks best, by measurement.

use super::dither::{Dither, Indexed, Mapper};
use super::film::Film;
use super::nearest::WEIGHT;
use super::palette::Palette;
use crate::image::Rgba8;
use crate::image::color::{LINEAR_OF_SRGB8, srgb_from_linear};

/// How far a way of dithering is from the frames.
///
/// Both figures are root mean squares over all pixels and frames, in 8-bit sRGB codes, channels weighted as in
/// [`Mapper`], after a Gaussian blur of σ = 1 pixel in linear light: an eye at 60 cm from a screen of 96 dpi sees a
/// pixel under 1.5′, about the width of its own point spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DitherScore {
    /// What was measured.
    pub dither: Dither,
    /// Difference from the frames.
    pub error: f64,
    /// Change of that difference from frame to frame where the frames themselves do not change.
    pub flicker: f64,
}

impl DitherScore {
    /// `√(error² + flicker²)`: the smallest wins.
    pub fn total(&self) -> f64 {
        self.error.hypot(self.flicker)
    }
}

/// Frames that are measured: two tell the flicker, and more cost as much as drawing them.
const FRAMES: usize = 2;

/// The dithering with the smallest total on the first and the middle one of the frames, and the figures of all.
///
/// Of equals the simplest is taken, so a film with few colours is not dithered at all.
pub fn choose_dither(frames: &[Rgba8], palette: &Palette, film: &Film) -> (Dither, [DitherScore; 3]) {
    let count = frames.len().min(FRAMES);
    let chosen: Vec<Seen> = (0..count).map(|k| Seen::new(&frames[k * frames.len() / count], film)).collect();
    let mut mapper = Mapper::new(palette, film);
    let scores = Dither::ALL.map(|dither| score(&chosen, &mut mapper, dither));
    let best = scores.iter().min_by(|a, b| a.total().total_cmp(&b.total()));
    (best.map_or(Dither::None, |s| s.dither), scores)
}

/// A frame, and how the eye sees it.
struct Seen<'a> {
    frame: &'a Rgba8,
    blurred: Vec<[f32; 3]>,
}

impl<'a> Seen<'a> {
    fn new(frame: &'a Rgba8, film: &Film) -> Self {
        let opaque = |p: &[u8; 4]| if film.is_hole(p[3]) { film.matte } else { film.over_matte(*p) };
        let blurred = seen(frame.data.as_chunks::<4>().0.iter().map(opaque), [frame.width, frame.height]);
        Self { frame, blurred }
    }
}

fn score(frames: &[Seen], mapper: &mut Mapper, dither: Dither) -> DitherScore {
    let (mut error, mut flicker, mut pixels, mut pairs) = (0.0, 0.0, 0usize, 0usize);
    let mut before: Option<(&Seen, Vec<[f32; 3]>)> = None;
    for now in frames {
        let difference = difference(now, &mapper.map(now.frame, dither), mapper);
        error += difference.iter().map(square).sum::<f64>();
        pixels += difference.len();
        if let Some((then, last)) = before.filter(|b| b.1.len() == difference.len()) {
            flicker += change(then, now, &last, &difference);
            pairs += difference.len();
        }
        before = Some((now, difference));
    }
    let root = |sum: f64, n: usize| (sum / n.max(1) as f64).sqrt();
    DitherScore { dither, error: root(error, pixels), flicker: root(flicker, pairs) }
}

/// What the eye sees of the indexed frame, less what it sees of the frame, in codes.
fn difference(seen_frame: &Seen, indexed: &Indexed, mapper: &Mapper) -> Vec<[f32; 3]> {
    let (colors, matte) = (mapper.palette().colors(), mapper.matte());
    let shown = indexed.indices.iter().map(|&i| *colors.get(usize::from(i)).unwrap_or(&matte));
    let mut codes = seen(shown, indexed.size);
    for (c, r) in codes.iter_mut().zip(&seen_frame.blurred) {
        *c = std::array::from_fn(|i| c[i] - r[i]);
    }
    codes
}

/// Squared changes of the difference where the frame stands still.
fn change(then: &Seen, now: &Seen, last: &[[f32; 3]], difference: &[[f32; 3]]) -> f64 {
    let pixels = then.frame.data.as_chunks::<4>().0.iter().zip(now.frame.data.as_chunks::<4>().0);
    let still = pixels.zip(last.iter().zip(difference)).filter(|((a, b), _)| a == b);
    still.map(|(_, (p, q))| square(&std::array::from_fn(|i| q[i] - p[i]))).sum()
}

/// `Σ wᵢ·dᵢ² / Σ wᵢ`
fn square(d: &[f32; 3]) -> f64 {
    let weight = |i: usize| f64::from(WEIGHT[i]);
    let sum: f64 = (0..3).map(|i| weight(i) * f64::from(d[i]) * f64::from(d[i])).sum();
    sum / (weight(0) + weight(1) + weight(2))
}

/// sRGB codes of a picture that was blurred in linear light.
fn seen(pixels: impl Iterator<Item = [u8; 3]>, [w, h]: [usize; 2]) -> Vec<[f32; 3]> {
    let light: Vec<[f32; 3]> = pixels.map(|p| p.map(|c| LINEAR_OF_SRGB8[usize::from(c)])).collect();
    let mut rows = vec![[0.0; 3]; light.len()];
    for y in 0..h {
        blur_line(&light[y * w..][..w], &mut rows[y * w..][..w]);
    }
    let mut out = light;
    for y in 0..h {
        blur_rows(&rows, &mut out[y * w..][..w], y, w, h);
    }
    out.iter_mut().for_each(|p| *p = p.map(code));
    out
}

/// The binomial kernel 1 4 6 4 1, a Gaussian of σ = 1; ends are repeated.
const KERNEL: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

fn blur_line(from: &[[f32; 3]], to: &mut [[f32; 3]]) {
    let last = from.len().saturating_sub(1);
    for (x, out) in to.iter_mut().enumerate() {
        let at = |k: usize| from[(x + k).saturating_sub(2).min(last)];
        let taps: [[f32; 3]; 5] = std::array::from_fn(at);
        *out = mix(&taps);
    }
}

fn blur_rows(from: &[[f32; 3]], to: &mut [[f32; 3]], y: usize, w: usize, h: usize) {
    let row = |k: usize| &from[(y + k).saturating_sub(2).min(h - 1) * w..][..w];
    let rows: [&[[f32; 3]]; 5] = std::array::from_fn(row);
    for (x, out) in to.iter_mut().enumerate() {
        *out = mix(&std::array::from_fn(|k| rows[k][x]));
    }
}

#[inline]
fn mix(taps: &[[f32; 3]; 5]) -> [f32; 3] {
    std::array::from_fn(|i| (0..5).map(|k| KERNEL[k] * taps[k][i]).sum())
}

/// The fractional sRGB code of light, by a table of 4096 steps of its root.
#[inline]
fn code(light: f32) -> f32 {
    use std::sync::LazyLock;
    static TABLE: LazyLock<Vec<f32>> = LazyLock::new(|| {
        (0..=4097).map(|i| 255.0 * srgb_from_linear((i as f32 / 4096.0).powi(2).min(1.0))).collect()
    });
    let x = light.clamp(0.0, 1.0).sqrt() * 4096.0;
    let (i, t) = (x as usize, x.fract());
    TABLE[i] + t * (TABLE[i + 1] - TABLE[i])
}
