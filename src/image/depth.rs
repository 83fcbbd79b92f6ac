//! How many bits a pixel takes, and how numbers become codes (notes §1.2).
//!
//! Codes are integers `0 … max` (255 for 8 bits). They become numbers `0 … 1` before anything is computed and are quantised once, at
//! the end, in a way that has a name.

/// What a pixel is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Depth {
    /// Black or white: 1 bit.
    Bitmap,
    /// Gray of 8 bits.
    Gray8,
    /// Gray of 16 bits.
    Gray16,
    /// Three channels of 8 bits.
    Rgb24,
    /// Three channels of 32-bit floating point: high dynamic range.
    RgbFloat,
}

impl Depth {
    /// Every depth, smallest first.
    pub const ALL: [Self; 5] = [Self::Bitmap, Self::Gray8, Self::Gray16, Self::Rgb24, Self::RgbFloat];

    /// Bits a pixel.
    pub fn bits(self) -> u64 {
        match self {
            Self::Bitmap => 1,
            Self::Gray8 => 8,
            Self::Gray16 => 16,
            Self::Rgb24 => 24,
            Self::RgbFloat => 96,
        }
    }

    /// Bytes of `width × height` pixels, rows of whole bytes: `height · ⌈width · bits / 8⌉`; `None` beyond 2⁶⁴.
    ///
    /// ```
    /// use sinew::image::depth::Depth;
    /// let kb = Depth::ALL.map(|d| d.bytes(1024, 1024).unwrap() / 1024);
    /// assert_eq!(kb, [128, 1024, 2 * 1024, 3 * 1024, 12 * 1024]);
    /// ```
    pub fn bytes(self, width: u64, height: u64) -> Option<u64> {
        width.checked_mul(self.bits())?.div_ceil(8).checked_mul(height)
    }
}

/// How a number becomes the code of 0…`max`; it is clipped to 0…1 first, and NaN is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Rounding {
    /// `⌊max·x + ½⌋`: at most half a code off.
    #[default]
    Nearest,
    /// `⌊max·x⌋`: half a code too dark on average. The notes' reference pictures are made so.
    Truncate,
}

impl Rounding {
    /// The code of `x`.
    ///
    /// ```
    /// use sinew::image::depth::Rounding;
    /// assert_eq!([Rounding::Nearest, Rounding::Truncate].map(|r| r.quantise(0.5, 255)), [128, 127]);
    /// ```
    pub fn quantise(self, x: f64, max: u32) -> u32 {
        let scaled = f64::from(max) * if x > 0.0 { x.min(1.0) } else { 0.0 };
        match self {
            Self::Nearest => (scaled + 0.5) as u32,
            Self::Truncate => scaled as u32,
        }
    }

    /// 8-bit codes → numbers → `f` → 8-bit codes.
    ///
    /// ```
    /// use sinew::image::depth::Rounding;
    /// let mut codes = [0, 100, 200];
    /// Rounding::Nearest.map8(&mut codes, |x| 1.5 * x);
    /// assert_eq!(codes, [0, 150, 255]);
    /// ```
    pub fn map8(self, codes: &mut [u8], f: impl Fn(f64) -> f64) {
        // 256 codes have 256 answers.
        let table: [u8; 256] = std::array::from_fn(|i| self.quantise(f(number(i as u32, 255)), 255) as u8);
        codes.iter_mut().for_each(|c| *c = table[usize::from(*c)]);
    }
}

/// The number of a code, `code / max`.
pub fn number(code: u32, max: u32) -> f64 {
    f64::from(code) / f64::from(max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_the_way_through_numbers() {
        for max in [1, 255, 65535] {
            assert!((0..=max).all(|c| Rounding::Nearest.quantise(number(c, max), max) == c), "{max}");
        }
        // c / 255 · 255 is c for every code in f64, so truncation is exact for what was not touched.
        assert!((0..=255).all(|c| Rounding::Truncate.quantise(number(c, 255), 255) == c));
    }

    #[test]
    fn what_is_no_number_between_0_and_1_is_clipped() {
        for r in [Rounding::Nearest, Rounding::Truncate] {
            assert_eq!([f64::NAN, -1.0, 2.0, f64::INFINITY].map(|x| r.quantise(x, 255)), [0, 0, 255, 255]);
        }
    }

    #[test]
    fn sizes_have_whole_rows_and_do_not_overflow() {
        assert_eq!(Depth::Bitmap.bytes(9, 3), Some(6));
        assert_eq!(Depth::RgbFloat.bytes(u64::MAX, 2), None);
    }
}
