//! Many frames in one picture: sprite sheets and contact sheets. Geometry and copying; no files and no drawing here.
//!
//! 1. Each frame is cut to what is visible of it ([`visible()`]), and equal cuts are kept once ([`Distinct`]).
//! 2. A [`Layout`] says where each cut goes: in a [`grid()`], or [`pack()`]ed.
//! 3. A [`Canvas`] takes the pixels, of whatever kind they are: colour, palette indices, normals, depth.
//! 4. An [`Assembler`] does all that with frames as they come.
//! 5. A [`Sheet`] says what was put where; `io::sheet_json` writes that down for game engines.
//!
//! Frames are seen from several directions as [`directions()`] names them.

mod assemble;
mod canvas;
mod directions;
mod distinct;
mod layout;
mod rect;

pub use assemble::{Assembler, Frames, Kind, Placed, SheetDesc};
pub use canvas::Canvas;
pub use directions::{Direction, directions};
pub use distinct::Distinct;
pub use layout::{Layout, Limits, Margins, Packing, SheetError, grid, pack};
pub use rect::{Rect, visible};

use crate::time::Rate;
use std::ops::Range;

/// One frame on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sprite {
    /// Unique on the sheet: `walk/s/0001`.
    pub name: String,
    /// Where its pixels are, on the sheet. Equal frames share one place.
    pub place: Rect,
    /// Where these pixels were in the frame as it was drawn.
    pub trim: Rect,
    /// Pixels of the frame as it was drawn, across and down.
    pub source: [usize; 2],
    /// The point that a game puts where the character stands: a fraction of `source` from its top left, possibly outside.
    pub pivot: [f64; 2],
    /// How long it is shown.
    pub duration_ms: u32,
}

/// Frames that follow one another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tag {
    /// `walk/s`, or the clip's name alone where there is one direction.
    pub name: String,
    /// Which sprites.
    pub frames: Range<usize>,
}

/// What is on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// File name of the picture, as seen from beside it.
    pub image: String,
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Whether pixels are indices into a palette.
    pub indexed: bool,
    /// Frames a second.
    pub rate: Rate,
    /// In the order in which they are shown: clip by clip, direction by direction.
    pub sprites: Vec<Sprite>,
    /// Clips and directions.
    pub tags: Vec<Tag>,
    /// Pictures of the same layout that say more than the colour does.
    pub maps: Vec<Map>,
}

/// A picture that has the layout of the sheet and holds something other than colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// File name of the picture, as seen from beside the sheet.
    pub image: String,
    /// What it holds.
    pub kind: MapKind,
}

/// What a map holds.
#[derive(Clone, Debug, PartialEq)]
pub enum MapKind {
    /// Unit normals in view space as `(n + 1)/2` in 8 bits, linear: +x right, +y up, +z towards the viewer.
    Normal,
    /// Distances along the view direction as 16-bit grey: `d = far − v/65535·(far − near)`; 0 where nothing is.
    Depth {
        /// Metres of white.
        near: f32,
        /// Metres of black.
        far: f32,
    },
    /// Numbers of objects from 1, as indices into a palette of distinct colours; 0 where nothing is.
    Object {
        /// Name and colour of each number, from 1.
        objects: Vec<(String, [u8; 3])>,
    },
}

impl MapKind {
    /// The word for it in options and file names.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Depth { .. } => "depth",
            Self::Object { .. } => "id",
        }
    }
}

/// Milliseconds of each of `count` frames, whole numbers that do not drift: frame `k` starts at `round(1000·k/fps)`.
///
/// ```
/// let rate = "24".parse().unwrap();
/// assert_eq!(sinew::sheet::durations(4, rate), [42, 41, 42, 42]);
/// ```
pub fn durations(count: usize, rate: Rate) -> Vec<u32> {
    let start = |k: usize| {
        let (n, d) = (1000 * k as u128 * u128::from(rate.seconds()), u128::from(rate.frames()));
        (2 * n + d) / (2 * d)
    };
    (0..count).map(|k| (start(k + 1) - start(k)).min(u128::from(u32::MAX)) as u32).collect()
}
