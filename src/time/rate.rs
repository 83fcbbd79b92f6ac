//! Frames a second as a fraction.

/// Frames a second, exactly: 24, or 30000/1001.
///
/// ```
/// use sinew::time::Rate;
/// assert_eq!("23.976".parse::<Rate>().unwrap().to_string(), "24000/1001");
/// assert_eq!("12.5".parse::<Rate>().unwrap().to_string(), "25/2");
/// assert_eq!("24".parse::<Rate>().unwrap().fps(), 24.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rate {
    frames: u16,
    seconds: u16,
}

/// Not a rate of frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{text}\": expected frames a second such as 24, 23.976 or 30000/1001, above 0 and at most 65535")]
pub struct RateError {
    /// What was found.
    pub text: String,
}

impl Default for Rate {
    fn default() -> Self {
        Self { frames: 24, seconds: 1 }
    }
}

impl Rate {
    /// `frames` in every `seconds`, in lowest terms.
    ///
    /// # Errors
    /// [`RateError`] where one of them is zero.
    pub fn new(frames: u16, seconds: u16) -> Result<Self, RateError> {
        if frames == 0 || seconds == 0 {
            return Err(RateError { text: format!("{frames}/{seconds}") });
        }
        let d = gcd(frames, seconds);
        Ok(Self { frames: frames / d, seconds: seconds / d })
    }

    /// The nearest fraction: NTSC's `n·1000/1001` within 0.0005, else the last convergent of the continued fraction
    /// whose parts fit 16 bits.
    ///
    /// # Errors
    /// [`RateError`] where that is zero, negative, above 65535 or no number.
    pub fn from_fps(fps: f64) -> Result<Self, RateError> {
        let error = || RateError { text: fps.to_string() };
        if !(fps > 0.0 && fps <= 65535.0) {
            return Err(error());
        }
        let whole = (fps * 1.001).round();
        let ntsc = [24.0, 30.0, 60.0].contains(&whole) && (fps - whole / 1.001).abs() < 5e-4;
        if ntsc {
            return Self::new(whole as u16 * 1000, 1001);
        }
        let (frames, seconds) = convergent(fps);
        Self::new(frames, seconds).map_err(|_| error())
    }

    /// The fraction's upper part.
    pub fn frames(self) -> u16 {
        self.frames
    }

    /// The fraction's lower part.
    pub fn seconds(self) -> u16 {
        self.seconds
    }

    /// Frames a second.
    pub fn fps(self) -> f64 {
        f64::from(self.frames) / f64::from(self.seconds)
    }

    /// When the frame after `frames` others starts, rounded to 1/100 s: differences of these are delays without drift.
    pub fn centiseconds(self, frames: u32) -> u64 {
        self.ticks(frames, 100)
    }

    /// The same in 1/1000 s.
    pub fn milliseconds(self, frames: u32) -> u64 {
        self.ticks(frames, 1000)
    }

    /// `frames / fps` in parts of a second, rounded to the nearest.
    fn ticks(self, frames: u32, parts: u128) -> u64 {
        let (n, d) = (u128::from(frames) * parts * u128::from(self.seconds), u128::from(self.frames));
        // At most 2³² · 1000 · 2¹⁶ < 2⁶⁴.
        ((2 * n + d) / (2 * d)) as u64
    }
}

fn gcd(a: u16, b: u16) -> u16 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The last convergent of `x`'s continued fraction with 16-bit parts.
fn convergent(x: f64) -> (u16, u16) {
    let (mut p, mut q) = ([0u64, 1], [1u64, 0]);
    let mut rest = x;
    for _ in 0..24 {
        let a = rest.floor() as u64;
        let next = (a.saturating_mul(p[1]).saturating_add(p[0]), a.saturating_mul(q[1]).saturating_add(q[0]));
        if next.0 > 65535 || next.1 > 65535 {
            break;
        }
        (p, q) = ([p[1], next.0], [q[1], next.1]);
        // What is left is rounding.
        if (x - p[1] as f64 / q[1] as f64).abs() <= 1e-12 * x || rest.fract() == 0.0 {
            break;
        }
        rest = 1.0 / rest.fract();
    }
    (p[1] as u16, q[1] as u16)
}

impl std::str::FromStr for Rate {
    type Err = RateError;

    fn from_str(text: &str) -> Result<Self, RateError> {
        let error = || RateError { text: text.to_owned() };
        if let Some((frames, seconds)) = text.split_once('/') {
            let part = |s: &str| s.trim().parse::<u16>().map_err(|_| error());
            return Self::new(part(frames)?, part(seconds)?).map_err(|_| error());
        }
        let fps = text.trim().parse::<f64>().map_err(|_| error())?;
        Self::from_fps(fps).map_err(|_| error())
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.seconds {
            1 => write!(f, "{}", self.frames),
            seconds => write!(f, "{}/{seconds}", self.frames),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_become_fractions() {
        let text = |fps: f64| Rate::from_fps(fps).unwrap().to_string();
        assert_eq!(text(29.97), "30000/1001");
        assert_eq!(text(23.976023976), "24000/1001");
        assert_eq!(text(60.0), "60");
        assert_eq!(text(0.1), "1/10");
        assert_eq!(text(100.0 / 3.0), "100/3");
        assert_eq!(Rate::new(50, 4).unwrap().to_string(), "25/2");
        assert_eq!(text(std::f64::consts::PI), "355/113");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["0", "-24", "nan", "inf", "1e9", "1e-9", "", "24/0", "0/1", "24/", "24fps"] {
            assert!(text.parse::<Rate>().unwrap_err().to_string().contains("23.976"), "{text}");
        }
    }

    #[test]
    fn centiseconds_do_not_drift() {
        let rate = Rate::new(60, 1).unwrap();
        assert_eq!([0, 1, 2, 3, 60].map(|k| rate.centiseconds(k)), [0, 2, 3, 5, 100]);
        assert_eq!(Rate::new(24000, 1001).unwrap().centiseconds(24_000), 100_100);
        assert_eq!([1, 2, 3, 60].map(|k| rate.milliseconds(k)), [17, 33, 50, 1000]);
        assert_eq!(Rate::new(1, 65535).unwrap().centiseconds(u32::MAX), u64::from(u32::MAX) * 6_553_500);
    }
}
