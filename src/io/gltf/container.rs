//! Telling `.glb` from `.gltf` by content, and taking a GLB apart.

use super::error::{GltfError, Result};

const MAGIC: &[u8; 4] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// The two parts of an asset.
pub(super) struct Parts<'a> {
    /// UTF-8 JSON, without a byte-order mark.
    pub json: &'a [u8],
    /// The binary chunk of a GLB.
    pub bin: Option<&'a [u8]>,
}

/// Find the JSON and the binary chunk.
pub(super) fn split(bytes: &[u8]) -> Result<Parts<'_>> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let first = json.iter().position(|b| !b.is_ascii_whitespace());
        if first.is_none_or(|i| json[i] != b'{') {
            let found = first.map_or("nothing".into(), |i| format!("byte 0x{:02x}", json[i]));
            return Err(broken(0, "`glTF` (a GLB) or `{` (JSON)", found));
        }
        return Ok(Parts { json, bin: None });
    };
    let word = |at: usize| rest.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let version = word(0).ok_or_else(|| broken(4, "a GLB version", "the end of the file"))?;
    if version != 2 {
        return Err(GltfError::Version { place: "GLB header", found: version.to_string() });
    }
    let length = word(4).ok_or_else(|| broken(8, "the length of the GLB", "the end of the file"))? as usize;
    if length > bytes.len() || length < 12 {
        return Err(broken(8, &format!("{length} bytes, as the header says"), format!("{}", bytes.len())));
    }
    chunks(&bytes[..length])
}

/// Walk the chunks: JSON first, the first BIN counts, unknown ones are skipped.
fn chunks(bytes: &[u8]) -> Result<Parts<'_>> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let (mut json, mut bin, mut at) = (None, None, 12);
    while at < bytes.len() {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(broken(at, "a chunk header of 8 bytes", format!("{} bytes", bytes.len() - at)));
        };
        let body = bytes.get(at + 8..).and_then(|b| b.get(..size as usize)).ok_or_else(|| {
            broken(at, &format!("a chunk of {size} bytes"), format!("{} bytes", bytes.len() - at - 8))
        })?;
        match kind {
            JSON if json.is_none() => json = Some(body),
            BIN if bin.is_none() => bin = Some(body),
            _ if json.is_none() => {
                return Err(broken(at + 4, "a JSON chunk first", format!("chunk type 0x{kind:08x}")));
            }
            _ => {}
        }
        at += 8 + size as usize;
    }
    let json = json.ok_or_else(|| broken(12, "a JSON chunk", "no chunk"))?;
    Ok(Parts { json: json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json), bin })
}

fn broken(offset: usize, expected: &str, found: impl Into<String>) -> GltfError {
    GltfError::Container { offset: offset as u64, expected: expected.into(), found: found.into() }
}
