//! Mip levels as filters read them: decoded once, not at every look.

use super::{Texture, WrapMode};
use crate::image::color::LINEAR_OF_SRGB8;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, OnceLock};

/// Decoded levels, in pieces that are each made when one of their texels is first asked for: pictures seldom need the finest level, and
/// hardly ever all of it.
///
/// A level lies row by row. Each row has one texel more, which is what lies right of its last, and each piece too, which is the first
/// of the next, so that two neighbours always lie side by side.
#[derive(Clone, Debug)]
pub(super) enum Texels {
    /// Square roots of linear light: 11 bits of red, 11 of green, 10 of blue. Opaque colours; to a tenth of an sRGB code.
    Packed(Vec<Level<u32>>),
    /// Linear RGBA in 65535ths.
    Wide(Vec<Level<[u16; 4]>>),
}

/// A level: pieces, and all of it once half of them have been made, as no question then needs to be asked at every texel.
#[derive(Debug)]
pub(crate) struct Level<T> {
    pieces: Vec<OnceLock<Vec<T>>>,
    made: AtomicUsize,
    whole: OnceLock<Vec<T>>,
}

/// A level of so few pieces is made at once.
const FEW: usize = 16;

/// Texels of a piece.
const PIECE: usize = 1 << 12;

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
        let texels = |k: usize| ((width >> k).max(1) as usize + 1) * (height >> k).max(1) as usize;
        let pieces = |k: usize| texels(k).div_ceil(PIECE);
        if packed {
            return Self::Packed((0..levels).map(|k| Level::new(pieces(k))).collect());
        }
        Self::Wide((0..levels).map(|k| Level::new(pieces(k))).collect())
    }
}

/// A copy decodes for itself.
impl<T: Copy> Clone for Level<T> {
    fn clone(&self) -> Self {
        Self::new(self.pieces.len())
    }
}

impl<T: Copy> Level<T> {
    fn new(pieces: usize) -> Self {
        let pieces = (0..pieces).map(|_| OnceLock::new()).collect();
        Self { pieces, made: AtomicUsize::new(0), whole: OnceLock::new() }
    }

    /// All of it, if it is there.
    #[inline(always)]
    pub fn whole(&self) -> Option<&[T]> {
        self.whole.get().map(Vec::as_slice)
    }

    /// A texel, by its place in the level, and its right neighbour; `make` makes a range of texels.
    #[inline(always)]
    pub fn pair(&self, place: usize, make: impl Fn(Range<usize>) -> Vec<T>) -> [T; 2] {
        let piece = &self.pieces[place / PIECE];
        let texels = match piece.get() {
            Some(texels) => texels,
            None => return self.fresh(place, make),
        };
        [texels[place % PIECE], texels[place % PIECE + 1]]
    }

    fn fresh(&self, place: usize, make: impl Fn(Range<usize>) -> Vec<T>) -> [T; 2] {
        let pieces = self.pieces.len();
        if pieces <= FEW || 2 * self.made.fetch_add(1, Ordering::Relaxed) >= pieces {
            let whole = self.whole.get_or_init(|| make(0..usize::MAX));
            return [whole[place], whole[place + 1]];
        }
        let (piece, at) = (place / PIECE, place % PIECE);
        let texels = self.pieces[piece].get_or_init(|| make(PIECE * piece..PIECE * (piece + 1) + 1));
        [texels[at], texels[at + 1]]
    }
}

/// Texels of a packed level.
#[inline(never)]
pub(crate) fn packed(t: &Texture, level: usize, range: Range<usize>) -> Vec<u32> {
    let table = &*ROOTS;
    decoded(t, level, range, |t| (0..3).fold(0, |w, c| w | table[c][t[c] as usize]))
}

/// Texels of a wide level.
#[inline(never)]
pub(crate) fn wide(t: &Texture, level: usize, range: Range<usize>) -> Vec<[u16; 4]> {
    let table = &*LINEAR16;
    if !t.srgb() {
        return decoded(t, level, range, |t| t.map(|v| v as u16 * 257));
    }
    let linear =
        |t: &[u8; 4]| [table[t[0] as usize], table[t[1] as usize], table[t[2] as usize], t[3] as u16 * 257];
    decoded(t, level, range, linear)
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

/// Decode a range of a level's texels, as far as there are any; rows end in their first texel again if they repeat, in their last otherwise.
fn decoded<T>(t: &Texture, level: usize, range: Range<usize>, decode: impl Fn(&[u8; 4]) -> T) -> Vec<T> {
    let texels = t.levels()[level].as_chunks::<4>().0;
    let width = (t.width() as usize >> level).max(1);
    let last = if t.wrap()[0] == WrapMode::Repeat { 0 } else { width - 1 };
    let end = range.end.min(texels.len() / width * (width + 1));
    let count = end.saturating_sub(range.start);
    let mut out = Vec::with_capacity(count);
    let mut column = range.start % (width + 1);
    for row in texels.chunks_exact(width).skip(range.start / (width + 1)) {
        let left = count - out.len();
        out.extend(row[column..].iter().take(left).map(&decode));
        if left > width - column {
            out.push(decode(&row[last]));
        }
        column = 0;
        if out.len() == count {
            break;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::color::srgb_from_linear;
    use crate::scene::{Content, Filter};

    fn texture(size: [u32; 2], bytes: Vec<u8>, content: Content, wrap: WrapMode) -> Texture {
        Texture::new(size[0], size[1], bytes, content, [wrap; 2], Filter::Trilinear).expect("it fits")
    }

    #[test]
    fn packed_texels_are_right_to_a_fifth_of_a_code_and_come_back() {
        let bytes: Vec<u8> = (0..=255u8).flat_map(|v| [v, v, v, 255]).collect();
        let t = texture([256, 1], bytes, Content::Color, WrapMode::Repeat);
        let row = packed(&t, 0, 0..usize::MAX);
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
        let row = wide(&numbers, 0, 0..usize::MAX);
        assert_eq!(row[..3].as_flattened(), [0, 65535, 13107, 32896, 65535, 0, 0, 0, 65535, 0, 0, 0]);
        let colors = texture([2, 1], bytes, Content::Color, WrapMode::Clamp);
        assert_eq!(wide(&colors, 0, 0..1)[0], [0, 65535, 2170, 32896]);
    }

    #[test]
    fn pieces_hold_what_the_level_does_and_their_neighbours() {
        // 618 texels a row: pieces end anywhere in one.
        let (w, h) = (617usize, 131usize);
        let bytes: Vec<u8> = (0..w * h).flat_map(|i| [i as u8, (i >> 8) as u8, 7, 3]).collect();
        for (wrap, end) in [(WrapMode::Repeat, 0), (WrapMode::Clamp, w - 1)] {
            let t = texture([w as u32, h as u32], bytes.clone(), Content::Numbers, wrap);
            let Texels::Wide(levels) = Texels::new(w as u32, h as u32, 1, false) else { panic!("asked for") };
            let texel = |y: usize, x: usize| {
                let i = 4 * (y * w + if x == w { end } else { x });
                [0, 1, 2, 3].map(|c| bytes[i + c] as u16 * 257)
            };
            for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                let found = levels[0].pair(y * (w + 1) + x, |range| wide(&t, 0, range));
                assert_eq!(found, [texel(y, x), texel(y, x + 1)], "{y} {x}");
            }
            let whole = levels[0].whole().expect("all pieces have been made");
            assert_eq!(whole.len(), (w + 1) * h);
            assert!(whole.iter().enumerate().all(|(i, &t)| t == texel(i / (w + 1), i % (w + 1))));
        }
    }
}
