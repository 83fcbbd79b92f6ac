//! A tile's colours into the picture.

use super::channels::{self, Band};
use super::colors::{Colors, Sink};
use super::fill::{NONE, Visibility};
use super::frame::Frame;
use super::resolve::Area;
use super::{IdImage, TILE};
use crate::image::{Image, Rgba8, color};
use crate::math::simd::{F8, I8};
use crate::render::channel::Channels;

/// 64 rows of the output.
pub(super) enum Target<'a> {
    Rgba8 { width: usize, data: &'a mut [u8] },
    Linear { width: usize, pixels: &'a mut [[f32; 4]] },
    Ids { width: usize, objects: &'a mut [u32], triangles: &'a mut [u32], depth: &'a mut [f32] },
    Channels(Band<'a>),
}

pub(super) fn channel_bands(out: &mut Channels) -> Vec<Target<'_>> {
    channels::bands(out).into_iter().map(Target::Channels).collect()
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
            Target::Channels(band) => band.rows,
        }
    }

    /// What colours are to become.
    pub fn sink(&self) -> Sink {
        if matches!(self, Target::Rgba8 { .. }) { Sink::Codes } else { Sink::Linear }
    }

    /// Write a tile that starts at column `x` and is `w` pixels wide.
    pub fn write(&mut self, x: usize, w: usize, colors: &Colors) {
        let rows = self.rows();
        match self {
            Target::Rgba8 { width, data } => {
                for y in 0..rows {
                    let row = data[4 * (y * *width + x)..][..4 * w].as_chunks_mut::<4>().0;
                    for (out, word) in row.iter_mut().zip(&colors.codes[y * TILE..]) {
                        *out = word.to_le_bytes();
                    }
                }
            }
            Target::Linear { width, pixels } => {
                for y in 0..rows {
                    pixels[y * *width + x..][..w].copy_from_slice(&colors.sums[y * TILE..][..w]);
                }
            }
            Target::Ids { .. } | Target::Channels(_) => {}
        }
    }

    /// Write a tile of which the colours are in planes.
    #[inline(always)]
    pub fn write_planes(&mut self, x: usize, w: usize, planes: &Planes) {
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
            Target::Ids { .. } | Target::Channels(_) => {}
        }
    }

    /// Fill a tile with one colour.
    pub fn fill(&mut self, x: usize, w: usize, pixel: [f32; 4]) {
        let rows = self.rows();
        match self {
            Target::Rgba8 { width, data } => {
                let codes = [color::encode_srgb8(pixel); TILE];
                for y in 0..rows {
                    data[4 * (y * *width + x)..][..4 * w].copy_from_slice(&codes.as_flattened()[..4 * w]);
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
            // They were cleared beforehand.
            Target::Channels(_) => {}
        }
    }

    /// Write what is visible, if that is what the picture is of.
    pub fn write_ids(&mut self, frame: &Frame, area: Area, seen: &Visibility) -> bool {
        if let Target::Channels(band) = self {
            band.write(frame, area, seen);
            return true;
        }
        let (rows, x, w) = (self.rows(), area.to, area.w);
        let Target::Ids { width, objects, triangles, depth } = self else { return false };
        for (y, i) in (0..rows).flat_map(|y| (0..w).map(move |i| (y, i))) {
            let (from, to) = (y * TILE + i, y * *width + x + i);
            let (id, z) = seen.look(from, 0);
            (objects[to], triangles[to], depth[to]) = (0, 0, f32::INFINITY);
            if id != NONE {
                let draw = &frame.draws[frame.draw_of(id)];
                objects[to] = draw.index as u32 + 1;
                triangles[to] = id - draw.first_triangle;
                depth[to] = frame.distance(z);
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
pub(super) fn encode8(c: [F8; 4]) -> I8 {
    let opaque = c[3].ge(F8::ONE);
    let clear = c[3].to_bits().equal(I8::ZERO);
    if clear.bitmask() == 0xff {
        return I8::ZERO;
    }
    if (opaque | clear).bitmask() == 0xff {
        let [r, g, b] = codes(&c);
        return opaque & (r | g.shift_left(8) | b.shift_left(16) | I8::splat(0xff << 24));
    }
    let mut out = I8::ZERO;
    for k in 0..8 {
        let p = color::encode_srgb8([c[0].0[k], c[1].0[k], c[2].0[k], c[3].0[k]]);
        out.0[k] = u32::from_le_bytes(p) as i32;
    }
    out
}

/// `255·(1.055 c^(1/2.4) − 0.055)` as a polynomial in `t = c^(1/4)`, for which it is `t^(5/3)`: interpolated at the Chebyshev
/// nodes of 0.0031308^(1/4)…1, it is right to 5.7e-4 codes.
const CURVE: [f32; 7] = [-15.224638, 36.101643, 345.84674, -211.41621, 159.53728, -75.77506, 15.930479];

/// Codes nearer to a step than this are looked up in the exact table.
const DOUBT: f32 = 1e-3;

/// End of the straight part of the curve.
const TOE: f32 = 0.0031308;

/// `x^(1/4)` of `TOE…1`, to 6e-7: a first guess of `x^(−1/4)` from the exponent, right to 3.2 %, and three of Newton's steps. Two
/// square roots in a row take twice as long.
#[inline(always)]
fn fourth_root(x: F8) -> F8 {
    let mut y = (I8::splat(0x4f58_8000) - x.to_bits().shift_right(2)).from_bits();
    for _ in 0..3 {
        let y2 = y * y;
        y = y * (x * y2 * y2 * -0.25 + 1.25);
    }
    x * y * (y * y)
}

/// Codes before rounding, of light within 0…1.
#[inline(always)]
fn curve(c: F8) -> F8 {
    let t = fourth_root(c.max(F8::splat(TOE)));
    let t2 = t * t;
    let low = (t * CURVE[1] + CURVE[0]) + (t * CURVE[3] + CURVE[2]) * t2;
    let p = low + (t2 * CURVE[6] + (t * CURVE[5] + CURVE[4])) * (t2 * t2);
    F8::splat(TOE).ge(c).select(c * (12.92 * 255.0), p)
}

/// Mask of codes too near to a step.
#[inline(always)]
fn doubtful(code: F8, rounded: I8) -> I8 {
    let off = code - rounded.to_f32();
    (off * off).gt(F8::splat((0.5 - DOUBT) * (0.5 - DOUBT)))
}

/// The nearest sRGB codes of linear light in three channels.
#[inline(always)]
fn codes(c: &[F8; 4]) -> [I8; 3] {
    let c = [c[0].clamp01(), c[1].clamp01(), c[2].clamp01()];
    let code = [curve(c[0]), curve(c[1]), curve(c[2])];
    let mut out = [code[0].round(), code[1].round(), code[2].round()];
    let doubt = [doubtful(code[0], out[0]), doubtful(code[1], out[1]), doubtful(code[2], out[2])];
    if (doubt[0] | doubt[1] | doubt[2]).any() {
        exact(&c, &doubt, &mut out);
    }
    out
}

/// Replace doubtful codes by the exact ones.
#[cold]
#[inline(never)]
fn exact(c: &[F8; 3], doubt: &[I8; 3], out: &mut [I8; 3]) {
    for channel in 0..3 {
        for k in 0..8 {
            if doubt[channel].0[k] < 0 {
                out[channel].0[k] = color::srgb8(c[channel].0[k]) as i32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_at_a_time_gives_the_bytes_of_one_at_a_time() {
        for i in 0..100_000 {
            let mut c = F8::ZERO;
            (0..8).for_each(|k| c.0[k] = (8 * i + k) as f32 / 799_999.0);
            let word = encode8([c, c * 0.1, c * 1.5, F8::ONE]);
            for k in 0..8 {
                let want = color::encode_srgb8([c.0[k], c.0[k] * 0.1, c.0[k] * 1.5, 1.0]);
                assert_eq!((word.0[k] as u32).to_le_bytes(), want, "{}", c.0[k]);
            }
        }
        let c = F8([f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30, 0.5, 2.0, 1.0]);
        let word = encode8([c, c, c, c]);
        for k in 0..8 {
            assert_eq!((word.0[k] as u32).to_le_bytes(), color::encode_srgb8([c.0[k]; 4]), "{}", c.0[k]);
        }
    }
}
