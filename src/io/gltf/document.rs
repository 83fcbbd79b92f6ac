//! The parsed file with its bytes: checked look-ups, buffers, buffer views, and the budget of decoded data.

use super::error::{GltfError, Result, entry};
use super::warnings::Warnings;
use super::{compressed, uri};
use ::gltf::json::{Root, buffer};
use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::path::Path;

/// Decoded data that any file may ask for.
const FREE_BYTES: u64 = 128 << 20;
/// Decoded data allowed for each byte of the file: packed vertices take two bytes each, and primitives share accessors.
const BYTES_A_BYTE: u64 = 32;

/// A glTF file: its typed JSON and its buffers.
pub(super) struct Document<'a> {
    /// The typed JSON.
    pub root: Root,
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    unpacked: Vec<OnceCell<Vec<u8>>>,
    used: Cell<u64>,
    limit: u64,
}

impl<'a> Document<'a> {
    /// Load the buffers: the binary chunk, embedded data, files beside the asset.
    pub fn new(mut root: Root, bin: Option<&'a [u8]>, base: Option<&Path>, w: &mut Warnings) -> Result<Self> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (i, b) in root.buffers.iter_mut().enumerate() {
            let place = format!("buffers[{i}]");
            // Embedded data are not kept twice.
            let bytes = match b.uri.take() {
                _ if compressed::is_fallback(b) => None,
                Some(u) => Some(Cow::Owned(uri::load(&u, base, &format!("{place}.uri"))?)),
                None => bin.filter(|_| i == 0).map(Cow::Borrowed),
            };
            if let Some(found) = bytes.as_ref().map(|b| b.len() as u64).filter(|&n| n < b.byte_length.0) {
                w.push(place, format!("says {} bytes, but has {found}", b.byte_length.0));
            }
            buffers.push(bytes);
        }
        let size: u64 = buffers.iter().flatten().map(|b| b.len() as u64).sum();
        let unpacked = root.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let limit = FREE_BYTES.saturating_add(size.saturating_mul(BYTES_A_BYTE));
        Ok(Self { root, buffers, unpacked, used: Cell::new(0), limit })
    }

    /// Count `bytes` of decoded data against what a file of this size may ask for.
    pub fn charge(&self, bytes: u64, place: &str) -> Result<()> {
        let asked = self.used.get().saturating_add(bytes);
        if asked > self.limit {
            return Err(GltfError::TooLarge { place: place.into(), asked, limit: self.limit });
        }
        self.used.set(asked);
        Ok(())
    }

    /// The bytes of a buffer view, decompressed if need be, and the view itself.
    pub fn view(&self, index: usize, place: &str) -> Result<(&[u8], &buffer::View)> {
        let view = entry(&self.root.buffer_views, index, "buffer view", || place.into())?;
        let at = format!("bufferViews[{index}]");
        if let Some(packed) = compressed::meshopt(view, &at)? {
            let cell = &self.unpacked[index];
            if cell.get().is_none() {
                self.charge(packed.size(), &at)?;
                let source = self.slice(packed.buffer, packed.offset, packed.length, &at)?;
                let _ = cell.set(packed.decode(source, &at)?);
            }
            return Ok((cell.get().map_or(&[], Vec::as_slice), view));
        }
        let offset = view.byte_offset.map_or(0, |o| o.0);
        Ok((self.slice(view.buffer.value(), offset, view.byte_length.0, &at)?, view))
    }

    /// A range of a buffer.
    fn slice(&self, buffer: usize, offset: u64, length: u64, place: &str) -> Result<&[u8]> {
        let bytes = entry(&self.buffers, buffer, "buffer", || format!("{place}.buffer"))?;
        let Some(bytes) = bytes else {
            let why = "the buffer has no URI, and the file no binary chunk for it";
            return Err(super::error::value(format!("{place}.buffer"), "a buffer with data", why));
        };
        let end = offset.saturating_add(length);
        if end > bytes.len() as u64 {
            let (of, found) = (format!("buffers[{buffer}]"), bytes.len() as u64);
            return Err(GltfError::Bytes { place: place.into(), needed: end, of, found });
        }
        Ok(&bytes[offset as usize..end as usize])
    }
}
