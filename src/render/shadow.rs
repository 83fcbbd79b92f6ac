//! Depth from a lamp, by the rasterizer itself.

use super::Settings;
use super::raster::{IdImage, Rasterizer, Stats};
use crate::scene::{Camera, Projection, Scene, ShadowMap};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// What a map is to be of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowDesc {
    /// The way light travels, scene space, unit.
    pub direction: Vec3,
    /// Lowest and highest corner of a box that holds everything that throws shadows, scene space.
    pub bounds: [Vec3; 2],
    /// Metres by which the map reaches beyond the box.
    pub margin: f32,
    /// Texels along a side.
    pub size: usize,
    /// Radius of the filter that softens edges, texels, at least ½.
    pub radius: f32,
    /// See [`ShadowMap::bias`].
    pub bias: f32,
    /// Worker threads; the map does not depend on them.
    pub threads: usize,
}

/// Draws [`ShadowMap`]s; keeps its buffers.
#[derive(Debug, Default)]
pub struct ShadowMaker {
    rasterizer: Rasterizer,
    ids: IdImage,
}

impl ShadowMaker {
    /// Draw the depth of everything in `scene` that does not blend, seen along `desc.direction`.
    ///
    /// Faces that are culled throw no shadow: hand over double-sided materials.
    ///
    /// # Panics
    /// If `desc.size` is above [`Settings::MAX_SIZE`].
    pub fn draw(&mut self, scene: &Scene, desc: &ShadowDesc, out: &mut ShadowMap) -> Stats {
        let (camera, texel) = eye(desc);
        let scene = Scene { camera, ..scene.clone() };
        let settings = Settings { width: desc.size, height: desc.size, samples: 1, threads: desc.threads };
        let stats = self.rasterizer.draw_ids(&scene, &settings, &mut self.ids);

        // Rows of the map count downwards, depth along the light.
        let view_from_scene = camera.scene_from_view.inverse();
        let half = 0.5 * desc.size as f32;
        let texel_from_view = Affine3A {
            matrix3: Mat3A::from_diagonal(Vec3::new(1.0 / texel, -1.0 / texel, -1.0)),
            translation: Vec3A::new(half, half, 0.0),
        };
        out.texel_from_scene = texel_from_view * view_from_scene;
        (out.size, out.texel, out.direction) = (desc.size, texel, desc.direction);
        (out.radius, out.bias) = (desc.radius.max(0.5), desc.bias);
        std::mem::swap(&mut out.depth, &mut self.ids.depth);
        stats
    }
}

/// A parallel camera that sees the whole box, and the side of its texels.
fn eye(desc: &ShadowDesc) -> (Camera, f32) {
    let w = -desc.direction.normalize_or(Vec3::NEG_Y);
    // Any right hand will do, as long as it is the same for the same direction.
    let aside = if w.y.abs() < 0.9 { Vec3::Y } else { Vec3::Z };
    let u = aside.cross(w).normalize();
    let axes = Mat3A::from_cols(u.into(), w.cross(u).into(), w.into());
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for k in 0..8 {
        let pick = |axis: usize| desc.bounds[k >> axis & 1][axis];
        let p = axes.transpose() * Vec3A::new(pick(0), pick(1), pick(2));
        (low, high) = (low.min(p), high.max(p));
    }
    let extent = (high - low).max_element().max(1e-6);
    let height = (high.x - low.x).max(high.y - low.y).max(1e-3 * extent) + 2.0 * desc.margin;
    let middle = (low + high) * 0.5;
    // A little before the box, so that nothing that touches it is cut off.
    let gap = 0.01 * extent;
    let camera = Camera {
        scene_from_view: Affine3A { matrix3: axes, translation: axes * middle.with_z(high.z + gap) },
        projection: Projection::Orthographic { height },
        near: 0.0,
        far: high.z - low.z + 2.0 * gap,
    };
    (camera, height / desc.size as f32)
}
