//! Signal and light: `light = signal^γ` (notes §1.3), and the sRGB curve that files use.
//!
//! Averaging, blending and dithering are right in light only; a signal is what is stored and sent to a display.

use super::color::{linear_from_srgb, srgb_from_linear};

/// The exponent of a display, 0.1…10: `light = signal^γ`, both 0…1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Gamma(f32);

/// A number that is no exponent of a display.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GammaError {
    /// γ itself.
    #[error("a gamma of {0}: expected 0.1 to 10; most displays have about 2.2")]
    Exponent(f64),
    /// The signal that looks half as bright as the brightest.
    #[error(
        "a signal of {0} for half the brightness: expected a number from 0.00098 to 0.933 (a gamma of 0.1 to 10)"
    )]
    Half(f64),
}

impl Gamma {
    /// The exponent itself.
    ///
    /// # Errors
    /// [`GammaError::Exponent`] outside 0.1…10.
    pub fn new(exponent: f64) -> Result<Self, GammaError> {
        let fine = (0.1..=10.0).contains(&exponent);
        if fine { Ok(Self(exponent as f32)) } else { Err(GammaError::Exponent(exponent)) }
    }

    /// From the signal `a` at which the display shows half its brightness: `γ = ln ½ / ln a`.
    ///
    /// ```
    /// use sinew::image::gamma::Gamma;
    /// assert_eq!(Gamma::fit(0.5).unwrap().exponent(), 1.0);
    /// assert!((Gamma::fit(0.73).unwrap().exponent() - 2.2025).abs() < 5e-5);
    /// ```
    ///
    /// # Errors
    /// [`GammaError::Half`] where the result is outside 0.1…10.
    pub fn fit(half: f64) -> Result<Self, GammaError> {
        Self::new(0.5f64.ln() / half.ln()).map_err(|_| GammaError::Half(half))
    }

    /// γ.
    pub fn exponent(self) -> f32 {
        self.0
    }

    /// The light of a signal, `a^γ`; below zero there is none.
    pub fn light(self, signal: f32) -> f32 {
        signal.max(0.0).powf(self.0)
    }

    /// The signal for some light, `l^(1/γ)`: gamma correction.
    pub fn signal(self, light: f32) -> f32 {
        light.max(0.0).powf(1.0 / self.0)
    }
}

/// How light becomes the signal that a file stores.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Transfer {
    /// The curve of sRGB (IEC 61966-2-1), which readers of PNG, GIF and WebP expect.
    #[default]
    Srgb,
    /// A pure power.
    Power(Gamma),
}

impl Transfer {
    /// The light of a signal, 0…1.
    pub fn light(self, signal: f32) -> f32 {
        match self {
            Self::Srgb => linear_from_srgb(signal),
            Self::Power(gamma) => gamma.light(signal),
        }
    }

    /// The signal for some light, 0…1.
    pub fn signal(self, light: f32) -> f32 {
        match self {
            Self::Srgb => srgb_from_linear(light),
            Self::Power(gamma) => gamma.signal(light),
        }
    }

    /// `srgb`, or the exponent of a pure power as in `2.2`.
    ///
    /// ```
    /// use sinew::image::gamma::Transfer;
    /// assert_eq!(Transfer::from_name("srgb"), Some(Transfer::Srgb));
    /// assert_eq!(Transfer::from_name("2.0").unwrap().light(0.5), 0.25);
    /// assert_eq!(Transfer::from_name("-1"), None);
    /// ```
    pub fn from_name(name: &str) -> Option<Self> {
        if name == "srgb" {
            return Some(Self::Srgb);
        }
        let exponent = name.parse::<f64>().ok()?;
        Gamma::new(exponent).ok().map(Self::Power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fit_shows_half_the_light_at_the_signal_it_was_given() {
        for half in [0.1, 0.3, 0.5, 0.73, 0.9] {
            let gamma = Gamma::fit(half).unwrap();
            assert!((gamma.light(half as f32) - 0.5).abs() < 1e-6, "{half}");
            assert!((gamma.signal(0.5) - half as f32).abs() < 1e-6, "{half}");
        }
    }

    #[test]
    fn light_and_signal_undo_each_other() {
        for transfer in [Transfer::Srgb, Transfer::Power(Gamma::new(2.2).unwrap())] {
            for i in 0..=255 {
                let signal = i as f32 / 255.0;
                assert!((transfer.signal(transfer.light(signal)) - signal).abs() < 1e-6, "{transfer:?} {i}");
            }
        }
    }

    #[test]
    fn what_is_no_gamma_is_refused() {
        assert!([0.0, -2.2, 11.0, f64::NAN, f64::INFINITY].iter().all(|&g| Gamma::new(g).is_err()));
        assert!([0.0, 1.0, -0.5, 2.0, f64::NAN].iter().all(|&a| Gamma::fit(a).is_err()));
    }
}
