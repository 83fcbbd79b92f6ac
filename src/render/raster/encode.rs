//! A tile's colours into the picture.

use super::channels::{self, Band};
use super::colors::{Colors, Sink};
use super::fill::{NONE, Visibility};
use super::frame::Frame;
use super::resolve::Area;
use super::{IdImage, TILE};
use crate::image::{Image, Rgba8, color};
use crate::math::simd::{F, F8, I, I8};
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

    /// Fill it with the background if all of that's bytes are the same, which memory takes in by itself at twice the speed: it need not
    /// be read first. Whether it was.
    pub fn clear(&mut self, background: [f32; 4]) -> bool {
        let Target::Rgba8 { data, .. } = self else { return false };
        let code = color::encode_srgb8(background);
        let same = code == [code[0]; 4];
        if same {
            data.fill(code[0]);
        }
        same
    }

    /// Write a tile that starts at column `x` and is `w` pixels wide.
    #[inline(always)]
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
    if opaque.all() {
        return encode_opaque([c[0], c[1], c[2]]);
    }
    // Nothing is left of pixels of less than half an alpha code.
    let alpha = opaque.select_int(I8::splat(255), (c[3].clamp01() * 255.0 + 0.5).floor());
    if !alpha.gt(I8::ZERO).any() {
        return I8::ZERO;
    }
    let scale = opaque.select(F8::ONE, F8::ONE / c[3]);
    let color = encode_opaque([c[0] * scale, c[1] * scale, c[2] * scale]) & I8::splat(0xff_ffff);
    alpha.gt(I8::ZERO) & (color | alpha.shift_left(24))
}

/// The same where all is opaque, of any number of pixels.
#[inline(always)]
pub(super) fn encode_opaque<const N: usize>(c: [F<N>; 3]) -> I<N> {
    let steps = &*color::STEPS;
    let [r, g, b] = [codes(c[0], steps), codes(c[1], steps), codes(c[2], steps)];
    r | g.shift_left(8) | b.shift_left(16) | I::splat(255 << 24)
}

/// [`color::srgb8`] of each.
#[inline(always)]
fn codes<const N: usize>(c: F<N>, steps: &[u32; 2048]) -> I<N> {
    let bits = c.max(F::splat(color::DARK)).min(F::ONE).to_bits();
    let place = bits.shift_right(16) - I::splat((color::DARK.to_bits() >> 16) as i32);
    let mut code = I::ZERO;
    for k in 0..N {
        code.0[k] = steps[place.0[k] as usize & 2047] as i32;
    }
    (code + (bits & I::splat(0xffff))).shift_right(16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::F;

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
        let c = F([f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30, 0.5, 2.0, 1.0]);
        let word = encode8([c, c, c, c]);
        for k in 0..8 {
            assert_eq!((word.0[k] as u32).to_le_bytes(), color::encode_srgb8([c.0[k]; 4]), "{}", c.0[k]);
        }
    }
}
