//! More light than a display can show: exposure and tone maps (notes §1.3).
//!
//! Everything here works on linear light that is *not* multiplied by alpha: a half-covered pixel of a bright thing is as bright as a
//! whole one.

use super::Image;

/// How light of 0…∞ becomes light of 0…1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ToneMap {
    /// `min(1, c)` a channel. Exact up to 1; beyond it details vanish, and hues move to the nearest corner of the cube: bright orange
    /// becomes yellow.
    #[default]
    Clip,
    /// Reinhard et al. 2002, equation 4, `m(1 + m/w²)/(1 + m)` with `w = 4`, where `m` is the largest channel and all three are
    /// scaled alike. So hue and saturation stay exactly; a light never bleaches to white. 1 becomes 0.53, 4 and more become 1.
    Reinhard,
    /// Narkowicz 2016, his fit to the ACES filmic curve, a channel: `c(2.51c + 0.03)/(c(2.43c + 0.59) + 0.14)`. Darks get contrast,
    /// highlights bleach towards white as on film, so saturation falls and hues move a little. 1 becomes 0.80, 7.3 becomes 1.
    Aces,
}

/// Light that Reinhard's curve shows as 1.
const WHITE: f32 = 4.0;

/// More light than this is taken for this, which every curve shows as 1: infinities stay harmless.
const MOST: f32 = 1e6;

impl ToneMap {
    /// Every tone map, simplest first.
    pub const ALL: [Self; 3] = [Self::Clip, Self::Reinhard, Self::Aces];

    /// The name for messages and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clip => "clip",
            Self::Reinhard => "reinhard",
            Self::Aces => "aces",
        }
    }

    /// The tone map of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// Straight linear colour to 0…1 a channel; NaN and what is below zero are 0.
    ///
    /// ```
    /// use sinew::image::tone::ToneMap;
    /// // The largest channel decides; the ratios stay.
    /// let [r, g, b] = ToneMap::Reinhard.map([4.0, 2.0, 1.0]);
    /// assert_eq!([r, g, b], [1.0, 0.5, 0.25]);
    /// assert_eq!(ToneMap::Clip.map([4.0, 2.0, 0.5]), [1.0, 1.0, 0.5]);
    /// ```
    #[inline]
    pub fn map(self, color: [f32; 3]) -> [f32; 3] {
        let c = color.map(|c| if c > 0.0 { c.min(MOST) } else { 0.0 });
        match self {
            Self::Clip => c.map(|c| c.min(1.0)),
            Self::Reinhard => {
                let m = c[0].max(c[1]).max(c[2]);
                let k = (1.0 + m / (WHITE * WHITE)) / (1.0 + m);
                // Beyond white the curve would pass 1.
                c.map(|c| if m > WHITE { c / m } else { c * k })
            }
            Self::Aces => c.map(|c| (c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14)).min(1.0)),
        }
    }
}

/// The factor of an exposure in stops, `2^stops`.
pub fn exposure(stops: f32) -> f32 {
    stops.clamp(-64.0, 64.0).exp2()
}

/// Expose a picture and bring its light into 0…1; alpha stays, and so does that colours are premultiplied.
///
/// ```
/// use sinew::image::{Image, tone::{ToneMap, tone_map}};
/// let mut image = Image::filled(1, 1, [0.25, 0.5, 1.0, 0.5]);
/// tone_map(&mut image, 1.0, ToneMap::Clip);
/// // Straight: (0.5, 1, 2), one stop up (1, 2, 4), clipped (1, 1, 1), and multiplied by alpha again.
/// assert_eq!(image.pixels, [[0.5, 0.5, 0.5, 0.5]]);
/// ```
pub fn tone_map(image: &mut Image, stops: f32, tone: ToneMap) {
    let gain = exposure(stops);
    for p in &mut image.pixels {
        let a = p[3];
        // What covers nothing has no colour of its own to map.
        let k = if a > 0.0 { gain / a } else { 0.0 };
        let [r, g, b] = tone.map([p[0] * k, p[1] * k, p[2] * k]).map(|c| c * a);
        *p = [r, g, b, a];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_rises_from_black_to_white_and_stays_there() {
        for tone in ToneMap::ALL {
            assert_eq!(ToneMap::from_name(tone.name()), Some(tone));
            assert_eq!(tone.map([0.0; 3]), [0.0; 3]);
            let mut last = 0.0;
            for i in 0..4000 {
                let [c, ..] = tone.map([i as f32 * 0.0025; 3]);
                assert!((last..=1.0).contains(&c), "{tone:?} at {i}: {c} after {last}");
                last = c;
            }
            assert_eq!(last, 1.0, "{tone:?}");
            assert_eq!(tone.map([f32::INFINITY, f32::NAN, -1.0]), [1.0, 0.0, 0.0], "{tone:?}");
        }
    }

    #[test]
    fn reinhard_keeps_hue_and_saturation_and_the_others_do_not() {
        let c = [6.0, 3.0, 1.5];
        let ratios = |c: [f32; 3]| [c[1] / c[0], c[2] / c[0]];
        assert_eq!(ratios(ToneMap::Reinhard.map(c)), [0.5, 0.25]);
        assert!(ratios(ToneMap::Clip.map(c))[0] == 1.0 && ratios(ToneMap::Aces.map(c))[0] > 0.9);
    }

    #[test]
    fn the_curves_have_the_figures_of_their_sources() {
        let at = |tone: ToneMap, c: f32| tone.map([c; 3])[0];
        assert!((at(ToneMap::Reinhard, 1.0) - 0.53125).abs() < 1e-6);
        assert!((at(ToneMap::Aces, 1.0) - 2.54 / 3.16).abs() < 1e-6);
        assert!((at(ToneMap::Aces, 0.18) - 0.2671).abs() < 1e-3, "{}", at(ToneMap::Aces, 0.18));
    }
}
