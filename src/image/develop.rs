//! From linear light to the 8 bits of a file, in the one order that is right: expose, map tones, encode, dither.

use super::color::encode_srgb8;
use super::dither::{Dither, Levels, dither_of};
use super::gamma::Transfer;
use super::tone::{ToneMap, exposure};
use super::{Image, Rgba8};

/// How a linear picture is brought to 8 bits. The default shows light as it is: no exposure, clipped at 1, sRGB, rounded to nearest.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Grade {
    /// Stops: light is multiplied by `2^stops`.
    pub exposure_stops: f32,
    /// What becomes of light beyond 1.
    pub tone: ToneMap,
    /// How light is encoded.
    pub transfer: Transfer,
    /// How light between two codes is shown.
    pub dither: Dither,
}

impl Grade {
    /// Whether pictures come out as by [`Image::to_rgba8`].
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// The grade with its tables, to be used for many pictures.
    pub fn developer(&self) -> Developer {
        Developer {
            grade: *self,
            gain: exposure(self.exposure_stops),
            levels: Levels::new(256, self.transfer),
        }
    }

    /// Bring one picture to 8 bits; for many, keep the [`Developer`].
    ///
    /// ```
    /// use sinew::image::{Image, Rgba8, develop::Grade, tone::ToneMap};
    /// let bright = Image::filled(1, 1, [4.0, 2.0, 1.0, 1.0]);
    /// let mut out = Rgba8::default();
    /// Grade::default().develop(&bright, &mut out);
    /// assert_eq!(out.data, [255, 255, 255, 255]);
    /// Grade { tone: ToneMap::Reinhard, ..Grade::default() }.develop(&bright, &mut out);
    /// assert_eq!(out.data, [255, 188, 137, 255]);
    /// ```
    pub fn develop(&self, image: &Image, out: &mut Rgba8) {
        self.developer().develop(image, out);
    }
}

/// A [`Grade`] with its tables.
#[derive(Clone, Debug)]
pub struct Developer {
    grade: Grade,
    gain: f32,
    levels: Levels,
}

impl Developer {
    /// The grade.
    pub fn grade(&self) -> &Grade {
        &self.grade
    }

    /// A linear, premultiplied picture as 8-bit codes with straight alpha; `out` gets its sides and keeps its memory.
    ///
    /// Colour is divided by alpha, exposed, tone mapped, encoded and dithered; alpha is rounded.
    pub fn develop(&self, image: &Image, out: &mut Rgba8) {
        if self.grade.is_plain() {
            (out.width, out.height) = (image.width, image.height);
            out.data.clear();
            out.data.extend(image.pixels.iter().flat_map(|p| encode_srgb8(*p)));
            return;
        }
        let (gain, tone) = (self.gain, self.grade.tone);
        dither_of(image, &self.levels, self.grade.dither, out, |[r, g, b, a]| {
            let k = if a > 0.0 && a < 1.0 { gain / a } else { gain };
            tone.map([r * k, g * k, b * k])
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::gamma::Gamma;

    /// Colours of every kind: over and under range, thin, empty, and no numbers at all.
    fn wild() -> Image {
        let mut rng = crate::test_rng::Rng::new(5);
        let mut pixels: Vec<[f32; 4]> = (0..4000)
            .map(|i| {
                let a = [0.0, 0.001, 0.3, 0.999, 1.0, 1.5][i % 6];
                let mut c = || a * rng.range(-0.1, 1.3) as f32;
                [c(), c(), c(), a]
            })
            .collect();
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, -0.0, f32::MAX] {
            pixels.extend([[odd, 0.5, 0.5, 1.0], [0.5, 0.5, 0.5, odd], [odd; 4]]);
        }
        pixels.truncate(pixels.len() / 2 * 2);
        Image { width: 2, height: pixels.len() / 2, pixels }
    }

    #[test]
    fn the_plain_grade_gives_the_bytes_of_to_rgba8() {
        let image = wild();
        let mut out = Rgba8 { width: 9, height: 9, data: vec![7; 5] };
        assert!(Grade::default().is_plain());
        Grade::default().develop(&image, &mut out);
        assert_eq!(out, image.to_rgba8());
        // The way that the other grades take agrees where they ask for the same.
        let Developer { levels, .. } = Grade::default().developer();
        crate::image::dither::dither(&image, &levels, Dither::None, &mut out);
        assert_eq!(out, image.to_rgba8());
    }

    #[test]
    fn every_grade_takes_every_pixel() {
        let image = wild();
        let mut out = Rgba8::default();
        for (tone, dither) in ToneMap::ALL.into_iter().flat_map(|t| Dither::ALL.map(|d| (t, d))) {
            let grade = Grade {
                tone,
                dither,
                exposure_stops: 1.0,
                transfer: Transfer::Power(Gamma::new(2.2).unwrap()),
            };
            assert!(!grade.is_plain());
            grade.develop(&image, &mut out);
            let plain = image.to_rgba8();
            let alphas = |p: &Rgba8| p.data.chunks(4).map(|p| p[3]).collect::<Vec<u8>>();
            assert_eq!(alphas(&out), alphas(&plain), "{grade:?}");
        }
    }

    #[test]
    fn a_stop_doubles_the_light_before_anything_else() {
        let image = Image::filled(3, 1, [0.1, 0.2, 0.3, 0.5]);
        let twice = Image::filled(3, 1, [0.2, 0.4, 0.6, 0.5]);
        let (mut a, mut b) = (Rgba8::default(), Rgba8::default());
        for tone in ToneMap::ALL {
            Grade { exposure_stops: 1.0, tone, ..Grade::default() }.develop(&image, &mut a);
            Grade { tone, ..Grade::default() }.develop(&twice, &mut b);
            assert_eq!(a, b, "{tone:?}");
        }
    }
}
