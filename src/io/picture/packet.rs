//! Films of any format: frames are encoded on any thread and written in order.

use super::apng::ApngWriter;
use super::delta::{Rect, bounds};
use super::dither::{Dither, Indexed, Mapper};
use super::film::{Film, FilmReport};
use super::format::Format;
use super::gif::GifWriter;
use super::palette::Palette;
use super::png::PngLevel;
use super::webp::WebpWriter;
use super::y4m::Y4mWriter;
use super::{Error, apng, webp, y4m};
use crate::image::Rgba8;
use std::io::{Seek, Write};

/// How the frames of a film become bytes.
#[derive(Clone, Debug, PartialEq)]
pub enum Coding {
    /// Mapped to one palette.
    Gif(Palette, Dither),
    /// Deflated.
    Apng(PngLevel),
    /// Lossless WebP.
    Webp,
    /// Not compressed: Y′CbCr 4:4:4 by BT.709 in the limited range, alpha laid over the matte.
    Y4m,
}

impl Coding {
    /// The format of the file.
    pub fn format(&self) -> Format {
        match self {
            Self::Gif(..) => Format::Gif,
            Self::Apng(_) => Format::Apng,
            Self::Webp => Format::Webp,
            Self::Y4m => Format::Y4m,
        }
    }
}

/// Encodes frames of one film; one a thread, for its buffers.
///
/// The same two frames give the same bytes, whatever was encoded before.
pub struct FrameEncoder<'a> {
    film: Film,
    coding: &'a Coding,
    mapper: Option<Mapper>,
}

/// A frame, ready to be written at its place in the film.
#[derive(Clone, Debug)]
pub struct EncodedFrame(Packet);

impl EncodedFrame {
    /// Bytes that it takes in memory.
    pub fn bytes(&self) -> usize {
        match &self.0 {
            Packet::Indexed(frame) => frame.indices.len(),
            Packet::Coded { bytes, .. } | Packet::Plain(bytes) => bytes.len(),
        }
    }
}

/// What is in an encoded frame.
#[derive(Clone, Debug)]
pub(super) enum Packet {
    /// Mapped to the palette of a GIF.
    Indexed(Indexed),
    /// Bytes of the rectangle that changed.
    Coded { rect: Rect, bytes: Vec<u8> },
    /// Bytes of the whole frame.
    Plain(Vec<u8>),
}

impl<'a> FrameEncoder<'a> {
    /// An encoder of a film's frames.
    pub fn new(film: Film, coding: &'a Coding) -> Self {
        let mapper = match coding {
            Coding::Gif(palette, _) => Some(Mapper::new(palette, &film)),
            _ => None,
        };
        Self { film, coding, mapper }
    }

    /// Encode a frame that follows `before`; none does for the first.
    ///
    /// # Errors
    /// [`Error::Size`] where a frame is none, [`Error::FrameSize`] where it has not the film's size, [`Error::Encode`].
    pub fn encode(&mut self, before: Option<&Rgba8>, now: &Rgba8) -> Result<EncodedFrame, Error> {
        for frame in before.into_iter().chain([now]) {
            self.film.check_frame(frame, self.coding.format().name())?;
        }
        let packet = match (self.coding, &mut self.mapper) {
            (Coding::Gif(_, dither), Some(mapper)) => Packet::Indexed(mapper.map(now, *dither)),
            (Coding::Apng(level), _) => apng::packet(&self.film, now, self.changed(before, now), *level)?,
            (Coding::Webp, _) => webp::packet(&self.film, now, self.changed(before, now))?,
            (Coding::Y4m | Coding::Gif(..), _) => y4m::packet(&self.film, now)?,
        };
        Ok(EncodedFrame(packet))
    }

    /// What changed; one pixel where nothing did, since a frame must have some.
    fn changed(&self, before: Option<&Rgba8>, now: &Rgba8) -> Rect {
        let Some(before) = before else { return Rect::full(self.film.size) };
        let (before, now) = (before.data.as_chunks::<4>().0, now.data.as_chunks::<4>().0);
        bounds(before, now, self.film.size[0]).unwrap_or(Rect::corner())
    }
}

/// Writes a film; memory holds a frame or two, whatever its length.
///
/// APNG and WebP store of each frame the rectangle that changed, without loss. The frames of a GIF below 2 centiseconds are
/// left out and counted in [`FilmReport::dropped`]. Frame `k` (from 0) starts where `k/fps` is rounded to the format's unit
/// (centiseconds in GIF, milliseconds in WebP, exact in the others), so the whole is as long as it should be.
///
/// ```
/// use sinew::image::Rgba8;
/// use sinew::io::picture::{Coding, Film, FilmWriter, FrameEncoder};
/// use sinew::time::Rate;
/// let film = Film::new([2, 1], 2, Rate::default());
/// let coding = Coding::Webp;
/// let mut file = std::io::Cursor::new(Vec::new());
/// let mut writer = FilmWriter::new(&mut file, film, &coding).unwrap();
/// let mut encoder = FrameEncoder::new(film, &coding);
/// let red = Rgba8 { width: 2, height: 1, data: [255, 0, 0, 255].repeat(2) };
/// let half = Rgba8 { width: 2, height: 1, data: vec![255, 0, 0, 255, 0, 0, 255, 255] };
/// writer.write(encoder.encode(None, &red).unwrap()).unwrap();
/// writer.write(encoder.encode(Some(&red), &half).unwrap()).unwrap();
/// assert_eq!(writer.finish().unwrap().frames, 2);
/// assert_eq!(&file.into_inner()[8..16], b"WEBPVP8X");
/// ```
pub struct FilmWriter<W: Write + Seek> {
    film: Film,
    came: u32,
    kind: Kind<W>,
}

enum Kind<W: Write + Seek> {
    Gif(Box<GifWriter<W>>),
    Apng(ApngWriter<W>),
    Webp(WebpWriter<W>),
    Y4m(Y4mWriter<W>),
}

impl<W: Write + Seek> FilmWriter<W> {
    /// Write the head of a film. Only WebP seeks, in [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`Error::Size`] for sides that the format cannot say, [`Error::FrameCount`] for a film without frames,
    /// [`Error::TooSlow`], [`Error::TooFast`], [`Error::Encode`].
    pub fn new(out: W, film: Film, coding: &Coding) -> Result<Self, Error> {
        if film.frames == 0 {
            return Err(Error::FrameCount { expected: 1, found: 0 });
        }
        let kind = match coding {
            Coding::Gif(palette, _) => Kind::Gif(Box::new(GifWriter::new(out, film, palette)?)),
            Coding::Apng(_) => Kind::Apng(ApngWriter::new(out, film)?),
            Coding::Webp => Kind::Webp(WebpWriter::new(out, film)?),
            Coding::Y4m => Kind::Y4m(Y4mWriter::new(out, film)?),
        };
        Ok(Self { film, came: 0, kind })
    }

    /// Add the next frame.
    ///
    /// # Errors
    /// [`Error::FrameCount`] where more come than were announced, [`Error::Encode`].
    ///
    /// # Panics
    /// If the frame was encoded for another format.
    pub fn write(&mut self, frame: EncodedFrame) -> Result<(), Error> {
        if self.came >= self.film.frames {
            return Err(Error::FrameCount { expected: self.film.frames, found: self.came + 1 });
        }
        match (&mut self.kind, frame.0) {
            (Kind::Gif(w), Packet::Indexed(frame)) => w.write(frame)?,
            (Kind::Apng(w), Packet::Coded { rect, bytes }) => w.write(rect, &bytes)?,
            (Kind::Webp(w), Packet::Coded { rect, bytes }) => w.write(rect, &bytes)?,
            (Kind::Y4m(w), Packet::Plain(bytes)) => w.write(&bytes)?,
            _ => panic!("a frame that was encoded for another format"),
        }
        self.came += 1;
        Ok(())
    }

    /// Write the tail and flush.
    ///
    /// # Errors
    /// [`Error::FrameCount`] where frames are missing, [`Error::Encode`].
    pub fn finish(self) -> Result<FilmReport, Error> {
        if self.came != self.film.frames {
            return Err(Error::FrameCount { expected: self.film.frames, found: self.came });
        }
        match self.kind {
            Kind::Gif(w) => w.finish(),
            Kind::Apng(w) => w.finish(),
            Kind::Webp(w) => w.finish(),
            Kind::Y4m(w) => w.finish(),
        }
    }
}
