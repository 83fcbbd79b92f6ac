//! From visible triangles to colours, eight evaluations at a time.
//!
//! Triangles of [clay](super::clay) share their lanes; of others those with enough pixels in the tile are shaded by themselves; what is left
//! over is shaded in order of material.

use super::clay::Clay;
use super::colors::{Colors, Sink};
use super::frame::{Draw, Frame, ROTATED};
use super::scan::{self, Chain, Key, WHOLE, covers, key};
use super::setup::Bins;
use super::surface::{self, Corners, Shade};
use super::tile::TileScratch;
use super::{Stats, TILE};
use crate::math::simd::{F, F8, I};
use glam::Vec4;

/// From so many pixels on, the rest of a triangle is shaded by itself.
const GROUP: u32 = 5;

/// Batches of eight evaluations a call: the shading equation is a long chain of operations that wait for each other, so the
/// processor works at two batches at once where it finds them in one loop.
pub(super) const BATCHES: usize = 8;

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

/// Light of as many batches, a plane a channel.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct Shades([[f32; 8 * BATCHES]; 4]);

impl Default for Shades {
    fn default() -> Self {
        Self([[0.0; 8 * BATCHES]; 4])
    }
}

impl Shades {
    /// Eight of them.
    #[inline(always)]
    pub fn batch(&self, i: usize) -> [F8; 4] {
        let c = &self.0;
        [
            F8::load(&c[0][8 * i..]),
            F8::load(&c[1][8 * i..]),
            F8::load(&c[2][8 * i..]),
            F8::load(&c[3][8 * i..]),
        ]
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, rgba: &[F8; 4]) {
        for c in 0..4 {
            rgba[c].store(&mut self.0[c][8 * i..]);
        }
    }
}

/// Colour everything that is visible in a tile.
#[inline(always)]
pub(super) fn resolve(
    frame: &Frame,
    bins: &[Bins],
    tile: usize,
    area: Area,
    sink: Sink,
    scratch: &mut TileScratch,
) {
    scratch.colors.start(sink, frame.samples, frame.scene.background);
    // What was found for another scene means nothing here.
    scratch.last_draw = LastDraw::default();
    scan::look(frame, bins, tile, area, scratch);
    let mut k = 0;
    while k < scratch.entries.chains.len() {
        k = chain(frame, area, k, scratch);
    }
    loose(frame, area, scratch);
    scratch.colors.finish();
}

/// Shade the pixels of one triangle, or of those of clay of one draw that follow each other; leave a few to be shaded with those of
/// others. The next chain.
#[inline(always)]
fn chain(frame: &Frame, area: Area, k: usize, scratch: &mut TileScratch) -> usize {
    let TileScratch { colors, stats, last_draw, entries, shades, points, .. } = scratch;
    let chain = entries.chains[k];
    let draw = last_draw.find(frame, chain.id);
    let corner = area.corner(frame);
    if draw.clay {
        let ours = |c: &&Chain| draw.ids().contains(&c.id);
        let n = entries.chains[k..].iter().take_while(ours).count();
        let (chains, keys) = (&entries.chains[k..k + n], &mut entries.keys[..]);
        stats.shaded += chains.iter().map(|c| c.count as u64).sum::<u64>();
        Clay { frame, draw, chains, keys, corner, points, colors }.shade();
        return k + n;
    }
    let ids = [[chain.id - draw.first_triangle; 8]];
    let known = surface::corners_of(frame, draw, ids[0][0]);
    let mut done = 0;
    while chain.count - done >= GROUP {
        let at = (chain.first + done) as usize;
        let left = (chain.count - done) as usize;
        let n = left.min(8 * BATCHES);
        let n = if n % 8 >= GROUP as usize { n } else { n & !7 };
        // There is room beyond the chain's end for lanes that repeat the first.
        let keys = &mut entries.keys[at..at + n.next_multiple_of(8)];
        for k in left..keys.len() {
            keys[k] = keys[0];
        }
        done += n as u32;
        let keys = keys.as_chunks::<8>().0;
        Shade::<true> { frame, draw, ids: &ids, known: &known, found: &mut [], keys, corner, out: shades }
            .colors();
        for (i, keys) in keys.iter().enumerate() {
            colors.put(&I(*keys), (n - 8 * i).min(8), &shades.batch(i));
        }
    }
    stats.shaded += done as u64;
    entries.loosen(chain, done);
    k + 1
}

/// Where evaluations are made, from the picture's centre; `corner` is the tile's first pixel.
#[inline(always)]
pub(super) fn points<const N: usize>(corner: [f32; 2], keys: &I<N>) -> [F<N>; 2] {
    let px = (*keys & I::splat(TILE as i32 - 1)).to_f32() + corner[0];
    let py = (keys.shift_right(6) & I::splat(TILE as i32 - 1)).to_f32() + corner[1];
    if keys.shift_right(12).equal(I::splat(WHOLE as i32)).all() {
        return [px, py];
    }
    let (mut cx, mut cy) = (F::ZERO, F::ZERO);
    for k in 0..N {
        [cx.0[k], cy.0[k]] = CENTROIDS[covers(keys.0[k]) as usize];
    }
    [px + cx, py + cy]
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

/// Shade what is in no chain, in order of the draws.
#[inline(always)]
fn loose(frame: &Frame, area: Area, scratch: &mut TileScratch) {
    let TileScratch { entries, colors, stats, runs, .. } = scratch;
    let (keys, ids) = (&entries.loose, &entries.loose_ids);
    stats.shaded += ids.len() as u64;
    find_runs(frame, ids, runs);
    let mut waiting = Waiting::new();
    let mut i = 0;
    while i < runs.len() {
        // Fill the lanes from the runs of one draw.
        let (d, mut from, mut to) = runs[i];
        let draw = &frame.draws[d as usize];
        loop {
            while from < to {
                if waiting.n.is_multiple_of(8) && to - from >= 8 {
                    waiting.take(&keys[from as usize..], &ids[from as usize..]);
                    from += 8;
                } else {
                    waiting.push(keys[from as usize], ids[from as usize]);
                    from += 1;
                }
                if waiting.n == 8 * BATCHES {
                    waiting.shade(frame, draw, area, colors);
                }
            }
            i += 1;
            match runs.get(i) {
                Some(r) if r.0 == d => (from, to) = (r.1, r.2),
                _ => break,
            }
        }
        if waiting.n > 0 {
            waiting.shade(frame, draw, area, colors);
        }
    }
}

/// Evaluations of one draw.
struct Waiting {
    keys: [[Key; 8]; BATCHES],
    ids: [[u32; 8]; BATCHES],
    found: [Corners; BATCHES],
    rgba: Shades,
    n: usize,
}

impl Waiting {
    #[inline(always)]
    fn new() -> Self {
        let (found, rgba) = ([Corners::NONE; BATCHES], Shades::default());
        Self { keys: [[0; 8]; BATCHES], ids: [[0; 8]; BATCHES], found, rgba, n: 0 }
    }

    #[inline(always)]
    fn push(&mut self, key: Key, id: u32) {
        let (batch, lane) = (self.n / 8 % BATCHES, self.n % 8);
        (self.keys[batch][lane], self.ids[batch][lane]) = (key, id);
        self.n += 1;
    }

    /// Eight at once.
    #[inline(always)]
    fn take(&mut self, keys: &[Key], ids: &[u32]) {
        let batch = self.n / 8 % BATCHES;
        self.keys[batch] = keys[..8].try_into().expect("eight");
        self.ids[batch] = ids[..8].try_into().expect("eight");
        self.n += 8;
    }

    /// Shade and start over.
    #[inline(always)]
    fn shade(&mut self, frame: &Frame, draw: &Draw, area: Area, colors: &mut Colors) {
        let batches = self.colors(frame, draw, area);
        for i in 0..batches {
            colors.put(&I(self.keys[i]), (self.n - 8 * i).min(8), &self.rgba.batch(i));
        }
        self.n = 0;
    }

    /// Find their colours; lanes beyond the last repeat the first of their batch. The number of batches.
    #[inline(always)]
    fn colors(&mut self, frame: &Frame, draw: &Draw, area: Area) -> usize {
        let batches = self.n.div_ceil(8).min(BATCHES);
        for k in self.n..8 * batches {
            let (batch, lane) = (k / 8, k % 8);
            self.keys[batch][lane] = self.keys[batch][0];
            self.ids[batch][lane] = self.ids[batch][0];
        }
        for ids in &mut self.ids[..batches] {
            for id in ids {
                *id -= draw.first_triangle;
            }
        }
        let (keys, ids, out) = (&self.keys[..batches], &self.ids[..batches], &mut self.rgba);
        let (known, corner, found) = (&[Vec4::ZERO; 3], area.corner(frame), &mut self.found[..batches]);
        Shade::<false> { frame, draw, ids, known, found, keys, corner, out }.colors();
        batches
    }
}

/// Find the runs of one draw, and order them by draw, so that lanes share a material: draw, first entry, end.
fn find_runs(frame: &Frame, ids: &[u32], runs: &mut Vec<(u32, u32, u32)>) {
    runs.clear();
    let mut range = 0..0;
    for (i, id) in ids.iter().enumerate() {
        if !range.contains(id) {
            let d = frame.draw_of(*id);
            range = frame.draws[d].ids();
            runs.push((d as u32, i as u32, 0));
        }
        runs.last_mut().expect("pushed").2 = i as u32 + 1;
    }
    runs.sort_by_key(|r| r.0);
}

/// Remembers which draw the last triangle belonged to: along an edge it is asked for every pixel.
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
        let n = rest.iter().take(8 * BATCHES).take_while(|l| draw.ids().contains(&l.id)).count();
        let mut waiting = Waiting::new();
        rest[..n].iter().for_each(|l| waiting.push(key(l.place as usize, l.mask as u32), l.id));
        waiting.colors(frame, draw, area);
        for k in 0..n {
            let c = &waiting.rgba.0;
            out.push([c[0][k], c[1][k], c[2][k], c[3][k]]);
        }
        rest = &rest[n..];
    }
}
