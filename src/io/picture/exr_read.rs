//! OpenEXR back to light: one part of scan lines with R, G and B, and A if there is one, as ours and most renderers write them.
//!
//! Industrial Light & Magic, *OpenEXR File Layout*. Compression: none, ZIPS, ZIP.

use crate::image::Image;
use flate2::read::ZlibDecoder;
use std::io::Read;

/// Most channels of a file, so that a small one cannot ask for much.
const MOST_CHANNELS: usize = 64;

/// A file whose head was understood.
pub(super) struct Exr<'a> {
    bytes: &'a [u8],
    pub size: [usize; 2],
    /// First row.
    top: i64,
    /// Rows a block.
    rows: usize,
    deflated: bool,
    /// In the file's order: which of R, G, B, A, if any, and whether it has 32 bits.
    channels: Vec<(Option<usize>, bool)>,
    /// Where the table of blocks begins.
    table: usize,
}

/// Bytes that are read from the front.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(n).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or_else(|| format!("the file ends at byte {}", self.bytes.len()))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn int(&mut self) -> Result<i32, String> {
        let bytes = self.take(4)?;
        Ok(i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    /// Text up to a zero; names have at most 255 bytes.
    fn text(&mut self) -> Result<&'a [u8], String> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().take(256).position(|&b| b == 0);
        let end = end.ok_or_else(|| format!("the name at byte {} has no end", self.at))?;
        let text = self.take(end)?;
        self.at += 1;
        Ok(text)
    }
}

impl<'a> Exr<'a> {
    /// Read the head.
    pub fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let mut c = Cursor { bytes, at: 0 };
        let (magic, version) = (c.int()?, c.int()?);
        if magic != 0x0131_2f76 || version & !0x400 != 2 {
            return Err(
                "expected one part of scan lines, version 2; tiles, deep data and more parts are not read"
                    .into(),
            );
        }
        let (mut channels, mut compression, mut window) = (Vec::new(), None, None);
        loop {
            let name = c.text()?;
            if name.is_empty() {
                break;
            }
            c.text()?;
            let size =
                usize::try_from(c.int()?).map_err(|_| "an attribute has a negative size".to_string())?;
            let mut value = Cursor { bytes: c.take(size)?, at: 0 };
            match name {
                b"channels" => channels = self::channels(&mut value)?,
                b"compression" => compression = value.take(1)?.first().copied(),
                b"dataWindow" => {
                    window = Some([value.int()?, value.int()?, value.int()?, value.int()?].map(i64::from))
                }
                _ => {}
            }
        }
        let (rows, deflated) = match compression {
            Some(0) => (1, false),
            Some(2) => (1, true),
            Some(3) => (16, true),
            other => return Err(format!("compression {other:?}: expected none (0), ZIPS (2) or ZIP (3)")),
        };
        let [left, top, right, bottom] = window.ok_or("there is no data window")?;
        if !(0..3).all(|k| channels.iter().any(|c| c.0 == Some(k))) {
            return Err("expected the channels R, G and B".into());
        }
        let side = |from: i64, to: i64| usize::try_from(to - from + 1).unwrap_or(0);
        let size = [side(left, right), side(top, bottom)];
        Ok(Self { bytes, size, top, rows, deflated, channels, table: c.at })
    }

    /// Decode all rows.
    pub fn image(&self) -> Result<Image, String> {
        let [width, height] = self.size;
        let blocks = height.div_ceil(self.rows);
        // The table alone shows whether there can be so many rows.
        let table = Cursor { bytes: self.bytes, at: self.table }.take(8 * blocks)?;
        let mut image = Image::filled(width, height, [0.0, 0.0, 0.0, 1.0]);
        let mut block = Vec::new();
        for offset in table.as_chunks::<8>().0 {
            let at = usize::try_from(u64::from_le_bytes(*offset)).unwrap_or(usize::MAX);
            let mut c = Cursor { bytes: self.bytes, at: at.min(self.bytes.len()) };
            let first = usize::try_from(i64::from(c.int()?) - self.top).unwrap_or(usize::MAX);
            let size = usize::try_from(c.int()?).unwrap_or(usize::MAX);
            if first >= height {
                return Err(format!("a block begins at row {first} of {height}"));
            }
            let rows = self.rows.min(height - first);
            self.unpack(c.take(size)?, rows * width * self.pixel_bytes(), &mut block)?;
            self.place(&block, &mut image.pixels[first * width..(first + rows) * width], width);
        }
        Ok(image)
    }

    fn pixel_bytes(&self) -> usize {
        self.channels.iter().map(|c| if c.1 { 4 } else { 2 }).sum()
    }

    /// Inflate, add up the differences and put the two halves together; `size` bytes must come out.
    fn unpack(&self, packed: &[u8], size: usize, out: &mut Vec<u8>) -> Result<(), String> {
        out.clear();
        if !self.deflated || packed.len() == size {
            out.extend(packed);
        } else {
            let mut plain = Vec::new();
            let limited = ZlibDecoder::new(packed).take(size as u64 + 1).read_to_end(&mut plain);
            limited.map_err(|e| e.to_string())?;
            for i in 1..plain.len() {
                plain[i] = plain[i - 1].wrapping_add(plain[i]).wrapping_sub(128);
            }
            let (even, odd) = plain.split_at(plain.len().div_ceil(2));
            out.extend((0..plain.len()).map(|i| if i % 2 == 0 { even[i / 2] } else { odd[i / 2] }));
        }
        let fine = out.len() == size;
        if fine { Ok(()) } else { Err(format!("a block has {} bytes, expected {size}", out.len())) }
    }

    /// Rows of planes into pixels.
    fn place(&self, block: &[u8], pixels: &mut [[f32; 4]], width: usize) {
        let mut at = 0;
        for row in pixels.chunks_mut(width) {
            for &(channel, float) in &self.channels {
                let plane = &block[at..at + width * if float { 4 } else { 2 }];
                at += plane.len();
                let Some(channel) = channel else { continue };
                if float {
                    let values = plane.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
                    row.iter_mut().zip(values).for_each(|(p, v)| p[channel] = v);
                } else {
                    let values = plane.as_chunks::<2>().0.iter().map(|b| half(u16::from_le_bytes(*b)));
                    row.iter_mut().zip(values).for_each(|(p, v)| p[channel] = v);
                }
            }
        }
    }
}

fn channels(c: &mut Cursor) -> Result<Vec<(Option<usize>, bool)>, String> {
    let mut channels = Vec::new();
    loop {
        let name = c.text()?;
        if name.is_empty() {
            return Ok(channels);
        }
        let (kind, _, steps) = (c.int()?, c.int()?, [c.int()?, c.int()?]);
        if steps != [1, 1] || !(0..=2).contains(&kind) {
            return Err(format!(
                "channel {}: expected a value for every pixel",
                String::from_utf8_lossy(name)
            ));
        }
        let known = [&b"R"[..], b"G", b"B", b"A"].iter().position(|n| *n == name);
        // Integers, which only channels without colour have, take four bytes too.
        if kind == 0 && known.is_some() {
            return Err("expected colours in floating point, found integers".into());
        }
        if channels.len() == MOST_CHANNELS {
            return Err(format!("more than {MOST_CHANNELS} channels"));
        }
        channels.push((known, kind != 1));
    }
}

/// A number of 16 bits: sign, 5 bits of exponent, 10 of mantissa.
fn half(bits: u16) -> f32 {
    let (sign, exponent, mantissa) =
        (u32::from(bits >> 15), u32::from(bits >> 10 & 31), u32::from(bits & 1023));
    let magnitude = match exponent {
        // Below 2⁻¹⁴, in steps of 2⁻²⁴.
        0 => mantissa as f32 / 16_777_216.0,
        31 => f32::from_bits(0x7f80_0000 | mantissa << 13),
        e => f32::from_bits((e + 112) << 23 | mantissa << 13),
    };
    if sign == 1 { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::picture::{ExrDepth, encode_exr};
    use crate::test_rng::Rng;

    fn light(width: usize, height: usize) -> Image {
        let mut rng = Rng::new(4);
        let mut pixel = || std::array::from_fn(|_| rng.span(-1.0, 9.0));
        Image { width, height, pixels: (0..width * height).map(|_| pixel()).collect() }
    }

    #[test]
    fn what_was_written_is_read() {
        for (width, height) in [(1, 1), (7, 16), (5, 17), (40, 50)] {
            let image = light(width, height);
            let bytes = encode_exr(&image, ExrDepth::Float).unwrap();
            assert_eq!(Exr::new(&bytes).unwrap().image().unwrap(), image);
            let rough = Exr::new(&encode_exr(&image, ExrDepth::Half).unwrap()).unwrap().image().unwrap();
            let near = |a: &[f32; 4], b: &[f32; 4]| {
                (0..4).all(|c| (a[c] - b[c]).abs() <= a[c].abs() / 2048.0 + 1e-7)
            };
            assert!(image.pixels.iter().zip(&rough.pixels).all(|(a, b)| near(a, b)));
        }
        // What does not vary does shrink.
        let flat = Image::filled(64, 64, [0.25, 0.5, 1.0, 1.0]);
        let bytes = encode_exr(&flat, ExrDepth::Half).unwrap();
        assert!(bytes.len() < 4096 && Exr::new(&bytes).unwrap().image().unwrap() == flat);
    }

    #[test]
    fn halves_are_numbers() {
        let found = [0x0001, 0x03ff, 0x0400, 0x3c00, 0xc000, 0x7bff, 0x7c00, 0x8000].map(half);
        let want = [5.9604645e-8, 6.097555e-5, 6.1035156e-5, 1.0, -2.0, 65504.0, f32::INFINITY, -0.0];
        assert_eq!(found, want);
        assert!(half(0x7e00).is_nan());
    }

    #[test]
    fn cut_and_changed_files_are_refused_or_read_never_worse() {
        let bytes = encode_exr(&light(9, 20), ExrDepth::Float).unwrap();
        let read = |bytes: &[u8]| {
            let exr = Exr::new(bytes)?;
            // The caller bounds the sides.
            if exr.size[0] > 4096 || exr.size[1] > 4096 { Err("sides".into()) } else { exr.image() }
        };
        assert!((0..bytes.len()).all(|n| read(&bytes[..n]).is_err()));
        let mut rng = Rng::new(8);
        for _ in 0..20_000 {
            let mut changed = bytes.clone();
            for _ in 0..1 + rng.below(3) {
                let within = [400, changed.len()][rng.below(2)];
                let at = rng.below(within);
                changed[at] = rng.next() as u8;
            }
            let _ = read(&changed);
        }
    }
}
