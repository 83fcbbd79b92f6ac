//! What a unit of a track's error costs, for all who share a tolerance out among tracks.

use super::gauge::{Gauge, Lever};
use super::times;
use crate::clip::{Clip, Target, Track};
use crate::pose::Pose;
use crate::skeleton::BoneId;

/// Moments at which levers are measured.
const MOMENTS: usize = 24;

/// A bone that moves little or nothing is treated as if it had this part of the longest lever.
const LEAST: f64 = 0.02;

/// The tracks of a clip, by what they move.
pub(super) struct Costs {
    levers: Vec<Lever>,
    longest: f64,
    unmoved: Pose,
    /// Of each morph weight.
    reach: Vec<f64>,
}

impl Costs {
    pub fn new(gauge: &Gauge, clip: &Clip) -> Self {
        let levers = gauge.levers(clip, &times::coarse(clip, MOMENTS));
        let longest = levers.iter().map(|l| l.turn).fold(0.0, f64::max);
        Self { levers, longest, unmoved: gauge.unmoved(), reach: gauge.character.target_reach() }
    }

    /// Metres a radian of a bone.
    pub fn turn(&self, bone: BoneId) -> f64 {
        self.levers[bone.index()].turn.max(LEAST * self.longest).max(1e-9)
    }

    /// Metres a unit of a track's error, and what is shown without the track.
    pub fn of(&self, track: &Track) -> (f64, Vec<f32>) {
        let local = |b: BoneId| &self.unmoved.locals[b.index()];
        match track.target {
            Target::Rotation(b) => (self.turn(b), local(b).rotation.to_array().to_vec()),
            Target::Translation(b) => {
                (self.levers[b.index()].shift.max(1e-9), local(b).translation.to_array().to_vec())
            }
            Target::Scale(b) => (self.turn(b), local(b).scale.to_array().to_vec()),
            Target::Xzx(b) => (self.turn(b), vec![0.0; 3]),
            Target::Weights { first } => {
                let run = first..first + track.curve.width();
                let reach = self.reach[run.clone()].iter().sum::<f64>().max(1e-9);
                (reach, self.unmoved.weights[run].to_vec())
            }
        }
    }
}
