//! Mip chains: each level the area-weighted mean of the one before, in linear light.

use super::Content;
use crate::image::color::{LINEAR_OF_SRGB8, srgb8};
use std::sync::LazyLock;

/// 8-bit sRGB codes of 65536 equal steps of linear light.
///
/// Codes rise with light, so it is enough to find by halving where each begins: a quarter of a millisecond less at the start
/// of a process than to encode every step.
static CODES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let code = |i: usize| srgb8(i as f32 / 65535.0);
    let mut codes = Vec::with_capacity(65536);
    for k in 0..=255 {
        let (mut low, mut high) = (codes.len(), 65536);
        while low < high {
            let middle = (low + high) / 2;
            if code(middle) <= k { low = middle + 1 } else { high = middle }
        }
        codes.resize(low, k);
    }
    codes
});

/// All levels down to 1×1, and whether every texel is opaque; each side is half of the one before, rounded down, at least 1.
pub(super) fn chain(
    width: u32,
    height: u32,
    bytes: Vec<u8>,
    channels: usize,
    content: Content,
) -> (Vec<Vec<u8>>, bool) {
    let size = [width as usize, height as usize];
    if channels == 3 { chain_of::<3>(size, bytes, content) } else { chain_of::<4>(size, bytes, content) }
}

/// The same of texels of `C` bytes: RGB or RGBA.
fn chain_of<const C: usize>(
    [mut w, mut h]: [usize; 2],
    bytes: Vec<u8>,
    content: Content,
) -> (Vec<Vec<u8>>, bool) {
    let (mut levels, mut opaque) = (vec![bytes], None);
    while w > 1 || h > 1 {
        let last = &levels[levels.len() - 1];
        let next = match content {
            Content::Numbers => half_linear::<C>(last, w, h),
            Content::Color | Content::ColorAndNumber => {
                let even = w.is_multiple_of(2) && h.is_multiple_of(2);
                let short = even.then(|| half_opaque::<C>(last, w));
                opaque = opaque.or(short.as_ref().map(Option::is_some).filter(|_| levels.len() == 1));
                short.flatten().unwrap_or_else(|| half_srgb::<C>(content, last, w, h))
            }
        };
        levels.push(next);
        (w, h) = ((w / 2).max(1), (h / 2).max(1));
    }
    let opaque = opaque.unwrap_or_else(|| C == 3 || is_opaque(&levels[0]));
    (levels, opaque)
}

fn is_opaque(rgba: &[u8]) -> bool {
    rgba.chunks(4096).all(|c| c.as_chunks::<4>().0.iter().fold(255, |a, t| a & t[3]) == 255)
}

/// Linear light of each 8-bit sRGB code in 65535ths.
static LINEAR16: LazyLock<[u32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| (LINEAR_OF_SRGB8[i] * 65535.0 + 0.5) as u32));

fn half_srgb<const C: usize>(content: Content, from: &[u8], w: usize, h: usize) -> Vec<u8> {
    let (linear, codes) = (&*LINEAR_OF_SRGB8, &**CODES);
    let (decode, encode) = (|c| linear[c as usize], |v: f32| codes[(v * 65535.0 + 0.5) as usize & 0xffff]);
    match content {
        Content::Color => half::<true, C>(from, w, h, decode, encode),
        _ => half::<false, C>(from, w, h, decode, encode),
    }
}

/// Texels of a level from which on two threads are worth their start; larger ones get one for each two of these.
const PARALLEL: usize = 1 << 18;

/// Threads at most: asking how many processors there are would take as long as a tenth of a level.
const WORKERS: usize = 8;

/// The plain mean of four opaque texels: most pictures have even sides and no holes, and this takes a third of the time.
/// `None` where a texel is not opaque.
fn half_opaque<const C: usize>(from: &[u8], w: usize) -> Option<Vec<u8>> {
    let mut out = vec![0; from.len() / 4];
    let workers = match from.len() / C {
        0..PARALLEL => 1,
        texels => (texels / PARALLEL / 2).clamp(2, WORKERS),
    };
    // Bands of rows, the first on this thread; each texel is made once, so their number changes nothing.
    let rows = (from.len() / (2 * C * w)).div_ceil(workers).max(1);
    let opaque = std::thread::scope(|scope| {
        let mut bands = from.chunks(2 * C * w * rows).zip(out.chunks_mut(C * w / 2 * rows));
        let own = bands.next();
        let others: Vec<_> = bands.map(|(from, to)| scope.spawn(move || halve::<C>(from, to, w))).collect();
        let own = own.is_none_or(|(from, to)| halve::<C>(from, to, w));
        others.into_iter().fold(own, |all, band| band.join().unwrap_or(false) && all)
    });
    opaque.then_some(out)
}

/// The means of a band, and whether all of it is opaque.
fn halve<const C: usize>(from: &[u8], to: &mut [u8], w: usize) -> bool {
    let (linear, codes) = (&*LINEAR16, &**CODES);
    let mut alpha = 255;
    for (rows, out) in from.chunks_exact(2 * C * w).zip(to.chunks_exact_mut(C * w / 2)) {
        let (upper, lower) = rows.split_at(C * w);
        let texels = upper.chunks_exact(2 * C).zip(lower.chunks_exact(2 * C));
        for ((a, b), out) in texels.zip(out.as_chunks_mut::<C>().0) {
            for c in 0..3 {
                let sum: u32 = [a[c], a[c + C], b[c], b[c + C]].iter().map(|&v| linear[v as usize]).sum();
                out[c] = codes[(sum as usize + 2) / 4];
            }
            if C == 4 {
                alpha &= a[3] & a[7] & b[3] & b[7];
                out[3] = 255;
            }
        }
        if alpha != 255 {
            return false;
        }
    }
    true
}

fn half_linear<const C: usize>(from: &[u8], w: usize, h: usize) -> Vec<u8> {
    half::<false, C>(from, w, h, |c| c as f32, |v| (v + 0.5) as u8)
}

/// Source texels of one target texel along a side: the first, and the weights of three, whose sum is 1.
///
/// Of an odd side `2n+1`, target `i` covers texels `2i`, `2i+1` and `2i+2` by `n−i`, `n` and `i+1` parts.
fn taps(side: usize) -> Vec<(usize, [f32; 3])> {
    let n = (side / 2).max(1);
    let one = |i: usize| match side {
        1 => (0, [1.0, 0.0, 0.0]),
        _ if side.is_multiple_of(2) => (2 * i, [0.5, 0.5, 0.0]),
        _ => (2 * i, [(n - i) as f32 / side as f32, n as f32 / side as f32, (i + 1) as f32 / side as f32]),
    };
    (0..n).map(one).collect()
}

/// The next level. Colours count by their alpha, so that what is invisible does not bleed into what is not; where alpha is
/// not coverage everything counts alike.
#[inline(always)]
fn half<const COVERAGE: bool, const C: usize>(
    from: &[u8],
    w: usize,
    h: usize,
    decode: impl Fn(u8) -> f32,
    encode: impl Fn(f32) -> u8,
) -> Vec<u8> {
    let (columns, rows) = (taps(w), taps(h));
    let texels = from.as_chunks::<C>().0;
    let (wide, high) =
        (if w % 2 == 1 && w > 1 { 3 } else { w.min(2) }, if h % 2 == 1 && h > 1 { 3 } else { h.min(2) });
    let mut out = Vec::with_capacity(C * columns.len() * rows.len());
    for (y, row_weights) in &rows {
        for (x, column_weights) in &columns {
            let (mut sum, mut plain, mut alpha) = ([0f32; 3], [0f32; 3], 0f32);
            for j in 0..high {
                for (i, t) in texels[(y + j) * w + x..][..wide].iter().enumerate() {
                    let weight = row_weights[j] * column_weights[i];
                    let a = weight * if C == 4 { t[C - 1] as f32 } else { 255.0 };
                    alpha += a;
                    for c in 0..3 {
                        let v = decode(t[c]);
                        sum[c] += a * v;
                        plain[c] += weight * v;
                    }
                }
            }
            let scale = 1.0 / alpha;
            let color = |c: usize| encode(if COVERAGE && alpha > 0.0 { sum[c] * scale } else { plain[c] });
            out.extend_from_slice(&[color(0), color(1), color(2), (alpha + 0.5) as u8][..C]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_what_encoding_gives() {
        assert_eq!(CODES.len(), 65536);
        assert!((0..65536).all(|i| CODES[i] == srgb8(i as f32 / 65535.0)));
    }

    #[test]
    fn black_and_white_meet_in_linear_light() {
        let levels = chain(2, 1, vec![0, 0, 0, 255, 255, 255, 255, 255], 4, Content::Color).0;
        // sRGB of one half is 187.5.
        assert_eq!(levels[1], [188, 188, 188, 255]);
        assert_eq!(
            chain(2, 1, vec![0, 10, 0, 255, 255, 20, 255, 255], 4, Content::Numbers).0[1],
            [128, 15, 128, 255]
        );
    }

    #[test]
    fn the_short_way_agrees_with_the_long_one() {
        let picture: Vec<u8> = (0..64 * 32)
            .flat_map(|i| [i * 7 % 256, i * 13 % 251, i * i % 256, 255].map(|v| v as u8))
            .collect();
        let (long, short) =
            (half_srgb::<4>(Content::Color, &picture, 64, 32), half_opaque::<4>(&picture, 64));
        let off = short.expect("no hole").iter().zip(&long).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(1), "{off:?}");
    }

    #[test]
    fn bands_and_holes_change_nothing() {
        // Large enough for several threads; one texel in the last row is not opaque.
        let (w, h) = (1024, 520);
        let mut picture: Vec<u8> =
            (0..w * h).flat_map(|i| [i * 7 % 256, i * 13 % 251, i / w % 256, 255].map(|v| v as u8)).collect();
        let mut whole = vec![0; picture.len() / 4];
        assert!(
            halve::<4>(&picture, &mut whole, w) && half_opaque::<4>(&picture, w).as_ref() == Some(&whole)
        );
        let last = picture.len() - 1;
        picture[last] = 254;
        assert_eq!(half_opaque::<4>(&picture, w), None);
        assert_eq!(half_srgb::<4>(Content::Color, &picture, w, h)[whole.len() - 1], 255);
    }

    #[test]
    fn without_alpha_levels_are_those_of_an_opaque_picture() {
        for (w, h) in [(64, 32), (6, 2), (7, 3), (1, 5)] {
            let rgb: Vec<u8> = (0..3 * w * h).map(|i| (i * i % 253) as u8).collect();
            let rgba: Vec<u8> = rgb.chunks(3).flat_map(|t| [t[0], t[1], t[2], 255]).collect();
            for content in [Content::Color, Content::ColorAndNumber, Content::Numbers] {
                let (four, opaque) = chain(w, h, rgba.clone(), 4, content);
                let (three, also) = chain(w, h, rgb.clone(), 3, content);
                let cut =
                    |level: &Vec<u8>| level.chunks(4).flat_map(|t| t[..3].to_vec()).collect::<Vec<u8>>();
                assert_eq!(four.iter().map(cut).collect::<Vec<_>>(), three, "{w}×{h} {content:?}");
                assert!(opaque && also);
            }
        }
    }

    #[test]
    fn what_is_invisible_does_not_bleed() {
        let levels = chain(2, 1, vec![200, 100, 50, 255, 0, 255, 0, 0], 4, Content::Color).0;
        assert_eq!(levels[1], [200, 100, 50, 128]);
    }

    #[test]
    fn odd_sizes_keep_the_mean() {
        // Five texels to two: the middle one counts half in each.
        let row: Vec<u8> = [10, 20, 30, 40, 50].iter().flat_map(|&v| [v, v, v, 255]).collect();
        let levels = chain(5, 1, row, 4, Content::Numbers).0;
        assert_eq!(levels.iter().map(|l| l.len() / 4).collect::<Vec<_>>(), [5, 2, 1]);
        assert_eq!((levels[1][0], levels[1][4], levels[2][0]), (18, 42, 30));
        let flat = chain(7, 3, vec![77; 4 * 21], 4, Content::Color).0;
        assert!(flat.iter().flatten().all(|&v| v == 77));
    }
}
