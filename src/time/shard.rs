//! A share of the work: every n-th piece.

use std::str::FromStr;

/// Share `index` of `count`, from 1: of a list, the pieces `index − 1`, `index − 1 + count`, …
///
/// The shares of all indices are disjoint and together the whole, so that as many machines do the work of one.
///
/// ```
/// use sinew::time::Shard;
/// let second: Shard = "2/4".parse().unwrap();
/// assert_eq!((0..10).filter(|&i| second.has(i)).collect::<Vec<_>>(), [1, 5, 9]);
/// assert!("0/4".parse::<Shard>().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// Not a share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{text}\": expected a share such as 1/4, from 1/n to n/n")]
pub struct ShardError {
    /// What was given.
    pub text: String,
}

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Whether piece `i`, counted from 0, belongs to this share.
    pub fn has(self, i: usize) -> bool {
        i % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let numbers =
            text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err(ShardError { text: text.to_owned() }),
        }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}
