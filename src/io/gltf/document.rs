//! The parsed file with its bytes: checked look-ups, buffers, buffer views, and the budget of decoded data.

use super::compressed;
use super::error::{GltfError, Result, entry};
use super::uri::Source;
use super::warnings::Warnings;
use ::gltf::json::{Root, buffer};
use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Decoded data that any file may ask for.
const FREE_BYTES: u64 = 128 << 20;
/// Decoded data allowed for each byte of the file: packed vertices take two bytes each, and primitives share accessors.
const BYTES_A_BYTE: u64 = 32;
/// Bytes of files beside the asset that are read, all told.
const READ_BYTES: u64 = 2 << 30;

/// A glTF file: its typed JSON and its buffers.
pub(super) struct Document<'a> {
    /// The typed JSON.
    pub root: Root,
    /// Bytes, each file's once, and where among them a buffer's are.
    blobs: Vec<Cow<'a, [u8]>>,
    blob_of: Vec<Option<usize>>,
    unpacked: Vec<OnceCell<Vec<u8>>>,
    used: Cell<u64>,
    limit: u64,
}

impl<'a> Document<'a> {
    /// Bytes of all buffers, each file's once.
    pub fn bytes(&self) -> u64 {
        self.blobs.iter().map(|b| b.len() as u64).sum()
    }

    /// Load the buffers: the binary chunk, embedded data, files beside the asset.
    pub fn new(mut root: Root, bin: Option<&'a [u8]>, base: Option<&Path>, w: &mut Warnings) -> Result<Self> {
        let mut files = Files::default();
        let mut blob_of = Vec::with_capacity(root.buffers.len());
        for (i, b) in root.buffers.iter_mut().enumerate() {
            // Embedded data are not kept twice.
            let blob = match b.uri.take() {
                _ if compressed::is_fallback(b) => None,
                Some(u) => Some(files.load(&u, base, &format!("buffers[{i}].uri"))?),
                None => bin.filter(|_| i == 0).map(|bytes| files.push(Cow::Borrowed(bytes))),
            };
            let found = blob.map(|k| files.blobs[k].len() as u64);
            if let Some(found) = found.filter(|&n| n < b.byte_length.0) {
                w.push(format!("buffers[{i}]"), format!("says {} bytes, but has {found}", b.byte_length.0));
            }
            blob_of.push(blob);
        }
        let blobs = files.blobs;
        let size: u64 = blobs.iter().map(|b| b.len() as u64).sum();
        let unpacked = root.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let limit = FREE_BYTES.saturating_add(size.saturating_mul(BYTES_A_BYTE));
        Ok(Self { root, blobs, blob_of, unpacked, used: Cell::new(0), limit })
    }

    /// All bytes of a buffer, if it has any.
    pub fn raw(&self, buffer: usize) -> Option<&[u8]> {
        self.blob_of.get(buffer).copied().flatten().map(|k| &self.blobs[k][..])
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
        let blob = entry(&self.blob_of, buffer, "buffer", || format!("{place}.buffer"))?;
        let Some(bytes) = blob.map(|k| &self.blobs[k]) else {
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

/// Bytes of buffers; a file that several buffers name is read once.
#[derive(Default)]
struct Files<'a> {
    blobs: Vec<Cow<'a, [u8]>>,
    of: BTreeMap<PathBuf, usize>,
    read: u64,
}

impl<'a> Files<'a> {
    fn push(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.blobs.push(bytes);
        self.blobs.len() - 1
    }

    /// Where the bytes of a URI are. Embedded data are no longer than the asset itself; files count before they are read.
    fn load(&mut self, uri: &str, base: Option<&Path>, place: &str) -> Result<usize> {
        let source = Source::of(uri, base, place)?;
        if let Source::File(path) = &source {
            if let Some(&known) = self.of.get(path) {
                return Ok(known);
            }
            let asked = self.read.saturating_add(source.size(place)?);
            if asked > READ_BYTES {
                return Err(GltfError::TooLarge { place: place.into(), asked, limit: READ_BYTES });
            }
            self.read = asked;
            self.of.insert(path.clone(), self.blobs.len());
        }
        Ok(self.push(Cow::Owned(source.read(place)?)))
    }
}
