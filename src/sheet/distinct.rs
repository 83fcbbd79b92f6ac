//! Equal pictures once.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Pictures of which no two are equal, numbered in the order in which they first came.
#[derive(Clone, Debug, Default)]
pub struct Distinct<P> {
    cuts: Vec<([usize; 2], Vec<P>)>,
    /// Numbers of the pictures by hash; which hash it is never shows.
    known: BTreeMap<u64, Vec<usize>>,
    pixels: usize,
}

impl<P: Copy + Eq + Hash> Distinct<P> {
    /// None yet.
    pub fn new() -> Self {
        Self { cuts: Vec::new(), known: BTreeMap::new(), pixels: 0 }
    }

    /// The number of a picture: that of an equal one, or the next.
    pub fn add(&mut self, size: [usize; 2], pixels: Vec<P>) -> usize {
        let mut hasher = DefaultHasher::new();
        (size, &pixels).hash(&mut hasher);
        let same = self.known.entry(hasher.finish()).or_default();
        let found = same.iter().find(|&&i| self.cuts[i].0 == size && self.cuts[i].1 == pixels);
        if let Some(&i) = found {
            return i;
        }
        same.push(self.cuts.len());
        self.pixels += pixels.len();
        self.cuts.push((size, pixels));
        self.cuts.len() - 1
    }

    /// Sizes, by number.
    pub fn sizes(&self) -> Vec<[usize; 2]> {
        self.cuts.iter().map(|c| c.0).collect()
    }

    /// The pixels of a picture.
    ///
    /// # Panics
    /// If there is no such number.
    pub fn pixels(&self, number: usize) -> &[P] {
        &self.cuts[number].1
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.cuts.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.cuts.is_empty()
    }

    /// Pixels of all together: what has to be found room for.
    pub fn area(&self) -> usize {
        self.pixels
    }
}
