//! Pictures in memory: linear light in f32, and 8-bit sRGB for files. No files here.
//!
//! Chapter 1 of the notes, a module a section: [`sample`] §1.1, [`depth`] §1.2, [`gamma`], [`tone`] and [`dither`](mod@dither) §1.3,
//! [`composite`] §1.4; [`hue`] and [`bayer`] are what its reference pictures ask for besides. [`develop`] joins them on the way from
//! light to a file.

pub mod bayer;
pub mod color;
pub mod composite;
pub mod depth;
pub mod develop;
pub mod dither;
pub mod gamma;
pub mod hue;
pub mod sample;
pub mod tone;
mod turn;

/// `width × height` pixels of linear RGBA, alpha premultiplied, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Image {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` pixels.
    pub pixels: Vec<[f32; 4]>,
}

/// `width × height` pixels of 8-bit sRGB RGBA with straight alpha, row by row from the top left: what PNG holds.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Rgba8 {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `4 · width · height` bytes.
    pub data: Vec<u8>,
}

impl Image {
    /// A picture of one colour (linear, premultiplied).
    pub fn filled(width: usize, height: usize, pixel: [f32; 4]) -> Self {
        Self { width, height, pixels: vec![pixel; width * height] }
    }

    /// To 8 bits: un-premultiply, encode as sRGB, round to nearest.
    pub fn to_rgba8(&self) -> Rgba8 {
        let data = self.pixels.iter().flat_map(|p| color::encode_srgb8(*p)).collect();
        Rgba8 { width: self.width, height: self.height, data }
    }

    /// From 8 bits: decode sRGB, multiply by alpha. [`to_rgba8`](Self::to_rgba8) gives the same codes back where alpha is not 0.
    ///
    /// # Panics
    /// Where the buffer does not hold `4 · width · height` bytes.
    pub fn from_rgba8(picture: &Rgba8) -> Self {
        let (width, height) = (picture.width, picture.height);
        assert_eq!(picture.data.len(), 4 * width * height, "bytes of the picture");
        let pixels = picture.data.as_chunks::<4>().0.iter().map(|p| color::decode_srgb8(*p)).collect();
        Self { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_the_way_through_light_at_every_alpha() {
        let data =
            (1..=255u8).flat_map(|a| (0..=255u8).flat_map(move |c| [c, 255 - c, c ^ 0x55, a])).collect();
        let picture = Rgba8 { width: 256, height: 255, data };
        assert_eq!(Image::from_rgba8(&picture).to_rgba8(), picture);
        let empty = Rgba8 { width: 1, height: 1, data: vec![9, 9, 9, 0] };
        assert_eq!(Image::from_rgba8(&empty).pixels, [[0.0; 4]]);
    }
}
