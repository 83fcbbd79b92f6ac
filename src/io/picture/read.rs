//! Picture files back to pixels: stills and films, a frame at a time.

use super::exr_read::Exr;
use super::gif_frames::GifFrames;
use crate::image::{Image, Rgba8};
use image::codecs::{png::PngDecoder, webp::WebPDecoder};
use image::{AnimationDecoder, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Longest side that is decoded, pixels.
const SIDE: usize = 1 << 14;
/// Most pixels of a frame: 8192². Decoders hold a few copies of it.
const FRAME: usize = 1 << 26;
/// Most pixels of a film: 8000 frames of 1920 × 1080. A few bytes can announce any number of frames.
const FILM: u64 = 1 << 34;
/// Bytes that a decoder may ask for besides.
const MEMORY: u64 = 1 << 30;

/// Why a picture was not read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The bytes are of no format that is read.
    #[error("expected a PNG, APNG, GIF, WebP, JPEG or OpenEXR picture, found {found}")]
    Unknown {
        /// The first bytes, or that there are none.
        found: String,
    },
    /// More than is decoded.
    #[error(
        "{width} × {height} pixels are too many: expected sides of 1 to {SIDE}, up to {FRAME} pixels a frame and {FILM} a film"
    )]
    Size {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The decoder refused.
    #[error("frame {frame} of the {format} file cannot be decoded: {message}")]
    Decode {
        /// Position in the file, from 1.
        frame: usize,
        /// PNG, GIF …
        format: &'static str,
        /// What it says.
        message: String,
    },
}

/// The pixels of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8 bits a channel; files of 16 are rounded.
    Codes(Rgba8),
    /// Floating-point light, premultiplied.
    Light(Image),
}

impl Pixels {
    /// As 8-bit sRGB.
    pub fn into_codes(self) -> Rgba8 {
        match self {
            Self::Codes(codes) => codes,
            Self::Light(light) => light.to_rgba8(),
        }
    }
}

/// A frame as it is seen: whole, whatever rectangle the file stores.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// What it shows.
    pub pixels: Pixels,
    /// How long, milliseconds as a fraction; 0/1 for stills.
    pub delay_ms: (u32, u32),
}

/// The frames of a file, decoded when they are asked for, so that memory holds one frame and the file.
///
/// ```
/// use sinew::image::Rgba8;
/// use sinew::io::picture::{Pixels, PngLevel, encode_png, frames_of};
/// let picture = Rgba8 { width: 1, height: 2, data: vec![255, 0, 0, 255, 0, 0, 255, 51] };
/// let bytes = encode_png(&picture, PngLevel::Fast).unwrap();
/// let frames: Vec<_> = frames_of(&bytes).unwrap().collect::<Result<_, _>>().unwrap();
/// assert_eq!(frames[0].pixels, Pixels::Codes(picture));
/// assert!(frames_of(b"BM").is_err());
/// ```
pub struct Frames<'a> {
    format: &'static str,
    source: Box<dyn Iterator<Item = Result<Frame, String>> + 'a>,
    came: usize,
    /// Pixels that may still come.
    left: u64,
    ended: bool,
}

impl Frames<'_> {
    /// PNG, APNG, GIF, WebP, JPEG or OpenEXR.
    pub fn format(&self) -> &'static str {
        self.format
    }
}

/// Read the head of a picture file and be ready for its frames.
///
/// What is seen is decoded: blending and disposal of films are applied, colour profiles are not. Frames may come to 2³⁴ pixels together.
///
/// # Errors
/// [`ReadError`]; the iterator gives one too where a frame is broken, and ends.
pub fn frames_of(bytes: &[u8]) -> Result<Frames<'_>, ReadError> {
    let guessed = image::guess_format(bytes).map_err(|_| unknown(bytes))?;
    let format = name(guessed).ok_or_else(|| unknown(bytes))?;
    let fail = |message: String| ReadError::Decode { frame: 1, format, message };
    let (format, source) = match guessed {
        ImageFormat::Gif => (format, boxed(gif(bytes)?)),
        ImageFormat::OpenExr => {
            let exr = Exr::new(bytes).map_err(fail)?;
            check(exr.size)?;
            let frame = move || exr.image().map(|i| Frame { pixels: Pixels::Light(i), delay_ms: (0, 1) });
            (format, boxed(std::iter::once_with(frame)))
        }
        ImageFormat::Png => {
            let decoder =
                PngDecoder::with_limits(Cursor::new(bytes), limits()).map_err(|e| fail(e.to_string()))?;
            check(sides(decoder.dimensions()))?;
            match decoder.is_apng().map_err(|e| fail(e.to_string()))? {
                true => ("APNG", boxed(film(decoder.apng().map_err(|e| fail(e.to_string()))?))),
                false => (format, boxed(still(decoder))),
            }
        }
        ImageFormat::WebP => {
            let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(|e| fail(e.to_string()))?;
            check(sides(decoder.dimensions()))?;
            decoder.set_limits(limits()).map_err(|e| fail(e.to_string()))?;
            match decoder.has_animation() {
                true => (format, boxed(film(decoder))),
                false => (format, boxed(still(decoder))),
            }
        }
        _ => {
            let mut reader = ImageReader::with_format(Cursor::new(bytes), guessed);
            reader.limits(limits());
            let decoder = reader.into_decoder().map_err(|e| fail(e.to_string()))?;
            check(sides(decoder.dimensions()))?;
            (format, boxed(still(decoder)))
        }
    };
    Ok(Frames { format, source, came: 0, left: FILM, ended: false })
}

type Source<'a> = Box<dyn Iterator<Item = Result<Frame, String>> + 'a>;

fn boxed<'a>(source: impl Iterator<Item = Result<Frame, String>> + 'a) -> Source<'a> {
    Box::new(source)
}

fn name(format: ImageFormat) -> Option<&'static str> {
    match format {
        ImageFormat::Png => Some("PNG"),
        ImageFormat::Gif => Some("GIF"),
        ImageFormat::WebP => Some("WebP"),
        ImageFormat::Jpeg => Some("JPEG"),
        ImageFormat::OpenExr => Some("OpenEXR"),
        _ => None,
    }
}

fn unknown(bytes: &[u8]) -> ReadError {
    let head: Vec<String> = bytes.iter().take(8).map(|b| format!("{b:02x}")).collect();
    let found = if head.is_empty() { "an empty file".into() } else { format!("bytes {}", head.join(" ")) };
    ReadError::Unknown { found }
}

fn sides((width, height): (u32, u32)) -> [usize; 2] {
    [width as usize, height as usize]
}

fn check([width, height]: [usize; 2]) -> Result<(), ReadError> {
    let fits = |n: usize| (1..=SIDE).contains(&n);
    let fine = fits(width) && fits(height) && width * height <= FRAME;
    if fine { Ok(()) } else { Err(ReadError::Size { width, height }) }
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    // Sides are checked here, with a message that says them.
    (limits.max_image_width, limits.max_image_height) = (None, None);
    limits.max_alloc = Some(MEMORY);
    limits
}

fn gif(bytes: &[u8]) -> Result<GifFrames<'_>, ReadError> {
    let frames = GifFrames::new(bytes, MEMORY);
    let frames = frames.map_err(|message| ReadError::Decode { frame: 1, format: "GIF", message })?;
    check(frames.size())?;
    Ok(frames)
}

/// The one frame of a still, decoded when it is asked for.
fn still<'a>(decoder: impl ImageDecoder + 'a) -> impl Iterator<Item = Result<Frame, String>> + 'a {
    let mut decoder = Some(decoder);
    std::iter::from_fn(move || {
        let image = DynamicImage::from_decoder(decoder.take()?).map_err(|e| e.to_string());
        Some(image.map(|image| Frame { pixels: pixels(image), delay_ms: (0, 1) }))
    })
}

fn film<'a>(decoder: impl AnimationDecoder<'a>) -> impl Iterator<Item = Result<Frame, String>> + 'a {
    decoder.into_frames().map(|frame| {
        let frame = frame.map_err(|e| e.to_string())?;
        let delay_ms = frame.delay().numer_denom_ms();
        Ok(Frame { pixels: pixels(frame.into_buffer().into()), delay_ms })
    })
}

fn pixels(image: DynamicImage) -> Pixels {
    let (width, height) = (image.width() as usize, image.height() as usize);
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let pixels = image.into_rgba32f().pixels().map(|p| p.0).collect();
            Pixels::Light(Image { width, height, pixels })
        }
        codes => Pixels::Codes(Rgba8 { width, height, data: codes.into_rgba8().into_raw() }),
    }
}

impl Iterator for Frames<'_> {
    type Item = Result<Frame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        let frame = if self.ended { None } else { self.source.next() };
        self.ended = frame.is_none();
        let frame = frame?;
        self.came += 1;
        let refuse = |message| ReadError::Decode { frame: self.came, format: self.format, message };
        let checked = frame.map_err(refuse).and_then(|frame| {
            let (width, height) = match &frame.pixels {
                Pixels::Codes(p) => (p.width, p.height),
                Pixels::Light(p) => (p.width, p.height),
            };
            let left = self.left.checked_sub((width * height) as u64);
            self.left = left.ok_or(ReadError::Size { width, height })?;
            Ok(frame)
        });
        self.ended = checked.is_err();
        Some(checked)
    }
}
