//! The notes' reference pictures of chapter 1, every one exact in every pixel.
//!
//! They belong to a course's first exercise: an operation each on `dog.png`, in 8-bit codes as they are (no linear light), f64 between 0
//! and 1, truncated. What cannot be read from the notes was found by trying: the demosaicked picture truncates each neighbour's share;
//! the composite is truncated after each of its three layers; hues stay below zero where red is largest and blue above green, and the
//! desaturated picture finds no sector for those and leaves them gray.

use sinew::image::Rgba8;
use sinew::image::bayer::Mosaic;
use sinew::image::composite::Operator;
use sinew::image::depth::Rounding;
use sinew::image::hue::{Hsv, desaturate, gray, shift_hue};
use sinew::io::picture::frames_of;
use std::path::Path;

pub fn load(file: &Path) -> Result<Rgba8, String> {
    let named = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
    let bytes = std::fs::read(file).map_err(|e| named(&e))?;
    let mut frames = frames_of(&bytes).map_err(|e| named(&e))?;
    let frame = frames.next().ok_or_else(|| named(&"no frame"))?;
    Ok(frame.map_err(|e| named(&e))?.pixels.into_codes())
}

fn input(data: &Path, name: &str) -> Result<Rgba8, String> {
    load(&data.join("notes/raster-images").join(name).with_extension("png"))
}

/// Difference 0 in every pixel.
fn exact(data: &Path, name: &str, found: &Rgba8) -> Result<(), String> {
    let want = load(&data.join("notes/raster-images/reference").join(name).with_extension("png"))?;
    if [want.width, want.height] != [found.width, found.height] {
        return Err(format!("{name}: {} × {} pixels", found.width, found.height));
    }
    let pairs = want.data.chunks(4).zip(found.data.chunks(4)).enumerate();
    let differ: Vec<_> = pairs.filter(|(_, (w, f))| w != f).collect();
    match differ.first() {
        None => Ok(()),
        Some((i, (w, f))) => {
            Err(format!("{name}: {} pixels differ, first {i}: expected {w:?}, found {f:?}", differ.len()))
        }
    }
}

/// A function of colours in 0…1, truncated to codes.
fn map(picture: &Rgba8, f: impl Fn([f64; 3]) -> [f64; 3]) -> Rgba8 {
    let pixel = |p: &[u8]| {
        let codes = f([p[0], p[1], p[2]].map(|c| f64::from(c) / 255.0)).map(truncated);
        [codes[0], codes[1], codes[2], 255]
    };
    Rgba8 { data: picture.data.chunks(4).flat_map(pixel).collect(), ..*picture }
}

fn truncated(x: f64) -> u8 {
    Rounding::Truncate.quantise(x, 255) as u8
}

fn of_grays(width: usize, height: usize, codes: impl Iterator<Item = u8>) -> Rgba8 {
    Rgba8 { width, height, data: codes.flat_map(|g| [g, g, g, 255]).collect() }
}

/// `rgb`, `reflected`, `rotated`.
pub fn pixels_move_as_in_the_notes(data: &Path) -> Result<(), String> {
    let dog = input(data, "dog")?;
    exact(data, "rgb", &dog)?;
    exact(data, "reflected", &dog.mirrored())?;
    exact(data, "rotated", &dog.turned_left())
}

/// `gray`: luma of codes, not of numbers, truncated.
pub fn grays_are_those_of_the_notes(data: &Path) -> Result<(), String> {
    let dog = input(data, "dog")?;
    let codes = dog.data.chunks(4).map(|p| gray([p[0], p[1], p[2]].map(f64::from)) as u8);
    exact(data, "gray", &of_grays(dog.width, dog.height, codes))
}

/// `bayer`, `demosaicked`.
pub fn the_mosaic_is_that_of_the_notes(data: &Path) -> Result<(), String> {
    let mosaic = Mosaic::of(&input(data, "dog")?);
    exact(data, "bayer", &of_grays(mosaic.width, mosaic.height, mosaic.data.iter().copied()))?;
    exact(data, "demosaicked", &mosaic.demosaic(Rounding::Truncate))
}

/// `shifted` by 180°, `desaturated` by a quarter.
pub fn hues_are_those_of_the_notes(data: &Path) -> Result<(), String> {
    let dog = input(data, "dog")?;
    exact(data, "shifted", &map(&dog, |c| shift_hue(c, 180.0)))?;
    // Hues below zero lose their colour there; that is the picture's fault, and shown here only.
    let faulty = |c: [f64; 3]| {
        let hsv = Hsv::of(c);
        let least = hsv.value - hsv.value * (hsv.saturation * 0.75);
        if hsv.hue_deg < 0.0 { [least; 3] } else { desaturate(c, 0.25) }
    };
    exact(data, "desaturated", &map(&dog, faulty))?;
    let lost = dog.data.chunks(4).filter(|p| p[0] > p[1] && p[0] >= p[2] && p[2] > p[1]).count();
    if lost == 5335 { Ok(()) } else { Err(format!("{lost} pixels have hues below zero")) }
}

/// `composite`: three layers over the dog.
pub fn layers_are_composited_as_in_the_notes(data: &Path) -> Result<(), String> {
    let numbers = |p: &[u8]| -> [f64; 4] { std::array::from_fn(|c| f64::from(p[c]) / 255.0) };
    let mut picture = input(data, "dog")?;
    for layer in ["glasses", "laser-beams", "sparkles"] {
        let layer = input(data, layer)?;
        for (p, l) in picture.data.chunks_mut(4).zip(layer.data.chunks(4)) {
            // Colours as codes, alpha as numbers.
            let codes = |p: &[u8]| [f64::from(p[0]), f64::from(p[1]), f64::from(p[2]), numbers(p)[3]];
            let [r, g, b, a] = Operator::OVER.straight(codes(l), codes(p));
            p.copy_from_slice(&[r as u8, g as u8, b as u8, truncated(a)]);
        }
    }
    exact(data, "composite", &picture)
}
