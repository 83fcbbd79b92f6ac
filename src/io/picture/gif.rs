//! GIF films, a frame at a time.

use super::Error;
use super::delta::{Rect, bounds, bounds_where};
use super::dither::Indexed;
use super::film::{Film, FilmReport};
use super::palette::Palette;
use std::borrow::Cow;
use std::io::Write;

/// Writes a GIF; memory holds two frames, whatever the length of the film.
///
/// A frame stores the rectangle that changed, with unchanged pixels transparent; decoded, the pictures are the same.
/// Browsers slow frames under 2 cs down to 10: above 50 frames a second those that would be so short are left out.
pub(super) struct GifWriter<W: Write> {
    encoder: ::gif::Encoder<W>,
    film: Film,
    /// The palette's index of a hole.
    hole: u8,
    /// What is shown before the waiting frame.
    canvas: Vec<u8>,
    /// A frame waits for the next one, which says how long it stays and what it must clear away.
    waiting: Option<Waiting>,
    came: u32,
    report: FilmReport,
}

struct Waiting {
    indices: Vec<u8>,
    start: u64,
}

/// Longest side, and longest delay in centiseconds.
const LIMIT: u64 = u16::MAX as u64;

impl<W: Write> GifWriter<W> {
    pub fn new(out: W, film: Film, palette: &Palette) -> Result<Self, Error> {
        film.check("GIF", LIMIT as usize)?;
        let [width, height] = film.size;
        if film.rate.centiseconds(1) > LIMIT {
            let rate = film.rate;
            return Err(Error::TooSlow { rate, format: "GIF", longest: "655.35 s", least: "0.0016" });
        }
        // One more entry than colours: the transparent index.
        let table = [palette.colors().as_flattened(), &[0; 3]].concat();
        let mut encoder = ::gif::Encoder::new(out, width as u16, height as u16, &table).map_err(failed)?;
        match film.plays {
            0 => encoder.set_repeat(::gif::Repeat::Infinite).map_err(failed)?,
            // Without the extension a GIF is shown once; with it, once more than it says.
            1 => {}
            n => encoder.set_repeat(::gif::Repeat::Finite(n - 1)).map_err(failed)?,
        }
        let canvas = vec![palette.transparent(); width * height];
        let (hole, waiting) = (palette.transparent(), None);
        Ok(Self { encoder, film, hole, canvas, waiting, came: 0, report: FilmReport::default() })
    }

    /// Add a frame that a [`Mapper`](super::Mapper) of the same palette and film has mapped.
    pub fn write(&mut self, frame: Indexed) -> Result<(), Error> {
        if !self.is_kept(self.came) {
            self.came += 1;
            self.report.dropped += 1;
            return Ok(());
        }
        let start = self.film.rate.centiseconds(self.came);
        self.emit(Some(&frame.indices), start)?;
        self.waiting = Some(Waiting { indices: frame.indices, start });
        self.came += 1;
        Ok(())
    }

    /// Write what waits and the tail.
    pub fn finish(mut self) -> Result<FilmReport, Error> {
        self.emit(None, self.film.rate.centiseconds(self.film.frames))?;
        let mut out = self.encoder.into_inner().map_err(failed)?;
        out.flush().map_err(|source| Error::Encode { format: "GIF", source })?;
        Ok(self.report)
    }

    /// Whether a frame and the one before it are both shown for at least 2 cs.
    fn is_kept(&self, k: u32) -> bool {
        let rate = self.film.rate;
        let start = rate.centiseconds(k);
        let Some(before) = &self.waiting else { return true };
        start - before.start >= 2 && rate.centiseconds(self.film.frames) - start >= 2
    }

    /// Write the waiting frame, which stays until `end`.
    fn emit(&mut self, next: Option<&[u8]>, end: u64) -> Result<(), Error> {
        let Some(Waiting { indices, start }) = self.waiting.take() else { return Ok(()) };
        let (hole, width) = (self.hole, self.film.size[0]);
        let changed = bounds(self.canvas.as_chunks::<1>().0, indices.as_chunks::<1>().0, width);
        // Pixels that become holes cannot be drawn: this frame's rectangle covers them and is cleared after it.
        let cleared = next.and_then(|n| bounds_where(&indices, n, width, |a, b| *a != hole && *b == hole));
        let rect = match (self.report.frames, changed, cleared) {
            (0, ..) => Rect::full(self.film.size),
            (_, Some(a), Some(b)) => a.union(b),
            (_, a, b) => a.or(b).unwrap_or(Rect::corner()),
        };
        let buffer = self.cut(&indices, rect, hole);
        let frame = ::gif::Frame {
            delay: (end - start).min(LIMIT) as u16,
            dispose: if cleared.is_some() {
                ::gif::DisposalMethod::Background
            } else {
                ::gif::DisposalMethod::Keep
            },
            transparent: Some(hole),
            left: rect.left as u16,
            top: rect.top as u16,
            width: rect.width() as u16,
            height: rect.height() as u16,
            buffer: Cow::Owned(buffer),
            ..::gif::Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(failed)?;
        self.report.frames += 1;
        self.canvas = indices;
        if cleared.is_some() {
            rect.rows(width).for_each(|r| self.canvas[r].fill(hole));
        }
        Ok(())
    }

    /// The pixels of a rectangle, holes where they are shown already.
    fn cut(&self, indices: &[u8], rect: Rect, hole: u8) -> Vec<u8> {
        let mut buffer = Vec::with_capacity(rect.width() * rect.height());
        for row in rect.rows(self.film.size[0]) {
            let pixels = indices[row.clone()].iter().zip(&self.canvas[row]);
            buffer.extend(pixels.map(|(new, old)| if new == old { hole } else { *new }));
        }
        buffer
    }
}

fn failed(e: ::gif::EncodingError) -> Error {
    let source = match e {
        ::gif::EncodingError::Io(e) => e,
        other => std::io::Error::other(other.to_string()),
    };
    Error::Encode { format: "GIF", source }
}
