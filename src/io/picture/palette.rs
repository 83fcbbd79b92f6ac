//! One palette for all frames of a clip.

use super::film::Film;
use super::nearest::{Nearest, distance};
use crate::image::Rgba8;
use quantette::deps::palette::{Oklab, Srgb, cast::from_component_slice};
use quantette::{color_space, kmeans, wu};
use std::cmp::Ordering;

/// At most 255 colours of 8-bit sRGB; the index after the last one is left to transparent pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Palette {
    colors: Vec<[u8; 3]>,
}

/// Distinct colours that are counted; beyond it neighbours are merged. 8 MB.
const MAX_DISTINCT: usize = 1 << 20;

/// Colours that the clustering draws from.
///
/// On shaded balls at 512² and 256 entries this takes 40 ms for 16 frames and leaves errors of 0.25 to 0.27 codes; four
/// times as many take 90 ms and leave 0.29 to 0.31, for the room that [`fill`] finds is worth more.
const SAMPLES: u32 = 1 << 16;

impl Palette {
    /// The colours that stand best for those of some frames, at most `n` with the transparent index.
    ///
    /// Frames with fewer colours keep them exactly. Otherwise Wu's bipartition of the exact histogram in Oklab gives
    /// a start and MacQueen's k-means (fixed seed, one thread) improves it. Centres that fall on the same 8-bit colour
    /// (dark gradients, mostly) make room for the colours with the largest squared error times pixels. The frames may be a sample of the film;
    /// memory is bounded whatever their number. `n` is brought into 2…256.
    pub fn from_frames<'a>(frames: impl IntoIterator<Item = &'a Rgba8>, n: usize, film: &Film) -> Self {
        let n = n.clamp(2, 256) - 1;
        let mut histogram = Histogram::default();
        for frame in frames {
            histogram.add(frame, film);
        }
        let colors = match histogram.colors.len() {
            0 => vec![film.matte],
            found if found <= n => histogram.colors.iter().map(|c| unpack(c.0)).collect(),
            _ => fill(cluster(&histogram.colors, n as u16), &histogram.colors, n),
        };
        Self { colors }
    }

    /// A palette of given colours.
    ///
    /// # Panics
    /// Without colours, or with more than 255.
    pub fn new(colors: Vec<[u8; 3]>) -> Self {
        assert!((1..=255).contains(&colors.len()), "a palette has 1 to 255 colours, found {}", colors.len());
        Self { colors }
    }

    /// The colours, in the order of their indices.
    pub fn colors(&self) -> &[[u8; 3]] {
        &self.colors
    }

    /// The index of transparent pixels: the one after the last colour.
    pub fn transparent(&self) -> u8 {
        self.colors.len() as u8
    }
}

/// Colours and their pixels, sorted by colour.
#[derive(Default)]
struct Histogram {
    colors: Vec<(u32, u32)>,
    /// Bits a channel that were given up for the sake of memory.
    coarse: u32,
}

impl Histogram {
    fn add(&mut self, frame: &Rgba8, film: &Film) {
        let mut last = ([0; 4], None);
        for p in frame.data.as_chunks::<4>().0 {
            // Rendered pictures have long runs: one entry a run.
            if last.1.is_none() || last.0 != *p {
                last = (*p, (!film.is_hole(p[3])).then(|| pack(film.over_matte(*p))));
                if let Some(color) = last.1 {
                    self.colors.push((color, 0));
                }
            }
            if let (Some(_), Some(run)) = (last.1, self.colors.last_mut()) {
                run.1 = run.1.saturating_add(1);
            }
        }
        self.merge();
    }

    /// Sort, join equals, and give up bits while there are too many.
    fn merge(&mut self) {
        loop {
            let mask = 0x01_01_01 * (0xff >> self.coarse << self.coarse);
            self.colors.iter_mut().for_each(|c| c.0 &= mask);
            self.colors.sort_unstable();
            self.colors.dedup_by(|b, a| {
                let same = a.0 == b.0;
                if same {
                    a.1 = a.1.saturating_add(b.1);
                }
                same
            });
            if self.colors.len() <= MAX_DISTINCT {
                return;
            }
            self.coarse += 1;
        }
    }
}

fn pack([r, g, b]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, r, g, b])
}

fn unpack(color: u32) -> [u8; 3] {
    let [_, r, g, b] = color.to_be_bytes();
    [r, g, b]
}

/// At most `n` colours that stand for a histogram, sorted by lightness and free of repetitions.
fn cluster(histogram: &[(u32, u32)], n: u16) -> Vec<[u8; 3]> {
    let drawn: Vec<u8> = draw(histogram).into_iter().flat_map(unpack).collect();
    let lab = color_space::srgb8_to_oklab(from_component_slice::<Srgb<u8>>(&drawn));
    let size = quantette::PaletteSize::try_from(n).unwrap_or(quantette::PaletteSize::MAX);
    let start = wu::WuF32x3::run_slice(&lab, wu::BinnerF32x3::oklab_from_srgb8()).map(|w| w.palette(size));
    // Each sample is seen twice on average.
    let options = kmeans::KmeansOptions::new().sampling_factor(2.0).max_samples(2 * SAMPLES).seed(0);
    let best = start.and_then(|start| kmeans::Kmeans::run_slice(&lab, start, options));
    let mut lab: Vec<Oklab> = best.map(|k| k.into_palette().into_vec()).unwrap_or_default();
    lab.sort_by(|a, b| a.l.partial_cmp(&b.l).unwrap_or(Ordering::Equal));
    let mut colors: Vec<[u8; 3]> = Vec::with_capacity(lab.len());
    for c in color_space::oklab_to_srgb8(&lab) {
        let c = [c.red, c.green, c.blue];
        if !colors.contains(&c) {
            colors.push(c);
        }
    }
    colors
}

/// Add colours of the histogram until there are `n`: each time the one that costs most.
fn fill(mut colors: Vec<[u8; 3]>, histogram: &[(u32, u32)], n: usize) -> Vec<[u8; 3]> {
    let wide = |c: [u8; 3]| c.map(i32::from);
    let mut nearest = Nearest::new(&colors);
    // Colour, squared error, pixels.
    let mut costs: Vec<_> = histogram
        .iter()
        .map(|&(c, pixels)| {
            let c = unpack(c);
            (wide(c), distance(wide(c), wide(colors[usize::from(nearest.of(c))])), pixels)
        })
        .collect();
    while colors.len() < n {
        // Of equals the first, so that the order of the histogram decides.
        let cost = |c: &&([i32; 3], i32, u32)| (c.1 as u64) * u64::from(c.2);
        let Some(worst) = costs.iter().rev().max_by_key(cost).filter(|c| c.1 > 0) else { break };
        let added = worst.0;
        colors.push(added.map(|c| c as u8));
        costs.iter_mut().for_each(|c| c.1 = c.1.min(distance(c.0, added)));
    }
    colors
}

/// [`SAMPLES`] colours in proportion to their pixels, by equal steps through the cumulated histogram.
fn draw(histogram: &[(u32, u32)]) -> Vec<u32> {
    let total: u64 = histogram.iter().map(|c| u64::from(c.1)).sum();
    let count = total.min(u64::from(SAMPLES));
    let (mut drawn, mut passed) = (Vec::with_capacity(count as usize), 0u64);
    for &(color, pixels) in histogram {
        passed += u64::from(pixels);
        // The k-th sample stands at pixel (k + ½)·total/count.
        while (2 * drawn.len() as u64 + 1) * total < 2 * count * passed {
            drawn.push(color);
        }
    }
    drawn
}
