//! Mip levels as filters read them: decoded once, not at every look.

use crate::image::color::LINEAR_OF_SRGB8;
use std::sync::{LazyLock, OnceLock};

/// Decoded levels, each made when it is first asked for: pictures seldom need the finest.
#[derive(Clone, Debug)]
pub(super) struct Texels {
    packed: bool,
    levels: Vec<OnceLock<Level>>,
}

/// A level, row by row. Each row has one texel more, which is what lies right of its last, so that two neighbours always lie
/// side by side.
#[derive(Clone, Debug)]
pub(crate) enum Level {
    /// Square roots of linear light: 11 bits of red, 11 of green, 10 of blue. Opaque colours; to a tenth of an sRGB code.
    Packed(Vec<u32>),
    /// Linear RGBA in 65535ths.
    Wide(Vec<u16>),
}

/// They follow from the bytes, so two are never different where the bytes are not.
impl PartialEq for Texels {
    fn eq(&self, other: &Self) -> bool {
        self.levels.len() == other.levels.len()
    }
}

/// Largest values of packed channels.
pub(crate) const PACKED: [f32; 3] = [2047.0, 2047.0, 1023.0];

impl Texels {
    pub fn new(levels: usize, packed: bool) -> Self {
        Self { packed, levels: (0..levels).map(|_| OnceLock::new()).collect() }
    }

    /// A level, of which `source` gives the bytes, the width and whether rows repeat.
    #[inline(always)]
    pub fn get<'a>(
        &self,
        level: usize,
        srgb: bool,
        source: impl FnOnce() -> (&'a [u8], usize, bool),
    ) -> &Level {
        self.levels[level].get_or_init(|| {
            let (bytes, width, repeats) = source();
            if self.packed {
                let table = &*ROOTS;
                let pack = |t: &[u8; 4]| (0..3).fold(0, |w, c| w | table[c][t[c] as usize]);
                return Level::Packed(rows(bytes, width, repeats, pack));
            }
            let table = &*LINEAR16;
            let wide = |t: &[u8; 4]| match srgb {
                true => [table[t[0] as usize], table[t[1] as usize], table[t[2] as usize], t[3] as u16 * 257],
                false => t.map(|v| v as u16 * 257),
            };
            Level::Wide(rows(bytes, width, repeats, wide).into_flattened())
        })
    }
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

/// Texels of a level from which on several threads are worth their start.
const PARALLEL: usize = 1 << 18;

/// Decode rows; each ends in its first texel again if it `repeats`, in its last otherwise.
fn rows<T: Copy + Default + Send>(
    bytes: &[u8],
    width: usize,
    repeats: bool,
    decode: impl Fn(&[u8; 4]) -> T + Sync,
) -> Vec<T> {
    let texels = bytes.as_chunks::<4>().0;
    let height = texels.len() / width;
    let mut out = vec![T::default(); height * (width + 1)];
    let band = |from: &[[u8; 4]], to: &mut [T]| {
        for (row, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(width + 1)) {
            to.iter_mut().zip(row).for_each(|(to, t)| *to = decode(t));
            to[width] = to[if repeats { 0 } else { width - 1 }];
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    if threads == 1 || texels.len() < PARALLEL {
        band(texels, &mut out);
        return out;
    }
    let share = height.div_ceil(threads);
    std::thread::scope(|scope| {
        for (from, to) in texels.chunks(share * width).zip(out.chunks_mut(share * (width + 1))) {
            scope.spawn(|| band(from, to));
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::color::srgb_from_linear;

    #[test]
    fn packed_texels_are_right_to_a_fifth_of_a_code_and_come_back() {
        let bytes: Vec<u8> = (0..=255u8).flat_map(|v| [v, v, v, 255]).collect();
        let texels = Texels::new(1, true);
        let Level::Packed(row) = texels.get(0, true, || (&bytes, 256, true)) else {
            panic!("they are opaque")
        };
        assert_eq!((row.len(), row[256]), (257, row[0]));
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
        let texels = Texels::new(2, false);
        let bytes = [0, 255, 51, 128, 255, 0, 0, 0];
        let Level::Wide(row) = texels.get(0, false, || (&bytes, 2, false)) else { panic!("asked for") };
        assert_eq!(row[..], [0, 65535, 13107, 32896, 65535, 0, 0, 0, 65535, 0, 0, 0]);
        let Level::Wide(row) = texels.get(1, true, || (&bytes[..4], 1, true)) else { panic!("asked for") };
        assert_eq!(row[..4], [0, 65535, 2170, 32896]);
    }
}
