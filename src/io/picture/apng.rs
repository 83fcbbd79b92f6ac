//! APNG films: a PNG's chunks, and for each frame one that says where and how long it is shown.
//!
//! W3C, *Portable Network Graphics (Third Edition)*, section 11.3.6.

use super::Error;
use super::delta::Rect;
use super::film::{Film, FilmReport};
use super::packet::Packet;
use super::png::{self, PngLevel};
use super::rows::Rows;
use crate::image::Rgba8;
use std::io::Write;

/// Longest side.
pub(super) const SIDE: usize = i32::MAX as usize;

/// What a film's file holds for a frame: the rectangle that changed, RGBA where the film is transparent, else RGB.
pub(super) fn packet(film: &Film, now: &Rgba8, rect: Rect, level: PngLevel) -> Result<Packet, Error> {
    let rows = Rows::of(now, rect);
    let bytes = match film.transparent {
        true => png::compress_rgba(rows, level)?,
        false => match png::compress_rgb(rows, level)? {
            Some(bytes) => bytes,
            None => png::compress_rgb(Rows::of(&film.flattened(now), rect), level)?.unwrap_or_default(),
        },
    };
    Ok(Packet::Coded { rect, bytes })
}

/// Writes an APNG; delays are the exact fraction of the film's rate.
pub(super) struct ApngWriter<W: Write> {
    out: W,
    film: Film,
    came: u32,
    /// Number of the next chunk of the animation.
    sequence: u32,
}

impl<W: Write> ApngWriter<W> {
    pub fn new(mut out: W, film: Film) -> Result<Self, Error> {
        film.check("APNG", SIDE)?;
        png::write_head(&mut out, film.size, !film.transparent).map_err(failed)?;
        let control = [film.frames.to_be_bytes(), u32::from(film.plays).to_be_bytes()].concat();
        png::write_chunk(&mut out, b"acTL", &[&control]).map_err(failed)?;
        Ok(Self { out, film, came: 0, sequence: 0 })
    }

    /// Add a frame.
    pub fn write(&mut self, rect: Rect, compressed: &[u8]) -> Result<(), Error> {
        let place =
            [self.number(), rect.width() as u32, rect.height() as u32, rect.left as u32, rect.top as u32];
        let place = place.map(u32::to_be_bytes).concat();
        let rate = self.film.rate;
        let delay = [rate.seconds().to_be_bytes(), rate.frames().to_be_bytes()].concat();
        // Pixels replace what was there, and stay.
        png::write_chunk(&mut self.out, b"fcTL", &[&place, &delay, &[0, 0]]).map_err(failed)?;
        let written = match self.came {
            0 => png::write_chunk(&mut self.out, b"IDAT", &[compressed]),
            _ => {
                let number = self.number().to_be_bytes();
                png::write_chunk(&mut self.out, b"fdAT", &[&number, compressed])
            }
        };
        self.came += 1;
        written.map_err(failed)
    }

    pub fn finish(mut self) -> Result<FilmReport, Error> {
        let done = png::write_chunk(&mut self.out, b"IEND", &[]).and_then(|()| self.out.flush());
        done.map_err(failed)?;
        Ok(FilmReport { frames: self.came, dropped: 0 })
    }

    fn number(&mut self) -> u32 {
        self.sequence += 1;
        self.sequence - 1
    }
}

fn failed(source: std::io::Error) -> Error {
    Error::Encode { format: "APNG", source }
}
