//! APNG films, a frame at a time.

use super::delta::{Rect, bounds};
use super::film::{Film, FilmReport};
use super::png::{PngLevel, encoder, failed};
use super::{Error, check_size};
use crate::image::Rgba8;
use std::io::Write;

/// Writes an APNG; memory holds one frame, whatever the length of the film.
///
/// Lend it the stream (`&mut file`): an [`AtomicFile`](super::AtomicFile) is committed after [`finish`](Self::finish).
/// A frame stores the rectangle that changed, without loss. Delays are the exact fraction of the film's rate.
pub struct ApngWriter<W: Write> {
    writer: ::png::Writer<W>,
    film: Film,
    /// The frame before, with as many bytes a pixel as the file has.
    before: Vec<u8>,
    came: u32,
}

impl<W: Write> ApngWriter<W> {
    /// Write the head of a film: RGBA where it is transparent, else RGB over the matte.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::FrameCount`] for a film without frames, [`Error::Encode`].
    pub fn new(out: W, film: Film, level: PngLevel) -> Result<Self, Error> {
        let [width, height] = film.size;
        let limit = i32::MAX as usize;
        if !film.size.iter().all(|s| (1..=limit).contains(s)) {
            return Err(Error::Size { width, height, bytes: 0, format: "APNG", limit });
        }
        if film.frames == 0 {
            return Err(Error::FrameCount { expected: 1, found: 0 });
        }
        let fail = |e| failed("APNG", e);
        let mut encoder = encoder(out, film.size, !film.transparent);
        level.apply(&mut encoder);
        encoder.set_animated(film.frames, u32::from(film.plays)).map_err(fail)?;
        encoder.set_frame_delay(film.rate.seconds(), film.rate.frames()).map_err(fail)?;
        let writer = encoder.write_header().map_err(fail)?;
        Ok(Self { writer, film, before: Vec::new(), came: 0 })
    }

    /// Add a frame.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::FrameSize`], [`Error::FrameCount`], [`Error::Encode`].
    pub fn write(&mut self, frame: &Rgba8) -> Result<(), Error> {
        check_size(frame, "APNG", i32::MAX as usize)?;
        let Film { size, frames, .. } = self.film;
        let found = [frame.width, frame.height];
        if self.came >= frames {
            return Err(Error::FrameCount { expected: frames, found: self.came + 1 });
        }
        if found != size {
            return Err(Error::FrameSize { frame: self.came + 1, expected: size, found });
        }
        let now = self.pixels(frame);
        let rect = if self.came == 0 { Rect::full(size) } else { self.changed(&now) };
        self.emit(&now, rect).map_err(|e| failed("APNG", e))?;
        (self.before, self.came) = (now, self.came + 1);
        Ok(())
    }

    /// Write the tail.
    ///
    /// # Errors
    /// [`Error::FrameCount`] where frames are missing, [`Error::Encode`].
    pub fn finish(self) -> Result<FilmReport, Error> {
        if self.came != self.film.frames {
            return Err(Error::FrameCount { expected: self.film.frames, found: self.came });
        }
        self.writer.finish().map_err(|e| failed("APNG", e))?;
        Ok(FilmReport { frames: self.came, dropped: 0 })
    }

    /// The bytes that the file holds for a frame.
    fn pixels(&self, frame: &Rgba8) -> Vec<u8> {
        if self.film.transparent {
            return frame.data.clone();
        }
        let mut rgb = vec![0; frame.width * frame.height * 3];
        for (to, from) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(frame.data.as_chunks::<4>().0) {
            *to = self.film.over_matte(*from);
        }
        rgb
    }

    fn changed(&self, now: &[u8]) -> Rect {
        let width = self.film.size[0];
        let found = match self.film.transparent {
            true => bounds(self.before.as_chunks::<4>().0, now.as_chunks::<4>().0, width, |a, b| a != b),
            false => bounds(self.before.as_chunks::<3>().0, now.as_chunks::<3>().0, width, |a, b| a != b),
        };
        found.unwrap_or(Rect::corner())
    }

    fn emit(&mut self, now: &[u8], rect: Rect) -> Result<(), ::png::EncodingError> {
        if rect == Rect::full(self.film.size) {
            self.writer.reset_frame_position()?;
            self.writer.reset_frame_dimension()?;
            return self.writer.write_image_data(now);
        }
        let bytes = if self.film.transparent { 4 } else { 3 };
        let rows = rect.rows(self.film.size[0]);
        let cut: Vec<u8> = rows.flat_map(|r| &now[r.start * bytes..r.end * bytes]).copied().collect();
        // The position returns to the corner first, where every size fits.
        self.writer.reset_frame_position()?;
        self.writer.set_frame_dimension(rect.width() as u32, rect.height() as u32)?;
        self.writer.set_frame_position(rect.left as u32, rect.top as u32)?;
        self.writer.write_image_data(&cut)
    }
}
