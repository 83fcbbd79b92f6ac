//! Pictures to files: PNG, WebP and OpenEXR, numbered sequences of them, and films as WebP, APNG, GIF and Y4M.
//!
//! Encoding is pure (frame → bytes, on any thread: [`encode_png`], [`encode_webp`], [`encode_exr`], [`FrameEncoder`]);
//! writing is separate ([`FilmWriter`]) and goes through an [`Output`], so a half-written picture never carries the name
//! that was asked for.
//!
//! ```
//! use sinew::image::Rgba8;
//! use sinew::io::picture::{PngLevel, Target, encode_png};
//! let target = Target::parse("walk/out.####.png").unwrap();
//! assert_eq!(target.path_of(7), Some("walk/out.0007.png".into()));
//! let picture = Rgba8 { width: 2, height: 1, data: vec![255, 0, 0, 255, 0, 0, 255, 255] };
//! assert_eq!(&encode_png(&picture, PngLevel::Fast).unwrap()[1..4], b"PNG");
//! ```

mod apng;
mod atomic;
mod delta;
mod dither;
mod exr;
mod exr_read;
mod film;
mod format;
mod gif;
mod gif_frames;
mod indexed;
mod judge;
mod nearest;
mod output;
mod packet;
mod palette;
mod palette_file;
mod pixel_art;
mod png;
mod read;
mod rows;
mod target;
mod template;
mod unnamed;
mod webp;
mod y4m;

pub use atomic::{AtomicFile, Folder, cleanup_temporaries};
pub use dither::{Dither, Indexed, Mapper};
pub use exr::{ExrDepth, encode_exr, encode_exr_layers};
pub use film::{Film, FilmReport};
pub use format::{Format, FormatError};
pub use indexed::{Data, encode_data_png, encode_indexed_png};
pub use judge::{DitherScore, choose_dither};
pub use output::Output;
pub use packet::{Coding, EncodedFrame, FilmWriter, FrameEncoder};
pub use palette::Palette;
pub use palette_file::PaletteError;
pub use pixel_art::{PixelArt, PixelArtDesc};
pub use png::{PngLevel, encode_png};
pub use read::{Frame, Frames, Pixels, ReadError, frames_of};
pub use target::{Pattern, Target, TargetError};
pub use template::{Fields, Template, TemplateError};
pub use webp::encode_webp;

use crate::image::Rgba8;
use std::path::PathBuf;

/// Why a picture was not written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The buffer is empty, does not match its sides, or is larger than the format can say.
    #[error(
        "a picture of {width} × {height} pixels in {bytes} bytes cannot be written as {format}: expected sides \
         of 1 to {limit} and {width} × {height} × 4 bytes"
    )]
    Size {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes that the buffer holds.
        bytes: usize,
        /// As [`Format::name`] has it.
        format: &'static str,
        /// Longest side that the format allows.
        limit: usize,
    },
    /// A film's frame of another size than the film.
    #[error("a frame of the film is {}, expected {}: every frame must have the same size", sides(.found), sides(.expected))]
    FrameSize {
        /// Width and height of the film.
        expected: [usize; 2],
        /// Width and height of the frame.
        found: [usize; 2],
    },
    /// A film that got fewer or more frames than it announced.
    #[error("the film was announced with {expected} frames and got {found}")]
    FrameCount {
        /// Frames that were announced.
        expected: u32,
        /// Frames that came.
        found: u32,
    },
    /// A frame cannot be shown so long.
    #[error(
        "{rate} frames a second is too slow for {format}, whose longest frame is {longest}: expected {least} or more"
    )]
    TooSlow {
        /// Frames a second.
        rate: crate::time::Rate,
        /// GIF or WebP.
        format: &'static str,
        /// The longest time.
        longest: &'static str,
        /// The least rate.
        least: &'static str,
    },
    /// A frame cannot be shown so briefly.
    #[error("{rate} frames a second is too fast for {format}: expected at most {most}")]
    TooFast {
        /// Frames a second.
        rate: crate::time::Rate,
        /// WebP.
        format: &'static str,
        /// The highest rate.
        most: u32,
    },
    /// Standard output cannot be written to; [`io::ErrorKind::BrokenPipe`](std::io::ErrorKind::BrokenPipe) where the
    /// program behind it has closed it.
    #[error("standard output: {source}")]
    Stdout {
        /// The system's reason.
        source: std::io::Error,
    },
    /// The encoder or the stream behind it failed.
    #[error("{format}: {source}")]
    Encode {
        /// As [`Format::name`] has it.
        format: &'static str,
        /// What failed.
        source: std::io::Error,
    },
    /// A file is there already.
    #[error("{}: the file exists already; choose another name, or --force to overwrite it", .path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The name is that of a folder, or of something that is no plain file.
    #[error("{}: expected a file name, found {found}", .path.display())]
    NotAFile {
        /// The name.
        path: PathBuf,
        /// `a folder`, `a device or pipe`.
        found: &'static str,
    },
    /// The folder of the file is missing.
    #[error("{}: the folder {} does not exist; create it first (mkdir -p)", .path.display(), .folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The system refused.
    #[error("{}: cannot {action}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// `create the file`, `write`.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// [`cleanup_temporaries`] ran: the program is about to end, and nothing more is written.
    #[error("{}: interrupted, nothing was written", .path.display())]
    Interrupted {
        /// The file.
        path: PathBuf,
    },
}

impl Error {
    /// Whether the program that reads standard output went away, which is no fault of anybody's.
    pub fn is_closed_pipe(&self) -> bool {
        match self {
            Self::Stdout { source } | Self::Encode { source, .. } => {
                source.kind() == std::io::ErrorKind::BrokenPipe
            }
            _ => false,
        }
    }
}

/// `640 × 480`.
fn sides(s: &[usize; 2]) -> String {
    format!("{} × {}", s[0], s[1])
}

/// Refuse buffers that do not hold `each` bytes for every pixel of a PNG picture.
fn check_sides([width, height]: [usize; 2], bytes: usize, each: usize) -> Result<(), Error> {
    let limit = i32::MAX as usize;
    let fits = |n: usize| (1..=limit).contains(&n);
    let want = width.checked_mul(height).and_then(|n| n.checked_mul(each));
    if fits(width) && fits(height) && want == Some(bytes) {
        return Ok(());
    }
    Err(Error::Size { width, height, bytes, format: "PNG", limit })
}

/// Refuse pictures whose buffer does not match their sides, or whose sides the format cannot say.
fn check_size(picture: &Rgba8, format: &'static str, limit: usize) -> Result<(), Error> {
    let Rgba8 { width, height, ref data } = *picture;
    let fits = |n: usize| (1..=limit).contains(&n);
    let bytes = width.checked_mul(height).and_then(|n| n.checked_mul(4));
    if fits(width) && fits(height) && bytes == Some(data.len()) {
        return Ok(());
    }
    Err(Error::Size { width, height, bytes: data.len(), format, limit })
}
