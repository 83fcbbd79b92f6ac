//! Two pictures compared: which pixels differ, by how much, and where.
//!
//! A pixel of alpha 0 has no colour: whatever codes a file stores there count as 0.

use crate::image::{Image, Rgba8};

/// Two pictures that cannot be compared pixel by pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the pictures have {} × {} and {} × {} pixels: expected the same sides", .expected[0], .expected[1], .actual[0], .actual[1]
)]
pub struct SidesDiffer {
    /// Width and height of the one.
    pub expected: [usize; 2],
    /// Width and height of the other.
    pub actual: [usize; 2],
}

/// The largest difference of a channel, and where it is first found, row by row from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Worst {
    /// In codes of 255.
    pub codes: u8,
    /// 0 red, 1 green, 2 blue, 3 alpha.
    pub channel: usize,
    /// Column and row from the top left.
    pub at: [usize; 2],
}

/// How two pictures of 8 bits differ.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Difference {
    /// Pixels that were compared.
    pub pixels: usize,
    /// Pixels whose worst channel differs by `k` codes, for `k` of 0…255.
    pub histogram: Vec<usize>,
    /// The largest difference.
    pub worst: Worst,
    /// Mean of the squared differences, codes². Over R, G and B where both pictures are opaque, else over R, G, B and alpha.
    pub mse: f64,
}

impl Difference {
    /// Pixels that differ by more than `codes` in any channel.
    pub fn beyond(&self, codes: u8) -> usize {
        self.histogram.iter().skip(usize::from(codes) + 1).sum()
    }

    /// Peak signal to noise, `10 log₁₀(255² / mse)` dB; infinite for equal pictures.
    pub fn psnr(&self) -> f64 {
        decibels(self.mse / (255.0 * 255.0))
    }
}

/// Compare the codes of two pictures.
///
/// ```
/// use sinew::{image::Rgba8, measure::picture::difference};
/// let gray = |v: u8| Rgba8 { width: 2, height: 1, data: vec![100, 100, 100, 255, v, v, v, 255] };
/// let d = difference(&gray(100), &gray(110)).unwrap();
/// assert_eq!((d.beyond(0), d.beyond(10), d.worst.codes, d.worst.at), (1, 0, 10, [1, 0]));
/// // Half the pixels are 10 codes off: 10 log₁₀(255² / 50).
/// assert!((d.psnr() - 31.14).abs() < 0.01);
/// assert_eq!(difference(&gray(7), &gray(7)).unwrap().psnr(), f64::INFINITY);
/// ```
///
/// # Errors
/// [`SidesDiffer`].
pub fn difference(expected: &Rgba8, actual: &Rgba8) -> Result<Difference, SidesDiffer> {
    same_sides(sides(expected), sides(actual))?;
    let (mut histogram, mut worst, mut squares) = (vec![0; 256], Worst::default(), 0u64);
    let (a, b) = (expected.data.as_chunks::<4>().0, actual.data.as_chunks::<4>().0);
    for (i, (p, q)) in a.iter().zip(b).enumerate() {
        if p == q {
            continue;
        }
        let off = absolute(*p, *q);
        let (channel, most) = (0..4).map(|c| (c, off[c])).rev().max_by_key(|o| o.1).unwrap_or((0, 0));
        histogram[usize::from(most)] += 1;
        squares += off.iter().map(|&d| u64::from(d) * u64::from(d)).sum::<u64>();
        if most > worst.codes {
            worst = Worst { codes: most, channel, at: [i % expected.width, i / expected.width] };
        }
    }
    // Pixels of the same bytes were passed over.
    histogram[0] += a.len() - histogram.iter().sum::<usize>();
    let opaque = |p: &[[u8; 4]]| p.iter().all(|p| p[3] == 255);
    let channels = if opaque(a) && opaque(b) { 3 } else { 4 };
    let mse = squares as f64 / (channels * a.len()).max(1) as f64;
    Ok(Difference { pixels: a.len(), histogram, worst, mse })
}

/// Peak signal to noise of linear, premultiplied light with 1 as the peak, `10 log₁₀(1 / mse)` dB; infinite for equal pictures, −∞
/// where one of them holds no numbers.
///
/// Over R, G and B where both pictures are opaque, else over R, G, B and alpha. Darks weigh less here than eyes give them.
///
/// ```
/// use sinew::{image::Image, measure::picture::psnr_linear};
/// let plain = |l: f32| Image::filled(4, 4, [l, l, l, 1.0]);
/// assert!((psnr_linear(&plain(0.5), &plain(0.6)).unwrap() - 20.0).abs() < 1e-5);
/// ```
///
/// # Errors
/// [`SidesDiffer`].
pub fn psnr_linear(expected: &Image, actual: &Image) -> Result<f64, SidesDiffer> {
    same_sides([expected.width, expected.height], [actual.width, actual.height])?;
    let opaque = |i: &Image| i.pixels.iter().all(|p| p[3] == 1.0);
    let channels = if opaque(expected) && opaque(actual) { 3 } else { 4 };
    let pairs = expected.pixels.iter().zip(&actual.pixels);
    let squares: f64 =
        pairs.flat_map(|(p, q)| (0..4).map(|c| f64::from(p[c]) - f64::from(q[c]))).map(|d| d * d).sum();
    Ok(decibels(squares / (channels * expected.pixels.len()).max(1) as f64))
}

/// `10 log₁₀(1 / noise)`.
fn decibels(noise: f64) -> f64 {
    if noise.is_nan() {
        return f64::NEG_INFINITY;
    }
    if noise > 0.0 { -10.0 * noise.log10() } else { f64::INFINITY }
}

fn sides(p: &Rgba8) -> [usize; 2] {
    [p.width, p.height]
}

pub(super) fn same_sides(expected: [usize; 2], actual: [usize; 2]) -> Result<(), SidesDiffer> {
    if expected == actual { Ok(()) } else { Err(SidesDiffer { expected, actual }) }
}

/// Differences of the channels; colour under alpha 0 is none.
fn absolute(p: [u8; 4], q: [u8; 4]) -> [u8; 4] {
    let [p, q] = [p, q].map(|p| if p[3] == 0 { [0; 4] } else { p });
    std::array::from_fn(|c| p[c].abs_diff(q[c]))
}

/// Columns between the panels.
const GAP: usize = 4;
/// Where only one picture has a pixel.
const ALONE: [u8; 4] = [255, 0, 255, 255];

/// How much a difference of at most `worst` codes is amplified for [`panels`]: so that it shows as white, `⌊255 / worst⌋`.
pub fn amplification(worst: u8) -> u8 {
    255 / worst.max(1)
}

/// Three pictures side by side: expected | difference | actual.
///
/// The difference is opaque: `gain · |Δ|` a channel on black, a difference of alpha added to all three. Pixels that only one of the
/// pictures has are magenta.
///
/// ```
/// use sinew::{image::Rgba8, measure::picture::panels};
/// let one = |c: [u8; 4]| Rgba8 { width: 1, height: 1, data: c.to_vec() };
/// let p = panels(&one([10, 0, 0, 255]), &one([13, 0, 0, 255]), 20);
/// assert_eq!(p.data[4 * 5..][..4], [60, 0, 0, 255]);
/// ```
pub fn panels(expected: &Rgba8, actual: &Rgba8, gain: u8) -> Rgba8 {
    let (width, height) = (expected.width.max(actual.width), expected.height.max(actual.height));
    let middle = expected.width + GAP;
    let last = middle + width + GAP;
    let mut out = Rgba8 { width: last + actual.width, height, data: vec![] };
    out.data.resize(4 * out.width * height, 0);
    let pixel = |p: &Rgba8, x: usize, y: usize| -> Option<[u8; 4]> {
        let at = 4 * (y * p.width + x);
        (x < p.width && y < p.height).then(|| std::array::from_fn(|c| p.data[at + c]))
    };
    for (y, row) in out.data.chunks_mut((4 * out.width).max(1)).enumerate() {
        let row = row.as_chunks_mut::<4>().0;
        for x in 0..width {
            let (e, a) = (pixel(expected, x, y), pixel(actual, x, y));
            if let Some(e) = e {
                row[x] = e;
            }
            if let Some(a) = a {
                row[last + x] = a;
            }
            row[middle + x] = match (e, a) {
                (Some(e), Some(a)) => amplified(absolute(e, a), gain),
                (None, None) => [0; 4],
                _ => ALONE,
            };
        }
    }
    out
}

fn amplified([r, g, b, a]: [u8; 4], gain: u8) -> [u8; 4] {
    let shown = |d: u8| d.saturating_add(a).saturating_mul(gain);
    [shown(r), shown(g), shown(b), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [u8; 4]) -> Rgba8 {
        let data = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .flat_map(|(x, y)| pixel(x, y))
            .collect();
        Rgba8 { width, height, data }
    }

    #[test]
    fn what_differs_is_counted_and_placed() {
        let a = picture(5, 4, |x, y| [x as u8, y as u8, 9, 255]);
        let mut b = a.clone();
        b.data[4 * (2 * 5 + 3) + 1] = 50;
        b.data[4 * (3 * 5 + 1) + 2] = 57;
        b.data[4 * (3 * 5 + 2)] = 3;
        let d = difference(&a, &b).unwrap();
        assert_eq!(d.pixels, 20);
        assert_eq!([0, 1, 47, 48].map(|k| d.beyond(k)), [3, 2, 2, 0]);
        // Of equal ones the first counts.
        assert_eq!(d.worst, Worst { codes: 48, channel: 1, at: [3, 2] });
        assert!((d.mse - (48.0 * 48.0 * 2.0 + 1.0) / 60.0).abs() < 1e-12);
    }

    #[test]
    fn colour_that_nobody_sees_does_not_differ() {
        let a = picture(2, 1, |_, _| [1, 2, 3, 0]);
        let b = picture(2, 1, |_, _| [200, 100, 0, 0]);
        let d = difference(&a, &b).unwrap();
        assert_eq!((d.beyond(0), d.psnr(), d.histogram[0]), (0, f64::INFINITY, 2));
        // Appearing out of nothing is a difference of the whole pixel.
        let c = picture(2, 1, |_, _| [200, 0, 0, 100]);
        assert_eq!(difference(&a, &c).unwrap().worst, Worst { codes: 200, channel: 0, at: [0, 0] });
        assert!((difference(&a, &c).unwrap().mse - (200.0 * 200.0 + 100.0 * 100.0) / 4.0).abs() < 1e-9);
    }

    #[test]
    fn other_sides_are_refused_and_still_shown() {
        let (a, b) = (picture(3, 2, |_, _| [9, 9, 9, 255]), picture(2, 3, |_, _| [9, 9, 9, 255]));
        let refused = difference(&a, &b).unwrap_err();
        assert!(refused.to_string().contains("3 × 2 and 2 × 3"), "{refused}");
        let shown = panels(&a, &b, 1);
        assert_eq!([shown.width, shown.height], [3 + 4 + 3 + 4 + 2, 3]);
        let at = |x: usize, y: usize| shown.data[4 * (y * shown.width + x)..][..4].to_vec();
        assert_eq!((at(7, 0), at(9, 0), at(9, 2)), (vec![0, 0, 0, 255], ALONE.to_vec(), vec![0; 4]));
        assert_eq!(difference(&Rgba8::default(), &Rgba8::default()).unwrap().psnr(), f64::INFINITY);
    }

    #[test]
    fn the_worst_is_shown_as_white() {
        assert_eq!([0, 1, 2, 100, 128, 255].map(amplification), [255, 255, 127, 2, 1, 1]);
    }
}
