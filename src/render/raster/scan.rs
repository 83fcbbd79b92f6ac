//! What has to be shaded in a tile: pixels by triangle.
//!
//! Pixels of one triangle are listed together for the whole tile, so that lanes read its corners once and are nearly always full; what
//! small triangles became is shaded as it comes. At four samples, pixels that show more than one triangle are seen to first: where one
//! of them stands for all, the pixel becomes its own.

use super::TILE;
use super::fill::{NONE, Won};
use super::frame::Frame;
use super::mend;
use super::resolve::Area;
use super::setup::Bins;
use super::tile::TileScratch;
use crate::math::simd::I8;

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
}

/// A part of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    id: u32,
    key: Key,
    /// Whether it is in a chain.
    listed: bool,
}

/// Places beyond the end of a chain: as many as the widest kernel has lanes.
pub(super) const ROOM: usize = 16;

/// Working memory.
#[derive(Debug, Default)]
pub(super) struct Entries {
    pub chains: Vec<Chain>,
    /// Evaluations by chain, each followed by [`ROOM`].
    pub keys: Vec<Key>,
    /// By triangle.
    parts: Vec<Part>,
    /// Of these the first that belongs to the triangle that was looked for last, or to one after it.
    next_part: usize,
    /// What is in no chain: keys and triangles.
    pub loose: Vec<Key>,
    pub loose_ids: Vec<u32>,
}

impl Entries {
    fn start(&mut self) {
        self.chains.clear();
        self.parts.clear();
        self.next_part = 0;
        self.loose.clear();
        self.loose_ids.clear();
    }

    /// A part of a pixel, that a triangle's chain takes in.
    #[inline(always)]
    pub fn push_part(&mut self, key: Key, id: u32) {
        self.parts.push(Part { id, key, listed: false });
    }

    #[inline(always)]
    fn push_loose(&mut self, key: Key, id: u32) {
        self.loose.push(key);
        self.loose_ids.push(id);
    }

    /// Evaluations `from..` of a chain are shaded with those of others.
    #[inline(always)]
    pub fn loosen(&mut self, chain: Chain, from: u32) {
        for k in from..chain.count {
            self.push_loose(self.keys[(chain.first + k) as usize], chain.id);
        }
    }

    /// List the pixels of a tile that show a triangle among those where it won, and its parts of others; the number of whole ones.
    #[inline(always)]
    fn find<const SAMPLES: usize, const LANES: usize>(
        &mut self,
        ids: &[u32; 4 * TILE * TILE],
        live: &[u64; TILE / 8],
        won: &Won,
    ) -> usize {
        let Won { id, places, .. } = *won;
        let last = self.chains.last().copied();
        let first = last.map_or(0, |c| c.first + c.count + ROOM as u32);
        let most = first as usize + 8 * places.len() + self.parts.len() + ROOM;
        if self.keys.len() < most {
            self.keys.resize(2 * most, 0);
        }
        let (keys, mut n) = (&mut self.keys[first as usize..most], 0);
        let shows = |at: usize| load(&ids[at..]).equal(I8::splat(id as i32)).bitmask();
        for &at in places {
            let at = (at as usize).min(SAMPLES * TILE * TILE - LANES);
            let mut mask = shows(at);
            if SAMPLES == 4 {
                mask |= if LANES == 16 { shows(at + 8) << 8 } else { 0 };
                let whole = mask & mask >> 1;
                let whole = whole & whole >> 2;
                // Every fourth bit, side by side.
                mask = ((whole & 0x1111) * 0x1248) >> 12 & 0xf;
            }
            let place = at / SAMPLES;
            // What lies side by side may reach beyond the picture, and into a block that holds what was seen in another one.
            mask &= (live[place / (8 * TILE)] >> (place % TILE)) as u32;
            // What is written beyond those that are there is overwritten by the next.
            let run = I8::splat(key(place, WHOLE)) + bits(mask);
            keys[n..n + 8].copy_from_slice(&run.0);
            n += mask.count_ones() as usize;
        }
        let mut whole = n;
        if !self.parts.is_empty() {
            // Most triangles come in the order of their numbers.
            if self.next_part > 0 && self.parts[self.next_part - 1].id >= id {
                self.next_part = self.parts.partition_point(|p| p.id < id);
            }
            self.next_part += self.parts[self.next_part..].iter().take_while(|p| p.id < id).count();
            for part in self.parts[self.next_part..].iter_mut().take_while(|p| p.id == id && !p.listed) {
                (keys[n], part.listed) = (part.key, true);
                n += 1;
            }
        }
        if n > 0 {
            self.chains.push(Chain { id, count: n as u32, first });
            // Parts of one clipped triangle follow each other, and where they meet both have won.
            if let Some(before) = last.filter(|before| before.id == id) {
                whole -= self.join(before);
            }
        }
        whole
    }

    /// Make one of the last two chains, of which the first is known; how many were in both.
    #[inline(never)]
    fn join(&mut self, before: Chain) -> usize {
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
        all - count
    }
}

/// Find what has to be shaded in a tile.
#[inline(always)]
pub(super) fn look(frame: &Frame, bins: &[Bins], tile: usize, area: Area, scratch: &mut TileScratch) {
    scratch.entries.start();
    match frame.samples {
        1 => list::<1>(bins, tile, area, scratch),
        _ => {
            mend::mend(frame, area, scratch);
            list::<4>(bins, tile, area, scratch);
        }
    }
}

#[inline(always)]
fn list<const SAMPLES: usize>(bins: &[Bins], tile: usize, area: Area, scratch: &mut TileScratch) {
    let TileScratch { entries, seen, stats, .. } = scratch;
    entries.parts.sort_unstable();
    let ids: &mut [u32; 4 * TILE * TILE] = (&mut seen.id[..4 * TILE * TILE]).try_into().expect("a tile");
    let live = live(seen.touched, area.w);
    for won in seen.places.iter() {
        let whole = match won.lanes {
            16 => entries.find::<SAMPLES, 16>(ids, &live, &won),
            _ => entries.find::<SAMPLES, 8>(ids, &live, &won),
        };
        stats.samples += (SAMPLES * whole) as u64;
    }
    for k in 0..entries.parts.len() {
        let part = entries.parts[k];
        if !part.listed {
            entries.push_loose(part.key, part.id);
        }
    }
    for f in bins.iter().flat_map(|b| &b.tiles[tile].fragments) {
        let place = f.place as usize / SAMPLES;
        let pixel = &mut ids[SAMPLES * place..][..SAMPLES];
        if pixel.iter().all(|&id| id == f.id) {
            // Its other samples do not list it again.
            pixel[0] = NONE;
            entries.push_loose(key(place, WHOLE), f.id);
            stats.samples += SAMPLES as u64;
        }
    }
}

/// For each row of blocks, which columns of a tile `w` wide lie in blocks that are in use: a bit each.
fn live(touched: u64, w: usize) -> [u64; TILE / 8] {
    let columns = u64::MAX >> (TILE - w.clamp(1, TILE));
    std::array::from_fn(|row| {
        let blocks = touched >> (8 * row);
        (0..8).filter(|b| blocks >> b & 1 != 0).fold(0, |all, b| all | 0xff << (8 * b)) & columns
    })
}

/// The numbers of the bits that are set among the lowest eight, side by side.
#[inline(always)]
pub(super) fn bits(mask: u32) -> I8 {
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
