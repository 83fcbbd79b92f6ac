//! One picture of linear light as OpenEXR.
//!
//! Industrial Light & Magic, *OpenEXR File Layout*: scan lines in blocks of 16, each with its bytes taken apart, differenced
//! and deflated ("ZIP"), a table of where the blocks are.

use super::Error;
use crate::image::Image;
use std::io::Write;

/// How the numbers of an OpenEXR file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum ExrDepth {
    /// 32 bits: the picture's own numbers.
    #[default]
    Float,
    /// 16 bits: 11 bits of precision up to 65504, in about half the bytes.
    Half,
}

/// Rows that are compressed together.
const BLOCK_ROWS: usize = 16;
/// Longest side: coordinates are 32-bit.
const LIMIT: usize = i32::MAX as usize / 2;
/// Channels in the file's order, by name, with their place in a pixel.
const CHANNELS: [(&str, usize); 4] = [("A", 3), ("B", 2), ("G", 1), ("R", 0)];

/// Bytes of an OpenEXR file: the channels R, G, B and A of linear light, alpha premultiplied, Rec. 709 primaries.
///
/// Without loss for [`ExrDepth::Float`]; halves are rounded to the nearest, ties to even. The same picture gives the same
/// bytes. Pure: it may run on any thread.
///
/// # Errors
/// [`Error::Size`] where a side is zero or the buffer does not hold `width · height` pixels.
pub fn encode_exr(picture: &Image, depth: ExrDepth) -> Result<Vec<u8>, Error> {
    let Image { width, height, ref pixels } = *picture;
    let fits = |n: usize| (1..=LIMIT).contains(&n);
    if !fits(width) || !fits(height) || width.checked_mul(height) != Some(pixels.len()) {
        let bytes = 16 * pixels.len();
        return Err(Error::Size { width, height, bytes, format: "OpenEXR", limit: LIMIT });
    }
    let mut file = header(width, height, depth);
    let blocks = pixels.chunks(width * BLOCK_ROWS);
    let table = file.len();
    file.resize(table + 8 * blocks.len(), 0);
    let (mut raw, mut apart, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
    for (k, rows) in blocks.enumerate() {
        let offset = file.len() as u64;
        file[table + 8 * k..][..8].copy_from_slice(&offset.to_le_bytes());
        gather(rows, width, depth, &mut raw);
        take_apart(&raw, &mut apart, &mut sorted);
        let packed = deflate(&sorted)?;
        // What does not shrink is stored as it is; readers tell by the size.
        let data = if packed.len() < raw.len() { &packed } else { &raw };
        file.extend(((k * BLOCK_ROWS) as i32).to_le_bytes());
        file.extend((data.len() as i32).to_le_bytes());
        file.extend(data);
    }
    Ok(file)
}

/// Magic number, version 2 and the attributes that every file must have.
fn header(width: usize, height: usize, depth: ExrDepth) -> Vec<u8> {
    let mut h = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        h.extend(name.bytes().chain([0]).chain(kind.bytes()).chain([0]));
        h.extend((value.len() as i32).to_le_bytes());
        h.extend(value);
    };
    let window: Vec<u8> =
        [0, 0, width as i32 - 1, height as i32 - 1].iter().flat_map(|v| v.to_le_bytes()).collect();
    let (one, origin) = (1.0_f32.to_le_bytes(), [0; 8]);
    // 3 is ZIP in blocks of 16 rows; rows run downwards.
    attribute("channels", "chlist", &channel_list(depth));
    attribute("compression", "compression", &[3]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &one);
    attribute("screenWindowCenter", "v2f", &origin);
    attribute("screenWindowWidth", "float", &one);
    h.push(0);
    h
}

fn channel_list(depth: ExrDepth) -> Vec<u8> {
    let kind: i32 = if depth == ExrDepth::Half { 1 } else { 2 };
    let mut list = Vec::new();
    for (name, _) in CHANNELS {
        list.extend(name.bytes().chain([0]));
        list.extend(kind.to_le_bytes());
        // Neither perceptually linear nor subsampled.
        list.extend([0; 4]);
        list.extend([1_i32.to_le_bytes(), 1_i32.to_le_bytes()].concat());
    }
    list.push(0);
    list
}

/// Numbers of some rows: row by row, channel by channel.
fn gather(rows: &[[f32; 4]], width: usize, depth: ExrDepth, out: &mut Vec<u8>) {
    let bytes = if depth == ExrDepth::Half { 2 } else { 4 };
    out.resize(4 * bytes * rows.len(), 0);
    for (line, row) in out.chunks_exact_mut(4 * bytes * width).zip(rows.chunks_exact(width)) {
        for (to, (_, c)) in line.chunks_exact_mut(bytes * width).zip(CHANNELS) {
            match depth {
                ExrDepth::Float => store(to, row.iter().map(|p| p[c].to_le_bytes())),
                ExrDepth::Half => store(to, row.iter().map(|p| half(p[c]).to_le_bytes())),
            }
        }
    }
}

fn store<const N: usize>(to: &mut [u8], numbers: impl Iterator<Item = [u8; N]>) {
    to.as_chunks_mut::<N>().0.iter_mut().zip(numbers).for_each(|(to, n)| *to = n);
}

/// Even bytes before odd ones, then each as its difference from the one before, plus 128. Their number is even.
fn take_apart(raw: &[u8], apart: &mut Vec<u8>, out: &mut Vec<u8>) {
    apart.resize(raw.len(), 0);
    let (even, odd) = apart.split_at_mut(raw.len() / 2);
    for ((pair, even), odd) in raw.as_chunks::<2>().0.iter().zip(even).zip(odd) {
        [*even, *odd] = *pair;
    }
    out.clear();
    let Some((first, rest)) = apart.split_first() else { return };
    out.push(*first);
    out.extend(
        rest.iter().zip(apart.iter()).map(|(now, before)| now.wrapping_sub(*before).wrapping_add(128)),
    );
}

fn deflate(bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let mut encoder =
        flate2::write::ZlibEncoder::new(Vec::with_capacity(bytes.len() / 4), flate2::Compression::new(1));
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    packed.map_err(|source| Error::Encode { format: "OpenEXR", source })
}

/// IEEE 754 binary16 of a number, rounded to nearest, ties to even.
fn half(v: f32) -> u16 {
    let bits = v.to_bits();
    let (sign, magnitude) = ((bits >> 16) as u16 & 0x8000, bits & 0x7fff_ffff);
    let code = match magnitude {
        // NaN stays one, with a bit that cannot be shifted away.
        0x7f80_0001.. => 0x7e00,
        // 65520 and above round to infinity.
        0x477f_f000.. => 0x7c00,
        // Normal numbers: another bias, and 13 bits rounded off.
        0x3880_0000.. => {
            let m = magnitude - 0x3800_0000;
            (m + 0xfff + (m >> 13 & 1)) >> 13
        }
        // Below 2⁻¹⁴ the unit is 2⁻²⁴: adding 0.5 lets the hardware round to it.
        _ => (f32::from_bits(magnitude) + 0.5).to_bits() - 0.5_f32.to_bits(),
    };
    sign | code as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_round_to_nearest_even() {
        let cases = [
            (0.0, 0x0000),
            (-0.0, 0x8000),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (65504.0, 0x7bff),
            (65519.9, 0x7bff),
            (65520.0, 0x7c00),
            (f32::INFINITY, 0x7c00),
            (6.1035156e-5, 0x0400),
            (5.9604645e-8, 0x0001),
            (2.9802322e-8, 0x0000),
            (2.9802326e-8, 0x0001),
            // Half way between neighbours: the even one.
            (1.0 + 1.0 / 2048.0, 0x3c00),
            (1.0 + 3.0 / 2048.0, 0x3c02),
        ];
        for (v, code) in cases {
            assert_eq!(half(v), code, "{v}");
        }
        assert!(half(f32::NAN) & 0x7c00 == 0x7c00 && half(f32::NAN) & 0x3ff != 0);
    }
}
