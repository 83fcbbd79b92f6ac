//! A triangle into a tile's visibility buffer.
//!
//! The samples of a pixel lie side by side, so that eight lanes are eight pixels of one sample or two pixels of four: small
//! triangles then fill their lanes at four samples as well as at one. Machines with sixteen lanes see twice as many at a time.

use super::TILE;
use super::frame::{Frame, ROTATED};
use super::setup::{Bounds, Fragment, Setup};
use crate::math::simd::{F, I};

/// Nothing is seen here.
pub(super) const NONE: u32 = u32::MAX;

/// What is seen at each sample of a tile: `(row · 64 + column) · samples + sample`.
///
/// Only 8×8 blocks that something touches are cleared; what the others hold is old.
#[derive(Debug, Default)]
pub(super) struct Visibility {
    pub z: Vec<f32>,
    pub id: Vec<u32>,
    /// A bit for each 8×8 block that was cleared: row of blocks · 8 + column.
    pub touched: u64,
    samples: usize,
    pub places: Places,
}

/// Where triangles won: what is seen of them is seen there.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// The first of samples side by side.
    at: Vec<u16>,
    /// Triangles in the order in which they were drawn.
    of: Vec<Of>,
}

#[derive(Clone, Copy, Debug)]
struct Of {
    id: u32,
    /// Where its places end.
    end: u32,
    /// How many samples each is of.
    lanes: u32,
}

/// Where one of them won.
pub(super) struct Won<'a> {
    pub id: u32,
    pub places: &'a [u16],
    pub lanes: usize,
}

/// Places that one triangle can have in a tile.
const MOST: usize = 4 * TILE * TILE / 8;

/// From so many on, places where nothing is seen any more are dropped: one a sample is left at most.
const MANY: usize = 1 << 15;

impl Places {
    /// Where triangles may be seen.
    pub fn iter(&self) -> impl Iterator<Item = Won<'_>> {
        let mut start = 0;
        self.of.iter().map(move |of| {
            let places = &self.at[start..of.end as usize];
            start = of.end as usize;
            Won { id: of.id, places, lanes: of.lanes as usize }
        })
    }

    fn end(&self) -> usize {
        self.of.last().map_or(0, |l| l.end as usize)
    }

    /// Room for a triangle's places, and where it starts.
    #[inline(always)]
    fn room(&mut self, seen: &[u32]) -> (usize, &mut [u16]) {
        let mut start = self.end();
        if start + MOST > self.at.len() {
            start = self.make_room(seen);
        }
        (start, &mut self.at[start..start + MOST])
    }

    #[inline(never)]
    fn make_room(&mut self, seen: &[u32]) -> usize {
        if self.at.len() >= MANY {
            let (mut from, mut to) = (0, 0);
            for of in &mut self.of {
                for k in from..of.end as usize {
                    let at = self.at[k];
                    if seen[at as usize..][..of.lanes as usize].contains(&of.id) {
                        self.at[to] = at;
                        to += 1;
                    }
                }
                (from, of.end) = (of.end as usize, to as u32);
            }
        }
        let end = self.end();
        self.at.resize(self.at.len().max(end + MANY), 0);
        end
    }
}

impl Visibility {
    pub fn start(&mut self, samples: usize) {
        (self.samples, self.touched) = (samples, 0);
        self.places.of.clear();
        self.z.resize(4 * TILE * TILE, 0.0);
        self.id.resize(4 * TILE * TILE, NONE);
    }

    /// Triangle and depth at a sample of a pixel; [`NONE`] where nothing is.
    pub fn look(&self, place: usize, sample: usize) -> (u32, f32) {
        let block = place / TILE / 8 * 8 + place % TILE / 8;
        if self.touched >> block & 1 == 0 {
            return (NONE, f32::NEG_INFINITY);
        }
        let at = place * self.samples + sample;
        (self.id[at], self.z[at])
    }

    /// Clear the blocks that hold the pixels of a rectangle, ends included, unless they are clear or in use.
    #[inline(always)]
    pub fn touch(&mut self, x: [i32; 2], y: [i32; 2]) {
        let columns = (0xff << (x[0] >> 3)) & (0xff >> (7 - (x[1] >> 3)));
        let mut new = 0u64;
        for row in y[0] >> 3..=y[1] >> 3 {
            new |= columns << (8 * row);
        }
        new &= !self.touched;
        if new != 0 {
            self.clear(new);
        }
    }

    /// Samples of small triangles: nearer wins, at equal depth the triangle that was submitted first.
    #[inline(always)]
    pub fn put(&mut self, fragments: &[Fragment]) {
        let shift = self.samples.trailing_zeros();
        let mut blocks = 0;
        for f in fragments {
            let place = f.place >> shift;
            blocks |= 1u64 << (place >> 6 & 0x38 | place >> 3 & 7);
        }
        self.clear(blocks & !self.touched);
        for f in fragments {
            let at = f.place as usize;
            let (z, id) = (&mut self.z[at], &mut self.id[at]);
            if f.z > *z || (f.z == *z && f.id < *id) {
                (*z, *id) = (f.z, f.id);
            }
        }
    }

    #[inline(always)]
    fn clear(&mut self, blocks: u64) {
        self.touched |= blocks;
        let (z, id) = (self.z.as_chunks_mut::<8>().0, self.id.as_chunks_mut::<8>().0);
        let mut left = blocks;
        while left != 0 {
            let b = left.trailing_zeros() as usize;
            left &= left - 1;
            for row in 0..8 {
                let first = (b / 8 * TILE + row * TILE / 8 + b % 8) * self.samples;
                for at in first..first + self.samples {
                    (z[at], id[at]) = ([f32::NEG_INFINITY; 8], [NONE; 8]);
                }
            }
        }
    }
}

/// The part of a triangle within a tile, ready to be walked.
pub(super) struct Walk<const N: usize> {
    /// Pixels in the tile, first and last.
    pub x: [i32; 2],
    pub y: [i32; 2],
    /// Edge functions at the lanes that start at the tile's first pixel, in units of 256.
    e: [I<N>; 3],
    /// Their steps along x and y, a pixel each.
    step_x: [i32; 3],
    step_y: [i32; 3],
    /// Depth at the same lanes, and its steps.
    z: F<N>,
    z_x: f32,
    z_y: f32,
    /// At the first pixel's centre.
    z_center: f32,
    z_lo: f32,
    z_hi: f32,
    pub id: u32,
}

/// Up to here from the tile's middle, edges are set up within 32 bits: with differences of 2¹⁵ and less than 25,500 from a
/// corner to a sample, the two products differ by less than 1.7e9.
const NEAR: u32 = 1 << 14;

impl<const N: usize> Walk<N> {
    /// `None` where the triangle and the tile's samples do not meet.
    #[inline(always)]
    pub fn new(frame: &Frame, s: &Setup, tile: [i32; 2]) -> Option<Self> {
        let size = TILE as i32;
        let Bounds { x, y } = Bounds::of(frame, s.x, s.y).within(tile);
        if x[0] > x[1] || y[0] > y[1] {
            return None;
        }
        let mut walk = Self {
            x,
            y,
            e: [I::ZERO; 3],
            step_x: [0; 3],
            step_y: [0; 3],
            z: F::ZERO,
            z_x: 0.0,
            z_y: 0.0,
            z_center: 0.0,
            z_lo: s.z[0].min(s.z[1]).min(s.z[2]),
            z_hi: s.z[0].max(s.z[1]).max(s.z[2]),
            id: s.id,
        };
        let far = |v: [i32; 3], o: i32| v.iter().any(|v| (v - 256 * (o + size / 2)).unsigned_abs() > NEAR);
        if far(s.x, tile[0]) || far(s.y, tile[1]) {
            for k in 0..3 {
                if !walk.edge(frame, s, tile, k) {
                    return None;
                }
            }
        } else {
            walk.short_edges(frame, s, tile);
        }
        walk.depth(frame, s, tile);
        Some(walk)
    }

    /// Set up the edges of a triangle that lies near the tile.
    #[inline(always)]
    fn short_edges(&mut self, frame: &Frame, s: &Setup, tile: [i32; 2]) {
        let [ox, oy] = lane_offsets(frame.samples);
        for k in 0..3 {
            let (a, b) = ([1, 2, 0][k], [2, 0, 1][k]);
            let (dx, dy) = (s.x[b] - s.x[a], s.y[b] - s.y[a]);
            let bias = if dy < 0 || (dy == 0 && dx > 0) { 0 } else { -1 };
            (self.step_x[k], self.step_y[k]) = (-dy, dx);
            let px = I::splat(tile[0] * 256 + 128 - s.x[a]) + ox;
            let py = I::splat(tile[1] * 256 + 128 - s.y[a]) + oy;
            self.e[k] = (I::splat(dx) * py - I::splat(dy) * px + I::splat(bias)).shift_right(8);
        }
    }

    /// Set up edge `k`; false if the whole bounds lie beyond it.
    #[inline(never)]
    fn edge(&mut self, frame: &Frame, s: &Setup, tile: [i32; 2], k: usize) -> bool {
        let (a, b) = ([1, 2, 0][k], [2, 0, 1][k]);
        let (dx, dy) = (s.x[b] - s.x[a], s.y[b] - s.y[a]);
        let bias = if dy < 0 || (dy == 0 && dx > 0) { 0 } else { -1 };
        (self.step_x[k], self.step_y[k]) = (-dy, dx);
        let mut best = i64::MIN;
        let mut clamped = [0; 4];
        for n in 0..frame.samples {
            let o = sample_offset(frame.samples, n);
            let px = (tile[0] * 256 + 128 + o[0] - s.x[a]) as i64;
            let py = (tile[1] * 256 + 128 + o[1] - s.y[a]) as i64;
            let e = (dx as i64 * py - dy as i64 * px + bias) >> 8;

            // The corner of the bounds that lies furthest inside.
            let (cx, cy) = (self.x[(-dy > 0) as usize], self.y[(dx > 0) as usize]);
            best = best.max(e + -dy as i64 * cx as i64 + dx as i64 * cy as i64);

            // Beyond ±2³⁰ the sign holds all over the tile.
            clamped[n] = e.clamp(-(1 << 30), 1 << 30) as i32;
        }
        for l in 0..N {
            self.e[k].0[l] = clamped[l % frame.samples] + self.step_x[k] * (l / frame.samples) as i32;
        }
        best >= 0
    }

    /// Set up the plane of depth, in f64 as slivers are steep.
    #[inline(always)]
    fn depth(&mut self, frame: &Frame, s: &Setup, tile: [i32; 2]) {
        let d = |v: [i32; 3], k: usize| (v[k] - v[0]) as f64;
        let (x1, x2, y1, y2) = (d(s.x, 1), d(s.x, 2), d(s.y, 1), d(s.y, 2));
        let (z1, z2) = ((s.z[1] - s.z[0]) as f64, (s.z[2] - s.z[0]) as f64);
        let scale = 1.0 / (x1 * y2 - y1 * x2);
        let (zx, zy) = ((z1 * y2 - z2 * y1) * scale, (z2 * x1 - z1 * x2) * scale);
        (self.z_x, self.z_y) = ((zx * 256.0) as f32, (zy * 256.0) as f32);
        let at = |o: [i32; 2]| {
            let px = (tile[0] * 256 + 128 + o[0] - s.x[0]) as f64;
            let py = (tile[1] * 256 + 128 + o[1] - s.y[0]) as f64;
            (s.z[0] as f64 + zx * px + zy * py) as f32
        };
        self.z_center = at([0, 0]);
        let mut z = [self.z_center; 4];
        if frame.samples == 4 {
            z = [at(ROTATED[0]), at(ROTATED[1]), at(ROTATED[2]), at(ROTATED[3])];
        }
        for l in 0..N {
            self.z.0[l] = z[l % 4];
        }
    }

    /// Visit all samples side by side, as many as lanes, of which one is covered, and some of which none is.
    #[inline(always)]
    pub fn visit(&self, samples: usize, visitor: &mut impl Visitor<N>) {
        let (lo, hi) = (F::splat(self.z_lo), F::splat(self.z_hi));
        let wide = (N / samples) as i32;
        let steps = (self.x[1] - self.x[0]) / wide + 1;
        let first = self.x[0].min(TILE as i32 - steps * wide);
        let at = |k: usize| self.e[k] + I::splat(self.step_x[k] * first + self.step_y[k] * self.y[0]);
        let (mut e0, mut e1, mut e2) = (at(0), at(1), at(2));
        let across = |k: usize| I::splat(self.step_x[k] * wide);
        let (across0, across1, across2) = (across(0), across(1), across(2));
        let down = |k: usize| I::splat(self.step_y[k]);
        let (down0, down1, down2) = (down(0), down(1), down(2));
        // Of four samples most steps hold one; whether one wins is asked anyway.
        let always = samples == 4;
        let x0 = (lane_pixels::<N>(samples) + I::splat(first)).to_f32();
        let (z_x, wide_x) = (F::splat(self.z_x), F::splat(wide as f32));
        if steps == 1 {
            let (z_x0, mut at) = (z_x * x0, (self.y[0] * TILE as i32 + first) as usize * samples);
            for y in self.y[0]..=self.y[1] {
                let inside = is_inside(e0, e1, e2);
                if always || inside.any() {
                    let z = self.z + (z_x0 + F::splat(self.z_y * y as f32));
                    visitor.see(at, inside, z.max(lo).min(hi));
                }
                (e0, e1, e2) = (e0 + down0, e1 + down1, e2 + down2);
                at += TILE * samples;
            }
            return;
        }
        for y in self.y[0]..=self.y[1] {
            let (mut f0, mut f1, mut f2) = (e0, e1, e2);
            let (mut at, mut x) = ((y * TILE as i32 + first) as usize * samples, x0);
            let z_y = F::splat(self.z_y * y as f32);
            let mut met = false;
            for _ in 0..steps {
                let inside = is_inside(f0, f1, f2);
                if always || inside.any() {
                    let z = self.z + (z_x * x + z_y);
                    visitor.see(at, inside, z.max(lo).min(hi));
                    met = true;
                } else if met && samples == 1 {
                    // Of one sample a pixel, those of a row that lie within follow each other.
                    break;
                }
                (f0, f1, f2) = (f0 + across0, f1 + across1, f2 + across2);
                (at, x) = (at + N, x + wide_x);
            }
            (e0, e1, e2) = (e0 + down0, e1 + down1, e2 + down2);
        }
    }

    /// Draw into the buffer, and list where it won: nearer wins, at equal depth the triangle that was submitted first.
    #[inline(always)]
    pub fn fill(&self, samples: usize, v: &mut Visibility, keep: impl Keep<N>) {
        v.touch(self.x, self.y);
        let (z, ids) = (&mut v.z[..], &mut v.id[..]);
        let (start, places) = v.places.room(ids);
        let mut fill = Fill { z, ids, id: self.id, keep, places, n: 0 };
        self.visit(samples, &mut fill);
        if fill.n > 0 {
            let end = (start + fill.n) as u32;
            v.places.of.push(Of { id: self.id, end, lanes: N as u32 });
        }
    }

    /// Depth at a pixel's centre in the tile.
    pub fn depth_at(&self, x: i32, y: i32) -> f32 {
        (self.z_center + self.z_x * x as f32 + self.z_y * y as f32).max(self.z_lo).min(self.z_hi)
    }
}

/// What is done where a triangle is. A trait and no closure: what is not inlined loses its vector instructions, and only of
/// functions can it be demanded.
pub(super) trait Visitor<const N: usize> {
    /// Samples side by side: place of the first, mask of those that are covered, if any is, depths.
    fn see(&mut self, at: usize, inside: I<N>, z: F<N>);
}

/// Takes lanes away that would win.
pub(super) trait Keep<const N: usize> {
    /// Whether triangles come in the order in which they were submitted: at equal depth, the one that is there stays.
    const IN_ORDER: bool;

    /// Which of the samples from `at` on that would win do.
    fn keep(&self, at: usize, wins: I<N>) -> I<N>;
}

/// Everything that would win does: opaque triangles, which are the first to come.
pub(super) struct All;

impl<const N: usize> Keep<N> for All {
    const IN_ORDER: bool = true;

    #[inline(always)]
    fn keep(&self, _: usize, wins: I<N>) -> I<N> {
        wins
    }
}

struct Fill<'a, K> {
    z: &'a mut [f32],
    ids: &'a mut [u32],
    id: u32,
    keep: K,
    places: &'a mut [u16],
    n: usize,
}

impl<const N: usize, K: Keep<N>> Visitor<N> for Fill<'_, K> {
    #[inline(always)]
    fn see(&mut self, at: usize, inside: I<N>, z: F<N>) {
        let zs: &mut [f32; N] = (&mut self.z[at..at + N]).try_into().expect("as many as lanes");
        let ids: &mut [u32; N] = (&mut self.ids[at..at + N]).try_into().expect("as many as lanes");
        let id = I::splat(self.id as i32);
        let (old_z, old_id) = (F(*zs), I(ids.map(|id| id as i32)));
        let wins = match K::IN_ORDER {
            true => inside & z.gt(old_z),
            false => inside & (z.gt(old_z) | (z.equal(old_z) & before(id, old_id))),
        };
        if !wins.any() {
            return;
        }
        let wins = self.keep.keep(at, wins);
        *zs = wins.select(z, old_z).0;
        *ids = wins.select_int(id, old_id).0.map(|id| id as u32);
        if let Some(place) = self.places.get_mut(self.n) {
            *place = at as u16;
        }
        self.n += 1;
    }
}

/// Where no edge function is negative.
#[inline(always)]
fn is_inside<const N: usize>(e0: I<N>, e1: I<N>, e2: I<N>) -> I<N> {
    let out = e0 | e1 | e2;
    if N > 8 { out.gt(I::splat(-1)) } else { !out }
}

/// Unsigned `a < b`.
#[inline(always)]
pub(super) fn before<const N: usize>(a: I<N>, b: I<N>) -> I<N> {
    let flip = I::splat(i32::MIN);
    (b + flip).gt(a + flip)
}

/// The pixel of each lane, from the first.
#[inline(always)]
pub(super) fn lane_pixels<const N: usize>(samples: usize) -> I<N> {
    if samples == 1 { I::IOTA } else { I::IOTA.shift_right(2) }
}

/// Where each lane's sample lies, in 1/256 pixels from the first pixel's centre.
#[inline(always)]
pub(super) fn lane_offsets<const N: usize>(samples: usize) -> [I<N>; 2] {
    if samples == 1 {
        return [I::IOTA.shift_left(8), I::ZERO];
    }
    let mut offsets = [I::IOTA.shift_right(2).shift_left(8), I::ZERO];
    for l in 0..N {
        offsets[0].0[l] += ROTATED[l % 4][0];
        offsets[1].0[l] = ROTATED[l % 4][1];
    }
    offsets
}

#[inline(always)]
fn sample_offset(samples: usize, n: usize) -> [i32; 2] {
    if samples == 1 { [0, 0] } else { ROTATED[n] }
}
