//! Frames compared one by one, and what may differ.

use super::picture::{Difference, SidesDiffer, Worst, difference, psnr_linear};
use super::ssim;
use crate::image::{Image, Rgba8};

/// How much two frames may differ. The default allows nothing.
///
/// Each bound that is given must hold. `codes` and `pixels` are one bound: at most `pixels` pixels of a frame differ by more than
/// `codes` in any channel, what is not given being 0. It applies unless only `psnr` or `ssim` is given.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Tolerance {
    /// Least peak signal to noise of a frame, dB.
    pub psnr: Option<f64>,
    /// Least structural similarity of a frame.
    pub ssim: Option<f64>,
    /// Codes that a pixel may be off.
    pub codes: Option<u8>,
    /// Pixels of a frame that may be off by more.
    pub pixels: Option<usize>,
}

/// A bound that does not hold.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Past {
    /// Too much noise.
    #[error("PSNR {found:.2} dB, expected {least} or more")]
    Psnr {
        /// What was measured.
        found: f64,
        /// The bound.
        least: f64,
    },
    /// Too little alike.
    #[error("SSIM {found:.4}, expected {least} or more")]
    Ssim {
        /// What was measured.
        found: f64,
        /// The bound.
        least: f64,
    },
    /// Too many pixels are off.
    #[error("{found} pixels of a frame differ by more than {codes} codes, expected {most} at most")]
    Pixels {
        /// What was counted.
        found: usize,
        /// The bound of each.
        codes: u8,
        /// The bound of their number.
        most: usize,
    },
    /// Light is not the same, where no bound allows it.
    #[error(
        "linear light differs, by less than a code anywhere (PSNR {found:.2} dB), expected the same; a bound of 0 codes compares codes alone"
    )]
    Light {
        /// Peak signal to noise of the light.
        found: f64,
    },
}

/// Two frames that were compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Which pixels differ, and by how much.
    pub difference: Difference,
    /// Peak signal to noise of linear light, dB.
    pub psnr_linear: f64,
    /// Structural similarity of luma.
    pub ssim: f64,
}

impl Compared {
    /// Measure two frames of 8 bits.
    ///
    /// ```
    /// use sinew::{image::Rgba8, measure::{Compared, Tolerance}};
    /// let gray = |v: u8| Rgba8 { width: 4, height: 4, data: [v, v, v, 255].repeat(16) };
    /// let c = Compared::of(&gray(100), &gray(102)).unwrap();
    /// assert!(Tolerance::default().check(&c).is_err());
    /// assert!(Tolerance { codes: Some(2), ..Tolerance::default() }.check(&c).is_ok());
    /// assert!(Tolerance { psnr: Some(40.0), ..Tolerance::default() }.check(&c).is_ok());
    /// ```
    ///
    /// # Errors
    /// [`SidesDiffer`].
    pub fn of(expected: &Rgba8, actual: &Rgba8) -> Result<Self, SidesDiffer> {
        let difference = difference(expected, actual)?;
        if difference.beyond(0) == 0 {
            return Ok(Self { difference, psnr_linear: f64::INFINITY, ssim: 1.0 });
        }
        let light = |p| Image::from_rgba8(p);
        let psnr_linear = psnr_linear(&light(expected), &light(actual))?;
        Ok(Self { psnr_linear, ssim: ssim(expected, actual)?, difference })
    }

    /// Measure two frames of floating-point light: as 8 bits, and the light itself.
    ///
    /// # Errors
    /// [`SidesDiffer`].
    pub fn of_light(expected: &Image, actual: &Image) -> Result<Self, SidesDiffer> {
        let codes = Self::of(&expected.to_rgba8(), &actual.to_rgba8())?;
        Ok(Self { psnr_linear: psnr_linear(expected, actual)?, ..codes })
    }

    /// Whether nothing differs, light included.
    pub fn equal(&self) -> bool {
        self.difference.beyond(0) == 0 && self.psnr_linear == f64::INFINITY
    }
}

impl Tolerance {
    /// Whether a pair of frames is alike enough.
    ///
    /// # Errors
    /// The first bound that does not hold.
    pub fn check(&self, c: &Compared) -> Result<(), Past> {
        let found = c.difference.psnr();
        if let Some(least) = self.psnr.filter(|&least| found < least) {
            return Err(Past::Psnr { found, least });
        }
        let found = c.ssim;
        if let Some(least) = self.ssim.filter(|&least| found < least) {
            return Err(Past::Ssim { found, least });
        }
        self.check_pixels(c)
    }

    fn check_pixels(&self, c: &Compared) -> Result<(), Past> {
        let counts = self.codes.is_some() || self.pixels.is_some();
        if !counts && (self.psnr.is_some() || self.ssim.is_some()) {
            return Ok(());
        }
        let (codes, most) = (self.codes.unwrap_or(0), self.pixels.unwrap_or(0));
        let found = c.difference.beyond(codes);
        // Without any bound light must be the same too, below what codes can tell.
        if !counts && found == 0 && !c.equal() {
            return Err(Past::Light { found: c.psnr_linear });
        }
        if found > most { Err(Past::Pixels { found, codes, most }) } else { Ok(()) }
    }
}

/// The figures of a film: its worst frame's.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Frames that were compared.
    pub frames: usize,
    /// Frames that differ.
    pub differing_frames: usize,
    /// The first frame that differs, from 1.
    pub first: Option<usize>,
    /// Pixels that differ, of all frames.
    pub differing_pixels: usize,
    /// Pixels of all frames.
    pub pixels: usize,
    /// The largest difference of a channel, and the frame, from 1, that has it.
    pub worst: (Worst, usize),
    /// Least peak signal to noise, dB.
    pub psnr: f64,
    /// Least peak signal to noise of linear light, dB.
    pub psnr_linear: f64,
    /// Least structural similarity.
    pub ssim: f64,
}

impl Default for Summary {
    fn default() -> Self {
        Self {
            frames: 0,
            differing_frames: 0,
            first: None,
            differing_pixels: 0,
            pixels: 0,
            worst: (Worst::default(), 0),
            psnr: f64::INFINITY,
            psnr_linear: f64::INFINITY,
            ssim: 1.0,
        }
    }
}

impl Summary {
    /// Add the next frame; tells whether it has the least peak signal to noise so far.
    pub fn add(&mut self, c: &Compared) -> bool {
        self.frames += 1;
        self.pixels += c.difference.pixels;
        if c.equal() {
            return false;
        }
        self.differing_frames += 1;
        self.first = self.first.or(Some(self.frames));
        self.differing_pixels += c.difference.beyond(0);
        if c.difference.worst.codes > self.worst.0.codes {
            self.worst = (c.difference.worst, self.frames);
        }
        let worse = self.differing_frames == 1 || c.difference.psnr() < self.psnr;
        self.psnr = self.psnr.min(c.difference.psnr());
        self.psnr_linear = self.psnr_linear.min(c.psnr_linear);
        self.ssim = self.ssim.min(c.ssim);
        worse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(values: &[u8]) -> Rgba8 {
        Rgba8 { width: values.len(), height: 1, data: values.iter().flat_map(|&v| [v, v, v, 255]).collect() }
    }

    #[test]
    fn bounds_hold_alone_and_together() {
        let c = Compared::of(&gray(&[10, 10, 10, 10]), &gray(&[10, 11, 12, 60])).unwrap();
        let none = Tolerance::default();
        let check = |t: Tolerance| t.check(&c);
        assert_eq!(check(none), Err(Past::Pixels { found: 3, codes: 0, most: 0 }));
        assert_eq!(
            check(Tolerance { codes: Some(1), ..none }),
            Err(Past::Pixels { found: 2, codes: 1, most: 0 })
        );
        assert_eq!(check(Tolerance { codes: Some(1), pixels: Some(2), ..none }), Ok(()));
        assert_eq!(check(Tolerance { pixels: Some(3), ..none }), Ok(()));
        let db = c.difference.psnr();
        assert_eq!(check(Tolerance { psnr: Some(db), ..none }), Ok(()));
        assert_eq!(
            check(Tolerance { psnr: Some(db + 0.1), ..none }),
            Err(Past::Psnr { found: db, least: db + 0.1 })
        );
        assert!(check(Tolerance { psnr: Some(db), ssim: Some(1.0), ..none }).is_err());
        assert!(check(Tolerance { psnr: Some(db), codes: Some(49), ..none }).is_err());
    }

    #[test]
    fn light_below_a_code_differs_only_where_nothing_may() {
        let (a, b) = (Image::filled(3, 3, [0.5; 4]), Image::filled(3, 3, [0.5000001; 4]));
        let c = Compared::of_light(&a, &b).unwrap();
        assert!(!c.equal() && c.difference.beyond(0) == 0);
        assert!(Tolerance { codes: Some(0), ..Tolerance::default() }.check(&c).is_ok());
        let past = Tolerance::default().check(&c);
        assert_eq!(
            past,
            Err(Past::Light { found: c.psnr_linear }),
            "no pixel is counted that differs by no code"
        );
        assert!(Compared::of_light(&a, &a).unwrap().equal());
    }

    #[test]
    fn a_film_is_as_bad_as_its_worst_frame() {
        let mut s = Summary::default();
        let one = |a: &[u8], b: &[u8]| Compared::of(&gray(a), &gray(b)).unwrap();
        let added = [(&[9, 9], &[9, 9]), (&[9, 9], &[9, 8]), (&[9, 9], &[0, 9]), (&[9, 9], &[8, 9])];
        let worse = added.map(|(a, b)| s.add(&one(a, b)));
        assert_eq!(worse, [false, true, true, false]);
        assert_eq!(
            (s.frames, s.differing_frames, s.first, s.differing_pixels, s.pixels),
            (4, 3, Some(2), 3, 8)
        );
        assert_eq!((s.worst.0.codes, s.worst.0.at, s.worst.1), (9, [0, 0], 3));
        assert_eq!(s.psnr, one(&[9, 9], &[0, 9]).difference.psnr());
    }
}
