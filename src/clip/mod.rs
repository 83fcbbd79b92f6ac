//! Clips: tracks of keys that turn a time into a pose.

mod curve;
mod edit;
mod mirror;
pub(crate) mod packed;

pub use curve::{Curve, CurveError, Integers, Interpolation};
pub use edit::Retime;
pub use packed::{Packed, PackedError};

use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use crate::time::Range;
use glam::{Quat, Vec3};

/// What a track moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// XZX angles about the bone's aim frame, radians; width 3.
    Xzx(BoneId),
    /// `parent_from_bone` rotation as a quaternion x, y, z, w; width 4.
    Rotation(BoneId),
    /// `parent_from_bone` translation, metres; width 3.
    Translation(BoneId),
    /// `parent_from_bone` scale; width 3.
    Scale(BoneId),
    /// A run of `Pose::weights` from `first`; as wide as the curve.
    Weights {
        /// First weight of the run.
        first: usize,
    },
}

/// A curve and what it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// What it moves.
    pub target: Target,
    /// How.
    pub curve: Curve,
}

impl Target {
    /// The bone, if it moves one.
    pub fn bone(&self) -> Option<BoneId> {
        match *self {
            Self::Xzx(b) | Self::Rotation(b) | Self::Translation(b) | Self::Scale(b) => Some(b),
            Self::Weights { .. } => None,
        }
    }
}

impl Track {
    /// Write this one channel at time `t` (seconds) over `pose`; the ends hold outside its keys.
    ///
    /// # Panics
    /// If its bone or run of weights is not in `pose`.
    pub fn sample(&self, skeleton: &Skeleton, t: f64, pose: &mut Pose) {
        let mut v = [0.0_f32; 4];
        match self.target {
            Target::Xzx(bone) => {
                self.curve.sample(t, &mut v[..3]);
                pose.set_xzx(skeleton, bone, Vec3::new(v[0], v[1], v[2]));
            }
            Target::Rotation(bone) => {
                pose.locals[bone.index()].rotation = self.curve.sample_rotation(t);
            }
            Target::Translation(bone) => {
                self.curve.sample(t, &mut v[..3]);
                pose.locals[bone.index()].translation = Vec3::new(v[0], v[1], v[2]);
            }
            Target::Scale(bone) => {
                self.curve.sample(t, &mut v[..3]);
                pose.locals[bone.index()].scale = Vec3::new(v[0], v[1], v[2]);
            }
            Target::Weights { first } => {
                let run = first..first + self.curve.width();
                self.curve.sample(t, &mut pose.weights[run]);
            }
        }
    }
}

/// A named animation: tracks that start from the rest pose.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Clip {
    /// For people and the command line; need not be unique.
    pub name: String,
    /// Later tracks win where two move the same channel.
    pub tracks: Vec<Track>,
}

impl Clip {
    /// From the first key of any track to the last; 0…0 without keys.
    pub fn range(&self) -> Range {
        let ends = self.tracks.iter().filter_map(|t| t.curve.range());
        ends.reduce(|a, b| Range { start: a.start.min(b.start), end: a.end.max(b.end) }).unwrap_or_default()
    }

    /// From 0 (or the first key, if that is earlier) to the last key: what a player shows.
    pub fn playback(&self) -> Range {
        let r = self.range();
        Range { start: r.start.min(0.0), end: r.end.max(0.0) }
    }

    /// Number of keys in all tracks.
    pub fn key_count(&self) -> usize {
        self.tracks.iter().map(|t| t.curve.times().len()).sum()
    }

    /// Write the clip at time `t` (seconds) over `pose`, which the caller set to rest; what no track moves is left.
    ///
    /// Each track holds its ends outside its own keys.
    ///
    /// # Panics
    /// If a track's bone or run of weights is not in `pose`; `Character::new` checks both.
    pub fn sample(&self, skeleton: &Skeleton, t: f64, pose: &mut Pose) {
        for track in &self.tracks {
            track.sample(skeleton, t, pose);
        }
    }
}

/// A quaternion from the four numbers of a key.
fn quat(v: &[f32]) -> Quat {
    Quat::from_xyzw(v[0], v[1], v[2], v[3])
}
