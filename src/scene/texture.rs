//! Textures: decoded pixels, how they repeat and how they are filtered.

use super::texels::{Level, Texels};

/// A texture's place in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureId(pub u32);

/// What lies outside 0…1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WrapMode {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture mirrored, every other time.
    Mirror,
    /// Its edge.
    Clamp,
}

/// How pixels are mixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// The nearest pixel of the nearest level.
    Nearest,
    /// Eight pixels of two levels.
    #[default]
    Trilinear,
}

/// What a texture's numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Content {
    /// RGB are sRGB codes and alpha is coverage: mip levels are means in linear light that count by alpha.
    Color,
    /// RGB are sRGB codes and alpha is a number of its own: means in linear light, alpha apart.
    ColorAndNumber,
    /// Four numbers, as in normal maps: plain means.
    Numbers,
}

/// Decoded 8-bit RGB or RGBA with its mip chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    width: u32,
    height: u32,
    content: Content,
    wrap: [WrapMode; 2],
    filter: Filter,
    channels: usize,
    levels: Vec<Vec<u8>>,
    /// The same for filters, made when they are first needed.
    texels: Texels,
}

/// Pixels that make no texture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "a {width}×{height} texture needs {expected} bytes (3 or 4 a pixel, at least one pixel), found {found}"
)]
pub struct TextureError {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `4 · width · height`; a quarter less without alpha.
    pub expected: u64,
    /// Bytes given.
    pub found: u64,
}

impl Texture {
    /// Build from RGBA bytes, or RGB where all of it is opaque, rows from the top.
    ///
    /// # Errors
    /// [`TextureError`] where the bytes do not fit the size.
    pub fn new(
        width: u32,
        height: u32,
        bytes: Vec<u8>,
        content: Content,
        wrap: [WrapMode; 2],
        filter: Filter,
    ) -> Result<Self, TextureError> {
        let (pixels, found) = (width as u64 * height as u64, bytes.len() as u64);
        if pixels == 0 || (found != 3 * pixels && found != 4 * pixels) {
            return Err(TextureError { width, height, expected: 4 * pixels, found });
        }
        let channels = (found / pixels) as usize;
        let (levels, opaque) = super::mips::chain(width, height, bytes, channels, content);
        let texels = Texels::new(width, height, levels.len(), opaque && content != Content::Numbers);
        Ok(Self { width, height, content, wrap, filter, channels, levels, texels })
    }

    /// Pixels a row of the finest level.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of the finest level.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// RGB are sRGB codes.
    pub fn srgb(&self) -> bool {
        self.content != Content::Numbers
    }

    /// What lies outside, along u and v.
    pub fn wrap(&self) -> [WrapMode; 2] {
        self.wrap
    }

    /// How pixels are mixed.
    pub fn filter(&self) -> Filter {
        self.filter
    }

    /// Bytes of a pixel: 4, or 3 where there is no alpha.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Bytes of the levels; 0 is the finest, each next one half as large.
    pub fn levels(&self) -> &[Vec<u8>] {
        &self.levels
    }

    /// RGBA bytes of the finest level.
    pub fn rgba(&self) -> Vec<u8> {
        let finest = &self.levels[0];
        match self.channels {
            3 => finest.as_chunks::<3>().0.iter().flat_map(opaque).collect(),
            _ => finest.clone(),
        }
    }

    /// The levels for filters, if they are packed.
    #[inline(always)]
    pub(crate) fn packed(&self) -> Option<&[Level<u32>]> {
        match &self.texels {
            Texels::Packed(levels) => Some(levels),
            Texels::Wide(_) => None,
        }
    }

    /// The levels for filters, if they are not packed.
    #[inline(always)]
    pub(crate) fn wide(&self) -> &[Level<[u16; 4]>] {
        match &self.texels {
            Texels::Packed(_) => &[],
            Texels::Wide(levels) => levels,
        }
    }
}

/// A pixel without alpha.
#[inline(always)]
pub(super) fn opaque(&[r, g, b]: &[u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}
