//! Pictures in memory: linear light in f32, and 8-bit sRGB for files. No files here.
//!
//! Chapter 1 of the notes, a module a section: [`sample`] §1.1, [`depth`] §1.2, [`gamma`], [`tone`] and [`dither`](mod@dither) §1.3,
//! [`composite`] §1.4. [`develop`] joins them on the way from light to a file.

pub mod color;
pub mod composite;
pub mod depth;
pub mod develop;
pub mod dither;
pub mod gamma;
pub mod sample;
pub mod tone;

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
}
