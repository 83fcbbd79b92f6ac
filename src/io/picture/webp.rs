//! WebP without loss: stills, and films a frame at a time.
//!
//! RFC 9649. The pixels are coded by the `image` crate; a film wraps each coded rectangle in a chunk that says where and how
//! long it is shown.

use super::delta::Rect;
use super::film::{Film, FilmReport};
use super::packet::Packet;
use super::rows::Rows;
use super::{Error, check_size};
use crate::image::Rgba8;
use image::ExtendedColorType;
use std::io::{Seek, SeekFrom, Write};

/// Longest side that lossless WebP can say.
const SIDE: usize = 16384;
/// Bytes before the chunks of a file: `RIFF`, its size, `WEBP`.
const HEAD: usize = 12;
/// Longest time that a frame can be shown, milliseconds.
const LONGEST: u64 = (1 << 24) - 1;

/// Bytes of a WebP file: 8-bit sRGB without loss, without alpha where the picture is opaque.
///
/// The same picture gives the same bytes. Pure: it may run on any thread.
///
/// ```
/// use sinew::image::Rgba8;
/// use sinew::io::picture::encode_webp;
/// let picture = Rgba8 { width: 1, height: 1, data: vec![255, 0, 0, 255] };
/// assert_eq!(&encode_webp(&picture).unwrap()[8..16], b"WEBPVP8L");
/// ```
///
/// # Errors
/// [`Error::Size`] where a side is zero or above 16384, or the buffer does not hold `4 · width · height` bytes.
pub fn encode_webp(picture: &Rgba8) -> Result<Vec<u8>, Error> {
    check_size(picture, "WebP", SIDE)?;
    let rows = Rows::of(picture, Rect::full([picture.width, picture.height]));
    encode(rows, rows.is_opaque())
}

fn encode(rows: Rows, opaque: bool) -> Result<Vec<u8>, Error> {
    let [width, height] = rows.size();
    let (pixels, color) = match opaque {
        true => (rows.rgb(), ExtendedColorType::Rgb8),
        false => (rows.rgba(), ExtendedColorType::Rgba8),
    };
    let mut bytes = Vec::with_capacity(pixels.len() / 8 + 1024);
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
    let coded = encoder.encode(&pixels, width as u32, height as u32, color);
    coded.map_err(|e| Error::Encode { format: "WebP", source: std::io::Error::other(e.to_string()) })?;
    Ok(bytes)
}

/// What a film's file holds for a frame: the changed rectangle, from even pixels on, as a chunk of its own.
pub(super) fn packet(film: &Film, now: &Rgba8, changed: Rect) -> Result<Packet, Error> {
    let rect = changed.even();
    let rows = Rows::of(now, rect);
    let mut bytes = match (film.transparent, rows.is_opaque()) {
        (false, false) => encode(Rows::of(&film.flattened(now), rect), true)?,
        (_, opaque) => encode(rows, opaque)?,
    };
    bytes.drain(..HEAD);
    Ok(Packet::Coded { rect, bytes })
}

/// Writes an animated WebP; memory holds one frame, whatever the length of the film.
///
/// A frame stores the rectangle that changed, without loss. Frame `k` (from 0) starts at `round(1000·k/fps)` milliseconds, so
/// the whole is as long as it should be.
pub(super) struct WebpWriter<W: Write + Seek> {
    out: W,
    film: Film,
    /// Bytes after the first eight: what the file's head says at the end.
    length: u64,
    start: u64,
    came: u32,
}

impl<W: Write + Seek> WebpWriter<W> {
    pub fn new(mut out: W, film: Film) -> Result<Self, Error> {
        film.check("WebP", SIDE)?;
        let rate = film.rate;
        if rate.milliseconds(1) > LONGEST {
            return Err(Error::TooSlow { rate, format: "WebP", longest: "16777 s", least: "0.00006" });
        }
        // A frame of no length is shown by nobody.
        if rate.fps() > 1000.0 {
            return Err(Error::TooFast { rate, format: "WebP", most: 1000 });
        }
        let start = out.stream_position().map_err(failed)?;
        let mut writer = Self { out, film, length: 4, start, came: 0 };
        let size = [film.size[0] - 1, film.size[1] - 1].map(|s| s as u32);
        let flags = if film.transparent { 0x12 } else { 0x02 };
        writer.out.write_all(b"RIFF\0\0\0\0WEBP").map_err(failed)?;
        writer.chunk(b"VP8X", &[&[flags, 0, 0, 0], &u24(size[0]), &u24(size[1])])?;
        writer.chunk(b"ANIM", &[&[0; 4], &film.plays.to_le_bytes()])?;
        Ok(writer)
    }

    /// Add a frame.
    pub fn write(&mut self, rect: Rect, coded: &[u8]) -> Result<(), Error> {
        let stays = self.film.rate.milliseconds(self.came + 1) - self.film.rate.milliseconds(self.came);
        let numbers = [rect.left / 2, rect.top / 2, rect.width() - 1, rect.height() - 1];
        let numbers = numbers.map(|n| u24(n as u32)).concat();
        // Pixels replace what was there, alpha and all, and stay.
        self.chunk(b"ANMF", &[&numbers, &u24(stays as u32), &[2], coded])?;
        self.came += 1;
        Ok(())
    }

    /// Say in the head how long the file is.
    pub fn finish(mut self) -> Result<FilmReport, Error> {
        let length = (self.length as u32).to_le_bytes();
        let head = self.out.seek(SeekFrom::Start(self.start + 4)).and_then(|_| self.out.write_all(&length));
        head.and_then(|()| self.out.seek(SeekFrom::End(0))).and_then(|_| self.out.flush()).map_err(failed)?;
        Ok(FilmReport { frames: self.came, dropped: 0 })
    }

    /// Write a chunk: its name, its size, its parts, padded to an even size.
    fn chunk(&mut self, name: &[u8; 4], parts: &[&[u8]]) -> Result<(), Error> {
        let size: u64 = parts.iter().map(|p| p.len() as u64).sum();
        self.length += 8 + size + size % 2;
        if self.length > u64::from(u32::MAX) - 16 {
            return Err(failed(std::io::Error::other("a WebP file holds at most 4 GiB; write fewer frames")));
        }
        let mut write = |bytes: &[u8]| self.out.write_all(bytes).map_err(failed);
        write(name)?;
        write(&(size as u32).to_le_bytes())?;
        parts.iter().try_for_each(|p| write(p))?;
        write(&[0][..(size % 2) as usize])
    }
}

fn u24(n: u32) -> [u8; 3] {
    let [a, b, c, _] = n.to_le_bytes();
    [a, b, c]
}

fn failed(source: std::io::Error) -> Error {
    Error::Encode { format: "WebP", source }
}
