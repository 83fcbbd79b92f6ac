//! Clips as differences from a reference, and what they make when they are added.

use super::EditError;
use super::keys::Keys;
use crate::character::Character;
use crate::clip::{Clip, Target, Track};
use crate::pose::Pose;
use glam::Quat;

/// What an additive clip is the difference from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The character at rest.
    Rest,
    /// The clip's own first moment.
    First,
}

/// The pose that a reference means.
pub fn reference_pose(character: &Character, clip: &Clip, reference: Reference) -> Pose {
    let mut pose = character.rest_pose();
    if reference == Reference::First {
        clip.sample(character.skeleton(), clip.range().start, &mut pose);
    }
    pose
}

/// `reference⁻¹ · clip`, bone by bone in the bones' own frames: rotations `r⁻¹·q`; translations, scales and morph weights as
/// differences `v − r`. It is what three.js plays as additive. Where no track is, nothing is added.
///
/// [`added`] puts it back: `added(reference, sample of the result) = sample of the clip`, between keys as well, since multiplying from the
/// left takes arcs to arcs. A channel that the clip does not move shows the rest, which is a difference too where the reference is elsewhere.
///
/// # Errors
/// [`EditError::Angles`] for tracks of XZX angles.
///
/// # Panics
/// If the clip or the reference is not of the character.
pub fn additive(clip: &Clip, reference: &Pose) -> Result<Clip, EditError> {
    let one = |track: &Track| {
        let mut keys = Keys::of(track);
        let from: Vec<f32> = match track.target {
            Target::Xzx(bone) => return Err(EditError::Angles { clip: clip.name.clone(), bone: bone.0 }),
            Target::Rotation(b) => {
                let back = reference.locals[b.index()].rotation.conjugate();
                for q in keys.values.chunks_mut(4) {
                    // Slopes are carried by the same linear map.
                    q.copy_from_slice(&(back * Quat::from_slice(q)).to_array());
                }
                return Ok(Track { target: track.target.clone(), curve: keys.curve() });
            }
            Target::Translation(b) => reference.locals[b.index()].translation.to_array().to_vec(),
            Target::Scale(b) => reference.locals[b.index()].scale.to_array().to_vec(),
            Target::Weights { first } => reference.weights[first..first + keys.width].to_vec(),
        };
        let (each, w) = (keys.each(), keys.width);
        let at = if each > w { w } else { 0 };
        for key in keys.values.chunks_mut(each) {
            (0..w).for_each(|c| key[at + c] -= from[c]);
        }
        Ok(Track { target: track.target.clone(), curve: keys.curve() })
    };
    Ok(Clip { name: clip.name.clone(), tracks: clip.tracks.iter().map(one).collect::<Result<_, _>>()? })
}

/// `base ∘ clip` at `t`: the pose that an additive clip makes of another.
pub fn added(base: &Pose, clip: &Clip, t: f64) -> Pose {
    let mut pose = base.clone();
    let mut v = [0.0; 3];
    for track in &clip.tracks {
        let bone = |b: crate::skeleton::BoneId| b.index();
        match track.target {
            Target::Rotation(b) => {
                let local = &mut pose.locals[bone(b)];
                local.rotation = (base.locals[bone(b)].rotation * track.curve.sample_rotation(t)).normalize();
            }
            Target::Translation(b) => {
                track.curve.sample(t, &mut v);
                pose.locals[bone(b)].translation = base.locals[bone(b)].translation + glam::Vec3::from(v);
            }
            Target::Scale(b) => {
                track.curve.sample(t, &mut v);
                pose.locals[bone(b)].scale = base.locals[bone(b)].scale + glam::Vec3::from(v);
            }
            Target::Weights { first } => {
                let run = first..first + track.curve.width();
                track.curve.sample(t, &mut pose.weights[run.clone()]);
                run.for_each(|i| pose.weights[i] += base.weights[i]);
            }
            Target::Xzx(_) => {}
        }
    }
    pose
}
