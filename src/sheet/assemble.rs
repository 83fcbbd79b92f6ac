//! Frames to a sheet, one after the other: cut, kept once, placed, and described.

use super::{
    Canvas, Direction, Distinct, Layout, Limits, Margins, Packing, Rect, Sheet, SheetError, Sprite, Tag,
    durations, grid, pack, visible,
};
use crate::time::Rate;
use std::hash::Hash;

/// How frames lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Kind {
    /// In rows and columns.
    #[default]
    Grid,
    /// Cut to what is visible and packed, equal frames once.
    Trimmed,
}

/// How frames become a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SheetDesc {
    /// How they lie.
    pub kind: Kind,
    /// Columns of a grid; without, the frames of a direction, or about a square where there is one direction.
    pub columns: Option<usize>,
    /// Clear pixels between frames and along the edges; without, 1 where frames are trimmed, 0 in a grid.
    pub padding: Option<usize>,
    /// Times that the pixels at a frame's edge are repeated beyond it.
    pub extrude: usize,
    /// Both sides of a trimmed sheet are powers of two.
    pub power_of_two: bool,
}

impl SheetDesc {
    fn margins(&self) -> Margins {
        let padding = self.padding.unwrap_or(usize::from(self.kind == Kind::Trimmed));
        Margins { between: padding, around: padding, extrude: self.extrude }
    }

    /// The columns of `count` frames from each of so many sides.
    fn columns(&self, count: usize, sides: usize, [w, h]: [usize; 2]) -> usize {
        // One direction alone makes about a square, so that the strip of a long clip is no strip.
        let square = (count as f64 * h as f64 / w.max(1) as f64).sqrt().ceil().max(1.0) as usize;
        self.columns.unwrap_or(if sides > 1 { count } else { square })
    }

    /// What is kept of a frame, and where it was in it: for whoever drew it, on any thread.
    pub fn cut<P: Copy>(
        &self,
        pixels: Vec<P>,
        size: [usize; 2],
        seen: impl Fn(&P) -> bool,
    ) -> (Rect, Vec<P>) {
        if self.kind == Kind::Grid {
            return (Rect::whole(size), pixels);
        }
        let trim = visible(&pixels, size[0], seen);
        (trim, trim.cut(&pixels, size[0]))
    }
}

/// Where everything went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Placed {
    /// Places on the sheet.
    pub layout: Layout,
    /// Of each frame: the number of its place, and which part of it is there.
    pub cuts: Vec<(usize, Rect)>,
    /// Times that edges are repeated.
    pub extrude: usize,
}

/// Takes the frames of a sheet, direction by direction.
pub struct Assembler<P> {
    desc: SheetDesc,
    /// Of a grid, where places are known before the frames are.
    grid: Option<(Layout, Canvas<P>)>,
    distinct: Distinct<P>,
    cuts: Vec<(usize, Rect)>,
    fill: P,
}

impl<P: Copy + Eq + Hash> Assembler<P> {
    /// For `count` frames of a size from each of so many sides, on a ground of `fill`.
    ///
    /// # Errors
    /// [`SheetError::TooLarge`]: a grid of them.
    pub fn new(
        desc: SheetDesc,
        count: usize,
        sides: usize,
        size: [usize; 2],
        fill: P,
    ) -> Result<Self, SheetError> {
        let layout = || {
            let columns = desc.columns(count, sides, size);
            grid(count * sides, size, columns, desc.margins(), Limits::default())
        };
        let layout = (desc.kind == Kind::Grid).then(layout).transpose()?;
        let grid = layout.map(|l| (l.clone(), Canvas::new(&l, fill)));
        Ok(Self { desc, grid, distinct: Distinct::new(), cuts: vec![], fill })
    }

    /// The next frame, as it was [`cut`](SheetDesc::cut).
    ///
    /// # Errors
    /// [`SheetError::TooFull`]: there is no room for it.
    ///
    /// # Panics
    /// If a grid has no place left.
    pub fn add(&mut self, trim: Rect, pixels: Vec<P>) -> Result<(), SheetError> {
        let frame = self.cuts.len();
        if let Some((layout, canvas)) = &mut self.grid {
            canvas.put(layout.places[frame], &pixels, self.desc.extrude);
            self.cuts.push((frame, trim));
            return Ok(());
        }
        self.cuts.push((self.distinct.add(trim.size(), pixels), trim));
        let (found, limits) = (self.distinct.area(), Limits::default());
        match found > limits.pixels {
            true => Err(SheetError::TooFull { frames: frame + 1, found, limits }),
            false => Ok(()),
        }
    }

    /// The sheet of all frames that came.
    ///
    /// # Errors
    /// [`SheetError`]: they cannot be packed.
    pub fn finish(self) -> Result<(Canvas<P>, Placed), SheetError> {
        let (extrude, cuts) = (self.desc.extrude, self.cuts);
        if let Some((layout, canvas)) = self.grid {
            return Ok((canvas, Placed { layout, cuts, extrude }));
        }
        let limits = Limits::default();
        let packing = Packing { margins: self.desc.margins(), power_of_two: self.desc.power_of_two, limits };
        let layout = pack(&self.distinct.sizes(), packing)?;
        let mut canvas = Canvas::new(&layout, self.fill);
        for (i, place) in layout.places.iter().enumerate() {
            canvas.put(*place, self.distinct.pixels(i), extrude);
        }
        Ok((canvas, Placed { layout, cuts, extrude }))
    }
}

/// What frames are, whatever their pixels.
#[derive(Clone, Debug)]
pub struct Frames<'a> {
    /// Name of the clip.
    pub clip: &'a str,
    /// Where it is seen from.
    pub sides: &'a [Direction],
    /// Numbers of the frames of one side.
    pub numbers: &'a [i64],
    /// Pixels of a frame.
    pub size: [usize; 2],
    /// Frames a second.
    pub rate: Rate,
    /// Where the character stands, frame by frame.
    pub pivots: &'a [[f64; 2]],
}

impl Frames<'_> {
    /// A sheet in words; `image` is the file name of its picture.
    ///
    /// # Panics
    /// If there are fewer pivots or cuts than frames.
    pub fn describe(&self, placed: &Placed, image: String) -> Sheet {
        let n = self.numbers.len();
        let times = durations(n, self.rate);
        // Numbers that sort as they follow one another.
        let digits = self.numbers.iter().map(|f| f.to_string().len()).max().unwrap_or(1).max(4);
        let tag = |d: &Direction| match d.name.is_empty() {
            true => self.clip.to_owned(),
            false => format!("{}/{}", self.clip, d.name),
        };
        let sprite = |i: usize| {
            let (place, trim) = placed.cuts[i];
            Sprite {
                name: format!("{}/{:0digits$}", tag(&self.sides[i / n]), self.numbers[i % n]),
                place: placed.layout.places[place],
                trim,
                source: self.size,
                pivot: self.pivots[i],
                duration_ms: times[i % n],
            }
        };
        let tags = self.sides.iter().enumerate();
        Sheet {
            image,
            size: placed.layout.size,
            indexed: false,
            rate: self.rate,
            sprites: (0..n * self.sides.len()).map(sprite).collect(),
            tags: tags.map(|(k, d)| Tag { name: tag(d), frames: k * n..(k + 1) * n }).collect(),
            maps: Vec::new(),
        }
    }
}
