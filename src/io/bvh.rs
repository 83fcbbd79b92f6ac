//! BioVision hierarchies (`.bvh`): a tree of joints and what they did, frame by frame.
//!
//! Joints become bones whose rest pose has no rotation and stands at the OFFSETs; end sites become bones named after their joint.
//! Rotations are `R₁·R₂·R₃` in the order of the joint's channels, degrees; position channels replace the OFFSET, axis by axis.
//! Lengths are kept in the file's unit, whatever that is.

use super::{Import, Warning};
use crate::asset::Asset;
use crate::character::{Character, CharacterError};
use crate::clip::{Clip, Curve, CurveError, Interpolation, Target, Track};
use crate::math::Trs;
use crate::skeleton::{BoneDesc, BoneId, Skeleton, SkeletonError};
use glam::{DQuat, Quat, Vec3};

/// Why a capture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum BvhError {
    /// Something else stands where a word or a number should.
    #[error("line {line}: expected {expected}, found {found}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
        /// What does.
        found: String,
    },
    /// The joints are no skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// The frames are no keys.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The parts do not fit.
    #[error(transparent)]
    Character(#[from] CharacterError),
}

/// What a channel moves: an axis of the position, or a turn about one.
#[derive(Clone, Copy, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

struct Joint {
    name: String,
    parent: Option<usize>,
    offset: [f64; 3],
    channels: Vec<Channel>,
}

/// Words of the file, and the lines they stand in.
struct Words<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Words<'t> {
    fn line(&self) -> usize {
        1 + self.text.as_bytes()[..self.at].iter().filter(|&&b| b == b'\n').count()
    }

    fn next(&mut self) -> Option<&'t str> {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        // A brace needs no blank after it.
        let end = if rest.starts_with(['{', '}']) { 1 } else { rest[..end].find(['{', '}']).unwrap_or(end) };
        self.at += end;
        (end > 0).then(|| &rest[..end])
    }

    fn fault(&self, expected: &'static str, found: Option<&str>) -> BvhError {
        let shown = |f: &str| format!("`{}`", f.chars().take(40).collect::<String>());
        BvhError::Syntax {
            line: self.line(),
            expected,
            found: found.map_or("the end of the file".into(), shown),
        }
    }

    fn word(&mut self, expected: &'static str) -> Result<(), BvhError> {
        match self.next() {
            Some(w) if w.eq_ignore_ascii_case(expected) => Ok(()),
            other => Err(self.fault(expected, other)),
        }
    }

    fn number(&mut self) -> Result<f64, BvhError> {
        let word = self.next();
        let number = word.and_then(|w| w.parse::<f64>().ok()).filter(|n| n.is_finite());
        number.ok_or_else(|| self.fault("a number", word))
    }

    fn count(&mut self) -> Result<usize, BvhError> {
        let word = self.next();
        word.and_then(|w| w.parse().ok()).ok_or_else(|| self.fault("a whole number", word))
    }

    /// What is left of the line, up to a brace: names may have blanks in them.
    fn name(&mut self) -> &'t str {
        let rest = &self.text[self.at..];
        let end = rest.find(['\n', '\r', '{']).unwrap_or(rest.len());
        self.at += end;
        rest[..end].trim()
    }
}

/// Read a capture: its skeleton, and one clip that is named `name`.
///
/// ```
/// use sinew::io::bvh;
/// let text = "HIERARCHY ROOT hip { OFFSET 0 1 0 CHANNELS 1 Zrotation End Site { OFFSET 0 1 0 } }
///             MOTION Frames: 2 Frame Time: .5 0 90";
/// let import = bvh::import_bytes(text.as_bytes(), "turn").unwrap();
/// let character = &import.asset.character;
/// assert_eq!(character.skeleton().len(), 2);
/// let tip = character.posed(&character.pose(Some(0), 0.5)).origin(character.skeleton().find("hip.end").unwrap());
/// assert!((tip - glam::DVec3::new(-1.0, 1.0, 0.0)).length() < 1e-6);
/// ```
///
/// # Errors
/// [`BvhError`] with the line, what was expected there and what was found.
pub fn import_bytes(bytes: &[u8], name: &str) -> Result<Import, BvhError> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words { text: text.trim_start_matches('\u{feff}'), at: 0 };
    let joints = hierarchy(&mut words)?;
    let mut warnings = vec![];
    let (step, frames) = motion(&mut words, &joints, &mut warnings)?;
    let (skeleton, bones) = Skeleton::new(bones(&joints))?;
    let tracks = tracks(&joints, &bones, step, &frames)?;
    let clips = if tracks.is_empty() { vec![] } else { vec![Clip { name: name.into(), tracks }] };
    let character = Character::new(skeleton, vec![], vec![], vec![], clips)?;
    let asset = Asset { character, ..Asset::default() };
    Ok(Import { asset, format: "BVH".into(), warnings, ..Import::default() })
}

fn hierarchy(words: &mut Words) -> Result<Vec<Joint>, BvhError> {
    words.word("HIERARCHY")?;
    let mut joints: Vec<Joint> = vec![];
    let mut open: Vec<usize> = vec![];
    loop {
        let word = words.next();
        let is = |w: &str| word.is_some_and(|found| found.eq_ignore_ascii_case(w));
        if is("MOTION") && open.is_empty() && !joints.is_empty() {
            return Ok(joints);
        }
        if is("}") && open.pop().is_some() {
            continue;
        }
        let parent = open.last().copied();
        let name = match (is("ROOT"), is("JOINT"), is("End"), parent) {
            (true, _, _, None) | (_, true, _, Some(_)) => words.name().to_owned(),
            (_, _, true, Some(p)) => {
                words.word("Site")?;
                format!("{}.end", joints[p].name)
            }
            _ if parent.is_none() => return Err(words.fault("ROOT or MOTION", word)),
            _ => return Err(words.fault("JOINT, End Site or }", word)),
        };
        words.word("{")?;
        let end = is("End");
        open.push(joints.len());
        joints.push(joint(words, name, parent, end)?);
    }
}

/// Offset and channels; the brace is left open.
fn joint(words: &mut Words, name: String, parent: Option<usize>, end: bool) -> Result<Joint, BvhError> {
    words.word("OFFSET")?;
    let offset = [words.number()?, words.number()?, words.number()?];
    let mut channels = vec![];
    if !end {
        words.word("CHANNELS")?;
        for _ in 0..words.count()? {
            let word = words.next();
            let lower = word.unwrap_or_default().to_ascii_lowercase();
            let axis = lower.bytes().next().map_or(3, |b| b.wrapping_sub(b'x') as usize);
            channels.push(match lower.get(1..) {
                Some("position") if axis < 3 => Channel::Position(axis),
                Some("rotation") if axis < 3 => Channel::Rotation(axis),
                _ => return Err(words.fault("a channel such as Xposition or Zrotation", word)),
            });
        }
    }
    Ok(Joint { name, parent, offset, channels })
}

/// Seconds a frame, and all numbers, frame by frame.
fn motion(
    words: &mut Words,
    joints: &[Joint],
    warnings: &mut Vec<Warning>,
) -> Result<(f64, Vec<f64>), BvhError> {
    words.word("Frames:")?;
    let stated = words.count()?;
    words.word("Frame")?;
    words.word("Time:")?;
    let step = words.number()?;
    if step <= 0.0 {
        return Err(words.fault("a frame time above 0", Some(&step.to_string())));
    }
    let each: usize = joints.iter().map(|j| j.channels.len()).sum();
    let mut numbers = vec![];
    while !words.text[words.at..].trim_start().is_empty() {
        numbers.push(words.number()?);
    }
    let found = numbers.len() / each.max(1);
    if numbers.len() != found * each {
        let expected = "as many numbers in the last frame as there are channels";
        return Err(words.fault(expected, Some(&format!("{} of {each}", numbers.len() % each.max(1)))));
    }
    if found != stated && each > 0 {
        let message = format!("{stated} are stated, but there are {found}; these are taken");
        warnings.push(Warning { place: "Frames".into(), message });
    }
    Ok((step, numbers))
}

fn bones(joints: &[Joint]) -> Vec<BoneDesc> {
    let place = |j: &Joint| Vec3::from_array(j.offset.map(|x| x as f32));
    // A bone points at its first child that stands elsewhere.
    let mut along = vec![Vec3::ZERO; joints.len()];
    for j in joints {
        if let Some(a) = j.parent.map(|p| &mut along[p]).filter(|a| **a == Vec3::ZERO) {
            *a = place(j);
        }
    }
    let bone = |(j, along): (&Joint, &Vec3)| BoneDesc {
        parent: j.parent,
        rest: Trs { translation: place(j), ..Trs::IDENTITY },
        length: along.length(),
        aim: along.try_normalize().map_or(Quat::IDENTITY, |d| Quat::from_rotation_arc(Vec3::X, d)),
        ..BoneDesc::new(&j.name)
    };
    joints.iter().zip(&along).map(bone).collect()
}

fn tracks(joints: &[Joint], bones: &[BoneId], step: f64, numbers: &[f64]) -> Result<Vec<Track>, BvhError> {
    let each: usize = joints.iter().map(|j| j.channels.len()).sum();
    let (mut out, mut first) = (vec![], 0);
    for (joint, &bone) in joints.iter().zip(bones) {
        let channels = &joint.channels;
        let frames = || numbers.chunks_exact(each.max(1)).map(|f| &f[first..first + channels.len()]);
        let times: Vec<f64> = (0..frames().len()).map(|i| i as f64 * step).collect();
        let mut push = |target, values: Vec<f32>, width| -> Result<(), BvhError> {
            let curve = Curve::new(times.clone(), values, width, Interpolation::Linear)?;
            out.push(Track { target, curve });
            Ok(())
        };
        if !times.is_empty() && channels.iter().any(|c| matches!(c, Channel::Position(_))) {
            let values = frames().flat_map(|f| position(joint, f)).collect();
            push(Target::Translation(bone), values, 3)?;
        }
        if !times.is_empty() && channels.iter().any(|c| matches!(c, Channel::Rotation(_))) {
            let values = frames().flat_map(|f| rotation(joint, f)).collect();
            push(Target::Rotation(bone), values, 4)?;
        }
        first += channels.len();
    }
    Ok(out)
}

fn position(joint: &Joint, frame: &[f64]) -> [f32; 3] {
    let mut p = joint.offset;
    for (c, v) in joint.channels.iter().zip(frame) {
        if let Channel::Position(axis) = c {
            p[*axis] = *v;
        }
    }
    p.map(|x| x as f32)
}

fn rotation(joint: &Joint, frame: &[f64]) -> [f32; 4] {
    let mut q = DQuat::IDENTITY;
    for (c, v) in joint.channels.iter().zip(frame) {
        if let Channel::Rotation(axis) = c {
            let about = [DQuat::from_rotation_x, DQuat::from_rotation_y, DQuat::from_rotation_z][*axis];
            q *= about(v.to_radians());
        }
    }
    q.normalize().as_quat().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "HIERARCHY\nROOT a b\n{\nOFFSET 1 2 3\nCHANNELS 2 Yposition Xrotation\n}\nMOTION\n";

    #[test]
    fn positions_replace_offsets_axis_by_axis_and_names_may_have_blanks() {
        let text = format!("{HEAD}Frames:\t1\nFrame Time:\t.5\n7 -.25\n");
        let import = import_bytes(text.as_bytes(), "x").unwrap();
        let c = &import.asset.character;
        let bone = c.skeleton().find("a b").unwrap();
        assert_eq!(c.posed(&c.pose(Some(0), 0.0)).origin(bone), glam::DVec3::new(1.0, 7.0, 3.0));
        assert!(import.warnings.is_empty());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let of =
            |t: &str| import_bytes(t.as_bytes(), "x").map(|i| i.warnings.len()).map_err(|e| e.to_string());
        assert_eq!(of(""), Err("line 1: expected HIERARCHY, found the end of the file".into()));
        let tail = |t: &str| of(&format!("{HEAD}{t}"));
        assert_eq!(tail("Frames: 9\nFrame Time: 1\n1 2 3 4\n"), Ok(1));
        assert!(
            tail("Frames: 1\nFrame Time: 0\n")
                .unwrap_err()
                .starts_with("line 9: expected a frame time above 0")
        );
        assert!(
            tail("Frames: 1\nFrame Time: 1\n1 nan").unwrap_err().contains("expected a number, found `nan`")
        );
        assert!(tail("Frames: 1\nFrame Time: 1\n1 2 3").unwrap_err().contains("found `1 of 2`"));
        let odd = of("HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Wrotation }").unwrap_err();
        assert!(odd.contains("a channel such as Xposition"), "{odd}");
        let deep = format!(
            "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS 0 {}",
            "JOINT b { OFFSET 0 0 0 CHANNELS 0 ".repeat(50_000)
        );
        assert!(of(&deep).unwrap_err().contains("the end of the file"));
        assert!(of("HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 99999999999 ").is_err());
    }
}
