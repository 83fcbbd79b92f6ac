//! Packed clips in a file (`.sinew`), and the names of the bones that they move.
//!
//! The layout: `SINEW` and the version, 1; the numbers of bones and of morph weights of the character; the bones that are moved, each
//! as what its number exceeds the one before by, and its name; the clips, each as its name and its packed bytes. Numbers are LEB128, names
//! and bytes begin with their length.

use super::Warning;
use crate::character::Character;
use crate::clip::{Clip, Packed, PackedError, Target};
use crate::skeleton::BoneId;
use std::collections::{BTreeMap, BTreeSet};

/// What a file begins with.
pub const MAGIC: &[u8; 5] = b"SINEW";

/// Version of the layout.
const VERSION: u8 = 1;

/// A file of packed clips.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SinewFile {
    /// Bones of the character that was packed.
    pub bones: u32,
    /// Its morph weights.
    pub weights: u32,
    /// Names of the bones that clips move.
    pub names: BTreeMap<u32, String>,
    /// Names and motions.
    pub clips: Vec<(String, Packed)>,
}

/// Why bytes are no such file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SinewFileError {
    /// Something else.
    #[error("expected a file that begins with SINEW and version {VERSION}")]
    Magic,
    /// Bytes that end too early or make no sense.
    #[error("at byte {at}: {what} is cut off or out of bounds")]
    Broken {
        /// Where.
        at: usize,
        /// What was being read.
        what: &'static str,
    },
    /// A clip that is none.
    #[error("clip {clip} `{name}`: {source}")]
    Clip {
        /// Which clip.
        clip: usize,
        /// Its name.
        name: String,
        /// What is wrong.
        source: PackedError,
    },
}

/// A file of clips that were packed for a character.
///
/// # Panics
/// If a clip moves bones that the character does not have.
pub fn write(character: &Character, clips: &[(&str, &Packed)]) -> Vec<u8> {
    let skeleton = character.skeleton();
    let moved: BTreeSet<BoneId> =
        clips.iter().flat_map(|c| c.1.targets()).filter_map(|t| bone(t.0)).collect();
    let mut out = [&MAGIC[..], &[VERSION]].concat();
    let number = |out: &mut Vec<u8>, mut v: usize| {
        while v > 127 {
            out.push(v as u8 | 128);
            v >>= 7;
        }
        out.push(v as u8);
    };
    let block = |out: &mut Vec<u8>, bytes: &[u8]| {
        number(out, bytes.len());
        out.extend(bytes);
    };
    number(&mut out, skeleton.len());
    number(&mut out, character.rest_pose().weights.len());
    number(&mut out, moved.len());
    let mut next = 0;
    for b in moved {
        number(&mut out, b.index() - next);
        block(&mut out, skeleton.name(b).as_bytes());
        next = b.index() + 1;
    }
    number(&mut out, clips.len());
    for (name, packed) in clips {
        block(&mut out, name.as_bytes());
        block(&mut out, packed.bytes());
    }
    out
}

/// Read a file; every byte is checked.
///
/// # Errors
/// [`SinewFileError`], with the place.
pub fn read(bytes: &[u8]) -> Result<SinewFile, SinewFileError> {
    let rest =
        bytes.strip_prefix(MAGIC).and_then(|r| r.strip_prefix(&[VERSION])).ok_or(SinewFileError::Magic)?;
    let mut r = Reader { bytes: rest, all: bytes.len() };
    let mut file = SinewFile {
        bones: r.number("the number of bones")?,
        weights: r.number("the number of weights")?,
        ..Default::default()
    };
    let mut next = 0_u32;
    for _ in 0..r.number("the number of names")? {
        let wrong = r.wrong("a bone's number");
        let bone = next.checked_add(r.number("a bone's number")?).filter(|b| *b < file.bones).ok_or(wrong)?;
        file.names.insert(bone, r.name("a bone's name")?);
        next = bone + 1;
    }
    for clip in 0..r.number("the number of clips")? as usize {
        let name = r.name("a clip's name")?;
        let packed = Packed::from_bytes(r.block("a clip")?);
        let packed = packed.map_err(|source| SinewFileError::Clip { clip, name: name.clone(), source })?;
        let wrong = r.wrong("a track's target");
        let fits = |(t, width): (&Target, usize)| match t {
            Target::Weights { first } => {
                first.checked_add(width).is_some_and(|end| end <= file.weights as usize)
            }
            _ => bone(t).is_some_and(|b| file.names.contains_key(&b.0)),
        };
        if !packed.targets().all(fits) {
            return Err(wrong);
        }
        file.clips.push((name, packed));
    }
    if r.bytes.is_empty() { Ok(file) } else { Err(r.wrong("the end")) }
}

impl SinewFile {
    /// The clips for a character: bones by name, morph weights if there are as many. What finds no place is left out, with a warning.
    pub fn onto(self, character: &Character, warnings: &mut Vec<Warning>) -> Vec<(String, Packed)> {
        let skeleton = character.skeleton();
        let mut found = BTreeMap::new();
        for (&bone, name) in &self.names {
            // Names need not be unique: the same place comes first.
            let same = Some(BoneId(bone)).filter(|b| b.index() < skeleton.len() && skeleton.name(*b) == name);
            match same.or_else(|| skeleton.find(name)) {
                Some(b) => drop(found.insert(bone, b)),
                None => warnings.push(Warning {
                    place: format!("bone \"{name}\""),
                    message: "the character has no such bone; it is not moved".into(),
                }),
            }
        }
        let weights = character.rest_pose().weights.len() == self.weights as usize;
        if !weights {
            let message = format!("packed for {} morph weights; they are not moved", self.weights);
            warnings.push(Warning { place: String::new(), message });
        }
        let of = |t: &Target| match t {
            Target::Rotation(b) => found.get(&b.0).map(|b| Target::Rotation(*b)),
            Target::Translation(b) => found.get(&b.0).map(|b| Target::Translation(*b)),
            Target::Scale(b) => found.get(&b.0).map(|b| Target::Scale(*b)),
            Target::Xzx(b) => found.get(&b.0).map(|b| Target::Xzx(*b)),
            Target::Weights { .. } => weights.then(|| t.clone()),
        };
        self.clips.into_iter().map(|(name, p)| (name, p.onto(of))).collect()
    }

    /// The same as clips of keys.
    pub fn clips(self, character: &Character, warnings: &mut Vec<Warning>) -> Vec<Clip> {
        self.onto(character, warnings).iter().map(|(name, p)| p.to_clip(name)).collect()
    }
}

fn bone(t: &Target) -> Option<BoneId> {
    match t {
        Target::Rotation(b) | Target::Translation(b) | Target::Scale(b) | Target::Xzx(b) => Some(*b),
        Target::Weights { .. } => None,
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    all: usize,
}

impl<'a> Reader<'a> {
    fn wrong(&self, what: &'static str) -> SinewFileError {
        SinewFileError::Broken { at: self.all - self.bytes.len(), what }
    }

    fn number(&mut self, what: &'static str) -> Result<u32, SinewFileError> {
        let mut v = 0_u64;
        for shift in (0..35).step_by(7) {
            let (b, rest) = self.bytes.split_first().ok_or_else(|| self.wrong(what))?;
            self.bytes = rest;
            v |= u64::from(b & 127) << shift;
            if b & 128 == 0 {
                return u32::try_from(v).map_err(|_| self.wrong(what));
            }
        }
        Err(self.wrong(what))
    }

    fn block(&mut self, what: &'static str) -> Result<&'a [u8], SinewFileError> {
        let n = self.number(what)? as usize;
        let (block, rest) = self.bytes.split_at_checked(n).ok_or_else(|| self.wrong(what))?;
        self.bytes = rest;
        Ok(block)
    }

    fn name(&mut self, what: &'static str) -> Result<String, SinewFileError> {
        let bytes = self.block(what)?;
        String::from_utf8(bytes.to_vec()).map_err(|_| self.wrong(what))
    }
}
