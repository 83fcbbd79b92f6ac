//! How far light from one direction gets.

use glam::{Affine3A, Vec3};

/// Depth of the nearest surface, seen in parallel from a lamp: `size²` texels, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ShadowMap {
    /// Scene space to texels (x right, y down; texel centres at halves) and metres along the light from the near plane.
    pub texel_from_scene: Affine3A,
    /// Texels along a side.
    pub size: usize,
    /// Metres along a texel's side.
    pub texel: f32,
    /// Metres from the near plane; infinite where light passes.
    pub depth: Vec<f32>,
    /// The way light travels, scene space, unit.
    pub direction: Vec3,
    /// Radius of the filter that softens edges, texels.
    pub radius: f32,
    /// Distance by which a surface must lie behind another to be shadowed, beyond what its slope calls for, metres.
    pub bias: f32,
}
