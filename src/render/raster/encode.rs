//! A tile's colours into the picture.

use super::fill::{NONE, Visibility};
use super::frame::Frame;
use super::{IdImage, TILE};
use crate::image::{Image, Rgba8, color};
use crate::math::simd::{self, F8, I8};

/// 64 rows of the output.
pub(super) enum Target<'a> {
    Rgba8 { width: usize, data: &'a mut [u8] },
    Linear { width: usize, pixels: &'a mut [[f32; 4]] },
    Ids { width: usize, objects: &'a mut [u32], triangles: &'a mut [u32], depth: &'a mut [f32] },
}

pub(super) fn rgba8_bands(out: &mut Rgba8) -> Vec<Target<'_>> {
    let width = out.width;
    out.data.chunks_mut((4 * TILE * width).max(1)).map(|data| Target::Rgba8 { width, data }).collect()
}

pub(super) fn linear_bands(out: &mut Image) -> Vec<Target<'_>> {
    let width = out.width;
    out.pixels.chunks_mut((TILE * width).max(1)).map(|pixels| Target::Linear { width, pixels }).collect()
}

pub(super) fn id_bands(out: &mut IdImage) -> Vec<Target<'_>> {
    let (width, n) = (out.width, (TILE * out.width).max(1));
    let ids = out.objects.chunks_mut(n).zip(out.triangles.chunks_mut(n));
    ids.zip(out.depth.chunks_mut(n))
        .map(|((objects, triangles), depth)| Target::Ids { width, objects, triangles, depth })
        .collect()
}

/// Four planes of linear, premultiplied colour: row in the tile · 64 + column.
type Planes = [Vec<f32>; 4];

impl Target<'_> {
    /// Rows of the picture in this band.
    pub fn rows(&self) -> usize {
        match self {
            Target::Rgba8 { width, data } => data.len() / (4 * width),
            Target::Linear { width, pixels } => pixels.len() / width,
            Target::Ids { width, objects, .. } => objects.len() / width,
        }
    }

    /// Write a tile that starts at column `x` and is `w` pixels wide.
    #[inline(always)]
    pub fn write(&mut self, x: usize, w: usize, planes: &Planes) {
        let rows = self.rows();
        match self {
            Target::Rgba8 { width, data } => {
                for y in 0..rows {
                    let row = &mut data[4 * (y * *width + x)..][..4 * w];
                    encode_row(row, planes, y * TILE);
                }
            }
            Target::Linear { width, pixels } => {
                for y in 0..rows {
                    let row = &mut pixels[y * *width + x..][..w];
                    for (i, p) in row.iter_mut().enumerate() {
                        let at = y * TILE + i;
                        *p = [planes[0][at], planes[1][at], planes[2][at], planes[3][at]];
                    }
                }
            }
            Target::Ids { .. } => {}
        }
    }

    /// Fill a tile with one colour.
    pub fn fill(&mut self, x: usize, w: usize, pixel: [f32; 4]) {
        let rows = self.rows();
        match self {
            Target::Rgba8 { width, data } => {
                let code = color::encode_srgb8(pixel);
                for y in 0..rows {
                    let row = &mut data[4 * (y * *width + x)..][..4 * w];
                    row.as_chunks_mut::<4>().0.fill(code);
                }
            }
            Target::Linear { width, pixels } => {
                (0..rows).for_each(|y| pixels[y * *width + x..][..w].fill(pixel));
            }
            Target::Ids { width, objects, triangles, depth } => {
                for y in 0..rows {
                    let r = y * *width + x..y * *width + x + w;
                    objects[r.clone()].fill(0);
                    triangles[r.clone()].fill(0);
                    depth[r].fill(f32::INFINITY);
                }
            }
        }
    }

    /// Write what is visible, if that is what the picture is of.
    pub fn write_ids(&mut self, frame: &Frame, x: usize, w: usize, seen: &Visibility) -> bool {
        let rows = self.rows();
        let Target::Ids { width, objects, triangles, depth } = self else { return false };
        for (y, i) in (0..rows).flat_map(|y| (0..w).map(move |i| (y, i))) {
            let (from, to) = (y * TILE + i, y * *width + x + i);
            let id = seen.id[from];
            (objects[to], triangles[to], depth[to]) = (0, 0, f32::INFINITY);
            if id != NONE {
                let draw = &frame.draws[frame.draw_of(id)];
                objects[to] = draw.index as u32 + 1;
                triangles[to] = id - draw.first_triangle;
                depth[to] = frame.distance(seen.z[from]);
            }
        }
        true
    }
}

/// A row of pixels to bytes, eight at a time.
#[inline(always)]
fn encode_row(row: &mut [u8], planes: &Planes, start: usize) {
    for (k, out) in row.chunks_mut(32).enumerate() {
        let at = start + 8 * k;
        let load = |c: usize| F8::load(&planes[c][at..]);
        let c = [load(0), load(1), load(2), load(3)];
        let words = encode8(c);
        for (bytes, word) in out.as_chunks_mut::<4>().0.iter_mut().zip(words.0) {
            *bytes = (word as u32).to_le_bytes();
        }
    }
}

/// Eight pixels as [`color::encode_srgb8`] does it: the same bytes, faster.
#[inline(always)]
fn encode8(c: [F8; 4]) -> I8 {
    let opaque = c[3].ge(F8::ONE);
    let clear = I8::ZERO.equal(c[3].to_bits());
    if (opaque | clear).bitmask() == 0xff {
        let (r, g, b) = (codes(c[0]), codes(c[1]), codes(c[2]));
        return opaque & (r | g.shl(8) | b.shl(16) | I8::splat(0xff << 24));
    }
    let mut out = I8::ZERO;
    for k in 0..8 {
        let p = color::encode_srgb8([c[0].0[k], c[1].0[k], c[2].0[k], c[3].0[k]]);
        out.0[k] = u32::from_le_bytes(p) as i32;
    }
    out
}

/// The nearest sRGB codes of linear light.
///
/// The curve by polynomials is right to 1/1000 of a code; where that leaves a doubt, the exact table decides.
#[inline(always)]
fn codes(c: F8) -> I8 {
    const DOUBT: f32 = 2e-3;
    let c = c.clamp01();
    let curve =
        simd::exp2(simd::log2(c.max(F8::splat(1e-6))) * (1.0 / 2.4)) * (1.055 * 255.0) + -0.055 * 255.0;
    let code = F8::splat(0.0031308).ge(c).select(c * (12.92 * 255.0), curve);
    let rounded = code.round();
    let off = code - rounded.to_f32();
    let doubt = off.max(F8::ZERO - off).gt(F8::splat(0.5 - DOUBT)).bitmask();
    let mut out = rounded;
    if doubt != 0 {
        for k in super::setup::bits(doubt) {
            out.0[k as usize] = color::srgb8(c.0[k as usize]) as i32;
        }
    }
    out
}
