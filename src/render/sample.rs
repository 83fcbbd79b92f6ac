//! Textures at eight points: wrapping, mip levels, filtering (notes §5.12).

use crate::image::color::LINEAR_OF_SRGB8;
use crate::math::simd::{self, F8, I8, Isa, Kernel};
use crate::scene::{Filter, Texture, WrapMode};
use std::sync::LazyLock;

/// Each 8-bit value as a fraction of one.
static UNIT8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));

/// Texture coordinates of eight points and how they change from pixel to pixel.
#[derive(Clone, Copy)]
pub(crate) struct Uv {
    pub u: F8,
    pub v: F8,
    /// Change of u and v a pixel to the right.
    pub right: [F8; 2],
    /// Change of u and v a pixel down.
    pub down: [F8; 2],
}

impl Uv {
    pub const ZERO: Self = Self { u: F8::ZERO, v: F8::ZERO, right: [F8::ZERO; 2], down: [F8::ZERO; 2] };
}

/// Linear RGBA, straight alpha.
///
/// The level is `log₂` of the longer side of the pixel's footprint in texels.
pub(crate) fn sample(isa: Isa, texture: &Texture, uv: &Uv) -> [F8; 4] {
    simd::run(isa, Lookup { texture, uv })
}

struct Lookup<'a> {
    texture: &'a Texture,
    uv: &'a Uv,
}

impl Kernel for Lookup<'_> {
    type Output = [F8; 4];

    #[inline(always)]
    fn run(self) -> [F8; 4] {
        filtered(self.texture, self.uv)
    }
}

#[inline(always)]
fn filtered(t: &Texture, uv: &Uv) -> [F8; 4] {
    let top = (t.levels().len() - 1) as f32;
    let lod = lod(t, uv).max(F8::ZERO).min(F8::splat(top));
    if t.filter() == Filter::Nearest {
        return nearest(t, uv, lod.round());
    }
    let level = lod.floor();
    let fine = bilinear(t, uv, level);
    let fraction = lod - level.to_f32();
    if fraction.gt(F8::ZERO).bitmask() == 0 {
        return fine;
    }
    let coarse = bilinear(t, uv, (level + I8::splat(1)).min(I8::splat(top as i32)));
    let mut out = fine;
    for c in 0..4 {
        out[c] = fine[c] + (coarse[c] - fine[c]) * fraction;
    }
    out
}

#[inline(always)]
fn lod(t: &Texture, uv: &Uv) -> F8 {
    let (w, h) = (t.width() as f32, t.height() as f32);
    let square = |d: [F8; 2]| {
        let (x, y) = (d[0] * w, d[1] * h);
        x * x + y * y
    };
    let footprint = square(uv.right).max(square(uv.down));
    simd::log2(footprint.max(F8::splat(1e-12)).min(F8::splat(1e12))) * 0.5
}

/// Sizes of each lane's level along one side.
#[inline(always)]
fn size(full: u32, level: I8) -> I8 {
    let mut s = I8::ZERO;
    for k in 0..8 {
        s.0[k] = (full >> (level.0[k] & 31)).max(1) as i32;
    }
    s
}

/// A coordinate into 0…1, as far as that can be said before texels are counted.
#[inline(always)]
fn wrapped(x: F8, mode: WrapMode) -> F8 {
    // Beyond 2²² no fraction is left, and NaN becomes a number here.
    let x = x.max(F8::splat(-4e6)).min(F8::splat(4e6));
    match mode {
        WrapMode::Repeat => x - x.floor().to_f32(),
        WrapMode::Mirror => {
            let t = x - (x * 0.5).floor().to_f32() * 2.0;
            t.min(F8::splat(2.0) - t)
        }
        WrapMode::Clamp => x.clamp01(),
    }
}

/// A texel index back into the level.
#[inline(always)]
fn within(i: I8, size: I8, mode: WrapMode) -> I8 {
    let last = size - I8::splat(1);
    if mode == WrapMode::Repeat {
        let up = I8::ZERO.gt(i).select_int(i + size, i);
        return up.gt(last).select_int(up - size, up).max(I8::ZERO).min(last);
    }
    i.max(I8::ZERO).min(last)
}

/// Texels by lane, as little-endian RGBA words.
#[inline(always)]
fn fetch(t: &Texture, level: I8, at: I8) -> I8 {
    let mut out = I8::ZERO;
    let first = level.0[0] as usize;
    if level == I8::splat(level.0[0]) {
        let texels = t.levels()[first].as_chunks::<4>().0;
        for k in 0..8 {
            out.0[k] = i32::from_le_bytes(texels[at.0[k] as usize]);
        }
        return out;
    }
    for k in 0..8 {
        let texels = t.levels()[level.0[k] as usize].as_chunks::<4>().0;
        out.0[k] = i32::from_le_bytes(texels[at.0[k] as usize]);
    }
    out
}

/// Add `weight` times a texel's linear colour.
#[inline(always)]
fn add(sum: &mut [F8; 4], texel: I8, weight: F8, table: &[f32; 256]) {
    for c in 0..3 {
        let mut value = F8::ZERO;
        for k in 0..8 {
            value.0[k] = table[(texel.0[k] as u32 >> (8 * c) & 255) as usize];
        }
        sum[c] = sum[c] + value * weight;
    }
    let alpha = (texel.shift_right(24) & I8::splat(255)).to_f32() / F8::splat(255.0);
    sum[3] = sum[3] + alpha * weight;
}

#[inline(always)]
fn table(t: &Texture) -> &'static [f32; 256] {
    if t.srgb() { &LINEAR_OF_SRGB8 } else { &UNIT8 }
}

#[inline(always)]
fn nearest(t: &Texture, uv: &Uv, level: I8) -> [F8; 4] {
    let (w, h) = (size(t.width(), level), size(t.height(), level));
    let [wrap_u, wrap_v] = t.wrap();
    let x = within((wrapped(uv.u, wrap_u) * w.to_f32()).floor(), w, WrapMode::Clamp);
    let y = within((wrapped(uv.v, wrap_v) * h.to_f32()).floor(), h, WrapMode::Clamp);
    let mut sum = [F8::ZERO; 4];
    add(&mut sum, fetch(t, level, y * w + x), F8::ONE, table(t));
    sum
}

/// Four texels around each point, whose centres are at half-integers.
#[inline(always)]
fn bilinear(t: &Texture, uv: &Uv, level: I8) -> [F8; 4] {
    let (w, h) = (size(t.width(), level), size(t.height(), level));
    let [wrap_u, wrap_v] = t.wrap();
    let x = wrapped(uv.u, wrap_u) * w.to_f32() + -0.5;
    let y = wrapped(uv.v, wrap_v) * h.to_f32() + -0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0.to_f32(), y - y0.to_f32());
    let one = I8::splat(1);
    let columns = [within(x0, w, wrap_u), within(x0 + one, w, wrap_u)];
    let rows = [within(y0, h, wrap_v) * w, within(y0 + one, h, wrap_v) * w];
    let (wx, wy) = ([F8::ONE - fx, fx], [F8::ONE - fy, fy]);
    let table = table(t);
    let mut sum = [F8::ZERO; 4];
    for j in 0..2 {
        for i in 0..2 {
            add(&mut sum, fetch(t, level, rows[j] + columns[i]), wx[i] * wy[j], table);
        }
    }
    sum
}
