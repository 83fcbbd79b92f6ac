//! Pictures that materials name.

use super::{Fetch, RigError, inside_project};
use crate::io::Warning;
use crate::scene::{Content, Texture, TextureId};

/// Bytes that the pictures of one rig may take together, decoded to four bytes a pixel and without their mip levels: 256 MiB.
pub const MAX_TEXTURE_BYTES: u64 = 256 << 20;

/// Pictures read so far; one that several materials name is read once.
pub struct Textures<'a> {
    wanted: bool,
    fetch: Fetch<'a>,
    files: Vec<(String, Content)>,
    /// Bytes that may still be decoded.
    left: u64,
    pub list: Vec<Texture>,
}

impl<'a> Textures<'a> {
    pub fn new(wanted: bool, fetch: Fetch<'a>) -> Self {
        Self { wanted, fetch, files: Vec::new(), left: MAX_TEXTURE_BYTES, list: Vec::new() }
    }

    /// The texture of a file, and what it is for; `None` where pictures are left out.
    pub fn load(
        &mut self,
        file: &str,
        content: Content,
        warnings: &mut Vec<Warning>,
    ) -> Result<Option<TextureId>, RigError> {
        let path = inside_project(file)?;
        if !self.wanted {
            return Ok(None);
        }
        if let Some(i) = self.files.iter().position(|(name, of)| *name == path && *of == content) {
            return Ok(Some(TextureId(i as u32)));
        }
        let bytes = (self.fetch)(&path).map_err(|source| RigError::Read { file: file.into(), source })?;
        let Some(texture) = decode(file, &bytes, content, &mut self.left)? else {
            let message = format!("texture `{file}` is left out: this build has no picture decoders");
            warnings.push(Warning { place: "materials".into(), message });
            return Ok(None);
        };
        self.files.push((path, content));
        self.list.push(texture);
        Ok(Some(TextureId(self.list.len() as u32 - 1)))
    }
}

#[cfg(not(feature = "pictures"))]
pub(super) fn decode(_: &str, _: &[u8], _: Content, _: &mut u64) -> Result<Option<Texture>, RigError> {
    Ok(None)
}

#[cfg(feature = "pictures")]
pub(super) fn decode(
    file: &str,
    bytes: &[u8],
    content: Content,
    left: &mut u64,
) -> Result<Option<Texture>, RigError> {
    use crate::scene::{Filter, WrapMode};
    let error = |message: String| RigError::Texture { file: file.into(), message };
    let open = || image::ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Png);

    // Know the size before anything of that size is allocated.
    let (width, height) = open().into_dimensions().map_err(|e| error(e.to_string()))?;
    let size = 4 * u64::from(width) * u64::from(height);
    *left = left.checked_sub(size).ok_or_else(|| {
        error(format!(
            "{width} × {height} pixels; the pictures of a rig may take {} MiB together, 4 bytes a pixel, and {} KiB are left",
            MAX_TEXTURE_BYTES >> 20,
            *left >> 10
        ))
    })?;
    let mut reader = open();
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(16_384), Some(16_384));
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| error(e.to_string()))?;
    let (width, height) = (picture.width(), picture.height());
    Texture::new(width, height, crate::io::codes(picture), content, [WrapMode::Repeat; 2], Filter::Trilinear)
        .map(Some)
        .map_err(|e| error(e.to_string()))
}
