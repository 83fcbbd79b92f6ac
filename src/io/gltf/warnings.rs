//! Collecting warnings; what repeats is counted instead of listed.

use crate::io::Warning;
use std::collections::HashMap;

/// Places that are named one by one before the rest is counted.
const NAMED: usize = 3;

/// Warnings in the order of their first occurrence.
#[derive(Default)]
pub(super) struct Warnings {
    list: Vec<Repeated>,
    of: HashMap<String, usize>,
}

struct Repeated {
    message: String,
    places: Vec<String>,
    count: usize,
}

impl Warnings {
    /// Note that `message` holds at `place`.
    pub fn push(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        let at = *self.of.entry(message.clone()).or_insert_with(|| {
            self.list.push(Repeated { message, places: Vec::new(), count: 0 });
            self.list.len() - 1
        });
        let entry = &mut self.list[at];
        entry.count += 1;
        if entry.places.len() < NAMED {
            entry.places.push(place.into());
        }
    }

    /// One warning a message: its first places, and how many more there are.
    pub fn finish(self) -> Vec<Warning> {
        let one = |r: Repeated| {
            let more = r.count - r.places.len();
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            Warning { place: r.places.join(", ") + &rest, message: r.message }
        };
        self.list.into_iter().map(one).collect()
    }
}
