//! Transparent triangles: sample by sample over what lies behind them, from back to front.

use super::TILE;
use super::fill::{Visitor, Walk, lane_pixels};
use super::frame::Frame;
use super::resolve::{self, Area};
use super::scan::WHOLE;
use super::setup::{Bins, Setup, bits};
use super::tile::TileScratch;
use crate::math::simd::{F8, I8};

/// Layers held at once; within so many, pixels are sorted exactly, beyond by whole triangles.
const HELD: usize = 1 << 16;

/// A transparent triangle in a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub place: u16,
    pub mask: u8,
    pub id: u32,
    /// Depth at the pixel's centre.
    pub z: f32,
}

/// Working memory.
#[derive(Debug, Default)]
pub(super) struct BlendScratch {
    layers: Vec<Layer>,
    shades: Vec<[f32; 4]>,
    order: Vec<u32>,
    mask: Vec<u8>,
}

/// Put a tile's transparent triangles over its colours.
#[inline(always)]
pub(super) fn blend(frame: &Frame, bins: &[Bins], tile: usize, area: Area, scratch: &mut TileScratch) {
    // Farthest first by the mean depth of the corners; at equal depth in order of submission.
    let mut list: Vec<&Setup> = vec![];
    for b in bins {
        list.extend(b.tiles[tile].blend.iter().map(|&s| &b.setups[s as usize]));
    }
    let depth = |s: &Setup| s.z[0] as f64 + s.z[1] as f64 + s.z[2] as f64;
    list.sort_by(|a, b| depth(a).total_cmp(&depth(b)).then(a.id.cmp(&b.id)));

    scratch.blend.mask.clear();
    scratch.blend.mask.resize(TILE * TILE, 0);
    scratch.blend.layers.clear();
    for s in list {
        if let Some(walk) = Walk::new(frame, s, area.origin) {
            gather(frame, &walk, scratch);
        }
        if scratch.blend.layers.len() >= HELD {
            flush(frame, area, scratch);
        }
    }
    flush(frame, area, scratch);
}

/// List the pixels where a triangle lies before everything opaque.
#[inline(always)]
fn gather(frame: &Frame, walk: &Walk<8>, scratch: &mut TileScratch) {
    let TileScratch { seen, blend, .. } = scratch;
    seen.touch(walk.x, walk.y);
    let mask = &mut blend.mask;
    walk.visit(frame.samples, &mut Gather { z: &seen.z, mask, samples: frame.samples });
    for y in walk.y[0]..=walk.y[1] {
        for x in walk.x[0]..=walk.x[1] {
            let at = y as usize * TILE + x as usize;
            if mask[at] != 0 {
                let z = walk.depth_at(x, y);
                blend.layers.push(Layer { place: at as u16, mask: mask[at], id: walk.id, z });
                mask[at] = 0;
            }
        }
    }
}

/// Collects the samples that lie before everything opaque.
struct Gather<'a> {
    z: &'a [f32],
    mask: &'a mut [u8],
    samples: usize,
}

impl Visitor<8> for Gather<'_> {
    #[inline(always)]
    fn see(&mut self, at: usize, inside: I8, z: F8) {
        let pixels: I8 = lane_pixels(self.samples);
        for k in bits(inside.bitmask()) {
            let k = k as usize;
            // What lies exactly on an opaque surface, a decal, is before it.
            if z.0[k] >= self.z[at + k] {
                let bit = if self.samples == 1 { WHOLE as u8 } else { 1 << (k % 4) };
                self.mask[at / self.samples + pixels.0[k] as usize] |= bit;
            }
        }
    }
}

/// Shade the layers that are held and put them over the picture.
#[inline(always)]
fn flush(frame: &Frame, area: Area, scratch: &mut TileScratch) {
    let TileScratch { blend, colors, stats, .. } = scratch;
    let BlendScratch { layers, shades, order, .. } = blend;
    shades.clear();
    resolve::shade_list(frame, area, layers, shades, stats);
    order.clear();
    order.extend(0..layers.len() as u32);
    order.sort_by(|&a, &b| {
        let (a, b) = (&layers[a as usize], &layers[b as usize]);
        a.place.cmp(&b.place).then(a.z.total_cmp(&b.z)).then(a.id.cmp(&b.id))
    });
    for &i in order.iter() {
        let (layer, color) = (&layers[i as usize], shades[i as usize]);
        let samples = if frame.samples == 4 { layer.mask as u32 } else { 1 };
        for s in bits(samples) {
            let at = s as usize * TILE * TILE + layer.place as usize;
            for c in 0..4 {
                let p = &mut colors.planes[c][at];
                *p = color[c] + *p * (1.0 - color[3]);
            }
        }
    }
    layers.clear();
}
