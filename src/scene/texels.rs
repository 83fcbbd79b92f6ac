//! Mip levels as filters read them: decoded once, not at every look.

use super::texture::opaque;
use super::{Texture, WrapMode};
use crate::image::color::LINEAR_OF_SRGB8;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, OnceLock};

/// Decoded levels, each made when twice as many of its texels were asked for as it has: pictures seldom need the finest level, one
/// picture alone hardly ever all of any, and until then each look decodes for itself. Twice, since a level is memory to come by too.
///
/// A level lies row by row. Each row has one texel more, which is what lies right of its last, so that two neighbours always lie side
/// by side.
#[derive(Clone, Debug)]
pub(super) enum Texels {
    /// Square roots of linear light: 11 bits of red, 11 of green, 10 of blue. Opaque colours; to a tenth of an sRGB code.
    Packed(Vec<Level<u32>>),
    /// Linear RGBA in 65535ths.
    Wide(Vec<Level<[u16; 4]>>),
}

/// A level.
#[derive(Debug)]
pub(crate) struct Level<T> {
    /// Texels a row, and the one beyond.
    stride: usize,
    rows: usize,
    asked: AtomicUsize,
    whole: OnceLock<Vec<T>>,
}

/// They follow from the bytes, so two are never different where the bytes are not.
impl PartialEq for Texels {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Largest values of packed channels.
pub(crate) const PACKED: [f32; 3] = [2047.0, 2047.0, 1023.0];

impl Texels {
    /// Of a chain of levels that starts with so many pixels.
    pub fn new(width: u32, height: u32, levels: usize, packed: bool) -> Self {
        let size = |k: usize| ((width >> k).max(1) as usize + 1, (height >> k).max(1) as usize);
        if packed {
            return Self::Packed((0..levels).map(|k| Level::new(size(k))).collect());
        }
        Self::Wide((0..levels).map(|k| Level::new(size(k))).collect())
    }
}

/// A texel as a filter reads it.
pub(crate) trait Texel: Copy {
    /// How it follows from RGBA bytes.
    fn decode(t: &Texture) -> impl Fn(&[u8; 4]) -> Self;
}

impl Texel for u32 {
    #[inline(always)]
    fn decode(_: &Texture) -> impl Fn(&[u8; 4]) -> Self {
        let table = &*ROOTS;
        |t| table[0][t[0] as usize] | table[1][t[1] as usize] | table[2][t[2] as usize]
    }
}

impl Texel for [u16; 4] {
    #[inline(always)]
    fn decode(t: &Texture) -> impl Fn(&[u8; 4]) -> Self {
        let table = t.srgb().then(|| &*LINEAR16);
        move |t| match table {
            Some(l) => [l[t[0] as usize], l[t[1] as usize], l[t[2] as usize], t[3] as u16 * 257],
            None => t.map(|v| v as u16 * 257),
        }
    }
}

/// A copy decodes for itself.
impl<T: Texel> Clone for Level<T> {
    fn clone(&self) -> Self {
        Self::new((self.stride, self.rows))
    }
}

impl<T: Texel> Level<T> {
    fn new((stride, rows): (usize, usize)) -> Self {
        Self { stride, rows, asked: AtomicUsize::new(0), whole: OnceLock::new() }
    }

    /// All of it, if it is there.
    #[inline(always)]
    pub fn whole(&self) -> Option<&[T]> {
        self.whole.get().map(Vec::as_slice)
    }

    /// A texel, by its place in the level `k` of the texture, and its right neighbour.
    #[inline(always)]
    pub fn pair(&self, t: &Texture, k: usize, place: usize) -> [T; 2] {
        match self.whole() {
            Some(texels) => [texels[place], texels[place + 1]],
            None => self.decoded_pair(t, k, place),
        }
    }

    #[inline(always)]
    fn decoded_pair(&self, t: &Texture, k: usize, place: usize) -> [T; 2] {
        let decode = T::decode(t);
        let width = self.stride - 1;
        let (y, x) = (place as u32 / self.stride as u32, place as u32 % self.stride as u32);
        let next = if x as usize + 1 < width { x as usize + 1 } else { beyond(t, width) };
        let level = &t.levels()[k];
        [x as usize, next].map(|x| decode(&texel(t, level, y as usize * width + x)))
    }

    /// Say that so many texels were asked for; who asks for the last that it takes decodes the level.
    #[inline(never)]
    pub fn count(&self, t: &Texture, k: usize, texels: usize) {
        let enough = 2 * self.stride * self.rows;
        let before = self.asked.fetch_add(texels, Ordering::Relaxed);
        if before < enough && before + texels >= enough {
            let _ = self.whole.set(self.decoded(t, k));
        }
    }

    fn decoded(&self, t: &Texture, k: usize) -> Vec<T> {
        let (decode, width) = (T::decode(t), self.stride - 1);
        let (mut out, level) = (Vec::with_capacity(self.stride * self.rows), &t.levels()[k]);
        for row in level.chunks_exact(t.channels() * width) {
            match t.channels() {
                3 => out.extend(row.as_chunks::<3>().0.iter().map(|t| decode(&opaque(t)))),
                _ => out.extend(row.as_chunks::<4>().0.iter().map(&decode)),
            }
            out.push(decode(&texel(t, row, beyond(t, width))));
        }
        out
    }
}

/// A pixel of a level, or of a row of it, as RGBA.
#[inline(always)]
pub(crate) fn texel(t: &Texture, level: &[u8], place: usize) -> [u8; 4] {
    match t.channels() {
        3 => opaque(&level.as_chunks::<3>().0[place]),
        _ => level.as_chunks::<4>().0[place],
    }
}

/// The column of what lies right of the last: the first again, or the last itself.
fn beyond(t: &Texture, width: usize) -> usize {
    if t.wrap()[0] == WrapMode::Repeat { 0 } else { width - 1 }
}

/// Linear light of each sRGB code in 65535ths: wrong by less than a thirtieth of a code.
static LINEAR16: LazyLock<[u16; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| (LINEAR_OF_SRGB8[i] * 65535.0 + 0.5) as u16));

/// The square root of linear light of each sRGB code, where it goes in a packed texel: by channel.
static ROOTS: LazyLock<[[u32; 256]; 3]> = LazyLock::new(|| {
    std::array::from_fn(|c| {
        std::array::from_fn(|i| ((LINEAR_OF_SRGB8[i].sqrt() * PACKED[c] + 0.5) as u32) << (11 * c))
    })
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::color::srgb_from_linear;
    use crate::scene::{Content, Filter};

    fn texture(size: [u32; 2], bytes: Vec<u8>, content: Content, wrap: WrapMode) -> Texture {
        Texture::new(size[0], size[1], bytes, content, [wrap; 2], Filter::Trilinear).expect("it fits")
    }

    fn whole<T: Texel>(t: &Texture) -> Vec<T> {
        Level::new((t.width() as usize + 1, t.height() as usize)).decoded(t, 0)
    }

    #[test]
    fn packed_texels_are_right_to_a_fifth_of_a_code_and_come_back() {
        let bytes: Vec<u8> = (0..=255u8).flat_map(|v| [v, v, v, 255]).collect();
        let row = whole::<u32>(&texture([256, 1], bytes, Content::Color, WrapMode::Repeat));
        assert_eq!(row[256], row[0]);
        for (v, w) in row[..256].iter().enumerate() {
            for (c, root) in [w & 2047, w >> 11 & 2047, w >> 22].into_iter().enumerate() {
                let light = (root as f32 / PACKED[c]).powi(2);
                let off = srgb_from_linear(light) * 255.0 - v as f32;
                assert!(off.abs() < if c < 2 { 0.1 } else { 0.2 }, "{v} {c}: {off}");
            }
        }
    }

    #[test]
    fn wide_texels_keep_alpha_and_numbers() {
        let bytes = vec![0, 255, 51, 128, 255, 0, 0, 0];
        let numbers = texture([2, 1], bytes.clone(), Content::Numbers, WrapMode::Clamp);
        let row = whole::<[u16; 4]>(&numbers);
        assert_eq!(row.as_flattened(), [0, 65535, 13107, 32896, 65535, 0, 0, 0, 65535, 0, 0, 0]);
        let colors = texture([2, 1], bytes, Content::Color, WrapMode::Clamp);
        assert_eq!(whole::<[u16; 4]>(&colors)[0], [0, 65535, 2170, 32896]);
    }

    #[test]
    fn a_look_finds_the_same_before_and_after_the_level_is_made() {
        let (w, h) = (61usize, 13usize);
        let bytes: Vec<u8> = (0..w * h).flat_map(|i| [i as u8, (i >> 8) as u8, 7, 3]).collect();
        for (wrap, end) in [(WrapMode::Repeat, 0), (WrapMode::Clamp, w - 1)] {
            let t = texture([w as u32, h as u32], bytes.clone(), Content::Numbers, wrap);
            let level = &t.wide()[0];
            let texel = |y: usize, x: usize| {
                let i = 4 * (y * w + if x == w { end } else { x });
                [0, 1, 2, 3].map(|c| bytes[i + c] as u16 * 257)
            };
            for made in [false, true] {
                for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                    let pair = level.pair(&t, 0, y * (w + 1) + x);
                    assert_eq!(pair, [texel(y, x), texel(y, x + 1)], "{y} {x} {made}");
                    level.count(&t, 0, 1);
                    assert_eq!(level.whole().is_some(), made);
                }
                level.count(&t, 0, (w + 2) * h);
            }
        }
    }
}
