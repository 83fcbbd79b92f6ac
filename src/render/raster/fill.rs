//! A triangle into a tile's visibility buffer.

use super::TILE;
use super::frame::{Frame, ROTATED};
use super::setup::{Bounds, Setup};
use crate::math::simd::{F8, I8};

/// Nothing is seen here.
pub(super) const NONE: u32 = u32::MAX;

/// What is seen at each sample of a tile: sample · 4096 + row · 64 + column.
#[derive(Debug, Default)]
pub(super) struct Visibility {
    pub z: Vec<f32>,
    pub id: Vec<u32>,
}

impl Visibility {
    pub fn clear(&mut self, samples: usize) {
        self.z.clear();
        self.z.resize(samples * TILE * TILE, f32::NEG_INFINITY);
        self.id.clear();
        self.id.resize(samples * TILE * TILE, NONE);
    }
}

/// The part of a triangle within a tile, ready to be walked.
pub(super) struct Walk {
    /// Pixels in the tile, first and last.
    pub x: [i32; 2],
    pub y: [i32; 2],
    /// Edge functions at the tile's first pixel centre, in units of 256, for each sample.
    e: [[i32; 3]; 4],
    /// Their steps along x and y.
    step_x: [i32; 3],
    step_y: [i32; 3],
    z: [f32; 4],
    z_x: f32,
    z_y: f32,
    /// At the first pixel's centre.
    z_center: f32,
    z_lo: f32,
    z_hi: f32,
    pub id: u32,
}

impl Walk {
    /// `None` where the triangle and the tile's samples do not meet.
    pub fn new(frame: &Frame, s: &Setup, tile: [i32; 2]) -> Option<Self> {
        let b = Bounds::of(frame, s.x, s.y);
        let size = TILE as i32;
        let clip = |r: [i32; 2], o: i32| [(r[0] - o).max(0), (r[1] - o).min(size - 1)];
        let (x, y) = (clip(b.x, tile[0]), clip(b.y, tile[1]));
        if x[0] > x[1] || y[0] > y[1] {
            return None;
        }
        let mut walk = Self {
            x,
            y,
            e: [[0; 3]; 4],
            step_x: [0; 3],
            step_y: [0; 3],
            z: [0.0; 4],
            z_x: 0.0,
            z_y: 0.0,
            z_center: 0.0,
            z_lo: s.z[0].min(s.z[1]).min(s.z[2]),
            z_hi: s.z[0].max(s.z[1]).max(s.z[2]),
            id: s.id,
        };
        for k in 0..3 {
            if !walk.edge(frame, s, tile, k) {
                return None;
            }
        }
        walk.depth(frame, s, tile);
        Some(walk)
    }

    /// Set up edge `k`; false if the whole bounds lie beyond it.
    fn edge(&mut self, frame: &Frame, s: &Setup, tile: [i32; 2], k: usize) -> bool {
        let (a, b) = ([1, 2, 0][k], [2, 0, 1][k]);
        let (dx, dy) = (s.x[b] - s.x[a], s.y[b] - s.y[a]);
        let bias = if dy < 0 || (dy == 0 && dx > 0) { 0 } else { -1 };
        (self.step_x[k], self.step_y[k]) = (-dy, dx);
        let mut best = i64::MIN;
        for n in 0..frame.samples {
            let o = sample_offset(frame.samples, n);
            let px = (tile[0] * 256 + 128 + o[0] - s.x[a]) as i64;
            let py = (tile[1] * 256 + 128 + o[1] - s.y[a]) as i64;
            let e = (dx as i64 * py - dy as i64 * px + bias) >> 8;

            // The corner of the bounds that lies furthest inside.
            let (cx, cy) = (self.x[(-dy > 0) as usize], self.y[(dx > 0) as usize]);
            best = best.max(e + -dy as i64 * cx as i64 + dx as i64 * cy as i64);

            // Beyond ±2³⁰ the sign holds all over the tile.
            self.e[n][k] = e.clamp(-(1 << 30), 1 << 30) as i32;
        }
        best >= 0
    }

    /// Set up the plane of depth, in f64 as slivers are steep.
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
        for n in 0..frame.samples {
            self.z[n] = at(sample_offset(frame.samples, n));
        }
    }

    /// Visit every row of eight pixels with a covered sample: first pixel, sample, mask of lanes, depths.
    #[inline(always)]
    pub fn visit(&self, samples: usize, mut f: impl FnMut(usize, usize, I8, F8)) {
        let (lo, hi) = (F8::splat(self.z_lo), F8::splat(self.z_hi));
        // What is at most eight pixels wide is walked in one column, wherever it starts.
        let narrow = self.x[1] - self.x[0] < 8;
        let first = if narrow { self.x[0].min(TILE as i32 - 8) } else { self.x[0] & !7 };
        for n in 0..samples {
            let along = |k: usize| I8::splat(self.e[n][k]) + I8::IOTA * I8::splat(self.step_x[k]);
            let base = [along(0), along(1), along(2)];
            let z_base = F8::splat(self.z[n]) + I8::IOTA.to_f32() * self.z_x;
            for x in (first..=self.x[1]).step_by(8) {
                let shift = |k: usize| base[k] + I8::splat(self.step_x[k] * x + self.step_y[k] * self.y[0]);
                let mut e = [shift(0), shift(1), shift(2)];
                for y in self.y[0]..=self.y[1] {
                    let out = e[0] | e[1] | e[2];
                    if out.bitmask() != 0xff {
                        let z = z_base + (self.z_x * x as f32 + self.z_y * y as f32);
                        f(y as usize * TILE + x as usize, n, !out, z.max(lo).min(hi));
                    }
                    for k in 0..3 {
                        e[k] = e[k] + I8::splat(self.step_y[k]);
                    }
                }
            }
        }
    }

    /// Draw into the buffer: nearer wins, at equal depth the triangle that was submitted first. `keep` may take lanes
    /// away: it is given the first pixel, the sample's offset in pixels and the lanes that would win.
    #[inline(always)]
    pub fn fill(&self, samples: usize, v: &mut Visibility, keep: impl Fn(usize, [f32; 2], I8) -> I8) {
        let id = I8::splat(self.id as i32);
        self.visit(samples, |first, n, inside, z| {
            let at = n * TILE * TILE + first;
            let zs: &mut [f32; 8] = (&mut v.z[at..at + 8]).try_into().expect("eight");
            let ids: &mut [u32; 8] = (&mut v.id[at..at + 8]).try_into().expect("eight");
            let (old_z, mut old_id) = (F8(*zs), I8::ZERO);
            for k in 0..8 {
                old_id.0[k] = ids[k] as i32;
            }
            let wins = inside & (z.gt(old_z) | (z.equal(old_z) & before(id, old_id)));
            if !wins.any() {
                return;
            }
            let o = sample_offset(samples, n);
            let wins = keep(first, [o[0] as f32 / 256.0, o[1] as f32 / 256.0], wins);
            *zs = wins.select(z, old_z).0;
            let new = wins.select_int(id, old_id);
            for k in 0..8 {
                ids[k] = new.0[k] as u32;
            }
        });
    }

    /// Depth at a pixel's centre in the tile.
    pub fn depth_at(&self, x: i32, y: i32) -> f32 {
        (self.z_center + self.z_x * x as f32 + self.z_y * y as f32).max(self.z_lo).min(self.z_hi)
    }
}

/// Unsigned `a < b`.
#[inline(always)]
fn before(a: I8, b: I8) -> I8 {
    let flip = I8::splat(i32::MIN);
    (b + flip).gt(a + flip)
}

#[inline(always)]
fn sample_offset(samples: usize, n: usize) -> [i32; 2] {
    if samples == 1 { [0, 0] } else { ROTATED[n] }
}
