//! PNG of pixels that are no colours: indices into a palette, and data that is linear.

use super::dither::Indexed;
use super::palette::Palette;
use super::png::{PngLevel, failed};
use super::{Error, check_sides};
use crate::image::Rgba8;

/// Pixels that mean what their numbers say: no colour space is written beside them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Data<'a> {
    /// Red, green, blue and alpha of 8 bits.
    Rgba8(&'a [[u8; 4]]),
    /// Red, green, blue and alpha of 16 bits.
    Rgba16(&'a [[u16; 4]]),
    /// One value of 16 bits.
    Gray16(&'a [u16]),
    /// Places in a list of sRGB colours; 0 is transparent. At most 256 colours.
    Index8(&'a [u8], &'a [[u8; 3]]),
}

impl Indexed {
    /// Every pixel `k` times across and down.
    ///
    /// ```
    /// use sinew::io::picture::Indexed;
    /// let small = Indexed { size: [2, 1], indices: vec![1, 2] };
    /// assert_eq!(small.enlarged(2).indices, [1, 1, 2, 2, 1, 1, 2, 2]);
    /// ```
    pub fn enlarged(&self, k: usize) -> Self {
        let [w, h] = self.size;
        let row = |y: usize| &self.indices[y * w..][..w];
        let wide = |y: usize| row(y).iter().flat_map(move |&i| std::iter::repeat_n(i, k));
        let indices = (0..h * k).flat_map(|y| wide(y / k)).collect();
        Self { size: [w * k, h * k], indices }
    }

    /// The indices of a picture whose colours are all in the palette: what undoes [`to_rgba8`](Self::to_rgba8). Pixels that are not opaque
    /// are transparent, and so are colours that the palette does not have.
    pub fn of_rgba8(picture: &Rgba8, palette: &Palette) -> Self {
        let mut places: Vec<([u8; 3], u8)> = palette.colors().iter().copied().zip(0..).collect();
        places.sort();
        let find = |color: [u8; 3]| places.binary_search_by_key(&color, |p| p.0).map(|i| places[i].1).ok();
        let index = |&[r, g, b, a]: &[u8; 4]| Some([r, g, b]).filter(|_| a == 255).and_then(find);
        let pixels = picture.data.as_chunks::<4>().0.iter();
        let indices = pixels.map(|p| index(p).unwrap_or(palette.transparent())).collect();
        Self { size: [picture.width, picture.height], indices }
    }

    /// The colours that the indices stand for; the index after the last colour is transparent.
    pub fn to_rgba8(&self, palette: &Palette) -> Rgba8 {
        let color = |&i: &u8| match palette.colors().get(usize::from(i)) {
            Some(&[r, g, b]) => [r, g, b, 255],
            None => [0; 4],
        };
        let data = self.indices.iter().flat_map(color).collect();
        Rgba8 { width: self.size[0], height: self.size[1], data }
    }
}

/// Bytes of a PNG file with a palette of 8-bit sRGB, transparent where the picture is.
///
/// The file holds the whole palette, so that pictures of one clip have the same one.
///
/// # Errors
/// [`Error::Size`] where a side is zero or the indices do not fill the picture.
pub fn encode_indexed_png(picture: &Indexed, palette: &Palette, level: PngLevel) -> Result<Vec<u8>, Error> {
    let holes = picture.indices.contains(&palette.transparent());
    let mut colors = palette.colors().to_vec();
    let mut alpha = None;
    if holes {
        alpha = Some([vec![255; colors.len()], vec![0]].concat());
        colors.push([0; 3]);
    }
    encode_palette(picture.size, &picture.indices, &colors, alpha, level, "")
}

/// Bytes of a PNG file of data; `note` says for readers what the numbers mean, if it is not empty.
///
/// # Errors
/// [`Error::Size`] where a side is zero or the pixels do not fill the picture.
pub fn encode_data_png(size: [usize; 2], data: Data, level: PngLevel, note: &str) -> Result<Vec<u8>, Error> {
    use ::png::{BitDepth, ColorType};
    let wide = |values: &[u16]| values.iter().flat_map(|v| v.to_be_bytes()).collect();
    let (bytes, color, depth) = match data {
        Data::Rgba8(pixels) => (pixels.as_flattened().to_vec(), ColorType::Rgba, BitDepth::Eight),
        Data::Rgba16(pixels) => (wide(pixels.as_flattened()), ColorType::Rgba, BitDepth::Sixteen),
        Data::Gray16(values) => (wide(values), ColorType::Grayscale, BitDepth::Sixteen),
        Data::Index8(indices, colors) => {
            return encode_palette(size, indices, colors, Some(vec![0]), level, note);
        }
    };
    check_sides(size, bytes.len(), color.samples() * if depth == BitDepth::Sixteen { 2 } else { 1 })?;
    let mut out = Vec::new();
    let mut encoder = encoder(&mut out, size, level, note)?;
    encoder.set_color(color);
    encoder.set_depth(depth);
    finish(encoder, &bytes)?;
    Ok(out)
}

fn encode_palette(
    size: [usize; 2],
    indices: &[u8],
    colors: &[[u8; 3]],
    alpha: Option<Vec<u8>>,
    level: PngLevel,
    note: &str,
) -> Result<Vec<u8>, Error> {
    check_sides(size, indices.len(), 1)?;
    let mut out = Vec::new();
    let mut encoder = encoder(&mut out, size, level, note)?;
    encoder.set_color(::png::ColorType::Indexed);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_palette(colors.as_flattened().to_vec());
    if let Some(alpha) = alpha {
        encoder.set_trns(alpha);
    }
    // Differences of indices mean nothing.
    encoder.set_filter(::png::Filter::NoFilter);
    finish(encoder, indices)?;
    Ok(out)
}

fn encoder<'a>(
    out: &'a mut Vec<u8>,
    size: [usize; 2],
    level: PngLevel,
    note: &str,
) -> Result<::png::Encoder<'a, &'a mut Vec<u8>>, Error> {
    let mut encoder = ::png::Encoder::new(out, size[0] as u32, size[1] as u32);
    encoder.set_compression(level.compression());
    if !note.is_empty() {
        encoder.add_itxt_chunk("Description".into(), note.into()).map_err(failed)?;
    }
    Ok(encoder)
}

fn finish(encoder: ::png::Encoder<'_, &mut Vec<u8>>, bytes: &[u8]) -> Result<(), Error> {
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(bytes)?;
        w.finish()
    });
    written.map_err(failed)
}
