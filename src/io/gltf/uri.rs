//! URIs of buffers and images: embedded data, or a file that stays inside the asset's folder.

use super::error::{GltfError, Result};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::path::{Path, PathBuf};

/// Padding is optional, as in browsers.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Where the bytes of a URI are. Different URIs of one file are the same source.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Source<'u> {
    /// In the URI itself.
    Data(&'u str),
    /// In a regular file, by its resolved path.
    File(PathBuf),
}

impl<'u> Source<'u> {
    /// What `uri` means; nothing is read yet.
    pub fn of(uri: &'u str, base: Option<&Path>, place: &str) -> Result<Self> {
        if uri.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:")) {
            return Ok(Self::Data(uri));
        }
        resolve(uri, base, place).map(Self::File)
    }

    /// Bytes that reading will take at most.
    pub fn size(&self, place: &str) -> Result<u64> {
        match self {
            Self::Data(uri) => Ok(uri.len() as u64),
            Self::File(path) => {
                let read = |source| GltfError::Read {
                    place: place.into(),
                    file: path.display().to_string(),
                    source,
                };
                std::fs::metadata(path).map(|m| m.len()).map_err(read)
            }
        }
    }

    /// The bytes.
    pub fn read(&self, place: &str) -> Result<Vec<u8>> {
        match self {
            Self::Data(uri) => data(uri, place),
            Self::File(path) => {
                let read = |source| GltfError::Read {
                    place: place.into(),
                    file: path.display().to_string(),
                    source,
                };
                crate::io::read_file(path).map_err(read)
            }
        }
    }
}

fn data(uri: &str, place: &str) -> Result<Vec<u8>> {
    let Some((head, body)) = uri[5..].split_once(',') else {
        return Err(wrong(uri, place, "has no comma before its data"));
    };
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Ok(percent_encoding::percent_decode_str(body).collect());
    }
    // Line breaks and percent-encoded signs occur in files written by hand.
    let clean: Vec<u8> =
        percent_encoding::percent_decode_str(body).filter(|b| !b.is_ascii_whitespace()).collect();
    BASE64.decode(clean).map_err(|e| wrong(uri, place, format!("is no base64: {e}")))
}

/// The file behind a relative URI. Neither `..`, nor an absolute path, nor a link leads out of `base`.
fn resolve(uri: &str, base: Option<&Path>, place: &str) -> Result<PathBuf> {
    let Some(base) = base else {
        return Err(wrong(uri, place, "names a file, but the asset was not read from a folder"));
    };
    let decoded = percent_encoding::percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| wrong(uri, place, "is not UTF-8 after percent decoding"))?;

    // The name as the standard reads it; then as written; then with the separators of Windows.
    let names = [decoded.to_string(), uri.to_string(), decoded.replace('\\', "/")];
    for name in &names {
        check(name).map_err(|why| wrong(uri, place, why))?;
    }
    let found = names.iter().map(|n| base.join(n)).find(|p| p.exists());
    let path = found.unwrap_or_else(|| base.join(&names[0]));
    let read = |source| GltfError::Read { place: place.into(), file: path.display().to_string(), source };
    let real = path.canonicalize().map_err(read)?;
    let root = base.canonicalize().map_err(read)?;
    if !real.starts_with(&root) {
        return Err(wrong(uri, place, "leads out of the asset's folder through a link"));
    }
    if !real.is_file() {
        return Err(wrong(uri, place, "is no regular file"));
    }
    Ok(real)
}

fn check(name: &str) -> std::result::Result<(), &'static str> {
    let scheme = name.split_once(':').is_some_and(|(s, _)| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    });
    if scheme {
        return Err("has a scheme; only data URIs and files beside the asset are read");
    }
    if name.starts_with(['/', '\\']) {
        return Err("is an absolute path; files must lie beside the asset");
    }
    let mut depth = 0_i64;
    for part in name.split(['/', '\\']) {
        depth += match part {
            "" | "." => 0,
            ".." => -1,
            _ => 1,
        };
        if depth < 0 {
            return Err("leads out of the asset's folder");
        }
    }
    if name.is_empty() { Err("is empty") } else { Ok(()) }
}

fn wrong(uri: &str, place: &str, why: impl Into<String>) -> GltfError {
    let short: String = uri.chars().take(60).collect();
    let uri = if short.len() < uri.len() { format!("{short}…") } else { short };
    GltfError::Uri { place: place.into(), uri, why: why.into() }
}
