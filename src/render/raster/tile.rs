//! A row of tiles: visibility, then colour, one tile after the other.

use super::blend::{self, BlendScratch};
use super::clay::Points;
use super::colors::{Colors, Sink};
use super::encode::Target;
use super::fill::{All, Keep, Visibility, Walk, lane_offsets};
use super::frame::{Draw, Frame};
use super::resolve::{self, Area, LastDraw, Shades};
use super::scan::Entries;
use super::setup::Bins;
use super::surface::Present;
use super::{Stats, TILE};
use crate::math::simd::{self, I8, Kernel, WideKernel};
use crate::render::Window;

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(super) struct TileScratch {
    pub stats: Stats,
    pub seen: Visibility,
    pub entries: Entries,
    /// Pixels that show more than one triangle, and room for eight more.
    pub torn: Vec<i32>,
    pub colors: Colors,
    pub blend: BlendScratch,
    pub last_draw: LastDraw,
    /// Runs of entries of one draw.
    pub runs: Vec<(u32, u32, u32)>,
    pub shades: Shades,
    pub points: Points,
}

/// The tiles of one row.
pub(super) struct Row<'a, 'b> {
    pub frame: &'a Frame<'a>,
    pub bins: &'a [Bins],
    pub row: usize,
    /// The part of the picture that the output shows.
    pub tiles: Window,
    pub scratch: &'a mut TileScratch,
    pub target: &'a mut Target<'b>,
}

impl Kernel for Row<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let tiles = self.tiles;
        let cleared = self.target.clear(self.frame.scene.background);
        for column in tiles.x / TILE..(tiles.x + tiles.width).div_ceil(TILE) {
            self.tile(column, cleared);
        }
    }
}

impl Row<'_, '_> {
    #[inline(always)]
    fn tile(&mut self, column: usize, cleared: bool) {
        let frame = self.frame;
        let index = self.row * frame.tiles_x + column;
        let (x, w) = (column * TILE, TILE.min(frame.width as usize - column * TILE));
        let to = x - self.tiles.x;
        let empty = |b: &Bins| {
            let t = &b.tiles[index];
            t.fragments.is_empty() && t.solid.is_empty() && t.blend.is_empty()
        };
        if self.bins.iter().all(empty) {
            if !cleared {
                self.target.fill(to, w, frame.scene.background);
            }
            return;
        }

        // What is visible at each sample?
        let area = Area { origin: [x as i32, (self.row * TILE) as i32], to, w, h: self.target.rows() };
        self.scratch.seen.start(frame.samples);
        let opaque = Opaque { frame, bins: self.bins, index, area, seen: &mut self.scratch.seen };
        if frame.samples == 1 {
            opaque.fill();
        } else {
            simd::run_wide(frame.isa, opaque);
        }
        for bins in self.bins {
            if frame.masks {
                self.masked(bins, index, area);
            }
            self.scratch.seen.put(&bins.tiles[index].fragments);
        }
        if self.target.write_ids(frame, area, &self.scratch.seen) {
            return;
        }

        // What does it look like, and what lies before it?
        let transparent = self.bins.iter().any(|b| !b.tiles[index].blend.is_empty());
        if !transparent {
            let sink = self.target.sink();
            resolve::resolve(frame, self.bins, index, area, sink, self.scratch);
            return self.target.write(to, w, &self.scratch.colors);
        }
        resolve::resolve(frame, self.bins, index, area, Sink::Layers, self.scratch);
        blend::blend(frame, self.bins, index, area, self.scratch);
        self.scratch.colors.average();
        self.target.write_planes(to, w, &self.scratch.colors.planes);
    }

    /// Masked triangles into the buffer.
    #[inline(always)]
    fn masked(&mut self, bins: &Bins, index: usize, area: Area) {
        let (frame, seen) = (self.frame, &mut self.scratch.seen);
        for setup in bins.solid(index) {
            if frame.is_masked(setup)
                && let Some(walk) = Walk::new(frame, setup, area.origin)
            {
                let draw = &frame.draws[setup.draw as usize];
                let id = setup.id - draw.first_triangle;
                let keep = Textured { frame, draw, id, corner: area.corner(frame) };
                walk.fill(frame.samples, seen, keep);
            }
        }
    }
}

/// Opaque triangles of a tile into the buffer.
struct Opaque<'a> {
    frame: &'a Frame<'a>,
    bins: &'a [Bins],
    index: usize,
    area: Area,
    seen: &'a mut Visibility,
}

impl Opaque<'_> {
    /// One sample a pixel: few triangles are wider than eight.
    #[inline(always)]
    fn fill(self) {
        let Self { frame, bins, index, area, seen } = self;
        for bins in bins {
            for setup in bins.solid(index) {
                if !frame.is_masked(setup)
                    && let Some(walk) = Walk::<8>::new(frame, setup, area.origin)
                {
                    walk.fill(1, seen, All);
                }
            }
        }
    }
}

/// Four samples a pixel.
impl WideKernel for Opaque<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize>(self) {
        let Self { frame, bins, index, area, seen } = self;
        for bins in bins {
            for setup in bins.solid(index) {
                if !frame.is_masked(setup)
                    && let Some(walk) = Walk::<N>::new(frame, setup, area.origin)
                {
                    walk.fill(4, seen, All);
                }
            }
        }
    }
}

/// What a material's cut-off leaves.
struct Textured<'a> {
    frame: &'a Frame<'a>,
    draw: &'a Draw<'a>,
    id: u32,
    corner: [f32; 2],
}

impl Keep<8> for Textured<'_> {
    const IN_ORDER: bool = false;

    #[inline(always)]
    fn keep(&self, at: usize, wins: I8) -> I8 {
        let Self { frame, draw, id, corner } = *self;
        let place = at / frame.samples;
        let [ox, oy] = lane_offsets::<8>(frame.samples).map(|o| o.to_f32() * (1.0 / 256.0));
        let px = ox + (corner[0] + (place % TILE) as f32);
        let py = oy + (corner[1] + (place / TILE) as f32);
        wins & Present { frame, draw, id, px, py }.mask()
    }
}
