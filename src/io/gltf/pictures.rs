//! Pictures: bytes from the file or beside it, decoded on all cores.

use super::document::Document;
use super::uri;
use super::warnings::Warnings;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Longest side that is decoded, pixels.
const SIDE: u32 = 1 << 14;
/// Decoded bytes that any file may ask for, and how many more for each byte of picture.
const FREE_BYTES: u64 = 512 << 20;
const BYTES_A_BYTE: u64 = 64;

/// Decoded RGBA, rows from the top.
pub(super) struct Picture {
    pub width: usize,
    pub height: usize,
    pub rgba: Vec<u8>,
}

impl Picture {
    fn white() -> Self {
        Self { width: 1, height: 1, rgba: vec![255; 4] }
    }

    /// The pixel that covers a place of another, finer grid.
    pub fn at(&self, (x, y): (usize, usize), (width, height): (usize, usize)) -> [u8; 4] {
        let i = (y * self.height / height * self.width + x * self.width / width) * 4;
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2], self.rgba[i + 3]]
    }
}

/// Decode the pictures that `wanted` names. What cannot be read is plain white and a warning.
pub(super) fn load(
    doc: &Document,
    base: Option<&Path>,
    wanted: &[bool],
    w: &mut Warnings,
) -> Vec<Option<Picture>> {
    // Read the bytes and check the sizes in order, so that the outcome does not depend on threads.
    let mut left = FREE_BYTES;
    let mut jobs: Vec<Option<Cow<[u8]>>> = Vec::with_capacity(wanted.len());
    let mut out: Vec<Option<Picture>> = Vec::with_capacity(wanted.len());
    for (i, wanted) in wanted.iter().enumerate() {
        let job = if *wanted { Some(bytes(doc, base, i).and_then(|b| admit(b, &mut left))) } else { None };
        out.push(None);
        jobs.push(match job {
            Some(Ok(bytes)) => Some(bytes),
            Some(Err(why)) => {
                w.push(format!("images[{i}]"), format!("{why}; plain white is used"));
                out[i] = Some(Picture::white());
                None
            }
            None => None,
        });
    }

    // Decode; each worker takes the next picture that is left.
    for (i, decoded) in decode_all(&jobs).into_iter().enumerate() {
        match decoded {
            Some(Ok(p)) => out[i] = Some(p),
            Some(Err(why)) => {
                w.push(format!("images[{i}]"), format!("{why}; plain white is used"));
                out[i] = Some(Picture::white());
            }
            None => {}
        }
    }
    out
}

fn bytes<'a>(doc: &'a Document, base: Option<&Path>, i: usize) -> Result<Cow<'a, [u8]>, String> {
    let image = &doc.root.images[i];
    let place = format!("images[{i}]");
    match (&image.uri, image.buffer_view) {
        (Some(u), _) => uri::load(u, base, &place).map(Cow::Owned).map_err(|e| e.to_string()),
        (None, Some(v)) => {
            let (bytes, _) = doc.view(v.value(), &place).map_err(|e| e.to_string())?;
            Ok(Cow::Borrowed(bytes))
        }
        (None, None) => Err("has neither a URI nor a buffer view".into()),
    }
}

type Decoded = Option<Result<Picture, String>>;

fn decode_all(jobs: &[Option<Cow<[u8]>>]) -> Vec<Decoded> {
    let slots: Vec<Mutex<Decoded>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(i) else { return };
            if let (Some(bytes), Ok(mut slot)) = (job, slots[i].lock()) {
                *slot = Some(decode(bytes));
            }
        }
    };
    let count = jobs.iter().flatten().count();
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()).min(count);
    std::thread::scope(|s| {
        (1..threads).for_each(|_| drop(s.spawn(work)));
        work();
    });
    slots.into_iter().map(|s| s.into_inner().unwrap_or(None)).collect()
}

/// Let a picture pass if what it decodes to is in proportion.
#[cfg(feature = "pictures")]
fn admit<'a>(bytes: Cow<'a, [u8]>, left: &mut u64) -> Result<Cow<'a, [u8]>, String> {
    let (width, height) = reader(&bytes)?.into_dimensions().map_err(|e| e.to_string())?;
    *left = left.saturating_add(bytes.len() as u64 * BYTES_A_BYTE);
    let needed = 4 * width as u64 * height as u64;
    if width > SIDE || height > SIDE || needed > *left {
        return Err(format!("{width}×{height} pixels are too many for a file of this size"));
    }
    *left -= needed;
    Ok(bytes)
}

#[cfg(feature = "pictures")]
fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let mut reader = reader(bytes)?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(SIDE);
    limits.max_image_height = Some(SIDE);
    limits.max_alloc = Some(FREE_BYTES.saturating_add(bytes.len() as u64 * BYTES_A_BYTE));
    reader.limits(limits);
    let rgba = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    Ok(Picture { width: rgba.width() as usize, height: rgba.height() as usize, rgba: rgba.into_raw() })
}

#[cfg(feature = "pictures")]
fn reader(bytes: &[u8]) -> Result<image::ImageReader<std::io::Cursor<&[u8]>>, String> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes));
    reader.with_guessed_format().map_err(|e| e.to_string())
}

#[cfg(not(feature = "pictures"))]
fn admit<'a>(_: Cow<'a, [u8]>, _: &mut u64) -> Result<Cow<'a, [u8]>, String> {
    let _ = (SIDE, FREE_BYTES, BYTES_A_BYTE);
    Err("pictures are not decoded in this build (feature `pictures`)".into())
}

#[cfg(not(feature = "pictures"))]
fn decode(_: &[u8]) -> Result<Picture, String> {
    Err("pictures are not decoded in this build (feature `pictures`)".into())
}
