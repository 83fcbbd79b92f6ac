//! From visible triangles to colours: one evaluation for each triangle in a pixel, eight at a time.
//!
//! Pixels that one triangle fills are taken from each 8×8 block triangle by triangle, so that its corners are read once for
//! eight pixels; what is left over, and pixels that several triangles share, is collected and shaded in order of material.

use super::fill::NONE;
use super::frame::{Draw, Frame, ROTATED};
use super::setup::bits;
use super::surface::{self, Shade};
use super::tile::TileScratch;
use super::{Stats, TILE};
use crate::math::simd::{F8, I8};
use glam::Vec4;

/// Samples of a whole tile.
const PLANE: usize = TILE * TILE;

/// All samples of a pixel.
pub(super) const WHOLE: u8 = 0xf;

/// From so many pixels in a block on, a triangle is shaded by itself.
const GROUP: u32 = 5;

/// Triangles with fewer pixels that a block may have before the rest of it is collected.
const PATIENCE: u32 = 6;

/// Four planes of linear, premultiplied colour: row in the tile · 64 + column; one set of them, or one a sample.
#[derive(Debug, Default)]
pub(super) struct Planes {
    pub c: [Vec<f32>; 4],
    /// Each sample has its own colour: needed where something blends.
    pub by_sample: bool,
}

impl Planes {
    fn clear(&mut self, background: [f32; 4], by_sample: bool) {
        self.by_sample = by_sample;
        let n = if by_sample { 4 * PLANE } else { PLANE };
        for (plane, value) in self.c.iter_mut().zip(background) {
            plane.clear();
            plane.resize(n, value);
        }
    }

    /// The background's share of a pixel of which `n` samples are empty.
    #[inline(always)]
    fn empty(&mut self, at: usize, n: u32, background: [f32; 4]) {
        if self.by_sample {
            return;
        }
        for c in 0..4 {
            self.c[c][at] = background[c] * (n as f32 * 0.25);
        }
    }

    /// Put eight colours, of which `n` count, where they belong.
    #[inline(always)]
    fn put(&mut self, lanes: &Lanes, n: usize, rgba: &[F8; 4]) {
        if self.by_sample {
            return self.put_samples(lanes, n, rgba);
        }
        let first = lanes.place.0[0];
        // Places of several blocks do not ascend, so that the two ends alone tell nothing.
        if lanes.whole && n == 8 && lanes.place == I8::splat(first) + I8::IOTA {
            let first = first as usize;
            for c in 0..4 {
                rgba[c].store(&mut self.c[c][first..]);
            }
            return;
        }
        for c in 0..4 {
            let plane: &mut [f32; PLANE] = (&mut self.c[c][..PLANE]).try_into().expect("a tile");
            for k in 0..n {
                let p = &mut plane[lanes.place.0[k] as usize % PLANE];
                let v = rgba[c].0[k];
                *p = if lanes.mask[k] == WHOLE { v } else { *p + v * share(lanes.mask[k]) };
            }
        }
    }

    #[inline(never)]
    fn put_samples(&mut self, lanes: &Lanes, n: usize, rgba: &[F8; 4]) {
        for k in 0..n {
            for s in bits(lanes.mask[k] as u32) {
                for c in 0..4 {
                    self.c[c][s as usize * PLANE + lanes.place.0[k] as usize] = rgba[c].0[k];
                }
            }
        }
    }

    /// The mean of the samples, where there are more than one.
    pub fn average(&mut self) {
        if !self.by_sample {
            return;
        }
        for plane in &mut self.c {
            for at in 0..PLANE {
                let pairs = (plane[at] + plane[PLANE + at]) + (plane[2 * PLANE + at] + plane[3 * PLANE + at]);
                plane[at] = pairs * 0.25;
            }
        }
    }
}

/// The part of a pixel that the samples of a mask stand for.
#[inline(always)]
fn share(mask: u8) -> f32 {
    mask.count_ones() as f32 * 0.25
}

/// Places and masks of eight entries.
pub(super) struct Lanes {
    place: I8,
    mask: [u8; 8],
    /// All masks are whole.
    whole: bool,
}

/// What is collected for later, in order of the pixels.
#[derive(Debug, Default)]
pub(super) struct Entries {
    list: Vec<Entry>,
    /// Runs of entries of one draw: draw, first entry, end.
    runs: Vec<(u32, u32, u32)>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    place: u16,
    mask: u8,
    id: u32,
}

impl Entries {
    #[inline(always)]
    fn push(&mut self, place: usize, mask: u8, id: u32) {
        self.list.push(Entry { place: place as u16, mask, id });
    }

    /// Find the runs of one draw, and order them by draw, so that lanes share a material.
    fn sort(&mut self, frame: &Frame) {
        self.runs.clear();
        let mut range = 0..0;
        for (i, e) in self.list.iter().enumerate() {
            if !range.contains(&e.id) {
                let d = frame.draw_of(e.id);
                range = frame.draws[d].ids();
                self.runs.push((d as u32, i as u32, 0));
            }
            self.runs.last_mut().expect("pushed").2 = i as u32 + 1;
        }
        self.runs.sort_by_key(|r| r.0);
    }
}

/// The part of a tile that is in the picture, and where it is.
#[derive(Clone, Copy)]
pub(super) struct Area {
    pub origin: [i32; 2],
    /// The output's column that it starts at.
    pub to: usize,
    pub w: usize,
    pub h: usize,
}

impl Area {
    /// The first pixel's centre, from the picture's centre.
    #[inline(always)]
    pub fn corner(&self, frame: &Frame) -> [f32; 2] {
        [
            self.origin[0] as f32 + 0.5 - frame.width as f32 * 0.5,
            self.origin[1] as f32 + 0.5 - frame.height as f32 * 0.5,
        ]
    }
}

/// Colour everything that is visible in a tile.
#[inline(always)]
pub(super) fn resolve(frame: &Frame, area: Area, by_sample: bool, scratch: &mut TileScratch) {
    scratch.planes.clear(frame.scene.background, by_sample && frame.samples == 4);
    scratch.entries.list.clear();
    // What was found for another scene means nothing here.
    scratch.last_draw = LastDraw::default();
    for y in (0..area.h).step_by(8) {
        for x in (0..area.w).step_by(8) {
            block(frame, area, [x, y], scratch);
        }
    }
    collected(frame, area, scratch);
}

/// One 8×8 block.
#[inline(always)]
fn block(frame: &Frame, area: Area, [x, y]: [usize; 2], scratch: &mut TileScratch) {
    let seen = &scratch.seen.id;
    let columns = (1u64 << (area.w - x).min(8)) - 1;
    let mut rows = [I8::ZERO; 8];
    let (mut whole, mut mixed_up) = (0u64, 0u64);
    for r in 0..8.min(area.h - y) {
        let at = (y + r) * TILE + x;
        let id = load(seen, at);
        let there = !id.equal(I8::splat(NONE as i32));
        rows[r] = id;
        let mut same = I8::splat(-1);
        if frame.samples == 4 {
            for s in 1..4 {
                same = same & id.equal(load(seen, s * PLANE + at));
            }
        }
        whole |= ((there & same).bitmask() as u64 & columns) << (8 * r);
        mixed_up |= ((!same).bitmask() as u64 & columns) << (8 * r);
    }
    scratch.stats.samples += whole.count_ones() as u64 * frame.samples as u64;
    for k in bits64(mixed_up) {
        mixed(frame, (y + (k as usize >> 3)) * TILE + x + (k as usize & 7), scratch);
    }

    // Take triangle after triangle out of the block.
    let mut patience = PATIENCE;
    while whole != 0 {
        let k = whole.trailing_zeros() as usize;
        let id = rows[k >> 3].0[k & 7];
        let mut own = 0u64;
        for (r, row) in rows.iter().enumerate() {
            own |= (row.equal(I8::splat(id)).bitmask() as u64) << (8 * r);
        }
        own &= whole;
        if own.count_ones() >= GROUP {
            group(frame, area, [x, y], id as u32, own, scratch);
        } else {
            patience -= 1;
            if patience == 0 {
                own = whole;
            }
            for k in bits64(own) {
                let (r, c) = (k as usize >> 3, k as usize & 7);
                scratch.entries.push((y + r) * TILE + x + c, WHOLE, rows[r].0[c] as u32);
            }
        }
        whole &= !own;
    }
}

#[inline(always)]
fn load(seen: &[u32], at: usize) -> I8 {
    let s: &[u32; 8] = seen[at..at + 8].try_into().expect("eight");
    let mut out = I8::ZERO;
    for k in 0..8 {
        out.0[k] = s[k] as i32;
    }
    out
}

/// The numbers of the bits that are set.
#[inline(always)]
fn bits64(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let k = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (k < 64).then_some(k)
    })
}

/// A pixel with more than one triangle, or with an empty part: an entry for each triangle.
#[inline(always)]
fn mixed(frame: &Frame, at: usize, scratch: &mut TileScratch) {
    let seen = &scratch.seen.id;
    let ids = [seen[at], seen[PLANE + at], seen[2 * PLANE + at], seen[3 * PLANE + at]];
    let mut done = 0u8;
    let mut empty = 0;
    for s in 0..4 {
        if done >> s & 1 != 0 {
            continue;
        }
        let mut same = 0u8;
        for (t, &id) in ids.iter().enumerate() {
            same |= ((id == ids[s]) as u8) << t;
        }
        done |= same;
        if ids[s] == NONE {
            empty = same.count_ones();
        } else {
            scratch.entries.push(at, same, ids[s]);
        }
    }
    scratch.stats.samples += 4 - empty as u64;
    scratch.planes.empty(at, empty, frame.scene.background);
}

/// Shade the pixels of one triangle in a block.
#[inline(always)]
fn group(frame: &Frame, area: Area, [x, y]: [usize; 2], id: u32, own: u64, scratch: &mut TileScratch) {
    let TileScratch { planes, stats, last_draw, .. } = scratch;
    let draw = last_draw.find(frame, id);
    let mut list = [0u8; 72];
    let mut n = 0;
    for k in bits64(own) {
        list[n] = k as u8;
        n += 1;
    }
    stats.shaded += n as u64;
    let [left, top] = area.corner(frame);
    let (left, top) = (F8::splat(left + x as f32), F8::splat(top + y as f32));
    let ids = [id - draw.first_triangle; 8];
    let known = surface::corners_of(frame, draw, ids[0]);
    for i in (0..n).step_by(8) {
        let count = (n - i).min(8);
        let mut k = I8::ZERO;
        for l in 0..8 {
            k.0[l] = list[i + l] as i32;
        }
        // Lanes beyond the end repeat the block's first pixel; nobody looks at them.
        let (column, row) = (k & I8::splat(7), k.shift_right(3));
        let (px, py) = (left + column.to_f32(), top + row.to_f32());
        let rgba = Shade::<true> { frame, draw, ids: &ids, known: &known, px, py }.color();
        let place = row.shift_left(6) + column + I8::splat((y * TILE + x) as i32);
        let lanes = Lanes { place, mask: [WHOLE; 8], whole: true };
        planes.put(&lanes, count, &rgba);
    }
}

#[inline(always)]
fn shade(frame: &Frame, draw: &Draw, ids: &[u32; 8], px: F8, py: F8) -> [F8; 4] {
    Shade::<false> { frame, draw, ids, known: &[Vec4::ZERO; 3], px, py }.color()
}

/// Mean position of the samples of a mask, pixels from the centre: it lies within the triangle that covers them.
pub(super) static CENTROIDS: [[f32; 2]; 16] = {
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

/// Shade what was collected.
#[inline(always)]
fn collected(frame: &Frame, area: Area, scratch: &mut TileScratch) {
    let TileScratch { entries, planes, stats, .. } = scratch;
    entries.sort(frame);
    stats.shaded += entries.list.len() as u64;
    let mut i = 0;
    while i < entries.runs.len() {
        // Fill eight lanes from the runs of one draw.
        let (d, mut from, mut to) = entries.runs[i];
        let draw = &frame.draws[d as usize];
        let mut waiting = Batch::new();
        loop {
            while from < to {
                let n = (to - from).min(8 - waiting.n as u32);
                waiting.take(&entries.list[from as usize..(from + n) as usize]);
                from += n;
                if waiting.n == 8 {
                    waiting.shade(frame, draw, area, planes);
                }
            }
            i += 1;
            match entries.runs.get(i) {
                Some(r) if r.0 == d => (from, to) = (r.1, r.2),
                _ => break,
            }
        }
        if waiting.n > 0 {
            waiting.shade(frame, draw, area, planes);
        }
    }
}

/// Up to eight entries of one draw.
struct Batch {
    entries: [Entry; 8],
    n: usize,
}

impl Batch {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [Entry { place: 0, mask: 0, id: 0 }; 8], n: 0 }
    }

    #[inline(always)]
    fn take(&mut self, list: &[Entry]) {
        for e in list {
            self.entries[self.n & 7] = *e;
            self.n += 1;
        }
    }

    /// Shade and start over.
    #[inline(always)]
    fn shade(&mut self, frame: &Frame, draw: &Draw, area: Area, planes: &mut Planes) {
        let n = self.n;
        for k in n..8 {
            self.entries[k] = self.entries[0];
        }
        let [left, top] = area.corner(frame);
        let mut ids = [0; 8];
        let (mut px, mut py) = (F8::ZERO, F8::ZERO);
        let mut lanes = Lanes { place: I8::ZERO, mask: [0; 8], whole: true };
        for k in 0..8 {
            let e = self.entries[k];
            let c = CENTROIDS[e.mask as usize & 15];
            ids[k] = e.id - draw.first_triangle;
            lanes.place.0[k] = e.place as i32;
            lanes.mask[k] = e.mask;
            lanes.whole &= e.mask == WHOLE;
            px.0[k] = left + (e.place as usize % TILE) as f32 + c[0];
            py.0[k] = top + (e.place as usize / TILE) as f32 + c[1];
        }
        let rgba = shade(frame, draw, &ids, px, py);
        planes.put(&lanes, n, &rgba);
        self.n = 0;
    }
}

/// Remembers which draw the last triangle belonged to.
#[derive(Debug, Default)]
pub(super) struct LastDraw {
    range: std::ops::Range<u32>,
    d: usize,
}

impl LastDraw {
    #[inline(always)]
    pub fn find<'a>(&mut self, frame: &'a Frame<'a>, id: u32) -> &'a Draw<'a> {
        if !self.range.contains(&id) {
            self.d = frame.draw_of(id);
            self.range = frame.draws[self.d].ids();
        }
        &frame.draws[self.d]
    }
}

/// Shade entries of transparent triangles: colours in the same order.
#[inline(always)]
pub(super) fn shade_list(
    frame: &Frame,
    area: Area,
    list: &[super::blend::Layer],
    out: &mut Vec<[f32; 4]>,
    stats: &mut Stats,
) {
    stats.shaded += list.len() as u64;
    let mut last = LastDraw::default();
    let mut rest = list;
    while let Some(first) = rest.first() {
        let draw = last.find(frame, first.id);
        let n = rest.iter().take(8).take_while(|l| draw.ids().contains(&l.id)).count();
        let [left, top] = area.corner(frame);
        let mut ids = [0; 8];
        let (mut px, mut py) = (F8::ZERO, F8::ZERO);
        for k in 0..8 {
            let l = if k < n { rest[k] } else { *first };
            let c = CENTROIDS[l.mask as usize & 15];
            ids[k] = l.id - draw.first_triangle;
            px.0[k] = left + (l.place as usize % TILE) as f32 + c[0];
            py.0[k] = top + (l.place as usize / TILE) as f32 + c[1];
        }
        let rgba = shade(frame, draw, &ids, px, py);
        for k in 0..n {
            out.push([rgba[0].0[k], rgba[1].0[k], rgba[2].0[k], rgba[3].0[k]]);
        }
        rest = &rest[n..];
    }
}
