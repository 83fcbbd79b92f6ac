//! Colours of a tile on their way into the picture.
//!
//! A pixel that one evaluation covers is encoded at once; only those that several share are summed up first, and encoded when
//! the tile is done. Where something blends, every sample keeps a colour of its own.

use super::TILE;
use super::encode::encode8;
use super::scan::{self, Key, WHOLE, covers, key};
use super::setup::bits;
use crate::image::color;
use crate::math::simd::{F8, I8};

/// Samples of a whole tile.
pub(super) const PLANE: usize = TILE * TILE;

/// Where colours go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Sink {
    /// 8-bit sRGB with straight alpha.
    #[default]
    Codes,
    /// Linear light, premultiplied.
    Linear,
    /// Linear light, a plane a sample, to be blended over.
    Layers,
}

/// Colours of a tile: row in the tile · 64 + column.
#[derive(Debug, Default)]
pub(super) struct Colors {
    pub sink: Sink,
    /// Little-endian RGBA words.
    pub codes: Vec<u32>,
    /// Linear light: of all pixels, or of those that several evaluations share.
    pub sums: Vec<[f32; 4]>,
    /// Those pixels.
    shared: Vec<u16>,
    /// A plane a channel and sample: sample · 4096 + place.
    pub planes: [Vec<f32>; 4],
    samples: usize,
}

impl Colors {
    /// Start a tile over the background.
    #[inline(always)]
    pub fn start(&mut self, sink: Sink, samples: usize, background: [f32; 4]) {
        (self.sink, self.samples) = (sink, samples);
        self.shared.clear();
        match sink {
            Sink::Codes => {
                self.codes.clear();
                self.codes.resize(PLANE, u32::from_le_bytes(color::encode_srgb8(background)));
                self.sums.resize(PLANE, background);
            }
            Sink::Linear => {
                self.sums.clear();
                self.sums.resize(PLANE, background);
            }
            Sink::Layers => {
                for (plane, value) in self.planes.iter_mut().zip(background) {
                    plane.clear();
                    plane.resize(samples * PLANE, value);
                }
            }
        }
    }

    /// A pixel that several evaluations share, `empty` of its four samples with the background.
    #[inline(always)]
    pub fn share(&mut self, place: usize, empty: u32, background: [f32; 4]) {
        if self.sink == Sink::Layers {
            return;
        }
        self.shared.push(place as u16);
        self.sums[place] = background.map(|c| c * (empty as f32 * 0.25));
    }

    /// Put eight colours, of which `n` count, where they belong.
    #[inline(always)]
    pub fn put(&mut self, keys: &I8, n: usize, rgba: &[F8; 4]) {
        let lane = |k: usize| [rgba[0].0[k], rgba[1].0[k], rgba[2].0[k], rgba[3].0[k]];
        match self.sink {
            Sink::Codes => self.put_codes(keys, n, rgba),
            Sink::Linear => (0..n).for_each(|k| self.put_light(keys.0[k], lane(k))),
            Sink::Layers => (0..n).for_each(|k| self.put_samples(keys.0[k], lane(k))),
        }
    }

    #[inline(always)]
    fn put_codes(&mut self, keys: &I8, n: usize, rgba: &[F8; 4]) {
        let words = encode8(*rgba);
        let first = keys.0[0];
        let row = scan::place(first);
        if n == 8 && *keys == I8::splat(key(row, WHOLE)) + I8::IOTA {
            let out: &mut [u32; 8] = (&mut self.codes[row..row + 8]).try_into().expect("eight");
            for k in 0..8 {
                out[k] = words.0[k] as u32;
            }
            return;
        }
        let codes: &mut [u32; PLANE] = (&mut self.codes[..PLANE]).try_into().expect("a tile");
        if keys.shift_right(12).equal(I8::splat(WHOLE as i32)).all() {
            // Lanes that do not count repeat one that does.
            for k in 0..8 {
                codes[scan::place(keys.0[k])] = words.0[k] as u32;
            }
            return;
        }
        for k in 0..n {
            if covers(keys.0[k]) == WHOLE {
                self.codes[scan::place(keys.0[k])] = words.0[k] as u32;
            } else {
                self.put_light(keys.0[k], [rgba[0].0[k], rgba[1].0[k], rgba[2].0[k], rgba[3].0[k]]);
            }
        }
    }

    /// Put colours of opaque surfaces where they belong: light, a plane a channel, and its codes if these are wanted.
    #[inline(always)]
    pub fn put_opaque<const L: usize>(&mut self, keys: &[Key], light: &[[f32; L]; 3], words: &[i32; L]) {
        let rgba = |k: usize| [light[0][k], light[1][k], light[2][k], 1.0];
        for (i, keys) in keys.chunks(16).enumerate() {
            let lights = keys.iter().enumerate().map(|(k, &key)| (key, rgba(16 * i + k)));
            match self.sink {
                Sink::Codes if scan::are_whole(keys) => {
                    let codes: &mut [u32; PLANE] = (&mut self.codes[..PLANE]).try_into().expect("a tile");
                    for (&key, &word) in keys.iter().zip(&words[16 * i..]) {
                        codes[scan::place(key)] = word as u32;
                    }
                }
                Sink::Codes => {
                    for ((key, light), &word) in lights.zip(&words[16 * i..]) {
                        match covers(key) {
                            WHOLE => self.codes[scan::place(key)] = word as u32,
                            _ => self.put_light(key, light),
                        }
                    }
                }
                Sink::Linear => lights.for_each(|(key, light)| self.put_light(key, light)),
                Sink::Layers => lights.for_each(|(key, light)| self.put_samples(key, light)),
            }
        }
    }

    /// Store linear light, or add the share of a pixel that an evaluation stands for.
    #[inline(always)]
    fn put_light(&mut self, key: Key, light: [f32; 4]) {
        let sum = &mut self.sums[scan::place(key)];
        if covers(key) == WHOLE {
            *sum = light;
            return;
        }
        let share = covers(key).count_ones() as f32 * 0.25;
        for c in 0..4 {
            sum[c] += light[c] * share;
        }
    }

    #[inline(never)]
    fn put_samples(&mut self, key: Key, light: [f32; 4]) {
        let samples = if self.samples == 1 { 1 } else { covers(key) };
        for s in bits(samples) {
            for c in 0..4 {
                self.planes[c][s as usize * PLANE + scan::place(key)] = light[c];
            }
        }
    }

    /// Encode the pixels that were summed up.
    #[inline(always)]
    pub fn finish(&mut self) {
        if self.sink != Sink::Codes {
            return;
        }
        for places in self.shared.chunks(8) {
            let mut c = [F8::ZERO; 4];
            for (k, &place) in places.iter().enumerate() {
                let sum = self.sums[place as usize];
                for i in 0..4 {
                    c[i].0[k] = sum[i];
                }
            }
            let words = encode8(c);
            for (k, &place) in places.iter().enumerate() {
                self.codes[place as usize] = words.0[k] as u32;
            }
        }
    }

    /// The mean of the samples into the first plane.
    pub fn average(&mut self) {
        if self.samples == 1 {
            return;
        }
        for plane in &mut self.planes {
            for at in 0..PLANE {
                let pairs = (plane[at] + plane[PLANE + at]) + (plane[2 * PLANE + at] + plane[3 * PLANE + at]);
                plane[at] = pairs * 0.25;
            }
        }
    }
}
