//! From visible triangles to colours: one evaluation for each triangle in a pixel, eight at a time.

use super::TILE;
use super::fill::NONE;
use super::frame::{Draw, Frame, ROTATED};
use super::tile::TileScratch;
use crate::math::simd::{F8, V8};
use crate::render::raster::surface;

/// What is to be shaded in a tile, in order of the pixels.
#[derive(Debug, Default)]
pub(super) struct Entries {
    /// Row · 64 + column in the tile.
    pub place: Vec<u16>,
    /// Samples of the pixel where the triangle is seen, a bit each.
    pub mask: Vec<u8>,
    pub id: Vec<u32>,
    /// Runs of entries of one draw: draw, first entry, end.
    pub runs: Vec<(u32, u32, u32)>,
    sorted: Vec<u32>,
}

impl Entries {
    fn clear(&mut self) {
        self.place.clear();
        self.mask.clear();
        self.id.clear();
        self.runs.clear();
    }

    #[inline(always)]
    fn push(&mut self, place: usize, mask: u8, id: u32) {
        self.place.push(place as u16);
        self.mask.push(mask);
        self.id.push(id);
    }

    /// Order by draw, so that lanes share a material. Pixels stay in order within a draw.
    fn sort(&mut self, frame: &Frame) {
        let mut range = 0..0;
        for (i, id) in self.id.iter().enumerate() {
            if !range.contains(id) {
                let d = frame.draw_of(*id);
                let first = frame.draws[d].first_triangle;
                range = first..first + frame.draws[d].object.mesh.triangles.len() as u32;
                if let Some(last) = self.runs.last_mut() {
                    last.2 = i as u32;
                }
                self.runs.push((d as u32, i as u32, i as u32));
            }
        }
        if let Some(last) = self.runs.last_mut() {
            last.2 = self.id.len() as u32;
        }
        self.runs.sort_by_key(|r| r.0);
        self.sorted.clear();
        for i in 0..self.runs.len() {
            let (draw, from, to) = self.runs[i];
            self.sorted.extend(from..to);
            self.runs[i] = (draw, self.sorted.len() as u32 - (to - from), self.sorted.len() as u32);
        }
        self.runs.dedup_by(|b, a| {
            a.0 == b.0 && {
                a.2 = b.2;
                true
            }
        });
    }
}

/// Collect what is visible, and put the background's share into the colours.
#[inline(always)]
pub(super) fn list(frame: &Frame, [w, rows]: [usize; 2], scratch: &mut TileScratch) {
    let TileScratch { seen, entries, planes, stats, .. } = scratch;
    entries.clear();
    for (plane, background) in planes.iter_mut().zip(frame.scene.background) {
        plane.clear();
        plane.resize(TILE * TILE, background);
    }
    for (y, x) in (0..rows).flat_map(|y| (0..w).map(move |x| (y, x))) {
        let at = y * TILE + x;
        if frame.samples == 1 {
            if seen.id[at] != NONE {
                entries.push(at, 0xf, seen.id[at]);
                stats.samples += 1;
            }
            continue;
        }
        let ids = [0, 1, 2, 3].map(|s| seen.id[s * TILE * TILE + at]);
        if ids == [ids[0]; 4] {
            if ids[0] != NONE {
                entries.push(at, 0xf, ids[0]);
                stats.samples += 4;
            }
            continue;
        }
        let empty = mixed(entries, at, ids);
        stats.samples += 4 - empty as u64;
        for (plane, background) in planes.iter_mut().zip(frame.scene.background) {
            plane[at] = background * (empty as f32 * 0.25);
        }
    }
    entries.sort(frame);
}

/// A pixel with more than one triangle: an entry for each; returns how many samples see nothing.
#[inline(always)]
fn mixed(entries: &mut Entries, at: usize, ids: [u32; 4]) -> u32 {
    let mut done = 0u8;
    let mut empty = 0;
    for s in 0..4 {
        if done >> s & 1 != 0 {
            continue;
        }
        let same = (s..4).fold(0u8, |m, t| m | ((ids[t] == ids[s]) as u8) << t);
        done |= same;
        if ids[s] == NONE {
            empty = same.count_ones();
        } else {
            entries.push(at, same, ids[s]);
        }
    }
    empty
}

/// Mean position of the samples of a mask, pixels from the centre: it lies within the triangle that covers them.
static CENTROIDS: [[f32; 2]; 16] = {
    let mut table = [[0.0; 2]; 16];
    let mut mask = 1;
    while mask < 16 {
        let (mut x, mut y, mut n, mut s) = (0, 0, 0, 0);
        while s < 4 {
            if mask >> s & 1 != 0 {
                x += ROTATED[s][0];
                y += ROTATED[s][1];
                n += 256;
            }
            s += 1;
        }
        table[mask] = [x as f32 / n as f32, y as f32 / n as f32];
        mask += 1;
    }
    table
};

/// Shade all entries and add them to the colours.
#[inline(always)]
pub(super) fn shade(frame: &Frame, origin: [i32; 2], scratch: &mut TileScratch) {
    let TileScratch { entries, planes, stats, .. } = scratch;
    stats.shaded += entries.id.len() as u64;
    for r in 0..entries.runs.len() {
        let (d, from, to) = entries.runs[r];
        let draw = &frame.draws[d as usize];
        for i in (from as usize..to as usize).step_by(8) {
            batch(frame, draw, origin, entries, planes, i, (to as usize - i).min(8));
        }
    }
}

/// Up to eight entries of one draw.
#[inline(always)]
fn batch(
    frame: &Frame,
    draw: &Draw,
    origin: [i32; 2],
    entries: &Entries,
    planes: &mut [Vec<f32>; 4],
    start: usize,
    n: usize,
) {
    let mut ids = [0; 8];
    let mut place = [0usize; 8];
    let mut mask = [0usize; 8];
    let (mut px, mut py) = (F8::ZERO, F8::ZERO);
    let corner = [
        origin[0] as f32 + 0.5 - frame.width as f32 * 0.5,
        origin[1] as f32 + 0.5 - frame.height as f32 * 0.5,
    ];
    for k in 0..8 {
        let e = entries.sorted[start + k.min(n - 1)] as usize;
        ids[k] = entries.id[e] - draw.first_triangle;
        place[k] = entries.place[e] as usize;
        mask[k] = entries.mask[e] as usize;
        let c = CENTROIDS[mask[k]];
        px.0[k] = corner[0] + (place[k] % TILE) as f32 + c[0];
        py.0[k] = corner[1] + (place[k] / TILE) as f32 + c[1];
    }
    let color: V8 = surface::color(frame, draw, ids, px, py);
    let rgba = [color.x, color.y, color.z, F8::ONE];
    for k in 0..n {
        for c in 0..4 {
            let p = &mut planes[c][place[k]];
            *p = if mask[k] == 0xf {
                rgba[c].0[k]
            } else {
                *p + rgba[c].0[k] * (mask[k].count_ones() as f32 * 0.25)
            };
        }
    }
}
