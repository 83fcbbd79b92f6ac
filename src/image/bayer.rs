//! One number a pixel, as a camera's sensor has it: the Bayer mosaic and the way back (chapter 1 of the notes, its reference pictures).
//!
//! Rows from the top left: `G B / R G`, repeated. What a pixel did not see is the mean of those of its eight neighbours that did.

use super::Rgba8;
use super::depth::Rounding;

/// A picture with one channel a pixel.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Mosaic {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` codes, row by row from the top left.
    pub data: Vec<u8>,
}

/// Which channel pixel `(x, y)`, rows from the top, sees: 0 red, 1 green, 2 blue.
#[inline]
pub fn channel(x: usize, y: usize) -> usize {
    match (x % 2, y % 2) {
        (1, 0) => 2,
        (0, 1) => 0,
        _ => 1,
    }
}

impl Mosaic {
    /// What the sensor keeps of a picture; alpha is not seen.
    ///
    /// ```
    /// use sinew::image::{Rgba8, bayer::Mosaic, depth::Rounding};
    /// let red = Rgba8 { width: 4, height: 4, data: [200, 0, 0, 255].repeat(16) };
    /// let seen = Mosaic::of(&red);
    /// assert_eq!(seen.data[..8], [0, 0, 0, 0, 200, 0, 200, 0]);
    /// assert_eq!(seen.demosaic(Rounding::Nearest), red);
    /// ```
    ///
    /// # Panics
    /// Where the buffer does not hold `4 · width · height` bytes.
    pub fn of(picture: &Rgba8) -> Self {
        let (width, height) = (picture.width, picture.height);
        assert_eq!(picture.data.len(), 4 * width * height, "bytes of the picture");
        let seen = |(i, p): (usize, &[u8; 4])| p[channel(i % width, i / width)];
        Self { width, height, data: picture.data.as_chunks::<4>().0.iter().enumerate().map(seen).collect() }
    }

    /// An opaque picture: what was seen as it is, the rest as the mean of the neighbours that saw it, `Σ v / n`.
    ///
    /// [`Rounding::Nearest`] rounds the mean. [`Rounding::Truncate`] truncates every share, `Σ ⌊v / n⌋`, as the notes' reference picture
    /// does: up to `n − 1` codes too dark. A channel that no neighbour saw (pictures a pixel wide) is 0.
    pub fn demosaic(&self, rounding: Rounding) -> Rgba8 {
        let mut data = Vec::with_capacity(4 * self.data.len());
        for (x, y) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))) {
            let mut pixel = self.around(x, y, rounding);
            pixel[channel(x, y)] = self.data[y * self.width + x];
            data.extend(pixel);
        }
        Rgba8 { width: self.width, height: self.height, data }
    }

    /// The means of the neighbours, opaque.
    fn around(&self, x: usize, y: usize, rounding: Rounding) -> [u8; 4] {
        let near = |v: usize, n: usize| v.saturating_sub(1)..(v + 2).min(n);
        let places = near(y, self.height).flat_map(|j| near(x, self.width).map(move |i| (i, j)));
        let (mut seen, mut count) = ([[0u16; 8]; 3], [0usize; 3]);
        for (i, j) in places.filter(|&p| p != (x, y)) {
            let c = channel(i, j);
            seen[c][count[c]] = u16::from(self.data[j * self.width + i]);
            count[c] += 1;
        }
        let mean = |c: usize| {
            let (values, n) = (&seen[c][..count[c]], count[c].max(1) as u16);
            match rounding {
                Rounding::Nearest => (2 * values.iter().sum::<u16>() + n) / (2 * n),
                Rounding::Truncate => values.iter().map(|v| v / n).sum(),
            }
        };
        [mean(0) as u8, mean(1) as u8, mean(2) as u8, 255]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_colours_survive_and_shares_are_rounded_as_said() {
        let plain = Rgba8 { width: 5, height: 4, data: [13, 101, 255, 255].repeat(20) };
        let mosaic = Mosaic::of(&plain);
        assert_eq!(mosaic.demosaic(Rounding::Nearest), plain);
        // Blue in the middle of four: 4 · ⌊101 / 4⌋ of green, 4 · ⌊13 / 4⌋ of red.
        let dark = mosaic.demosaic(Rounding::Truncate);
        assert_eq!(dark.data[4 * (2 * 5 + 1)..][..4], [12, 100, 255, 255]);
    }

    #[test]
    fn the_smallest_pictures_have_no_neighbours() {
        for (w, h) in [(0, 0), (1, 1), (1, 3), (2, 1)] {
            let picture = Rgba8 { width: w, height: h, data: vec![255; 4 * w * h] };
            assert_eq!(Mosaic::of(&picture).demosaic(Rounding::Nearest).data.len(), 4 * w * h);
        }
    }
}
