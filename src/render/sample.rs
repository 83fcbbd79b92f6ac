//! Textures at eight points: wrapping, mip levels, filtering (notes §5.12).

use crate::image::color::LINEAR_OF_SRGB8;
use crate::math::power;
use crate::math::simd::{self, F, I, Isa, Kernel};
use crate::scene::texels::{Level, PACKED, texel};
use crate::scene::{Filter, Texture, WrapMode};
use std::sync::LazyLock;

/// Each 8-bit value as a fraction of one.
static UNIT8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));

/// Texture coordinates of points and how they change from pixel to pixel.
#[derive(Clone, Copy)]
pub(crate) struct Uv<const N: usize = 8> {
    pub u: F<N>,
    pub v: F<N>,
    /// Change of u and v a pixel to the right.
    pub right: [F<N>; 2],
    /// Change of u and v a pixel down.
    pub down: [F<N>; 2],
}

impl<const N: usize> Uv<N> {
    pub const ZERO: Self = Self { u: F::ZERO, v: F::ZERO, right: [F::ZERO; 2], down: [F::ZERO; 2] };
}

/// Linear RGBA, straight alpha.
///
/// The level is `log₂` of the longer side of the pixel's footprint in texels.
pub(crate) fn sample<const N: usize>(isa: Isa, texture: &Texture, uv: &Uv<N>) -> [F<N>; 4] {
    simd::run_as::<N, _>(isa, Lookup { texture, uv })
}

/// Batches of lanes for [`sample_all`].
pub(crate) const AT_ONCE: usize = 4;

/// The same for up to [`AT_ONCE`] batches: what is fetched for one of them is on its way while others are asked for.
pub(crate) fn sample_all<const N: usize>(isa: Isa, texture: &Texture, uvs: &[Uv<N>], out: &mut [[F<N>; 4]]) {
    simd::run_as::<N, _>(isa, Lookups { texture, uvs, out })
}

struct Lookups<'a, const N: usize> {
    texture: &'a Texture,
    uvs: &'a [Uv<N>],
    out: &'a mut [[F<N>; 4]],
}

impl<const N: usize> Kernel for Lookups<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { texture, uvs, out } = self;
        debug_assert!(uvs.len() <= AT_ONCE && uvs.len() == out.len());
        let levels = texture.packed().filter(|_| texture.filter() != Filter::Nearest);
        let Some(levels) = levels else {
            return out.iter_mut().zip(uvs).for_each(|(out, uv)| *out = filtered(texture, uv));
        };
        let mut taps = [Taps::NONE; AT_ONCE];
        for (taps, uv) in taps.iter_mut().zip(uvs) {
            taps.fetch(texture, levels, uv);
        }
        let taps = std::hint::black_box(&taps);
        for (out, taps) in out.iter_mut().zip(taps) {
            *out = taps.sum();
        }
    }
}

struct Lookup<'a, const N: usize> {
    texture: &'a Texture,
    uv: &'a Uv<N>,
}

impl<const N: usize> Kernel for Lookup<'_, N> {
    type Output = [F<N>; 4];

    #[inline(always)]
    fn run(self) -> [F<N>; 4] {
        filtered(self.texture, self.uv)
    }
}

#[inline(always)]
fn filtered<const N: usize>(t: &Texture, uv: &Uv<N>) -> [F<N>; 4] {
    let lod = lod(t, uv);
    if t.filter() == Filter::Nearest {
        return nearest(t, uv, lod.round());
    }
    if let Some(levels) = t.packed() {
        let mut taps = Taps::NONE;
        taps.fetch(t, levels, uv);
        return std::hint::black_box(&taps).sum();
    }
    let (level, next, fraction) = between(t, lod);
    let mut sum = [F::ZERO; 4];
    add_wide(t, uv, level, F::ONE - fraction, &mut sum);
    if fraction.gt(F::ZERO).any() {
        add_wide(t, uv, next, fraction, &mut sum);
    }
    sum
}

/// The two levels that a level of detail lies between, and how far it is from the first.
#[inline(always)]
fn between<const N: usize>(t: &Texture, lod: F<N>) -> (I<N>, I<N>, F<N>) {
    let level = lod.floor();
    let last = I::splat(t.levels().len() as i32 - 1);
    (level, (level + I::splat(1)).min(last), lod - level.to_f32())
}

#[inline(always)]
fn lod<const N: usize>(t: &Texture, uv: &Uv<N>) -> F<N> {
    let top = (t.levels().len() - 1) as f32;
    if top <= 0.0 {
        return F::ZERO;
    }
    let (w, h) = (t.width() as f32, t.height() as f32);
    let square = |d: [F<N>; 2]| {
        let (x, y) = (d[0] * w, d[1] * h);
        x * x + y * y
    };
    let footprint = square(uv.right).max(square(uv.down));
    let lod = power::log2(footprint.max(F::splat(1e-12)).min(F::splat(1e12))) * 0.5;
    lod.max(F::ZERO).min(F::splat(top))
}

/// Sizes of each lane's level along one side.
#[inline(always)]
fn size<const N: usize>(full: u32, level: I<N>, same: bool) -> I<N> {
    if same {
        return I::splat((full >> (level.0[0] & 31)).max(1) as i32);
    }
    let mut s = I::ZERO;
    for k in 0..N {
        s.0[k] = (full >> (level.0[k] & 31)).max(1) as i32;
    }
    s
}

/// A coordinate into 0…1, as far as that can be said before texels are counted.
#[inline(always)]
fn wrapped<const N: usize>(x: F<N>, mode: WrapMode) -> F<N> {
    // Beyond 2²² no fraction is left, and NaN becomes a number here.
    let x = x.max(F::splat(-4e6)).min(F::splat(4e6));
    match mode {
        WrapMode::Repeat => x - x.floor().to_f32(),
        WrapMode::Mirror => {
            let t = x - (x * 0.5).floor().to_f32() * 2.0;
            t.min(F::splat(2.0) - t)
        }
        WrapMode::Clamp => x.clamp01(),
    }
}

/// Texels by lane, as little-endian RGBA words.
#[inline(always)]
fn fetch<const N: usize>(t: &Texture, level: I<N>, at: I<N>) -> I<N> {
    let mut out = I::ZERO;
    let first = level.0[0] as usize;
    if level == I::splat(level.0[0]) {
        let texels = &t.levels()[first];
        for k in 0..N {
            out.0[k] = i32::from_le_bytes(texel(t, texels, at.0[k] as usize));
        }
        return out;
    }
    for k in 0..N {
        out.0[k] = i32::from_le_bytes(texel(t, &t.levels()[level.0[k] as usize], at.0[k] as usize));
    }
    out
}

/// Add `weight` times a texel's linear colour.
#[inline(always)]
fn add<const N: usize>(sum: &mut [F<N>; 4], texel: I<N>, weight: F<N>, table: &[f32; 256]) {
    for c in 0..3 {
        let mut value = F::ZERO;
        for k in 0..N {
            value.0[k] = table[(texel.0[k] as u32 >> (8 * c) & 255) as usize];
        }
        sum[c] = sum[c] + value * weight;
    }
    let alpha = (texel.shift_right(24) & I::splat(255)).to_f32() / F::splat(255.0);
    sum[3] = sum[3] + alpha * weight;
}

#[inline(always)]
fn table(t: &Texture) -> &'static [f32; 256] {
    if t.srgb() { &LINEAR_OF_SRGB8 } else { &UNIT8 }
}

#[inline(always)]
fn nearest<const N: usize>(t: &Texture, uv: &Uv<N>, level: I<N>) -> [F<N>; 4] {
    let (w, h) = (size(t.width(), level, false), size(t.height(), level, false));
    let [wrap_u, wrap_v] = t.wrap();
    let index = |x: F<N>, size: I<N>| (x * size.to_f32()).floor().max(I::ZERO).min(size - I::splat(1));
    let (x, y) = (index(wrapped(uv.u, wrap_u), w), index(wrapped(uv.v, wrap_v), h));
    let mut sum = [F::ZERO; 4];
    add(&mut sum, fetch(t, level, y * w + x), F::ONE, table(t));
    sum
}

/// The two texels on either side of a point along an axis, the weight of the second; centres are at half-integers.
#[inline(always)]
fn neighbours<const N: usize>(x: F<N>, size: I<N>, mode: WrapMode) -> (I<N>, I<N>, F<N>) {
    let x = wrapped(x, mode) * size.to_f32() + -0.5;
    let last = size - I::splat(1);
    if mode != WrapMode::Repeat {
        let x = x.max(F::ZERO).min(last.to_f32());
        let first = x.floor();
        return (first, (first + I::splat(1)).min(last), x - first.to_f32());
    }
    let first = x.floor();
    let fraction = x - first.to_f32();
    let first = I::ZERO.gt(first).select_int(last, first).min(last);
    let second = first.equal(last).select_int(I::ZERO, first + I::splat(1));
    (first, second, fraction)
}

/// Where the four texels around each point are: the first of two in the upper row and in the lower, and the weights of all.
#[inline(always)]
fn around<const N: usize>(
    t: &Texture,
    uv: &Uv<N>,
    level: I<N>,
    same: bool,
    weight: F<N>,
) -> ([I<N>; 2], [[F<N>; 2]; 2]) {
    let (w, h) = (size(t.width(), level, same), size(t.height(), level, same));
    let [wrap_u, wrap_v] = t.wrap();
    let (x, _, fx) = neighbours(uv.u, w, wrap_u);
    let (y0, y1, fy) = neighbours(uv.v, h, wrap_v);
    let stride = w + I::splat(1);
    let (upper, lower) = ((F::ONE - fy) * weight, fy * weight);
    let left = F::ONE - fx;
    ([y0 * stride + x, y1 * stride + x], [[upper * left, upper * fx], [lower * left, lower * fx]])
}

/// The texels around points, packed values, and their weights.
///
/// A channel is decoded by one product, and a level takes half the memory of one in linear light, which matters most: texels
/// come from far away. They go through memory, and wait there as long as they can: what is taken apart right from single numbers becomes
/// vector instructions in parts only.
struct Taps<const N: usize> {
    /// Texels and their right neighbours: of the upper row and the lower, of one level or two.
    words: [[u64; N]; 4],
    weights: [[F<N>; 2]; 4],
    rows: usize,
}

impl<const N: usize> Taps<N> {
    const NONE: Self = Self { words: [[0; N]; 4], weights: [[F::ZERO; 2]; 4], rows: 0 };

    #[inline(always)]
    fn fetch(&mut self, t: &Texture, levels: &[Level<u32>], uv: &Uv<N>) {
        let (level, next, fraction) = between(t, lod(t, uv));
        self.fetch_level(t, levels, uv, level, F::ONE - fraction, 0);
        self.rows = 2;
        if fraction.gt(F::ZERO).any() {
            self.fetch_level(t, levels, uv, next, fraction, 2);
            self.rows = 4;
        }
    }

    #[inline(always)]
    fn fetch_level(
        &mut self,
        t: &Texture,
        levels: &[Level<u32>],
        uv: &Uv<N>,
        level: I<N>,
        weight: F<N>,
        row: usize,
    ) {
        let same = level.equal(I::splat(level.0[0])).all();
        let (at, weights) = around(t, uv, level, same, weight);
        let (mut whole, mut all) = ([&[][..]; N], true);
        for k in 0..if same { 1 } else { N } {
            let texels = levels[level.0[k] as usize].whole();
            (whole[k], all) = (texels.unwrap_or_default(), all & texels.is_some());
        }
        for j in 0..2 {
            self.weights[row + j] = weights[j];
            let words = &mut self.words[row + j];
            match (all, same) {
                (true, true) => pairs::<true, N>(&whole, at[j], words),
                (true, false) => pairs::<false, N>(&whole, at[j], words),
                _ => single(t, levels, level, at[j], words),
            }
        }
    }

    /// Linear colours.
    #[inline(always)]
    fn sum(&self) -> [F<N>; 4] {
        let mut sum = [F::ZERO; 4];
        for (words, weights) in self.words.iter().zip(&self.weights).take(self.rows) {
            let (mut left, mut right) = (I::ZERO, I::ZERO);
            for k in 0..N {
                (left.0[k], right.0[k]) = (words[k] as i32, (words[k] >> 32) as i32);
            }
            add_squares(&mut sum, left, weights[0]);
            add_squares(&mut sum, right, weights[1]);
        }
        for c in 0..3 {
            sum[c] = sum[c] * (1.0 / (PACKED[c] * PACKED[c]));
        }
        [sum[0], sum[1], sum[2], F::ONE]
    }
}

/// Texels and their right neighbours, of one level if it is the `SAME`.
#[inline(always)]
fn pairs<const SAME: bool, const N: usize>(levels: &[&[u32]; N], at: I<N>, out: &mut [u64; N]) {
    for k in 0..N {
        let first = at.0[k] as u32 as usize;
        let pair = &levels[if SAME { 0 } else { k }][first..first + 2];
        out[k] = u64::from(pair[0]) | u64::from(pair[1]) << 32;
    }
}

/// The same where not all levels are decoded.
#[inline(never)]
fn single<const N: usize>(t: &Texture, levels: &[Level<u32>], level: I<N>, at: I<N>, out: &mut [u64; N]) {
    for k in 0..N {
        let number = level.0[k] as usize;
        let pair = levels[number].pair(t, number, at.0[k] as u32 as usize);
        out[k] = u64::from(pair[0]) | u64::from(pair[1]) << 32;
    }
    // That the lanes mostly agree in their level is good enough for a count.
    levels[level.0[0] as usize].count(t, level.0[0] as usize, 2 * N);
}

#[inline(always)]
fn add_squares<const N: usize>(sum: &mut [F<N>; 4], texel: I<N>, weight: F<N>) {
    let low = I::splat(2047);
    let r = (texel & low).to_f32();
    let g = (texel.shift_right(11) & low).to_f32();
    let b = (texel.shift_right(22) & I::splat(1023)).to_f32();
    sum[0] = sum[0] + r * r * weight;
    sum[1] = sum[1] + g * g * weight;
    sum[2] = sum[2] + b * b * weight;
}

/// Add `weight` times the four texels around each point.
///
/// Each lane takes the two texels of a row in one load, all channels side by side.
#[inline(always)]
fn add_wide<const N: usize>(t: &Texture, uv: &Uv<N>, level: I<N>, weight: F<N>, sum: &mut [F<N>; 4]) {
    let (at, weights) = around(t, uv, level, false, weight * (1.0 / 65535.0));
    for k in 0..N {
        let number = level.0[k] as usize;
        let texels = &t.wide()[number];
        let row = |j: usize| texels.pair(t, number, at[j].0[k] as usize);
        if k == 0 && texels.whole().is_none() {
            texels.count(t, number, 4 * N);
        }
        let (upper, lower) = (row(0), row(1));
        for c in 0..4 {
            let mean = |row: &[[u16; 4]; 2], w: &[F<N>; 2]| {
                row[0][c] as f32 * w[0].0[k] + row[1][c] as f32 * w[1].0[k]
            };
            sum[c].0[k] += mean(&upper, &weights[0]) + mean(&lower, &weights[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Content, Texture};
    use crate::test_rng::Rng;

    #[test]
    fn a_texture_without_alpha_looks_like_an_opaque_one() {
        let mut rng = Rng::new(8);
        let rgb: Vec<u8> = (0..3 * 20 * 9).map(|_| rng.range(0.0, 256.0) as u8).collect();
        let rgba = rgb.chunks(3).flat_map(|t| [t[0], t[1], t[2], 255]).collect::<Vec<u8>>();
        let cases =
            [Content::Color, Content::Numbers].map(|c| [(c, Filter::Trilinear), (c, Filter::Nearest)]);
        for (content, filter) in cases.into_iter().flatten() {
            let of = |bytes: &Vec<u8>| {
                Texture::new(20, 9, bytes.clone(), content, [WrapMode::Repeat; 2], filter).expect("it fits")
            };
            let (three, four) = (of(&rgb), of(&rgba));
            assert_eq!((three.channels(), three.rgba()), (3, rgba.clone()));
            // Before a level is decoded and after.
            for _ in 0..300 {
                let mut number = |lo: f64, hi: f64| F::<8>([0.0; 8].map(|_: f32| rng.range(lo, hi) as f32));
                let (u, v, right) = (number(-2.0, 2.0), number(-2.0, 2.0), [number(0.001, 0.3), F::ZERO]);
                let uv = Uv { u, v, right, down: [F::ZERO, number(0.001, 0.3)] };
                assert_eq!(sample(Isa::Best, &three, &uv), sample(Isa::Best, &four, &uv));
            }
        }
        assert!(
            Texture::new(20, 9, vec![0; 5 * 180], Content::Color, [WrapMode::Repeat; 2], Filter::Nearest)
                .is_err()
        );
    }

    #[test]
    fn batches_at_once_are_what_each_is() {
        let mut rng = Rng::new(7);
        let noise: Vec<u8> = (0..4 * 37 * 20).map(|_| rng.range(0.0, 256.0) as u8).collect();
        let opaque = noise.chunks(4).flat_map(|p| [p[0], p[1], p[2], 255]).collect::<Vec<u8>>();
        for (texels, filter) in
            [(&opaque, Filter::Trilinear), (&noise, Filter::Trilinear), (&opaque, Filter::Nearest)]
        {
            let t = Texture::new(37, 20, texels.clone(), Content::Color, [WrapMode::Repeat; 2], filter)
                .expect("it fits");
            for batches in 1..=AT_ONCE {
                let mut number = |lo: f64, hi: f64| F::<8>([0.0; 8].map(|_: f32| rng.range(lo, hi) as f32));
                let uvs: Vec<Uv<8>> = (0..batches)
                    .map(|_| {
                        let [u, v] = [number(-2.0, 2.0), number(-2.0, 2.0)];
                        // Footprints of a tenth of a texel to all of them.
                        let right = [number(0.001, 1.5), number(-0.1, 0.1)];
                        Uv { u, v, right, down: [F::ZERO, number(0.001, 0.2)] }
                    })
                    .collect();
                let mut found = vec![[F::ZERO; 4]; batches];
                sample_all(Isa::Best, &t, &uvs, &mut found);
                for (found, uv) in found.iter().zip(&uvs) {
                    assert_eq!(*found, sample(Isa::Portable, &t, uv), "{filter:?}");
                }
            }
        }
    }
}
