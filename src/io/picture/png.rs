//! One picture as PNG.

use super::delta::Rect;
use super::rows::Rows;
use super::{Error, check_size};
use crate::image::Rgba8;
use std::io::Write;

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
    /// The `png` crate's name for it.
    pub(super) fn compression(self) -> ::png::Compression {
        match self {
            Self::Fast => ::png::Compression::Fast,
            Self::Balanced => ::png::Compression::Balanced,
            Self::Best => ::png::Compression::High,
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
    let size = [picture.width, picture.height];
    let rows = Rows::of(picture, Rect::full(size));
    let (opaque, data) = match compress_rgb(rows, level)? {
        Some(data) => (true, data),
        None => (false, compress_rgba(rows, level)?),
    };
    let mut file = Vec::with_capacity(data.len() + 128);
    let written = write_head(&mut file, size, opaque)
        .and_then(|()| write_chunk(&mut file, b"IDAT", &[&data]))
        .and_then(|()| write_chunk(&mut file, b"IEND", &[]));
    written.map_err(failed_io)?;
    Ok(file)
}

/// The signature and the chunks before a picture's data: 8 bits a channel, sRGB, perceptual intent.
pub(super) fn write_head(out: &mut impl Write, size: [usize; 2], opaque: bool) -> std::io::Result<()> {
    out.write_all(b"\x89PNG\r\n\x1a\n")?;
    let sides = size.map(|s| (s as u32).to_be_bytes()).concat();
    write_chunk(out, b"IHDR", &[&sides, &[8, if opaque { 2 } else { 6 }, 0, 0, 0]])?;
    write_chunk(out, b"sRGB", &[&[0]])
}

/// A chunk: size, name, parts, checksum.
pub(super) fn write_chunk(out: &mut impl Write, name: &[u8; 4], parts: &[&[u8]]) -> std::io::Result<()> {
    let size = parts.iter().map(|p| p.len()).sum::<usize>();
    let size = u32::try_from(size).ok().filter(|s| *s <= i32::MAX as u32);
    let size = size.ok_or_else(|| std::io::Error::other("a chunk of PNG holds at most 2 GiB"))?;
    let mut sum = crc32fast::Hasher::new();
    out.write_all(&size.to_be_bytes())?;
    for part in [name.as_slice()].iter().chain(parts) {
        sum.update(part);
        out.write_all(part)?;
    }
    out.write_all(&sum.finalize().to_be_bytes())
}

/// What `IDAT` holds of opaque rows; `None` where a pixel is not opaque.
pub(super) fn compress_rgb(rows: Rows, level: PngLevel) -> Result<Option<Vec<u8>>, Error> {
    if level == PngLevel::Fast {
        return rows.deflate_rgb().map_err(failed_io);
    }
    let opaque = rows.is_opaque();
    opaque.then(|| compress(&rows.rgb(), rows.size(), ::png::ColorType::Rgb, level)).transpose()
}

/// What `IDAT` holds of rows with alpha.
pub(super) fn compress_rgba(rows: Rows, level: PngLevel) -> Result<Vec<u8>, Error> {
    match level {
        PngLevel::Fast => rows.deflate_rgba().map_err(failed_io),
        _ => compress(&rows.rgba(), rows.size(), ::png::ColorType::Rgba, level),
    }
}

/// By the `png` crate, which tries filters and searches for what repeats.
fn compress(
    bytes: &[u8],
    [width, height]: [usize; 2],
    color: ::png::ColorType,
    level: PngLevel,
) -> Result<Vec<u8>, Error> {
    let mut file = Vec::with_capacity(bytes.len() / 4 + 1024);
    let mut encoder = ::png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(color);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(level.compression());
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(bytes)?;
        w.finish()
    });
    written.map_err(failed)?;
    Ok(data_of(&file))
}

/// What the `IDAT` chunks of a PNG hold together.
fn data_of(file: &[u8]) -> Vec<u8> {
    let mut data = Vec::with_capacity(file.len());
    let mut rest = &file[8.min(file.len())..];
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let [a, b, c, d, name @ ..] = *head;
        let size = (u32::from_be_bytes([a, b, c, d]) as usize).min(after.len());
        if &name == b"IDAT" {
            data.extend_from_slice(&after[..size]);
        }
        rest = after.get(size + 4..).unwrap_or_default();
    }
    data
}

/// The encoder's error as ours.
pub(super) fn failed(e: ::png::EncodingError) -> Error {
    let source = match e {
        ::png::EncodingError::IoError(e) => e,
        other => std::io::Error::other(other.to_string()),
    };
    failed_io(source)
}

fn failed_io(source: std::io::Error) -> Error {
    Error::Encode { format: "PNG", source }
}
