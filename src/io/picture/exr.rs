//! One picture of linear light as OpenEXR, with more channels beside it if wanted.
//!
//! Industrial Light & Magic, *OpenEXR File Layout*: scan lines in blocks of 16, each with its bytes taken apart, differenced
//! and deflated ("ZIP"), a table of where the blocks are.

use super::Error;
use crate::image::Image;
use std::io::Write;
use std::ops::Range;

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
/// A channel of the file.
struct Channel<'a> {
    name: &'a str,
    from: Source<'a>,
    half: bool,
}

/// Where its numbers are: a place in each pixel of the picture, or a list.
enum Source<'a> {
    Pixel(usize),
    List(&'a [f32]),
}

/// Bytes of an OpenEXR file: the channels R, G, B and A of linear light, alpha premultiplied, Rec. 709 primaries.
///
/// Without loss for [`ExrDepth::Float`]; halves are rounded to the nearest, ties to even. The same picture gives the same
/// bytes. Pure: it may run on any thread.
///
/// # Errors
/// [`Error::Size`] where a side is zero or the buffer does not hold `width · height` pixels.
pub fn encode_exr(picture: &Image, depth: ExrDepth) -> Result<Vec<u8>, Error> {
    encode_exr_layers(picture, depth, &[])
}

/// The same with more channels in the file: a name such as `normal.X` (layer, point, component) and a 32-bit number a pixel each.
///
/// # Errors
/// As [`encode_exr`]; also where a list does not hold a number for each pixel.
pub fn encode_exr_layers(
    picture: &Image,
    depth: ExrDepth,
    layers: &[(String, Vec<f32>)],
) -> Result<Vec<u8>, Error> {
    let Image { width, height, ref pixels } = *picture;
    let fits = |n: usize| (1..=LIMIT).contains(&n);
    let full = |n: usize| width.checked_mul(height) == Some(n);
    if !fits(width) || !fits(height) || !full(pixels.len()) || layers.iter().any(|l| !full(l.1.len())) {
        let bytes = 16 * pixels.len();
        return Err(Error::Size { width, height, bytes, format: "OpenEXR", limit: LIMIT });
    }
    let half = depth == ExrDepth::Half;
    let color = |(c, name)| Channel { name, from: Source::Pixel(c), half };
    let mut channels: Vec<Channel> = ["R", "G", "B", "A"].into_iter().enumerate().map(color).collect();
    channels.extend(layers.iter().map(|l| Channel { name: &l.0, from: Source::List(&l.1), half: false }));
    // Readers expect them sorted by their bytes.
    channels.sort_by_key(|c| c.name);

    let mut file = header(width, height, &channels);
    let table = file.len();
    file.resize(table + 8 * height.div_ceil(BLOCK_ROWS), 0);
    let (mut raw, mut apart, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
    for (k, top) in (0..height).step_by(BLOCK_ROWS).enumerate() {
        let offset = file.len() as u64;
        file[table + 8 * k..][..8].copy_from_slice(&offset.to_le_bytes());
        raw.clear();
        for y in top..height.min(top + BLOCK_ROWS) {
            let row = y * width..(y + 1) * width;
            channels.iter().for_each(|c| gather(c, pixels, row.clone(), &mut raw));
        }
        take_apart(&raw, &mut apart, &mut sorted);
        let packed = deflate(&sorted)?;
        // What does not shrink is stored as it is; readers tell by the size.
        let data = if packed.len() < raw.len() { &packed } else { &raw };
        file.extend((top as i32).to_le_bytes());
        file.extend((data.len() as i32).to_le_bytes());
        file.extend(data);
    }
    Ok(file)
}

/// Magic number, version 2 and the attributes that every file must have.
fn header(width: usize, height: usize, channels: &[Channel]) -> Vec<u8> {
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
    attribute("channels", "chlist", &channel_list(channels));
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

fn channel_list(channels: &[Channel]) -> Vec<u8> {
    let mut list = Vec::new();
    for c in channels {
        list.extend(c.name.bytes().chain([0]));
        list.extend(if c.half { 1_i32 } else { 2 }.to_le_bytes());
        // Neither perceptually linear nor subsampled.
        list.extend([0; 4]);
        list.extend([1_i32.to_le_bytes(), 1_i32.to_le_bytes()].concat());
    }
    list.push(0);
    list
}

/// A row of a channel.
fn gather(channel: &Channel, pixels: &[[f32; 4]], row: Range<usize>, out: &mut Vec<u8>) {
    match (&channel.from, channel.half) {
        (Source::Pixel(c), true) => out.extend(pixels[row].iter().flat_map(|p| half(p[*c]).to_le_bytes())),
        (Source::Pixel(c), false) => out.extend(pixels[row].iter().flat_map(|p| p[*c].to_le_bytes())),
        (Source::List(list), _) => out.extend(list[row].iter().flat_map(|v| v.to_le_bytes())),
    }
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
