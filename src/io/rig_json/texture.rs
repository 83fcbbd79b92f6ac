//! Pictures that materials name.

use super::{Fetch, RigError, inside_project};
use crate::io::Warning;
use crate::scene::{Texture, TextureId};

/// Pictures read so far; one that several materials name is read once.
pub struct Textures<'a> {
    wanted: bool,
    fetch: Fetch<'a>,
    files: Vec<String>,
    pub list: Vec<Texture>,
}

impl<'a> Textures<'a> {
    pub fn new(wanted: bool, fetch: Fetch<'a>) -> Self {
        Self { wanted, fetch, files: Vec::new(), list: Vec::new() }
    }

    /// The texture of a file; `None` where pictures are left out.
    pub fn load(&mut self, file: &str, warnings: &mut Vec<Warning>) -> Result<Option<TextureId>, RigError> {
        let path = inside_project(file)?;
        if !self.wanted {
            return Ok(None);
        }
        if let Some(i) = self.files.iter().position(|f| f == file) {
            return Ok(Some(TextureId(i as u32)));
        }
        let bytes = (self.fetch)(path).map_err(|source| RigError::Read { file: file.into(), source })?;
        let Some(texture) = decode(file, &bytes)? else {
            let message = format!("texture `{file}` is left out: this build has no picture decoders");
            warnings.push(Warning { place: "materials".into(), message });
            return Ok(None);
        };
        self.files.push(file.into());
        self.list.push(texture);
        Ok(Some(TextureId(self.list.len() as u32 - 1)))
    }
}

#[cfg(not(feature = "pictures"))]
fn decode(_: &str, _: &[u8]) -> Result<Option<Texture>, RigError> {
    Ok(None)
}

#[cfg(feature = "pictures")]
fn decode(file: &str, bytes: &[u8]) -> Result<Option<Texture>, RigError> {
    use crate::scene::{Filter, WrapMode};
    let error = |message: String| RigError::Texture { file: file.into(), message };
    let mut reader = image::ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(16_384), Some(16_384));
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| error(e.to_string()))?.into_rgba8();
    let (width, height) = picture.dimensions();
    Texture::new(width, height, picture.into_raw(), true, [WrapMode::Repeat; 2], Filter::Trilinear)
        .map(Some)
        .map_err(|e| error(e.to_string()))
}
