//! Bones by name, and what to say of names that are not there.

use crate::cli::{Failure, say};
use sinew::skeleton::{BoneId, Skeleton};

/// Names that are shown where none fits.
const SHOWN: usize = 8;

/// The bone that an option names: as written, else by its letters and digits whatever their case, else by index.
pub fn find_bone(skeleton: &Skeleton, option: &str, name: &str) -> Result<BoneId, Failure> {
    let plain = plain(name);
    let index = name.parse::<u32>().ok().filter(|&i| (i as usize) < skeleton.len()).map(BoneId);
    let loose = || skeleton.ids().find(|&b| !plain.is_empty() && self::plain(skeleton.name(b)) == plain);
    skeleton.find(name).or_else(loose).or(index).ok_or_else(|| {
        let near: Vec<String> = near(skeleton, &plain).into_iter().map(say::name).collect();
        let count = skeleton.len();
        let rest = if count > near.len() {
            format!(" (of {count}; `sinew info --json` lists all)")
        } else {
            String::new()
        };
        let has = if near.is_empty() { "there are none".into() } else { near.join(", ") };
        Failure::Usage(format!("{option} {name}: there is no such bone; near names: {has}{rest}"))
    })
}

/// Letters and digits, in lower case.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The names most like a plain one, best first: those that contain it, then by edits.
fn near<'s>(skeleton: &'s Skeleton, name: &str) -> Vec<&'s str> {
    let mut all: Vec<(usize, &str)> = skeleton
        .ids()
        .map(|b| {
            let other = plain(skeleton.name(b));
            let part =
                !name.is_empty() && !other.is_empty() && (other.contains(name) || name.contains(&other));
            (if part { 0 } else { 1 + edits(name, &other) }, skeleton.name(b))
        })
        .collect();
    all.sort_by_key(|(d, _)| *d);
    all.into_iter().map(|(_, name)| name).take(SHOWN).collect()
}

/// Letters to be put in, taken out or replaced to make one word the other; words are cut at 64 letters.
fn edits(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut corner = i;
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = corner + usize::from(x != y);
            corner = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        for (a, b, n) in [("", "abc", 3), ("tail", "tale", 2), ("hand", "hand", 0), ("head", "heads", 1)] {
            assert_eq!((edits(a, b), edits(b, a)), (n, n), "{a} {b}");
        }
    }
}
