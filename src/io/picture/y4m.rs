//! Films without compression for programs that read a pipe: YUV4MPEG2.
//!
//! Planes of Y′, Cb and Cr in full resolution (`C444`), 8 bits in the limited range (16…235 and 16…240), by the matrix of
//! ITU-R BT.709. The format does not say which matrix it is: ffmpeg must be told (`-colorspace bt709` before `-i`).

use super::film::{Film, FilmReport};
use super::packet::Packet;
use super::{Error, check_size};
use crate::image::Rgba8;
use std::io::Write;

/// Longest side: what fits any reader's 32-bit sums.
pub(super) const SIDE: usize = 1 << 15;

/// Shares of red and blue in luma, BT.709-6 item 3.2.
const RED: f64 = 0.2126;
const BLUE: f64 = 0.0722;
/// Bits after the point of the matrix.
const BITS: u32 = 15;

/// A weight of the matrix.
const fn fixed(x: f64) -> i32 {
    let scaled = x * (1 << BITS) as f64;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}

/// Rows for Y′, Cb, Cr; columns for R′, G′, B′.
const MATRIX: [[i32; 3]; 3] = {
    let (luma, chroma) = (219.0 / 255.0, 224.0 / 255.0);
    let green = 1.0 - RED - BLUE;
    let (cb, cr) = (0.5 / (1.0 - BLUE) * chroma, 0.5 / (1.0 - RED) * chroma);
    // Rows of differences must cancel for grey, so one weight is what the others leave.
    let [y0, y2] = [fixed(RED * luma), fixed(BLUE * luma)];
    let [b0, b2] = [fixed(-RED * cb), fixed((1.0 - BLUE) * cb)];
    let [r0, r2] = [fixed((1.0 - RED) * cr), fixed(-BLUE * cr)];
    [[y0, fixed(green * luma), y2], [b0, -b0 - b2, b2], [r0, -r0 - r2, r2]]
};

/// A frame as the file holds it; alpha is laid over the matte in linear light.
pub(super) fn packet(film: &Film, now: &Rgba8) -> Result<Packet, Error> {
    check_size(now, "Y4M", SIDE)?;
    let count = now.width * now.height;
    let mut bytes = b"FRAME\n".to_vec();
    bytes.resize(6 + 3 * count, 0);
    let (luma, chroma) = bytes[6..].split_at_mut(count);
    let (blue, red) = chroma.split_at_mut(count);
    let planes = luma.iter_mut().zip(blue).zip(red);
    for (((y, cb), cr), p) in planes.zip(now.data.as_chunks::<4>().0) {
        let [r, g, b] = film.over_matte(*p).map(i32::from);
        let row = |k: usize, offset: i32| {
            let [a, c, d] = MATRIX[k];
            ((a * r + c * g + d * b + (offset << BITS) + (1 << (BITS - 1))) >> BITS) as u8
        };
        (*y, *cb, *cr) = (row(0, 16), row(1, 128), row(2, 128));
    }
    Ok(Packet::Plain(bytes))
}

/// Writes a Y4M; memory holds one frame, whatever the length of the film.
pub(super) struct Y4mWriter<W: Write> {
    out: W,
    came: u32,
}

impl<W: Write> Y4mWriter<W> {
    pub fn new(mut out: W, film: Film) -> Result<Self, Error> {
        film.check("Y4M", SIDE)?;
        let ([width, height], rate) = (film.size, film.rate);
        let (frames, seconds) = (rate.frames(), rate.seconds());
        let head =
            format!("YUV4MPEG2 W{width} H{height} F{frames}:{seconds} Ip A1:1 C444 XCOLORRANGE=LIMITED\n");
        out.write_all(head.as_bytes()).map_err(failed)?;
        Ok(Self { out, came: 0 })
    }

    /// Add a frame.
    pub fn write(&mut self, planes: &[u8]) -> Result<(), Error> {
        self.came += 1;
        self.out.write_all(planes).map_err(failed)
    }

    pub fn finish(mut self) -> Result<FilmReport, Error> {
        self.out.flush().map_err(failed)?;
        Ok(FilmReport { frames: self.came, dropped: 0 })
    }
}

fn failed(source: std::io::Error) -> Error {
    Error::Encode { format: "Y4M", source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Rate;

    #[test]
    fn planes_are_what_the_standard_says() {
        let colors = [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [90, 90, 90]];
        let data: Vec<u8> = colors.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let film = Film { size: [6, 1], ..Film::new([6, 1], 1, Rate::default()) };
        let Ok(Packet::Plain(bytes)) = packet(&film, &Rgba8 { width: 6, height: 1, data }) else { panic!() };
        // BT.709, 8 bits: 16 + 219 Y′, 128 + 224 C′, rounded.
        let expect =
            [[16, 235, 63, 173, 32, 93], [128, 128, 102, 42, 240, 128], [128, 128, 240, 26, 118, 128]];
        assert_eq!(bytes[6..], *expect.as_flattened());
    }
}
