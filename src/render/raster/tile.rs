//! A row of tiles: visibility, then colour, one tile after the other.

use super::encode::{Planes, Target};
use super::fill::{Visibility, Walk};
use super::frame::Frame;
use super::resolve::{self, Entries};
use super::setup::{Bins, Fragment};
use super::{Stats, TILE};
use crate::math::simd::Kernel;

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(super) struct TileScratch {
    pub stats: Stats,
    pub seen: Visibility,
    pub entries: Entries,
    pub planes: Planes,
}

/// The tiles of one row.
pub(super) struct Row<'a, 'b> {
    pub frame: &'a Frame<'a>,
    pub bins: &'a [Bins],
    pub row: usize,
    pub scratch: &'a mut TileScratch,
    pub target: &'a mut Target<'b>,
}

impl Kernel for Row<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        for column in 0..self.frame.tiles_x {
            self.tile(column);
        }
    }
}

impl Row<'_, '_> {
    #[inline(always)]
    fn tile(&mut self, column: usize) {
        let frame = self.frame;
        let index = self.row * frame.tiles_x + column;
        let (x, w) = (column * TILE, TILE.min(frame.width as usize - column * TILE));
        let empty = |b: &Bins| {
            let t = &b.tiles[index];
            t.fragments.is_empty() && t.solid.is_empty() && t.blend.is_empty()
        };
        if self.bins.iter().all(empty) {
            return self.target.fill(x, w, frame.scene.background);
        }

        // What is visible at each sample?
        let origin = [x as i32, (self.row * TILE) as i32];
        let seen = &mut self.scratch.seen;
        seen.clear(frame.samples);
        for bins in self.bins {
            for &s in &bins.tiles[index].solid {
                if let Some(walk) = Walk::new(frame, &bins.setups[s as usize], origin) {
                    walk.fill(frame.samples, seen);
                }
            }
            bins.tiles[index].fragments.iter().for_each(|f| put(seen, f));
        }
        if self.target.write_ids(frame, x, w, seen) {
            return;
        }

        // What does it look like?
        let rows = self.target.rows();
        let scratch = &mut *self.scratch;
        resolve::list(frame, [w, rows], scratch);
        resolve::shade(frame, origin, scratch);
        self.target.write(x, w, &scratch.planes);
    }
}

/// A sample of a small triangle into the buffer.
#[inline(always)]
fn put(seen: &mut Visibility, f: &Fragment) {
    let at = f.place as usize;
    let (z, id) = (&mut seen.z[at], &mut seen.id[at]);
    if f.z > *z || (f.z == *z && f.id < *id) {
        (*z, *id) = (f.z, f.id);
    }
}
