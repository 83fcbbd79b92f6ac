//! One picture as PNG.

use super::{Error, check_size};
use crate::image::Rgba8;

/// How hard PNG is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum PngLevel {
    /// A fraction of the time that drawing takes.
    #[default]
    Fast,
    /// zlib's middle: on shaded balls 3 to 12 % smaller for thirty times the time.
    Balanced,
    /// zlib's best: another 3 % for three times the time again.
    Best,
}

impl PngLevel {
    /// Set the compressor and the row filter.
    pub(super) fn apply<W: std::io::Write>(self, encoder: &mut ::png::Encoder<'_, W>) {
        encoder.set_compression(match self {
            Self::Fast => ::png::Compression::Fast,
            Self::Balanced => ::png::Compression::Balanced,
            Self::Best => ::png::Compression::High,
        });
        // On shaded balls at 512² Paeth alone takes 0.72 ms and 72.2 KB a frame where trying all filters takes
        // 1.14 ms and 72.2 KB; Sub takes 0.79 ms and 89.8 KB, Up 0.64 ms and 107.2 KB.
        if self == Self::Fast {
            encoder.set_filter(::png::Filter::Paeth);
        }
    }
}

/// Bytes of a PNG file: 8-bit sRGB, without an alpha channel where the picture is opaque.
///
/// The same picture gives the same bytes. Pure: it may run on any thread.
///
/// # Errors
/// [`Error::Size`] where a side is zero or the buffer does not hold `4 · width · height` bytes.
pub fn encode_png(picture: &Rgba8, level: PngLevel) -> Result<Vec<u8>, Error> {
    check_size(picture, "PNG", i32::MAX as usize)?;
    let opaque = is_opaque(&picture.data);
    // Rendered pictures shrink at least to a quarter or so; a wrong guess costs one reallocation.
    let mut bytes = Vec::with_capacity(picture.data.len() / 4 + 1024);
    let mut encoder = encoder(&mut bytes, [picture.width, picture.height], opaque);
    level.apply(&mut encoder);
    let written = encoder.write_header().and_then(|mut w| {
        match opaque {
            true => w.write_image_data(&without_alpha(&picture.data))?,
            false => w.write_image_data(&picture.data)?,
        }
        w.finish()
    });
    written.map_err(|e| failed("PNG", e))?;
    Ok(bytes)
}

/// An encoder of 8-bit sRGB.
pub(super) fn encoder<W: std::io::Write>(
    out: W,
    size: [usize; 2],
    opaque: bool,
) -> ::png::Encoder<'static, W> {
    let mut encoder = ::png::Encoder::new(out, size[0] as u32, size[1] as u32);
    encoder.set_color(if opaque { ::png::ColorType::Rgb } else { ::png::ColorType::Rgba });
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    encoder
}

/// Whether every pixel covers what is behind it.
fn is_opaque(rgba: &[u8]) -> bool {
    rgba.chunks(4096).all(|row| row.as_chunks::<4>().0.iter().fold(255, |a, p| a & p[3]) == 255)
}

/// RGB of RGBA.
pub(super) fn without_alpha(rgba: &[u8]) -> Vec<u8> {
    let pixels = rgba.as_chunks::<4>().0;
    let mut rgb = vec![0; pixels.len() * 3];
    for (to, from) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(pixels) {
        *to = [from[0], from[1], from[2]];
    }
    rgb
}

/// The encoder's error as ours.
pub(super) fn failed(format: &'static str, e: ::png::EncodingError) -> Error {
    let source = match e {
        ::png::EncodingError::IoError(e) => e,
        other => std::io::Error::other(other.to_string()),
    };
    Error::Encode { format, source }
}
