//! What has to be shaded in a tile: pixels by triangle.
//!
//! Pixels of one triangle are listed together for the whole tile, so that eight lanes read its corners once and are nearly
//! always full; pixels of blocks with a triangle or more for every second pixel are not worth it and are shaded as they come.

use super::TILE;
use super::fill::NONE;
use super::frame::Frame;
use super::merge;
use super::resolve::Area;
use super::setup::Bins;
use super::tile::TileScratch;
use crate::math::simd::{I, I8};

/// All samples of a pixel.
pub(super) const WHOLE: u32 = 0xf;

/// An evaluation of the shading equation: row in the tile · 64 + column, and from bit 12 on the samples that take the colour.
pub(super) type Key = i32;

#[inline(always)]
pub(super) fn key(place: usize, covers: u32) -> Key {
    (place as u32 | covers << 12) as Key
}

#[inline(always)]
pub(super) fn place(key: Key) -> usize {
    key as usize % (TILE * TILE)
}

#[inline(always)]
pub(super) fn covers(key: Key) -> u32 {
    key as u32 >> 12 & WHOLE
}

/// Whether they take all samples.
#[inline(always)]
pub(super) fn are_whole(keys: &[Key]) -> bool {
    keys.iter().fold(-1, |all, key| all & *key) as u32 >> 12 & WHOLE == WHOLE
}

/// Evaluations of one triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    pub id: u32,
    pub count: u32,
    /// Where they start in `keys`.
    pub first: u32,
    slot: u32,
}

/// Pixels side by side.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    /// Triangle at first, then its chain.
    of: u32,
    key: Key,
    length: u32,
}

/// Places beyond the end of a chain: as many as the widest kernel has lanes.
pub(super) const ROOM: usize = 16;

/// Slots of the table: more than chains can be in a tile.
const SLOTS: usize = 1 << 14;

/// A block with more runs of equal pixels than this is not sorted.
const DENSE: usize = 40;

/// Working memory.
#[derive(Debug, Default)]
pub(super) struct Entries {
    pub chains: Vec<Chain>,
    /// Evaluations by chain, each followed by [`ROOM`].
    pub keys: Vec<Key>,
    runs: Vec<Run>,
    /// Parts of pixels of the block at hand.
    shared: Vec<Run>,
    /// Chain of each triangle plus one, by a hash of the triangle.
    table: Vec<u16>,
    /// What is in no chain, in order of the pixels: keys and triangles.
    pub loose: Vec<Key>,
    pub loose_ids: Vec<u32>,
}

impl Entries {
    fn start(&mut self) {
        self.table.resize(SLOTS, 0);
        for c in self.chains.drain(..) {
            self.table[c.slot as usize] = 0;
        }
        self.runs.clear();
        self.loose.clear();
        self.loose_ids.clear();
    }

    /// The chain of a triangle.
    #[inline(always)]
    fn chain(&mut self, id: u32) -> usize {
        let table: &mut [u16; SLOTS] = (&mut self.table[..SLOTS]).try_into().expect("its size");
        let mut slot = (id.wrapping_mul(0x9e37_79b1) >> 18) as usize;
        loop {
            match table[slot % SLOTS] {
                0 => {
                    self.chains.push(Chain { id, count: 0, first: 0, slot: slot as u32 });
                    table[slot % SLOTS] = self.chains.len() as u16;
                    return self.chains.len() - 1;
                }
                k if self.chains[k as usize - 1].id == id => return k as usize - 1,
                _ => slot = (slot + 1) % SLOTS,
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, run: Run, dense: bool) {
        if !dense {
            let of = self.chain(run.of);
            self.chains[of].count += run.length;
            self.runs.push(Run { of: of as u32, ..run });
            return;
        }
        for i in 0..run.length {
            self.loose.push(run.key + i as Key);
            self.loose_ids.push(run.of);
        }
    }

    /// Evaluations `from..` of a chain are shaded with those of others.
    #[inline(always)]
    pub fn loosen(&mut self, chain: Chain, from: u32) {
        for k in from..chain.count {
            self.loose.push(self.keys[(chain.first + k) as usize]);
            self.loose_ids.push(chain.id);
        }
    }

    /// List the pixels of a tile, `w` wide, that show a triangle among those where it won; their number.
    #[inline(always)]
    fn find(&mut self, ids: &[u32; TILE * TILE], w: usize, id: u32, places: &[u16]) -> u32 {
        let last = self.chains.last().copied();
        let first = last.map_or(0, |c| c.first + c.count + ROOM as u32);
        let most = first as usize + 8 * places.len() + ROOM;
        if self.keys.len() < most {
            self.keys.resize(2 * most, 0);
        }
        let (keys, mut n, cut) = (&mut self.keys[first as usize..most], 0, w < TILE);
        for &place in places {
            let place = (place as usize).min(TILE * TILE - 8);
            let mut mask = load(&ids[place..]).equal(I8::splat(id as i32)).bitmask();
            if cut && place % TILE + 8 > w {
                // Eight side by side may reach beyond the picture.
                mask &= (1 << (w - place % TILE)) - 1;
            }
            // What is written beyond those that are there is overwritten by the next.
            let run = I8::splat(key(place, WHOLE)) + bits(mask);
            keys[n..n + 8].copy_from_slice(&run.0);
            n += mask.count_ones() as usize;
        }
        if n > 0 {
            self.chains.push(Chain { id, count: n as u32, first, slot: 0 });
        }
        // Parts of one clipped triangle follow each other, and where they meet both have won.
        match last {
            Some(before) if before.id == id && n > 0 => self.join(before),
            _ => n as u32,
        }
    }

    /// Make one of the last two chains, of which the first is known; by how much it grew.
    #[inline(never)]
    fn join(&mut self, before: Chain) -> u32 {
        let after = self.chains.pop().expect("it was pushed");
        let end = after.first as usize + after.count as usize;
        self.keys.copy_within(after.first as usize..end, (before.first + before.count) as usize);
        let all = (before.count + after.count) as usize;
        let keys = &mut self.keys[before.first as usize..][..all];
        keys.sort_unstable();
        let mut count = 0;
        for k in 0..all {
            if k == 0 || keys[k] != keys[k - 1] {
                keys[count] = keys[k];
                count += 1;
            }
        }
        self.chains.last_mut().expect("the one before").count = count as u32;
        count as u32 - before.count
    }

    /// Lay out the runs by chain.
    #[inline(always)]
    fn sort(&mut self) {
        let mut end = 0;
        for c in &mut self.chains {
            c.first = end;
            end += c.count + ROOM as u32;
            c.count = 0;
        }
        self.keys.resize(self.keys.len().max(end as usize), 0);
        for run in &self.runs {
            let c = &mut self.chains[run.of as usize];
            let at = (c.first + c.count) as usize;
            c.count += run.length;
            // A run is at most a block wide, and what is written beyond its end is overwritten by the next.
            let keys = I8::splat(run.key) + I8::IOTA;
            let out: &mut [i32; 8] = (&mut self.keys[at..at + 8]).try_into().expect("eight");
            *out = keys.0;
        }
    }
}

/// Find what has to be shaded in a tile at one sample a pixel: every triangle is looked for where it has won.
#[inline(always)]
pub(super) fn look(bins: &[Bins], tile: usize, area: Area, scratch: &mut TileScratch) {
    let TileScratch { entries, seen, stats, .. } = scratch;
    entries.start();
    let ids = seen.id[..TILE * TILE].try_into().expect("a tile");
    for (id, places) in seen.places.iter() {
        stats.samples += entries.find(ids, area.w, id, places) as u64;
    }
    for bins in bins {
        for f in &bins.tiles[tile].fragments {
            if seen.id[f.place as usize] == f.id {
                entries.loose.push(key(f.place as usize, WHOLE));
                entries.loose_ids.push(f.id);
                stats.samples += 1;
            }
        }
    }
}

/// The same at four samples.
#[inline(always)]
pub(super) fn scan(frame: &Frame, area: Area, scratch: &mut TileScratch) {
    scratch.entries.start();
    let mut left = scratch.seen.touched;
    while left != 0 {
        let b = left.trailing_zeros() as usize;
        left &= left - 1;
        let [x, y] = [b % 8 * 8, b / 8 * 8];
        if x < area.w && y < area.h {
            block(frame, area, [x, y], scratch);
        }
    }
    scratch.entries.sort();
}

/// One 8×8 block.
#[inline(always)]
fn block(frame: &Frame, area: Area, [x, y]: [usize; 2], scratch: &mut TileScratch) {
    let mut runs = [Run::default(); 64];
    let mut n = 0;
    scratch.entries.shared.clear();
    let columns = (1u32 << (area.w - x).min(8)) - 1;
    let mut whole = 0;
    for r in 0..8.min(area.h - y) {
        let first = (y + r) * TILE + x;
        let (mut row, torn) = pixels(&scratch.seen.id[4 * first..]);
        let mut torn = torn & columns;
        while torn != 0 {
            let k = torn.trailing_zeros() as usize & 7;
            torn &= torn - 1;
            row.0[k] = pixel(frame, first + k, scratch) as i32;
        }

        // A run starts where something is that differs from what lies left of it.
        let mut shifted = I([NONE as i32; 8]);
        shifted.0[1..].copy_from_slice(&row.0[..7]);
        let same = row.equal(shifted).bitmask();
        let there = !row.equal(I([NONE as i32; 8])).bitmask() & columns;
        whole += there.count_ones();
        let mut starts = there & !same;
        while starts != 0 {
            let k = starts.trailing_zeros();
            starts &= starts - 1;
            let length = (!(there & same) >> (k + 1)).trailing_zeros() + 1;
            let key = key(first + k as usize, WHOLE);
            runs[n & 63] = Run { of: row.0[k as usize & 7] as u32, key, length };
            n += 1;
        }
    }
    let dense = n + scratch.entries.shared.len() > DENSE;
    for run in &runs[..n] {
        scratch.entries.push(*run, dense);
    }
    for k in 0..scratch.entries.shared.len() {
        scratch.entries.push(scratch.entries.shared[k], dense);
    }
    scratch.stats.samples += 4 * whole as u64;
}

/// The numbers of the bits that are set among the lowest eight, side by side.
#[inline(always)]
fn bits(mask: u32) -> I8 {
    static BITS: [[u8; 8]; 256] = {
        let (mut table, mut mask) = ([[0; 8]; 256], 0);
        while mask < 256 {
            let (mut bit, mut n) = (0, 0);
            while bit < 8 {
                if mask >> bit & 1 != 0 {
                    table[mask][n] = bit as u8;
                    n += 1;
                }
                bit += 1;
            }
            mask += 1;
        }
        table
    };
    let mut numbers = I8::ZERO;
    for (number, &bit) in numbers.0.iter_mut().zip(&BITS[mask as usize & 255]) {
        *number = i32::from(bit);
    }
    numbers
}

#[inline(always)]
fn load(ids: &[u32]) -> I8 {
    let ids: &[u32; 8] = ids[..8].try_into().expect("eight");
    let mut row = I8::ZERO;
    for k in 0..8 {
        row.0[k] = ids[k] as i32;
    }
    row
}

/// What eight pixels of four samples show, and a bit for each pixel whose samples differ: these show nothing.
#[inline(always)]
fn pixels(ids: &[u32]) -> (I8, u32) {
    let ids: &[[u32; 4]; 8] = ids[..32].as_chunks::<4>().0.try_into().expect("eight pixels");
    let mut by_sample = [I8::ZERO; 4];
    for s in 0..4 {
        for k in 0..8 {
            by_sample[s].0[k] = ids[k][s] as i32;
        }
    }
    let [a, b, c, d] = by_sample;
    let same = a.equal(b) & a.equal(c) & a.equal(d);
    (same.select_int(a, I8::splat(NONE as i32)), !same.bitmask() & 0xff)
}

/// A pixel with more than one triangle, or with an empty part: the triangle if one stands for all, else nothing, and what is to
/// be shaded is in `shared`.
#[inline(always)]
fn pixel(frame: &Frame, place: usize, scratch: &mut TileScratch) -> u32 {
    let ids: &[u32; 4] = scratch.seen.id[4 * place..][..4].try_into().expect("four");
    let z: &[f32; 4] = scratch.seen.z[4 * place..][..4].try_into().expect("four");
    let (groups, n) = merge::groups(frame, ids, z, &mut scratch.last_draw);
    if groups[0].covers == WHOLE {
        return groups[0].id;
    }
    let mut covered = 0;
    for g in &groups[..n] {
        covered |= g.covers;
        scratch.entries.shared.push(Run { of: g.id, key: key(place, g.covers), length: 1 });
    }
    let count = covered.count_ones();
    scratch.stats.samples += count as u64;
    scratch.colors.share(place, 4 - count, frame.scene.background);
    NONE
}
