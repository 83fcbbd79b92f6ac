//! Where each frame goes.

use super::rect::Rect;
use crunch::{Item, Packer, Rotation};

/// A size, and a place for each frame in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// By number of the frame; no two of them overlap.
    pub places: Vec<Rect>,
}

/// What lies between frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Margins {
    /// Clear pixels between neighbours.
    pub between: usize,
    /// Clear pixels along the sheet's edges.
    pub around: usize,
    /// Times that the pixels at a frame's edge are repeated beyond it, so that a filter finds no seam.
    pub extrude: usize,
}

impl Margins {
    /// Pixels from one frame's start to the next, along a side of `n` pixels.
    fn pitch(&self, n: usize) -> usize {
        n.saturating_add(2 * self.extrude).saturating_add(self.between)
    }

    /// Pixels from the edge to the first frame.
    fn first(&self) -> usize {
        self.around + self.extrude
    }
}

/// How large a sheet may become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Pixels along a side.
    pub side: usize,
    /// Pixels in all.
    pub pixels: usize,
}

impl Default for Limits {
    /// What graphics hardware takes at most, 16384 along a side; in all half of that square, which is 512 MiB of colour.
    fn default() -> Self {
        Self { side: 16384, pixels: 1 << 27 }
    }
}

/// How frames of several sizes are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Packing {
    /// What lies between them.
    pub margins: Margins,
    /// Both sides of the sheet are powers of two.
    pub power_of_two: bool,
    /// How large it may become.
    pub limits: Limits,
}

/// No sheet can hold the frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SheetError {
    /// Too long a side, or too many pixels.
    #[error(
        "a sheet of {frames} frames would have {width} × {height} pixels: expected at most {side} along a side and {pixels} in all; \
         draw fewer frames (--fps, --frames) or smaller ones (--size), or choose other --columns",
        side = .limits.side, pixels = .limits.pixels
    )]
    TooLarge {
        /// Frames that it should hold.
        frames: usize,
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// What was allowed.
        limits: Limits,
    },
    /// The parts that are visible have more pixels than a sheet may.
    #[error(
        "{frames} frames have {found} visible pixels and a sheet may have {pixels}, at most {side} along a side; \
         draw fewer frames (--fps, --frames) or smaller ones (--size)",
        side = .limits.side, pixels = .limits.pixels
    )]
    TooFull {
        /// Frames until then, each different one counted once.
        frames: usize,
        /// Their pixels with what lies between them.
        found: usize,
        /// What was allowed.
        limits: Limits,
    },
    /// More frames than packing takes a reasonable time for.
    #[error(
        "{found} different frames are too many to pack: expected at most {limit}; a grid takes any number"
    )]
    TooMany {
        /// Different frames.
        found: usize,
        /// The limit.
        limit: usize,
    },
    /// A frame without pixels.
    #[error("a frame of {width} × {height} pixels has no place on a sheet")]
    Empty {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
}

/// Different frames that are packed: the time grows with the square of their number, and this many take some seconds.
const MOST_PACKED: usize = 4096;

/// Rows of `columns` cells of one size, in order.
///
/// ```
/// use sinew::sheet::{Limits, Margins, grid};
/// let gaps = Margins { between: 2, ..Default::default() };
/// let layout = grid(5, [10, 20], 3, gaps, Limits::default()).unwrap();
/// assert_eq!(layout.size, [34, 42]);
/// assert_eq!((layout.places[4].x, layout.places[4].y), (12, 22));
/// ```
///
/// # Errors
/// [`SheetError::TooLarge`], [`SheetError::Empty`]; nothing is allocated then.
pub fn grid(
    count: usize,
    cell: [usize; 2],
    columns: usize,
    margins: Margins,
    limits: Limits,
) -> Result<Layout, SheetError> {
    check_sizes(&[cell])?;
    let columns = columns.clamp(1, count.max(1));
    let rows = count.div_ceil(columns).max(1);
    let side = |n: usize, cell: usize| {
        margins.pitch(cell).saturating_mul(n).saturating_add(2 * margins.around) - margins.between
    };
    let size = [side(columns, cell[0]), side(rows, cell[1])];
    check(count, size, limits)?;
    let place = |i: usize| Rect {
        x: margins.first() + i % columns * margins.pitch(cell[0]),
        y: margins.first() + i / columns * margins.pitch(cell[1]),
        w: cell[0],
        h: cell[1],
    };
    Ok(Layout { size, places: (0..count).map(place).collect() })
}

/// A small sheet for frames of several sizes: the smallest of squares and of rectangles twice as long as wide that hold them, found by
/// growing in steps of a fiftieth, cut to what is used. Frames are never turned. The same sizes give the same layout.
///
/// # Errors
/// [`SheetError`]: too many frames, or a sheet beyond the limits.
pub fn pack(sizes: &[[usize; 2]], packing: Packing) -> Result<Layout, SheetError> {
    check_sizes(sizes)?;
    let Packing { margins, power_of_two, limits } = packing;
    // Areas of any sides up to here fit a machine word.
    let limits = Limits { side: limits.side.min(1 << 24), ..limits };
    if sizes.len() > MOST_PACKED {
        return Err(SheetError::TooMany { found: sizes.len(), limit: MOST_PACKED });
    }
    // Each frame brings the gap to its right and below; one gap too many at the far edges is taken off again.
    let frame = |s: &[usize; 2]| [margins.pitch(s[0]), margins.pitch(s[1])];
    let padded: Vec<[usize; 2]> = sizes.iter().map(frame).collect();
    let area = padded.iter().fold(0usize, |sum, s| sum.saturating_add(s[0].saturating_mul(s[1])));
    let full = SheetError::TooFull { frames: sizes.len(), found: area, limits };
    if area > limits.pixels {
        return Err(full);
    }
    let items = padded.iter().enumerate().map(|(i, s)| Item::new(i, s[0], s[1], Rotation::None));
    let mut packer = Packer::with_items(items);
    let shapes =
        if power_of_two { powers(limits.side) } else { shapes(area, &padded, margins.around, limits.side) };
    let edges = 2 * margins.around;
    for [w, h] in shapes {
        let inner = [w.saturating_sub(edges) + margins.between, h.saturating_sub(edges) + margins.between];
        if w * h > limits.pixels || inner[0] * inner[1] < area {
            continue;
        }
        let Ok(packed) = packer.pack(crunch::Rect::of_size(inner[0], inner[1])) else { continue };
        let mut layout = Layout { size: [w, h], places: vec![Rect::default(); sizes.len()] };
        for p in packed {
            let [w, h] = sizes[p.data];
            layout.places[p.data] =
                Rect { x: p.rect.x + margins.first(), y: p.rect.y + margins.first(), w, h };
        }
        if !power_of_two {
            layout.size = used(&layout.places, margins);
        }
        return Ok(layout);
    }
    Err(full)
}

/// Pixels up to the last frame, its margins included.
fn used(places: &[Rect], margins: Margins) -> [usize; 2] {
    let most = |end: fn(&Rect) -> usize| places.iter().map(end).max().unwrap_or(1) + margins.first();
    [most(|r| r.x + r.w), most(|r| r.y + r.h)]
}

/// Powers of two by area, the square first, then the wide one.
fn powers(limit: usize) -> Vec<[usize; 2]> {
    let sides = || (0..usize::BITS - 1).map(|k| 1usize << k).take_while(|s| *s <= limit);
    let mut all: Vec<[usize; 2]> = sides().flat_map(|w| sides().map(move |h| [w, h])).collect();
    all.retain(|[w, h]| w.max(h) <= &(4 * w.min(h)));
    all.sort_by_key(|[w, h]| (w * h, w.abs_diff(*h), usize::MAX - w));
    all
}

/// Squares and twice as wide rectangles of growing area.
fn shapes(area: usize, padded: &[[usize; 2]], around: usize, limit: usize) -> Vec<[usize; 2]> {
    let longest = |c: usize| padded.iter().map(|s| s[c]).max().unwrap_or(1) + 2 * around;
    let (least_w, least_h) = (longest(0), longest(1));
    let mut shapes = Vec::new();
    let mut grown = area as f64;
    let last = (limit * limit) as f64;
    while grown <= 2.0 * last {
        for ratio in [1.0, 2.0, 0.5] {
            let w = (grown * ratio).sqrt().ceil() as usize;
            let h = (grown / ratio).sqrt().ceil() as usize;
            let shape = [w.clamp(least_w, limit.max(least_w)), h.clamp(least_h, limit.max(least_h))];
            if shape[0] <= limit && shape[1] <= limit {
                shapes.push(shape);
            }
        }
        grown *= 1.02;
    }
    shapes.dedup();
    shapes
}

fn check_sizes(sizes: &[[usize; 2]]) -> Result<(), SheetError> {
    match sizes.iter().find(|s| s.contains(&0)) {
        Some(&[width, height]) => Err(SheetError::Empty { width, height }),
        None => Ok(()),
    }
}

fn check(frames: usize, [width, height]: [usize; 2], limits: Limits) -> Result<(), SheetError> {
    let fits = width <= limits.side && height <= limits.side && width.saturating_mul(height) <= limits.pixels;
    if fits { Ok(()) } else { Err(SheetError::TooLarge { frames, width, height, limits }) }
}
