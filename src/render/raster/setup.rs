//! Triangles into tiles: eight at a time are culled and bounded; small ones become samples on the spot.

use super::clip;
use super::frame::{Class, Draw, Frame, ROTATED};
use super::vertex::{OUTSIDE, Vertices};
use super::{Stats, TILE};
use crate::math::simd::{self, F8, I8, Isa, Kernel};

/// A sample of a small triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    /// (Row in the tile · 64 + column) · samples + sample.
    pub place: u32,
    pub z: f32,
    pub id: u32,
}

/// A triangle on the picture plane, turned so that its area is positive (clockwise with y down).
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub x: [i32; 3],
    pub y: [i32; 3],
    pub z: [f32; 3],
    /// Triangle, counted over all draws.
    pub id: u32,
    pub draw: u32,
}

/// What one share of the triangles puts into the tiles.
#[derive(Debug, Default)]
pub(super) struct Bins {
    pub setups: Vec<Setup>,
    pub tiles: Vec<TileBin>,
    pub stats: Stats,
    corners: Vec<Corners>,
}

/// Pixels that a small triangle may have.
const TESTS: usize = (SMALL * SMALL) as usize;

/// Second and third edge functions of eight triangles at one of those pixels each.
type Edges = [I8; 2];

/// Coordinates of the three corners of eight triangles.
#[derive(Clone, Copy, Debug)]
struct Corners {
    x: [I8; 3],
    y: [I8; 3],
}

/// Corners are looked up for so many groups of eight at a time, through memory: what is computed right from single numbers becomes
/// vector instructions in parts only.
const GROUPS: usize = 32;

#[derive(Debug, Default)]
pub(super) struct TileBin {
    pub fragments: Vec<Fragment>,
    /// Indices of setups that are opaque or masked.
    pub solid: Vec<u32>,
    /// Indices of setups that let light through.
    pub blend: Vec<u32>,
}

/// Triangles of at most so many pixels along each side become samples at once.
const SMALL: i32 = 4;

/// The same at four samples a pixel: more samples are better walked by themselves.
const SMALL_OF_FOUR: i32 = 3;

/// Differences up to here multiply within 32 bits.
const SHORT: i32 = 1 << 14;

/// Pixels, first and last, whose samples may lie within a triangle.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub x: [i32; 2],
    pub y: [i32; 2],
}

impl Bounds {
    pub fn of(frame: &Frame, x: [i32; 3], y: [i32; 3]) -> Self {
        let reach = reach(frame.samples);
        let range = |v: [i32; 3], size: i32| {
            let (lo, hi) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
            [((lo + 127 - reach) >> 8).max(0), ((hi - 128 + reach) >> 8).min(size - 1)]
        };
        Self { x: range(x, frame.width), y: range(y, frame.height) }
    }

    pub fn is_empty(&self) -> bool {
        self.x[0] > self.x[1] || self.y[0] > self.y[1]
    }

    /// What of them lies in the tile that starts at a pixel, from there.
    #[inline(always)]
    pub fn within(self, tile: [i32; 2]) -> Self {
        let clip = |r: [i32; 2], o: i32| [(r[0] - o).max(0), (r[1] - o).min(TILE as i32 - 1)];
        Self { x: clip(self.x, tile[0]), y: clip(self.y, tile[1]) }
    }
}

/// How far samples lie from their pixel's centre, in 1/256 pixels.
#[inline(always)]
fn reach(samples: usize) -> i32 {
    if samples == 1 { 0 } else { 96 }
}

impl Bins {
    /// Bin the `k`-th of `shares` equal parts of the triangle list.
    pub fn fill(&mut self, isa: Isa, frame: &Frame, vertices: &Vertices, k: usize, shares: usize) {
        self.clear(frame.tiles_x * frame.tiles_y);
        let cut = |k: usize| (frame.triangle_count as u64 * k as u64 / shares as u64) as u32;
        let (start, end) = (cut(k), cut(k + 1));
        for (d, draw) in frame.draws.iter().enumerate() {
            let last = draw.first_triangle + draw.object.mesh.triangles.len() as u32;
            let (from, to) = (start.max(draw.first_triangle), end.min(last));
            if from < to {
                simd::run(isa, Share { bins: self, frame, vertices, draw, d: d as u32, from, to });
            }
        }
        let s = &mut self.stats;
        s.drawn = (end - start) as u64 - s.skipped - s.culled - s.missed;
    }

    /// Triangles of a tile that are opaque or masked.
    #[inline(always)]
    pub fn solid(&self, tile: usize) -> impl Iterator<Item = &Setup> {
        self.tiles[tile].solid.iter().map(|&s| &self.setups[s as usize])
    }

    fn clear(&mut self, tiles: usize) {
        self.stats = Stats::default();
        self.setups.clear();
        self.tiles.resize_with(tiles, TileBin::default);
        for t in &mut self.tiles {
            t.fragments.clear();
            t.solid.clear();
            t.blend.clear();
        }
    }

    /// Put a triangle into every tile that its bounds meet; false if there is none.
    pub fn bin(&mut self, frame: &Frame, class: Class, setup: Setup) -> bool {
        let b = Bounds::of(frame, setup.x, setup.y);
        if b.is_empty() {
            return false;
        }
        let index = self.setups.len() as u32;
        self.setups.push(setup);
        for ty in b.y[0] as usize / TILE..=b.y[1] as usize / TILE {
            for tx in b.x[0] as usize / TILE..=b.x[1] as usize / TILE {
                let tile = &mut self.tiles[ty * frame.tiles_x + tx];
                if class == Class::Blend { &mut tile.blend } else { &mut tile.solid }.push(index);
            }
        }
        true
    }
}

/// Part of one draw.
struct Share<'a> {
    bins: &'a mut Bins,
    frame: &'a Frame<'a>,
    vertices: &'a Vertices,
    draw: &'a Draw<'a>,
    d: u32,
    from: u32,
    to: u32,
}

/// Eight triangles, and the first and last pixels of their bounds.
struct Group<'a> {
    tris: &'a [[u32; 3]; 8],
    first: u32,
    corners: &'a Corners,
    lo: [I8; 2],
    hi: [I8; 2],
}

/// Planes of depth of eight triangles.
#[derive(Clone, Copy)]
struct Depths {
    first: F8,
    along: [F8; 2],
    /// One over twice the area.
    scale: F8,
}

impl Depths {
    /// Of one triangle, where the second and third edge function have these values.
    #[inline(always)]
    fn at(&self, [e1, e2]: [I8; 2], l: usize) -> f32 {
        let (b1, b2) = (e1.0[l] as f32 * self.scale.0[l], e2.0[l] as f32 * self.scale.0[l]);
        self.first.0[l] + self.along[0].0[l] * b1 + self.along[1].0[l] * b2
    }
}

impl Kernel for Share<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let first = self.draw.first_triangle;
        let list = &self.draw.object.mesh.triangles[(self.from - first) as usize..(self.to - first) as usize];
        let n = self.draw.object.positions.len();
        let xy = &self.vertices.xy[self.draw.first_vertex..][..n];
        let mut id = self.from;
        let mut corners = std::mem::take(&mut self.bins.corners);
        let mut tested = [[I8::ZERO; 2]; TESTS];
        corners.resize(GROUPS, Corners { x: [I8::ZERO; 3], y: [I8::ZERO; 3] });
        for chunk in list.chunks(8 * GROUPS) {
            look_up(chunk, xy, &mut corners);
            let (groups, rest) = chunk.as_chunks::<8>();
            for (tris, corners) in groups.iter().zip(&corners) {
                self.group(tris, 0xff, id, corners, &mut tested);
                id += 8;
            }
            if let Some(&first) = rest.first() {
                let mut tris = [first; 8];
                tris[..rest.len()].copy_from_slice(rest);
                self.group(&tris, (1 << rest.len()) - 1, id, &corners[groups.len()], &mut tested);
            }
        }
        self.bins.corners = corners;
    }
}

impl Share<'_> {
    #[inline(always)]
    fn group(
        &mut self,
        tris: &[[u32; 3]; 8],
        lanes: u32,
        first: u32,
        corners: &Corners,
        tested: &mut [Edges; TESTS],
    ) {
        let Corners { x, y } = corners;

        // Lanes with a corner outside, or too long for 32-bit products, go one by one.
        let (lo_x, hi_x) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
        let (lo_y, hi_y) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
        let outside = I8::splat(OUTSIDE + 1).gt(lo_x);
        let short = I8::splat(SHORT);
        let long = (hi_x - lo_x).gt(short) | (hi_y - lo_y).gt(short) | outside;
        let slow = long.bitmask() & lanes;

        // Cull the rest by area, then by bounds without a sample.
        let area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        let culled = match (self.draw.cull, self.draw.object.mirrored) {
            (true, false) => I8::splat(0).gt(area),
            (true, true) => area.gt(I8::ZERO),
            (false, _) => !area.equal(I8::ZERO),
        };
        let culled = !culled.bitmask() & lanes & !slow;
        self.bins.stats.culled += culled.count_ones() as u64;
        if culled == lanes {
            return;
        }
        let reach = reach(self.frame.samples);
        let ends = |lo: I8, hi: I8, size: i32| {
            let lo = (lo + I8::splat(127 - reach)).shift_right(8).max(I8::ZERO);
            (lo, (hi + I8::splat(reach - 128)).shift_right(8).min(I8::splat(size - 1)))
        };
        let ((lo_x, hi_x), (lo_y, hi_y)) =
            (ends(lo_x, hi_x, self.frame.width), ends(lo_y, hi_y, self.frame.height));
        let empty = lo_x.gt(hi_x) | lo_y.gt(hi_y);
        let missed = empty.bitmask() & lanes & !slow & !culled;
        self.bins.stats.missed += missed.count_ones() as u64;

        // What is left is drawn at once if it is small, binned if not.
        let left = lanes & !slow & !culled & !missed;
        let most = if self.frame.samples == 1 { SMALL } else { SMALL_OF_FOUR };
        let wide = (hi_x - lo_x).max(hi_y - lo_y).gt(I8::splat(most - 1));
        let direct = self.draw.class == Class::Opaque;
        let large = if direct { wide.bitmask() & left } else { left };
        let g = Group { tris, first, corners, lo: [lo_x, lo_y], hi: [hi_x, hi_y] };
        if left & !large != 0 {
            self.small(&g, area, left & !large, tested);
        }
        // In the order in which they were submitted.
        for k in bits(large | slow) {
            self.large(first + k, tris[k as usize]);
        }
    }

    /// Test every sample in the bounds of small triangles, a sample of all eight at a time.
    #[inline(always)]
    fn small(&mut self, g: &Group, area: I8, active: u32, tested: &mut [Edges; TESTS]) {
        // Turn all triangles the same way round.
        let turn = I8::ZERO.gt(area);
        let pick = |a: I8, b: I8| (turn.select_int(b, a), turn.select_int(a, b));
        let Corners { x, y } = g.corners;
        let ((x1, x2), (y1, y2)) = (pick(x[1], x[2]), pick(y[1], y[2]));
        let (x, y) = ([x[0], x1, x2], [y[0], y1, y2]);
        let mut plane = None;

        // Edge functions at the first pixel's centre, with the fill rule as a bias; steps of one pixel.
        let px = g.lo[0].shift_left(8) + I8::splat(128);
        let py = g.lo[1].shift_left(8) + I8::splat(128);
        let (mut e, mut dx, mut dy, mut bias) = ([I8::ZERO; 3], [I8::ZERO; 3], [I8::ZERO; 3], [I8::ZERO; 3]);
        for k in 0..3 {
            let (a, b) = ([1, 2, 0][k], [2, 0, 1][k]);
            (dx[k], dy[k]) = (x[b] - x[a], y[b] - y[a]);
            let keep = I8::ZERO.gt(dy[k]) | (dy[k].equal(I8::ZERO) & dx[k].gt(I8::ZERO));
            bias[k] = !keep;
            e[k] = dx[k] * (py - y[a]) - dy[k] * (px - x[a]) + bias[k];
        }
        let (w, h) = (g.hi[0] - g.lo[0], g.hi[1] - g.lo[1]);
        let (mut columns, mut rows) = ([0; SMALL as usize], [0; SMALL as usize]);
        for i in 0..SMALL {
            columns[i as usize] = !I8::splat(i).gt(w).bitmask();
            rows[i as usize] = active & !I8::splat(i).gt(h).bitmask();
        }
        let (mut down, mut across) = (dx, dy);
        for k in 0..3 {
            (down[k], across[k]) = (dx[k].shift_left(8), dy[k].shift_left(8));
        }
        for s in 0..self.frame.samples {
            let [sx, sy] = if self.frame.samples == 1 { [0, 0] } else { ROTATED[s] };
            let start = |k: usize| e[k] + dx[k] * I8::splat(sy) - dy[k] * I8::splat(sx);
            let mut row = [start(0), start(1), start(2)];
            // Eight bits a test. None is handed out before all are known: whether a test finds any nobody can foretell.
            let mut found = 0u128;
            for j in 0..SMALL {
                let in_rows = rows[j as usize];
                if in_rows == 0 {
                    break;
                }
                let mut at = row;
                for i in 0..SMALL {
                    let in_bounds = in_rows & columns[i as usize];
                    if in_bounds == 0 {
                        break;
                    }
                    let hit = in_bounds & !(at[0] | at[1] | at[2]).bitmask();
                    let test = SMALL * j + i;
                    found |= u128::from(hit) << (8 * test);
                    tested[test as usize] = [at[1] - bias[1], at[2] - bias[2]];
                    for k in 0..3 {
                        at[k] = at[k] - across[k];
                    }
                }
                for k in 0..3 {
                    row[k] = row[k] + down[k];
                }
            }
            if found != 0 {
                // Most triangles that are this small hold no sample, so their depths wait for the first that does.
                let now = match plane {
                    Some(plane) => plane,
                    None => self.depths(g, turn, turn.select_int(I8::ZERO - area, area)),
                };
                plane = Some(now);
                self.emit(g, found, tested, &now, s);
            }
        }
    }

    /// Depths of eight triangles that were turned.
    #[inline(always)]
    fn depths(&self, g: &Group, turn: I8, area: I8) -> Depths {
        let list = &self.vertices.z[self.draw.first_vertex..][..self.draw.object.positions.len()];
        let mut z = [F8::ZERO; 3];
        for c in 0..3 {
            for k in 0..8 {
                z[c].0[k] = list[g.tris[k][c] as usize];
            }
        }
        // Through memory, as corners go.
        let z = std::hint::black_box(z);
        let (z1, z2) = (turn.select(z[2], z[1]), turn.select(z[1], z[2]));
        Depths { first: z[0], along: [z1 - z[0], z2 - z[0]], scale: F8::ONE / area.to_f32() }
    }

    /// Hand the samples that were found to their tiles.
    #[inline(always)]
    fn emit(&mut self, g: &Group, found: u128, tested: &[Edges; TESTS], plane: &Depths, s: usize) {
        for (half, mut left) in [found as u64, (found >> 64) as u64].into_iter().enumerate() {
            while left != 0 {
                let bit = left.trailing_zeros() as usize;
                left &= left - 1;
                let (test, l) = (8 * half + bit / 8, bit % 8);
                let x = g.lo[0].0[l] as usize + test % SMALL as usize;
                let y = g.lo[1].0[l] as usize + test / SMALL as usize;
                let tile = &mut self.bins.tiles[y / TILE * self.frame.tiles_x + x / TILE];
                let place = ((y % TILE * TILE + x % TILE) * self.frame.samples + s) as u32;
                let z = plane.at(tested[test], l);
                tile.fragments.push(Fragment { place, z, id: g.first + l as u32 });
            }
        }
    }

    /// A triangle of any size and place, in 64 bits.
    #[inline(never)]
    fn large(&mut self, id: u32, t: [u32; 3]) {
        let corner = t.map(|v| self.draw.first_vertex + v as usize);
        let xy = corner.map(|v| self.vertices.xy[v]);
        if xy.iter().any(|c| c[0] == OUTSIDE) {
            let p = t.map(|v| self.draw.object.positions[v as usize]);
            return clip::clipped(self.bins, self.frame, self.draw, self.d, id, p);
        }
        let z = corner.map(|v| self.vertices.z[v]);
        match oriented(self.draw, xy.map(|c| c[0]), xy.map(|c| c[1]), z, id, self.d) {
            None => self.bins.stats.culled += 1,
            Some(setup) => {
                let met = self.bins.bin(self.frame, self.draw.class, setup);
                self.bins.stats.missed += !met as u64;
            }
        }
    }
}

/// Turned to positive area; `None` if it is culled.
pub(super) fn oriented(
    draw: &Draw,
    mut x: [i32; 3],
    mut y: [i32; 3],
    mut z: [f32; 3],
    id: u32,
    d: u32,
) -> Option<Setup> {
    let area = (x[1] - x[0]) as i64 * (y[2] - y[0]) as i64 - (y[1] - y[0]) as i64 * (x[2] - x[0]) as i64;
    let front = if draw.object.mirrored { area > 0 } else { area < 0 };
    if area == 0 || (draw.cull && !front) {
        return None;
    }
    if area < 0 {
        x.swap(1, 2);
        y.swap(1, 2);
        z.swap(1, 2);
    }
    Some(Setup { x, y, z, id, draw: d })
}

/// Corners of triangles, eight by eight; lanes beyond the last keep what they held. A call, so that its few numbers stay in registers.
#[inline(never)]
fn look_up(tris: &[[u32; 3]], xy: &[[i32; 2]], out: &mut [Corners]) {
    for (tris, out) in tris.chunks(8).zip(out) {
        for (k, t) in tris.iter().enumerate() {
            for c in 0..3 {
                let [x, y] = xy[t[c] as usize];
                (out.x[c].0[k & 7], out.y[c].0[k & 7]) = (x, y);
            }
        }
    }
}

/// The numbers of the bits that are set.
#[inline(always)]
pub(super) fn bits(mut mask: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let k = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (k < 32).then_some(k)
    })
}
