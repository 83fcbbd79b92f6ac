//! What is selected: bones, and keys as runs of indices, so that a million keys are a few numbers.

use sinew::skeleton::BoneId;
use std::collections::BTreeMap;
use std::ops::Range;

/// Indices as sorted, disjoint, non-empty runs.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Spans(Vec<Range<u32>>);

impl Spans {
    /// One run; none if it is empty.
    pub fn one(run: Range<usize>) -> Self {
        Self(Some(run.start as u32..run.end as u32).filter(|r| !r.is_empty()).into_iter().collect())
    }

    /// Sorted or not, repeated or not.
    pub fn from_indices(of: impl IntoIterator<Item = usize>) -> Self {
        let mut s = Self::default();
        let mut all: Vec<usize> = of.into_iter().collect();
        all.sort_unstable();
        for i in all {
            s.push(i as u32..i as u32 + 1);
        }
        s
    }

    /// Append a run that starts no earlier than the last one does.
    fn push(&mut self, run: Range<u32>) {
        match self.0.last_mut() {
            Some(last) if last.end >= run.start => last.end = last.end.max(run.end),
            _ if run.is_empty() => {}
            _ => self.0.push(run),
        }
    }

    /// Whether `i` is among them.
    pub fn contains(&self, i: usize) -> bool {
        let at = self.0.partition_point(|r| r.end as usize <= i);
        self.0.get(at).is_some_and(|r| r.start as usize <= i)
    }

    /// Whether any of a run is among them.
    pub fn meets(&self, run: Range<usize>) -> bool {
        let at = self.0.partition_point(|r| r.end as usize <= run.start);
        self.0.get(at).is_some_and(|r| (r.start as usize) < run.end)
    }

    /// How many indices.
    pub fn len(&self) -> usize {
        self.0.iter().map(|r| r.len()).sum()
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The runs.
    pub fn runs(&self) -> &[Range<u32>] {
        &self.0
    }

    /// All indices, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().cloned().flatten().map(|i| i as usize)
    }

    /// In one or in both.
    pub fn union(&self, other: &Self) -> Self {
        let mut all: Vec<_> = self.0.iter().chain(&other.0).cloned().collect();
        all.sort_unstable_by_key(|r| r.start);
        let mut s = Self::default();
        all.into_iter().for_each(|r| s.push(r));
        s
    }

    /// In this and not in `other`.
    pub fn minus(&self, other: &Self) -> Self {
        let mut s = Self::default();
        for run in &self.0 {
            let mut start = run.start;
            for cut in other.0.iter().filter(|c| c.end > run.start && c.start < run.end) {
                s.push(start..cut.start.max(start));
                start = start.max(cut.end);
            }
            s.push(start.min(run.end)..run.end);
        }
        s
    }

    /// Those below `len`.
    pub fn below(&self, len: usize) -> Self {
        let runs = self.0.iter().map(|r| r.start..r.end.min(len as u32)).filter(|r| !r.is_empty());
        Self(runs.collect())
    }
}

/// Selected keys of one track.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrackKeys {
    /// Indices of keys.
    pub spans: Spans,
    /// Which components a change of value moves, a bit each; components beyond the seventh share the last bit.
    pub mask: u8,
}

/// Selected keys: tracks of the active clip.
pub type Keys = BTreeMap<u32, TrackKeys>;

/// How a choice meets what was selected before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// It takes its place (click).
    Replace,
    /// It is added (box with Shift).
    Add,
    /// What was selected is not, the rest is (Shift and click).
    Toggle,
}

/// What commands act upon.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Selection {
    /// In the order of choosing: the last is the active one.
    pub bones: Vec<BoneId>,
    /// Of the active clip.
    pub keys: Keys,
}

impl Selection {
    /// The bone chosen last.
    pub fn active(&self) -> Option<BoneId> {
        self.bones.last().copied()
    }

    /// Whether a key is selected.
    pub fn has_key(&self, track: usize, key: usize) -> bool {
        self.keys.get(&(track as u32)).is_some_and(|t| t.spans.contains(key))
    }

    /// Number of keys.
    pub fn key_count(&self) -> usize {
        self.keys.values().map(|t| t.spans.len()).sum()
    }

    /// Choose bones.
    pub fn choose_bones(&mut self, bones: &[BoneId], mode: Mode) {
        if mode == Mode::Replace {
            self.bones.clear();
        }
        for &b in bones {
            let was = self.bones.iter().position(|&s| s == b);
            was.map(|at| self.bones.remove(at));
            if was.is_none() || mode != Mode::Toggle {
                self.bones.push(b);
            }
        }
    }

    /// Choose keys.
    pub fn choose_keys(&mut self, keys: Keys, mode: Mode) {
        if mode == Mode::Replace {
            self.keys = keys;
        } else {
            for (track, new) in keys {
                let old = self.keys.remove(&track);
                let spans = match &old {
                    None => new.spans,
                    Some(old) if mode == Mode::Add => old.spans.union(&new.spans),
                    Some(old) => old.spans.minus(&new.spans).union(&new.spans.minus(&old.spans)),
                };
                let mask = new.mask | old.map_or(0, |o| o.mask);
                self.keys.insert(track, TrackKeys { spans, mask });
            }
        }
        self.keys.retain(|_, k| !k.spans.is_empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_sets() {
        let set = |bits: u32| Spans::from_indices((0..8).filter(move |i| bits >> i & 1 == 1));
        for (a, b) in (0..256).flat_map(|a| (0..256).map(move |b| (a, b))) {
            assert_eq!(set(a).union(&set(b)), set(a | b));
            assert_eq!(set(a).minus(&set(b)), set(a & !b), "{a:b} minus {b:b}");
        }
        assert_eq!(set(0b1011_0110).below(5), set(0b1_0110));
        assert!((0..8).all(|i| set(0b1011_0110).contains(i) == (0b1011_0110 >> i & 1 == 1)));
    }
}
