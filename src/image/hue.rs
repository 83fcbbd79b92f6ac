//! Gray, hue, saturation and value of a colour (chapter 1 of the notes, its reference pictures).
//!
//! All functions take three numbers of any unit: of light or of signals, 0…1 or more. Hue and saturation mean what eyes see only for
//! signals, as picture editors have it.

/// How bright a colour is, `0.2126 R + 0.7152 G + 0.0722 B` (ITU-R BT.709): the luminance of light, the luma of signals.
///
/// ```
/// use sinew::image::hue::gray;
/// assert_eq!(gray([0.0, 1.0, 0.0]), 0.7152);
/// ```
#[inline]
pub fn gray([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// A colour by hue, saturation and value.
///
/// With `M` the largest channel, `m` the smallest and `C = M − m`: value `M`, saturation `C/M`, and hue by the sector of the largest
/// channel, `60°·(G−B)/C`, `60°·(2 + (B−R)/C)` or `60°·(4 + (R−G)/C)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hsv {
    /// Degrees, −60…300: red is 0°, green 120°, blue 240°. 0 for grays.
    pub hue_deg: f64,
    /// 0 (gray) … 1; 0 for black.
    pub saturation: f64,
    /// The largest channel.
    pub value: f64,
}

impl Hsv {
    /// Of a colour without negative channels.
    ///
    /// ```
    /// use sinew::image::hue::Hsv;
    /// let purple = Hsv::of([0.5, 0.25, 0.5]);
    /// assert_eq!(purple, Hsv { hue_deg: -60.0, saturation: 0.5, value: 0.5 });
    /// assert_eq!(purple.rgb(), [0.5, 0.25, 0.5]);
    /// ```
    pub fn of([r, g, b]: [f64; 3]) -> Self {
        let value = r.max(g).max(b);
        let chroma = value - r.min(g).min(b);
        let sector = |difference: f64, at: f64| 60.0 * (difference / chroma + at);
        let hue_deg = match value {
            _ if chroma <= 0.0 => 0.0,
            v if v == r => sector(g - b, 0.0),
            v if v == g => sector(b - r, 2.0),
            _ => sector(r - g, 4.0),
        };
        let saturation = if value > 0.0 { chroma / value } else { 0.0 };
        Self { hue_deg, saturation, value }
    }

    /// The colour; hues of −360° and more that are not within 0…360° are brought there as `(h + 360) mod 360`.
    pub fn rgb(self) -> [f64; 3] {
        let inside = (0.0..360.0).contains(&self.hue_deg);
        let sixth = if inside { self.hue_deg } else { (self.hue_deg + 360.0) % 360.0 } / 60.0;
        let chroma = self.value * self.saturation;
        let middle = chroma * (1.0 - (sixth % 2.0 - 1.0).abs());
        let color = match sixth as u8 {
            0 => [chroma, middle, 0.0],
            1 => [middle, chroma, 0.0],
            2 => [0.0, chroma, middle],
            3 => [0.0, middle, chroma],
            4 => [middle, 0.0, chroma],
            _ => [chroma, 0.0, middle],
        };
        let least = self.value - chroma;
        color.map(|c| c + least)
    }
}

/// The colour with its hue turned by −300° or more, to `(h + degrees + 360) mod 360`.
///
/// ```
/// use sinew::image::hue::shift_hue;
/// assert_eq!(shift_hue([1.0, 0.0, 0.0], 180.0), [0.0, 1.0, 1.0]);
/// ```
pub fn shift_hue(color: [f64; 3], degrees: f64) -> [f64; 3] {
    let hsv = Hsv::of(color);
    Hsv { hue_deg: (hsv.hue_deg + degrees + 360.0) % 360.0, ..hsv }.rgb()
}

/// The colour with less saturation, `S(1 − amount)`: nothing happens at 0, grays are left at 1.
///
/// ```
/// use sinew::image::hue::desaturate;
/// assert_eq!(desaturate([1.0, 0.0, 0.5], 0.5), [1.0, 0.5, 0.75]);
/// ```
pub fn desaturate(color: [f64; 3], amount: f64) -> [f64; 3] {
    let hsv = Hsv::of(color);
    Hsv { saturation: hsv.saturation * (1.0 - amount), ..hsv }.rgb()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        (0..3).all(|c| (a[c] - b[c]).abs() < 1e-12)
    }

    #[test]
    fn colours_survive_the_way_through_hue() {
        let mut rng = crate::test_rng::Rng::new(2);
        for _ in 0..2000 {
            let color = std::array::from_fn(|_| (rng.range(0.0, 8.0) as u8) as f64 / 7.0);
            let hsv = Hsv::of(color);
            assert!(
                (-60.0..=300.0).contains(&hsv.hue_deg) && (0.0..=1.0).contains(&hsv.saturation),
                "{hsv:?}"
            );
            assert!(near(hsv.rgb(), color), "{color:?} {hsv:?} {:?}", hsv.rgb());
            // Six turns of 60° come back; each moves the channels on.
            assert!(near(shift_hue(shift_hue(color, 150.0), 210.0), color), "{color:?}");
            assert!(near(shift_hue(color, 120.0), [color[2], color[0], color[1]]), "{color:?}");
            assert!(near(desaturate(color, 1.0), [hsv.value; 3]), "{color:?}");
        }
    }

    #[test]
    fn gray_weighs_to_one() {
        assert!((gray([1.0; 3]) - 1.0).abs() < 1e-15);
    }
}
