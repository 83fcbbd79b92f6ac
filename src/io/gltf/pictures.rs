//! Pictures: bytes from the file or beside it, decoded on all cores.

use super::container::Parts;
use super::document::Document;
use super::glance;
use super::uri::Source;
use super::warnings::Warnings;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Scope, ScopedJoinHandle};

/// Longest side that is decoded, pixels.
const SIDE: u32 = 1 << 14;
/// Bytes that the decoded pictures of a file may take together however small the file is, mip levels included: twelve of
/// 2048×2048. What is made of the pictures besides may take as many.
pub(super) const PIXEL_BYTES: u64 = 256 << 20;
/// Decoded bytes that each undecoded one allows in addition: photographs as JPEG stay below, so that an asset with hundreds
/// of honest pictures is read, and a small file cannot ask for much.
const EXPANSION: u64 = 64;
/// Bytes of pictures in files beside the asset.
const ENCODED_BYTES: u64 = 1 << 30;

/// Bytes of RGBA with mip levels, for sides up to [`SIDE`].
pub(super) fn with_mips(width: usize, height: usize) -> u64 {
    (4 * width as u64 * height as u64).saturating_mul(4).div_ceil(3)
}

/// Decoded RGBA, or RGB where there is no alpha, rows from the top.
pub(super) struct Picture {
    pub width: usize,
    pub height: usize,
    pub bytes: Vec<u8>,
}

impl Picture {
    fn white() -> Self {
        Self { width: 1, height: 1, bytes: vec![255; 3] }
    }
}

/// Pictures, each decoded once however many images name it.
pub(super) struct Pictures {
    /// The pictures.
    pub list: Vec<Picture>,
    /// Bytes that may be made of them besides.
    pub allowance: u64,
    of: Vec<Option<usize>>,
}

impl Pictures {
    /// Where in the list the picture of an image is.
    pub fn of(&self, image: usize) -> Option<usize> {
        *self.of.get(image)?
    }
}

/// What an image is the same as another by.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Key<'a> {
    Uri(Source<'a>),
    View(usize),
}

/// Bytes that may still be read, and decoded.
struct Budget {
    encoded: u64,
    pixels: u64,
    /// Bytes of buffers that have not allowed any decoded ones yet: views may overlap, but each byte counts once.
    buffers: u64,
    /// What undecoded bytes have allowed so far.
    allowed: u64,
}

type Job<'a> = Result<Cow<'a, [u8]>, String>;

/// Undecoded bytes from which on a picture takes longer than a thread to start.
const LONG: usize = 1 << 16;

/// A picture that is decoded while the rest of the file is read: what most often takes longer than all else, so that it should not wait
/// for what the file says besides.
pub(super) struct Ahead<'s> {
    bytes: &'s [u8],
    picture: ScopedJoinHandle<'s, Decoded>,
}

impl<'s> Ahead<'s> {
    /// Begin with the picture that a [`glance`] finds in a GLB, if it is neither small nor larger than a file of no size allows.
    pub fn begin<'e>(scope: &'s Scope<'s, 'e>, parts: &Parts<'s>) -> Option<Self> {
        let bytes = glance::first_picture(parts).filter(|b| b.len() >= LONG)?;
        let mut budget = Budget { encoded: 0, pixels: PIXEL_BYTES, buffers: 0, allowed: 0 };
        let picture = scope.spawn(move || budget.admit(Cow::Borrowed(bytes)).ok().map(|b| decode(&b)));
        Some(Self { bytes, picture })
    }

    /// Whether it is not done yet.
    pub fn is_at_work(&self) -> bool {
        !self.picture.is_finished()
    }
}

/// Decode the pictures that `wanted` names. What cannot be read is plain white and a warning.
pub(super) fn load(
    doc: &Document,
    base: Option<&Path>,
    wanted: &[bool],
    ahead: Option<Ahead>,
    w: &mut Warnings,
) -> Pictures {
    // Read the bytes and check the sizes in order, so that the outcome does not depend on threads.
    let mut budget = Budget { encoded: ENCODED_BYTES, pixels: PIXEL_BYTES, buffers: doc.bytes(), allowed: 0 };
    let mut known = BTreeMap::new();
    let (mut jobs, mut images): (Vec<Job>, Vec<usize>) = Default::default();
    let mut of = vec![None; wanted.len()];
    for i in (0..wanted.len()).filter(|&i| wanted[i]) {
        let job = match key(doc, base, i) {
            Ok(key) => {
                if let Some(&same) = known.get(&key) {
                    of[i] = Some(same);
                    continue;
                }
                let job = budget.bytes(doc, &key, i).and_then(|b| budget.admit(b));
                known.insert(key, jobs.len());
                job
            }
            Err(why) => Err(why),
        };
        of[i] = Some(jobs.len());
        jobs.push(job);
        images.push(i);
    }

    // Decode; each worker takes the next picture that is left.
    let begun = ahead.and_then(|a| {
        let same = |job: &Job| job.as_ref().is_ok_and(|b| std::ptr::eq(&**b, a.bytes));
        Some((jobs.iter().position(same)?, a.picture))
    });
    let mut list = Vec::with_capacity(jobs.len());
    for (i, (decoded, job)) in images.into_iter().zip(decode_all(&jobs, begun).into_iter().zip(&jobs)) {
        let refused = || Err(job.as_ref().err().cloned().unwrap_or_default());
        let place = format!("images[{i}]");
        if job.as_ref().is_ok_and(|bytes| is_cut_short(bytes)) {
            w.push(place.clone(), "the JPEG ends early; what is missing is grey or black");
        }
        list.push(decoded.unwrap_or_else(refused).unwrap_or_else(|why| {
            // Who says why may have said where.
            let why = why.strip_prefix(&format!("{place}: ")).unwrap_or(&why).trim_end();
            w.push(place, format!("{why}; plain white is used"));
            Picture::white()
        }));
    }
    Pictures { list, allowance: PIXEL_BYTES + budget.allowed, of }
}

fn key<'a>(doc: &'a Document, base: Option<&Path>, i: usize) -> Result<Key<'a>, String> {
    let image = &doc.root.images[i];
    match (&image.uri, image.buffer_view) {
        (Some(u), _) => Source::of(u, base, &format!("images[{i}]")).map(Key::Uri).map_err(|e| e.to_string()),
        (None, Some(v)) => Ok(Key::View(v.value())),
        (None, None) => Err("has neither a URI nor a buffer view".into()),
    }
}

impl Budget {
    /// The undecoded bytes.
    fn bytes<'a>(&mut self, doc: &'a Document, key: &Key, i: usize) -> Job<'a> {
        let place = format!("images[{i}]");
        match key {
            Key::Uri(source) => {
                let size = source.size(&place).map_err(|e| e.to_string())?;
                if size > self.encoded {
                    return Err(format!("has {size} bytes, too many; {}", limit()));
                }
                self.encoded -= size;
                self.allow(size);
                source.read(&place).map(Cow::Owned).map_err(|e| e.to_string())
            }
            Key::View(v) => {
                let (bytes, _) = doc.view(*v, &place).map_err(|e| e.to_string())?;
                let fresh = self.buffers.min(bytes.len() as u64);
                self.buffers -= fresh;
                self.allow(fresh);
                Ok(Cow::Borrowed(bytes))
            }
        }
    }

    fn allow(&mut self, undecoded: u64) {
        self.pixels += EXPANSION * undecoded;
        self.allowed += EXPANSION * undecoded;
    }

    /// Let a picture pass if there is room for what it decodes to.
    #[cfg(feature = "pictures")]
    fn admit<'a>(&mut self, bytes: Cow<'a, [u8]>) -> Job<'a> {
        let (width, height) = reader(&bytes)?.into_dimensions().map_err(|e| e.to_string())?;
        let sides = width <= SIDE && height <= SIDE;
        let needed = if sides { with_mips(width as usize, height as usize) } else { u64::MAX };
        if needed > self.pixels {
            return Err(format!("{width}×{height} pixels are too many; {}", limit()));
        }
        self.pixels -= needed;
        Ok(bytes)
    }

    #[cfg(not(feature = "pictures"))]
    fn admit<'a>(&mut self, _: Cow<'a, [u8]>) -> Job<'a> {
        let _ = (SIDE, self.pixels);
        Err("pictures are not decoded in this build (feature `pictures`)".into())
    }
}

fn limit() -> String {
    format!(
        "the pictures of a file may take {} MiB and {EXPANSION} times its bytes together",
        PIXEL_BYTES >> 20
    )
}

type Decoded = Option<Result<Picture, String>>;

/// Decode all jobs, of which one may have `begun`.
fn decode_all(jobs: &[Job], begun: Option<(usize, ScopedJoinHandle<Decoded>)>) -> Vec<Decoded> {
    let is_begun = |i: usize| begun.as_ref().is_some_and(|b| b.0 == i);
    let slots: Vec<Mutex<Decoded>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(i) else { return };
            if let (Ok(bytes), Ok(mut slot), false) = (job, slots[i].lock(), is_begun(i)) {
                *slot = Some(decode(bytes));
            }
        }
    };
    let count = jobs.iter().flatten().count() - usize::from(begun.is_some());
    // Asking for the processors costs as much as decoding an icon.
    let threads =
        if count > 1 { std::thread::available_parallelism().map_or(1, |n| n.get()).min(count) } else { 1 };
    std::thread::scope(|s| {
        (1..threads).for_each(|_| drop(s.spawn(work)));
        work();
    });
    let mut all: Vec<Decoded> = slots.into_iter().map(|s| s.into_inner().unwrap_or(None)).collect();
    if let Some((i, picture)) = begun {
        let begun = picture.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        all[i] = begun.or_else(|| jobs[i].as_ref().ok().map(|bytes| decode(bytes)));
    }
    all
}

#[cfg(feature = "pictures")]
fn decode(bytes: &[u8]) -> Result<Picture, String> {
    match decode_jpeg(bytes) {
        Some(picture) => Ok(picture),
        None => decode_any(bytes),
    }
}

/// A JPEG of luma and chroma straight into RGB.
///
/// `None` where it is anything else, or where something is wrong that [`decode_any`] can name.
#[cfg(feature = "pictures")]
fn decode_jpeg(bytes: &[u8]) -> Option<Picture> {
    use zune_jpeg::zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
    if !bytes.starts_with(b"\xff\xd8") {
        return None;
    }
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_strict_mode(false)
        .set_max_width(SIDE as usize)
        .set_max_height(SIDE as usize);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().ok()?;
    let (width, height) = decoder.dimensions()?;
    if decoder.input_colorspace()? != ColorSpace::YCbCr {
        return None;
    }
    let mut bytes = vec![0; 3 * width * height];
    decoder.decode_into(&mut bytes).ok()?;
    Some(Picture { width, height, bytes })
}

/// Whether a JPEG's last scan has no end: within one neither marker can stand.
fn is_cut_short(bytes: &[u8]) -> bool {
    let mut markers = bytes.windows(2).rev().filter(|w| w[0] == 0xff && matches!(w[1], 0xd9 | 0xda));
    bytes.starts_with(b"\xff\xd8") && markers.next().is_some_and(|last| last[1] == 0xda)
}

#[cfg(feature = "pictures")]
fn decode_any(bytes: &[u8]) -> Result<Picture, String> {
    let mut reader = reader(bytes)?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(SIDE);
    limits.max_image_height = Some(SIDE);
    // Decoders may hold 16 bits a channel.
    limits.max_alloc = Some(2 * PIXEL_BYTES);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| e.to_string())?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Ok(Picture { width, height, bytes: crate::io::codes(picture) })
}

#[cfg(feature = "pictures")]
fn reader(bytes: &[u8]) -> Result<image::ImageReader<std::io::Cursor<&[u8]>>, String> {
    let reader = image::ImageReader::new(std::io::Cursor::new(bytes));
    reader.with_guessed_format().map_err(|e| e.to_string())
}

#[cfg(not(feature = "pictures"))]
fn decode(_: &[u8]) -> Result<Picture, String> {
    Err("pictures are not decoded in this build (feature `pictures`)".into())
}

#[cfg(all(test, feature = "pictures"))]
mod tests {
    use super::*;

    /// A triangle with a picture, its bytes in the binary chunk of a GLB, or embedded.
    fn triangle(picture: &[u8], glb: bool) -> Vec<u8> {
        use base64::Engine;
        let mut bin: Vec<u8> =
            [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        bin.extend(picture);
        bin.resize(bin.len().next_multiple_of(4), 0);
        let uri = base64::engine::general_purpose::STANDARD.encode(&bin);
        let uri = if glb { String::new() } else { format!(r#""uri": "data:;base64,{uri}", "#) };
        let mut json = format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "nodes": [{{ "mesh": 0 }}], "buffers": [{{ {uri}"byteLength": {} }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}, {{ "buffer": 0, "byteOffset": 36, "byteLength": {} }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [1,1,0] }}],
            "images": [{{ "bufferView": 1, "mimeType": "image/jpeg" }}], "textures": [{{ "source": 0 }}],
            "materials": [{{ "pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 }} }} }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}] }}"#,
            bin.len(),
            picture.len(),
        )
        .into_bytes();
        if !glb {
            return json;
        }
        json.resize(json.len().next_multiple_of(4), b' ');
        let word = |n: usize| (n as u32).to_le_bytes();
        let (head, size) = (word(2), word(28 + json.len() + bin.len()));
        let (json_size, bin_size) = (word(json.len()), word(bin.len()));
        [b"glTF", &head[..], &size, &json_size, b"JSON", &json, &bin_size, b"BIN\0", &bin].concat()
    }

    #[test]
    fn a_picture_that_was_begun_at_a_glance_is_the_same() {
        let pixels = (0..400 * 400 * 3u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let picture = image::RgbImage::from_raw(400, 400, pixels).unwrap();
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        let whole = bytes.into_inner();
        for picture in [&whole[..], &whole[..whole.len() / 2], &vec![7; 2 * LONG]] {
            assert!(picture.len() >= LONG, "{} bytes are not begun with", picture.len());
            let (glb, embedded) = (triangle(picture, true), triangle(picture, false));
            let parts = super::super::container::split(&glb).unwrap();
            assert_eq!(glance::first_picture(&parts), Some(picture));
            let import = |bytes: &[u8]| {
                let options = crate::io::Options { textures: true };
                super::super::import_bytes(bytes, None, &options).unwrap()
            };
            let (early, late) = (import(&glb), import(&embedded));
            assert!(!late.asset.textures.is_empty() && early.asset.textures == late.asset.textures);
            assert_eq!(early.warnings, late.warnings);
            let said = early.warnings.iter().map(|w| w.to_string()).collect::<String>();
            assert_eq!(
                said.contains("images[0]: the JPEG ends early"),
                picture.len() < whole.len() && picture[0] == 0xff,
                "{said}"
            );
        }
    }

    #[test]
    fn the_short_way_into_rgb_gives_the_same_pixels() {
        for (w, h) in [(1, 1), (16, 16), (61, 47), (200, 9)] {
            let pixels = (0..w * h * 3).map(|i| (i * 37 % 251 + i / 7 % 40).min(255) as u8).collect();
            let picture = image::RgbImage::from_raw(w, h, pixels).unwrap();
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
            let (short, long) = (decode_jpeg(bytes.get_ref()).unwrap(), decode_any(bytes.get_ref()).unwrap());
            assert_eq!((short.width, short.height), (w as usize, h as usize));
            assert!(short.bytes == long.bytes);
            // What is cut off is named, or read alike.
            for n in [2, 100, bytes.get_ref().len() / 2] {
                let cut = &bytes.get_ref()[..n.min(bytes.get_ref().len())];
                assert_eq!(decode(cut).map(|p| p.bytes), decode_any(cut).map(|p| p.bytes));
            }
        }
        let grey = image::GrayImage::from_pixel(5, 4, image::Luma([7]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        grey.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
        assert!(decode_jpeg(bytes.get_ref()).is_none() && decode(bytes.get_ref()).is_ok());
    }
}
