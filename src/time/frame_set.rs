//! Which frames are meant: `1-48x2,60`.

use super::Rate;

/// Frame numbers, ascending, each once.
///
/// Frames are numbered from 1, as animators do: frame 1 shows the clip's first instant ([`frame_time`]). Zero and
/// negative numbers are times before it.
///
/// ```
/// use sinew::time::FrameSet;
/// let set = FrameSet::parse("60, 1-7x3, 4").unwrap();
/// assert_eq!(set.iter().collect::<Vec<_>>(), [1, 4, 7, 60]);
/// assert_eq!(FrameSet::parse("1-48x0").unwrap_err().to_string(), "\"1-48x0\": the step must be at least 1");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameSet {
    numbers: Vec<i64>,
}

/// The second that frame `number` shows: `start + (number − 1)/fps`.
///
/// ```
/// use sinew::time::{Rate, frame_time};
/// assert_eq!(frame_time(0.5, 1, Rate::default()), 0.5);
/// assert_eq!(frame_time(0.5, 25, Rate::default()), 1.5);
/// ```
pub fn frame_time(start: f64, number: i64, rate: Rate) -> f64 {
    // One multiplication and one division, so that whole seconds come out exactly.
    let ahead = i128::from(number) - 1;
    start + ahead as f64 * f64::from(rate.seconds()) / f64::from(rate.frames())
}

/// Not a set of frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameSetError {
    /// Something that is no number.
    #[error("\"{text}\": expected frames such as 12, 1-48 or 1-48x2, found \"{found}\"")]
    Number {
        /// The part between commas.
        text: String,
        /// What should be a number.
        found: String,
    },
    /// A step of 0 or less.
    #[error("\"{text}\": the step must be at least 1")]
    Step {
        /// The part between commas.
        text: String,
    },
    /// A range that runs backwards.
    #[error("\"{text}\": the range runs backwards; expected the smaller number first, as in {last}-{first}")]
    Backwards {
        /// The part between commas.
        text: String,
        /// First number.
        first: i64,
        /// Last number, smaller.
        last: i64,
    },
    /// More frames than anybody can mean.
    #[error("\"{text}\": that makes {frames} frames, more than the limit of {limit}; choose a shorter range or a step", limit = FrameSet::LIMIT)]
    TooMany {
        /// The part between commas that passed the limit.
        text: String,
        /// Frames up to there.
        frames: u128,
    },
}

impl FrameSet {
    /// Frames that a set may hold: eleven hours at 24 a second.
    pub const LIMIT: u32 = 1_000_000;

    /// Numbers and ranges between commas; `xN` takes every N-th frame of a range from its first.
    ///
    /// Numbers may be negative (`-5--1`). A range that runs backwards is an error.
    ///
    /// # Errors
    /// [`FrameSetError`]; nothing is allocated for a set beyond [`LIMIT`](Self::LIMIT).
    pub fn parse(text: &str) -> Result<Self, FrameSetError> {
        let mut numbers = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (first, last, step) = parse_part(part)?;
            let count = (i128::from(last) - i128::from(first)) as u128 / step as u128 + 1;
            let frames = numbers.len() as u128 + count;
            if frames > u128::from(Self::LIMIT) {
                return Err(FrameSetError::TooMany { text: part.to_owned(), frames });
            }
            // The last product may leave 64 bits where the sum does not.
            let number = |k: i64| (i128::from(first) + i128::from(k) * i128::from(step)) as i64;
            numbers.extend((0..count as i64).map(number));
        }
        numbers.sort_unstable();
        numbers.dedup();
        Ok(Self { numbers })
    }

    /// The frames 1 … `count`, at most [`LIMIT`](Self::LIMIT).
    pub fn first(count: u32) -> Self {
        Self { numbers: (1..=i64::from(count.min(Self::LIMIT))).collect() }
    }

    /// The numbers, ascending.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = i64> + '_ {
        self.numbers.iter().copied()
    }

    /// How many; at least one after [`parse`](Self::parse).
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }
}

impl std::str::FromStr for FrameSet {
    type Err = FrameSetError;

    fn from_str(text: &str) -> Result<Self, FrameSetError> {
        Self::parse(text)
    }
}

/// First, last and step of `12`, `1-48` or `1-48x2`.
fn parse_part(text: &str) -> Result<(i64, i64, i64), FrameSetError> {
    let number = |found: &str| {
        let found = found.trim();
        let bad = || FrameSetError::Number { text: text.to_owned(), found: found.to_owned() };
        // `parse` would take a plus sign.
        if found.starts_with('+') { Err(bad()) } else { found.parse::<i64>().map_err(|_| bad()) }
    };
    let (range, step) = match text.split_once('x') {
        Some((range, step)) => (range, number(step)?),
        None => (text, 1),
    };
    if step < 1 {
        return Err(FrameSetError::Step { text: text.to_owned() });
    }
    // The dash of a range is the first one behind a digit; others are signs.
    let dash = range.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(i, _)| i);
    let (first, last) = match dash {
        Some(dash) => (number(&range[..dash])?, number(&range[dash + 1..])?),
        None => (number(range)?, number(range)?),
    };
    if last < first {
        return Err(FrameSetError::Backwards { text: text.to_owned(), first, last });
    }
    Ok((first, last, step))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<i64> {
        FrameSet::parse(text).unwrap().iter().collect()
    }

    #[test]
    fn sets_are_ordered_and_hold_each_frame_once() {
        assert_eq!(numbers("5"), [5]);
        assert_eq!(numbers("1-48x2,60").len(), 25);
        assert_eq!(numbers("4-6,1-5"), [1, 2, 3, 4, 5, 6]);
        assert_eq!(numbers("-5--3,-1-1"), [-5, -4, -3, -1, 0, 1]);
        assert_eq!(numbers(" 2 - 4 , 9 "), [2, 3, 4, 9]);
        assert_eq!(numbers("7-7x100"), [7]);
        let far = format!("{}-{}x9223372036854775807", i64::MIN, i64::MAX);
        assert_eq!(numbers(&far), [i64::MIN, -1, i64::MAX - 1]);
        assert_eq!(FrameSet::first(3).iter().collect::<Vec<_>>(), [1, 2, 3]);
    }

    #[test]
    fn mistakes_are_named() {
        let says = |text: &str, part: &str| {
            let message = FrameSet::parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text}: {message}");
        };
        says("", "found \"\"");
        says("1,,2", "found \"\"");
        says("1-", "\"1-\"");
        says("a-b", "found \"a\"");
        says("+1", "found \"+1\"");
        says("1-48x", "found \"\"");
        says("1-48x-2", "\"1-48x-2\": the step must be at least 1");
        says("48-1", "as in 1-48");
        says("99999999999999999999", "found \"99999999999999999999\"");
        says("1-1000001", "1000001 frames");
        says("1-9223372036854775807", "more than the limit of 1000000");
        says("1-600000,1-600000", "1200000 frames");
    }
}
