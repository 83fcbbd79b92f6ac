//! Left and right by names: `hand.L`, `l_hand`, `LeftHand`, `LHand`, `Bip01 R Hand`.

use crate::skeleton::{BoneId, Skeleton};
use std::collections::BTreeMap;

/// Which side a name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The character's left.
    Left,
    /// Its right.
    Right,
}

impl Side {
    fn other(self) -> Self {
        if self == Self::Left { Self::Right } else { Self::Left }
    }
}

/// The side that a name says, and the name in lower case with `*` in the side's place: equal for both bones of a pair.
///
/// ```
/// use sinew::pose::sides::{Side, side_of};
/// assert_eq!(side_of("hand.L"), Some((Side::Left, "hand.*".into())));
/// assert_eq!(side_of("mixamorig:RightFoot"), Some((Side::Right, "mixamorig:*foot".into())));
/// assert_eq!(side_of("LowerBack"), None);
/// ```
pub fn side_of(name: &str) -> Option<(Side, String)> {
    let chars: Vec<char> = name.chars().collect();
    let (at, length, side) = word(&chars).or_else(|| letter(&chars))?;
    let lower = |c: &[char]| c.iter().flat_map(|c| c.to_lowercase()).collect::<String>();
    Some((side, format!("{}*{}", lower(&chars[..at]), lower(&chars[at + length..]))))
}

/// `left` or `right` where a word begins.
fn word(name: &[char]) -> Option<(usize, usize, Side)> {
    (0..name.len()).find_map(|at| {
        let begins = at == 0
            || !name[at - 1].is_alphabetic()
            || (name[at - 1].is_lowercase() && name[at].is_uppercase());
        let says = |word: &str| {
            let mut rest = name[at..].iter();
            word.chars().all(|w| rest.next().is_some_and(|c| c.eq_ignore_ascii_case(&w)))
        };
        [("left", Side::Left), ("right", Side::Right)]
            .into_iter()
            .find(|(w, _)| begins && says(w))
            .map(|(w, side)| (at, w.len(), side))
    })
}

/// `L` or `R` alone, before a capitalised word, or at the end of a word in small letters.
fn letter(name: &[char]) -> Option<(usize, usize, Side)> {
    (0..name.len()).find_map(|at| {
        let side = match name[at] {
            'l' | 'L' => Side::Left,
            'r' | 'R' => Side::Right,
            _ => return None,
        };
        let before = at.checked_sub(1).map(|i| name[i]);
        let after = |k: usize| name.get(at + k).copied();
        let letter = |c: Option<char>| c.is_some_and(char::is_alphabetic);
        let capital = name[at].is_uppercase();
        let alone = !before.is_some_and(char::is_alphanumeric) && !letter(after(1));
        let prefix = capital
            && !letter(before)
            && after(1).is_some_and(char::is_uppercase)
            && after(2).is_some_and(char::is_lowercase);
        let suffix = capital && before.is_some_and(char::is_lowercase) && !letter(after(1));
        (alone || prefix || suffix).then_some((at, 1, side))
    })
}

/// The bone on the other side of every bone, itself for those in the middle; and the bones that say a side and have no partner.
///
/// Parents are partners, too, where there is a choice. Names decide, and where only numbers differ (`b_LeftHand_011`,
/// `b_RightHand_08`) the order.
pub fn pairs(skeleton: &Skeleton) -> (Vec<BoneId>, Vec<BoneId>) {
    let sides: Vec<Option<(Side, String)>> = skeleton.ids().map(|b| side_of(skeleton.name(b))).collect();
    let side = |b: BoneId| sides[b.index()].as_ref().map(|s| s.0);
    let stem = |b: BoneId| sides[b.index()].as_ref().map_or_else(|| skeleton.name(b), |s| &s.1);
    let letters = |b: BoneId| stem(b).chars().filter(|c| c.is_alphabetic() || *c == '*').collect::<String>();
    let place = |parent: Option<BoneId>| parent.map_or(skeleton.len(), BoneId::index);
    let mut children: Vec<Vec<BoneId>> = vec![vec![]; skeleton.len() + 1];
    skeleton.ids().for_each(|b| children[place(skeleton.parent(b))].push(b));

    // From the roots down: among the children of the parent's partner, the same name or the same but for its numbers.
    let mut pair: Vec<Option<BoneId>> = vec![None; skeleton.len()];
    for b in skeleton.ids() {
        let parent = skeleton.parent(b);
        let over = parent.map(|p| pair[p.index()].unwrap_or(p));
        if pair[b.index()].is_some() || (side(b).is_none() && over == parent) {
            continue;
        }
        let free = |o: &&BoneId| pair[o.index()].is_none() && side(**o) == side(b).map(Side::other);
        let there = || children[place(over)].iter().filter(free);
        let found = there().find(|o| stem(**o) == stem(b));
        if let Some(&o) = found.or_else(|| there().find(|o| letters(**o) == letters(b))) {
            (pair[b.index()], pair[o.index()]) = (Some(o), Some(b));
        }
    }

    // What is left: the same name anywhere.
    let mut named: BTreeMap<(&str, bool), BoneId> = BTreeMap::new();
    for b in skeleton
        .ids()
        .filter(|b| side(*b).is_some())
        .filter(|b| pair[b.index()].is_none())
        .collect::<Vec<_>>()
    {
        let left = side(b) == Some(Side::Left);
        match named.remove(&(stem(b), !left)) {
            Some(o) => (pair[b.index()], pair[o.index()]) = (Some(o), Some(b)),
            None => drop(named.entry((stem(b), left)).or_insert(b)),
        }
    }
    let alone = skeleton.ids().filter(|b| side(*b).is_some() && pair[b.index()].is_none()).collect();
    (skeleton.ids().map(|b| pair[b.index()].unwrap_or(b)).collect(), alone)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::BoneDesc;

    #[test]
    fn names_as_they_are_found_in_files() {
        for (l, r) in [
            ("upper arm.L", "upper arm.R"),
            ("arm_l", "arm_r"),
            ("L_arm", "R_arm"),
            ("l-backleg001", "r-backleg001"),
            ("mixamorig:LeftArm", "mixamorig:RightArm"),
            ("leftArm", "rightArm"),
            ("arm_joint_L_1", "arm_joint_R_1"),
            ("Bip01 L Thigh", "Bip01 R Thigh"),
            ("LThumb", "RThumb"),
            ("handL", "handR"),
            ("Hand.L.001", "Hand.R.001"),
        ] {
            let (a, b) = (side_of(l), side_of(r));
            assert_eq!(
                (a.clone().map(|s| s.0), b.clone().map(|s| s.0)),
                (Some(Side::Left), Some(Side::Right)),
                "{l}"
            );
            assert_eq!(a.map(|s| s.1), b.map(|s| s.1), "{l}");
        }
        for middle in
            ["LowerBack", "Root", "RIG", "upright", "tail", "spine.001", "Leaf", "Rig", "bright", ""]
        {
            assert_eq!(side_of(middle), None, "{middle}");
        }
    }

    #[test]
    fn partners_are_found_by_name_and_else_below_partners() {
        let tree = [
            (None, "hip_01"),
            (Some(0), "b_RightArm_06"),
            (Some(1), "b_RightHand_07"),
            (Some(2), "claw 1"),
            (Some(0), "b_LeftArm_09"),
            (Some(4), "b_LeftHand_010"),
            (Some(5), "claw 2"),
            (Some(0), "wing.L"),
            (Some(0), "shoulder_L_3"),
            (Some(8), "elbow_L_2"),
            (Some(9), "elbow_L_1"),
            (Some(0), "shoulder_R_1"),
            (Some(11), "elbow_R_1"),
            (Some(12), "elbow_R_2"),
            (Some(0), "pole.L"),
            (Some(1), "pole.R"),
        ];
        let bone =
            |(parent, name): &(Option<usize>, &str)| BoneDesc { parent: *parent, ..BoneDesc::new(*name) };
        let (s, _) = Skeleton::new(tree.iter().map(bone).collect()).unwrap();
        let (pair, alone) = pairs(&s);
        let names = |list: &[BoneId]| list.iter().map(|b| s.name(*b).to_owned()).collect::<Vec<_>>();
        for (a, b) in [
            ("hip_01", "hip_01"),
            ("b_RightHand_07", "b_LeftHand_010"),
            ("claw 1", "claw 2"),
            ("wing.L", "wing.L"),
            ("shoulder_L_3", "shoulder_R_1"),
            ("elbow_L_2", "elbow_R_1"),
            ("elbow_L_1", "elbow_R_2"),
            ("pole.L", "pole.R"),
        ] {
            let (a, b) = (s.find(a).unwrap(), s.find(b).unwrap());
            assert_eq!((pair[a.index()], pair[b.index()]), (b, a), "{}", s.name(a));
        }
        assert_eq!(names(&alone), ["wing.L"]);
    }
}
