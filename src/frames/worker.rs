//! What one thread works with.

use super::effects::Effects;
use crate::asset::Asset;
use crate::character::{LastDeform, Scratch};
use crate::fk::{self, Posed};
use crate::image::Image;
use crate::pose::Pose;
use crate::render::Painter;
use crate::skin::Deformed;
use glam::DVec3;

/// Buffers that one thread uses again from frame to frame.
#[derive(Default)]
pub struct Worker {
    pub(super) pose: Pose,
    pub(super) posed: Posed,
    pub(super) scratch: Scratch,
    pub(super) deformed: Vec<Deformed>,
    /// What `deformed` was made by, and for which shot.
    last: Vec<LastDeform>,
    shot: u64,
    /// Draws; whoever wants to watch a picture by rays come along says so here.
    pub painter: Painter,
    pub(super) effects: Effects,
    /// A picture on its way to 8 bits, and one that is put on it.
    pub(super) light: Image,
    pub(super) layer: Image,
}

impl Worker {
    pub(super) fn evaluate(&mut self, asset: &Asset, clip: Option<usize>, t: f64) {
        let character = &asset.character;
        self.pose = character.pose(clip, t);
        fk::forward(character.skeleton(), &self.pose, &mut self.posed);
    }

    /// Deform what moved since this worker's last moment of the same shot; returns how many vertices that were.
    pub(super) fn deform(&mut self, asset: &Asset, center: DVec3, shot: u64) -> usize {
        let character = &asset.character;
        let n = character.instances().len();
        self.deformed.resize_with(n, Deformed::default);
        if self.shot != shot {
            self.shot = shot;
            self.last.clear();
        }
        self.last.resize_with(n, LastDeform::default);
        let mut vertices = 0;
        for (i, (out, last)) in self.deformed.iter_mut().zip(&mut self.last).enumerate() {
            let Self { pose, posed, scratch, .. } = self;
            if character.deform_if_moved(i, pose, posed, center, scratch, last, out) {
                vertices += out.positions.len();
            }
        }
        vertices
    }
}
