//! What one thread works with.

use super::effects::Effects;
use crate::asset::Asset;
use crate::character::Scratch;
use crate::fk::{self, Posed};
use crate::image::Image;
use crate::pose::Pose;
use crate::render::raster::Rasterizer;
use crate::skin::Deformed;
use glam::DVec3;

/// Buffers that one thread uses again from frame to frame.
#[derive(Default)]
pub struct Worker {
    pub(super) pose: Pose,
    pub(super) posed: Posed,
    pub(super) scratch: Scratch,
    pub(super) deformed: Vec<Deformed>,
    pub(super) rasterizer: Rasterizer,
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

    pub(super) fn deform(&mut self, asset: &Asset, center: DVec3) {
        let character = &asset.character;
        self.deformed.resize_with(character.instances().len(), Deformed::default);
        for (i, out) in self.deformed.iter_mut().enumerate() {
            character.deform(i, &self.pose, &self.posed, center, &mut self.scratch, out);
        }
    }
}
