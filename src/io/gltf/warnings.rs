//! Collecting warnings; what repeats is counted instead of listed.

use crate::io::Warning;
use std::collections::HashMap;

/// Places that are named one by one before the rest is counted.
const NAMED: usize = 3;
/// Different messages that are kept.
const KEPT: usize = 100;

/// Warnings in the order of their first occurrence.
#[derive(Default)]
pub(super) struct Warnings {
    list: Vec<Repeated>,
    of: HashMap<String, usize>,
    dropped: usize,
}

struct Repeated {
    message: String,
    places: Vec<String>,
    count: usize,
    /// Where it was found last.
    last: String,
}

impl Warnings {
    /// Note that `message` holds at `place`; said twice of one place, it counts once.
    pub fn push(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        if self.list.len() == KEPT && !self.of.contains_key(&message) {
            self.dropped += 1;
            return;
        }
        let at = *self.of.entry(message.clone()).or_insert_with(|| {
            self.list.push(Repeated { message, places: Vec::new(), count: 0, last: String::new() });
            self.list.len() - 1
        });
        let (entry, place) = (&mut self.list[at], place.into());
        if entry.count > 0 && entry.last == place {
            return;
        }
        entry.count += 1;
        if entry.places.len() < NAMED {
            entry.places.push(place.clone());
        }
        entry.last = place;
    }

    /// One warning a message: its first places, and how many more there are.
    pub fn finish(self) -> Vec<Warning> {
        let one = |r: Repeated| {
            let more = r.count - r.places.len();
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            Warning { place: r.places.join(", ") + &rest, message: r.message }
        };
        let mut out: Vec<Warning> = self.list.into_iter().map(one).collect();
        if self.dropped > 0 {
            let message = format!("{} more warnings", self.dropped);
            out.push(Warning { place: String::new(), message });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_repeats_is_counted() {
        let mut w = Warnings::default();
        (0..20_000).for_each(|i| w.push(format!("nodes[{}]", i / 2), "odd"));
        (0..500).for_each(|i| w.push("meshes[0]", format!("{i} odd")));
        let list = w.finish();
        assert_eq!(list[0].to_string(), "nodes[0], nodes[1], nodes[2] and 9997 more: odd");
        assert_eq!((list.len(), list[100].message.as_str()), (101, "401 more warnings"));
    }
}
