//! What every film has, whatever its format.

use super::{Error, check_size};
use crate::image::Rgba8;
use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
use crate::time::Rate;

/// A film that is to be written.
///
/// The number of frames is known beforehand: APNG states it first, and GIF spreads the rounding of its delays with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Pixels a row, and rows.
    pub size: [usize; 2],
    /// Frames that will come.
    pub frames: u32,
    /// Frames a second.
    pub rate: Rate,
    /// How often it is shown; 0 is for ever.
    pub plays: u16,
    /// Keep transparent pixels. Otherwise everything is laid over `matte`.
    pub transparent: bool,
    /// sRGB colour behind what is partly transparent.
    pub matte: [u8; 3],
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct FilmReport {
    /// Frames in the file.
    pub frames: u32,
    /// Frames that the format cannot show, because they are too short; the length of the film is right without them.
    pub dropped: u32,
}

impl Film {
    /// An opaque film over white that repeats for ever.
    pub fn new(size: [usize; 2], frames: u32, rate: Rate) -> Self {
        Self { size, frames, rate, plays: 0, transparent: false, matte: [255; 3] }
    }

    /// Refuse sides that a format cannot say.
    pub(super) fn check(&self, format: &'static str, limit: usize) -> Result<(), Error> {
        let [width, height] = self.size;
        match self.size.iter().all(|s| (1..=limit).contains(s)) {
            true => Ok(()),
            false => Err(Error::Size { width, height, bytes: 0, format, limit }),
        }
    }

    /// Refuse a frame that is none, or that has another size.
    pub(super) fn check_frame(&self, frame: &Rgba8, format: &'static str) -> Result<(), Error> {
        check_size(frame, format, i32::MAX as usize)?;
        let found = [frame.width, frame.height];
        match found == self.size {
            true => Ok(()),
            false => Err(Error::FrameSize { expected: self.size, found }),
        }
    }

    /// A frame laid over the matte.
    pub(super) fn flattened(&self, frame: &Rgba8) -> Rgba8 {
        let flat = |p: &[u8; 4]| {
            let [r, g, b] = self.over_matte(*p);
            [r, g, b, 255]
        };
        let pixels: Vec<[u8; 4]> = frame.data.as_chunks::<4>().0.iter().map(flat).collect();
        Rgba8 { data: pixels.into_flattened(), ..*frame }
    }

    /// A pixel laid over the matte in linear light; its own alpha is left out of it.
    ///
    /// `result = α·colour + (1 − α)·matte`
    #[inline]
    pub(super) fn over_matte(&self, p: [u8; 4]) -> [u8; 3] {
        match p[3] {
            255 => [p[0], p[1], p[2]],
            0 => self.matte,
            a => std::array::from_fn(|i| {
                let a = f32::from(a) / 255.0;
                let [front, back] = [p[i], self.matte[i]].map(|c| LINEAR_OF_SRGB8[usize::from(c)]);
                srgb8(a * front + (1.0 - a) * back)
            }),
        }
    }

    /// Whether a pixel shows what is behind the film, for a format without partial transparency.
    #[inline]
    pub(super) fn is_hole(&self, alpha: u8) -> bool {
        self.transparent && alpha < 128
    }
}
