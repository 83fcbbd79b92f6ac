//! What the pixels of a moment show, beside their colour.

use super::fit::{self, Span};
use super::{FrameStats, Moment, Shot, Worker};
use crate::character::{Binding, Character, Instance};
use crate::render::Renderer;
use crate::render::channel::{Channel, Channels};
use crate::scene::{AlphaMode, Geometry, Material, Scene};
use glam::{DVec3, Vec3, Vec3A};

/// Half an 8-bit step: whatever blends with more than that is visible.
const VISIBLE: f32 = 0.5 / 255.0;

/// Where the pixels of a shot can be.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Extent {
    /// Corners of a box around all vertices, and around shapes that have an end where rays draw, world space.
    pub bounds: [DVec3; 2],
    /// Least and greatest distance of these along the view direction, metres.
    pub depth: [f32; 2],
}

impl Shot<'_> {
    /// The extent over the whole clip, looked at as for framing: which frames are drawn makes no difference. Between two of these moments a
    /// vertex may leave it by a little. Where nothing is drawn it is a cube of 1 m, a metre away.
    pub fn extent(&self, worker: &mut Worker) -> Extent {
        let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        let (mut near, mut far) = (f32::INFINITY, f32::NEG_INFINITY);
        let span = Span { asset: self.asset, clip: self.desc.clip, center: self.center, shapes: None };
        let drawn = if self.desc.renderer == Renderer::Raster { &[] } else { &self.shapes[..] };
        let shapes: Vec<Vec3> = drawn.iter().flat_map(|s| ends(&s.geometry)).collect();
        for t in fit::times(&span).0 {
            self.pose(t, worker, &mut FrameStats::default());
            let camera = self.stand.camera(t.into(), &worker.posed, &worker.deformed);
            let (eye, back) = (camera.scene_from_view.translation, camera.scene_from_view.matrix3.z_axis);
            let axis = self.stand.turns().map(Vec3A::from);
            let vertices = worker.deformed.iter().flat_map(|d| &d.positions).chain(&shapes);
            for p in vertices.filter(|p| p.is_finite()) {
                let p = Vec3A::from(*p);
                (low, high) = (low.min(p), high.max(p));
                // A camera that walks around sees the point anywhere on a circle.
                let (middle, reach) = match axis {
                    Some(axis) => {
                        let level = |v: Vec3A| (v.x * v.x + v.z * v.z).sqrt();
                        (Vec3A::new(axis.x, p.y, axis.z), level(p - axis) * level(back))
                    }
                    None => (p, 0.0),
                };
                let distance = (eye - middle).dot(back);
                (near, far) = (near.min(distance - reach), far.max(distance + reach));
            }
        }
        if !low.is_finite() {
            return Extent { bounds: [DVec3::splat(-0.5), DVec3::splat(0.5)], depth: [1.0, 2.0] };
        }
        let world = |p: Vec3A| self.center + Vec3::from(p).as_dvec3();
        Extent { bounds: [world(low), world(high)], depth: [near.max(0.0), far] }
    }

    /// What the pixels of a moment show, with the samples that the shot's pictures have.
    ///
    /// Objects are the character's mesh instances, in order. Labels are bones, counted from 1: of each vertex the one with the strongest
    /// weight. Positions are in world space. A surface that blends counts where nothing lies behind it: then it is what the pixel shows, so
    /// that wherever a picture of the character has alpha there is a surface.
    pub fn draw_channels(
        &self,
        moment: impl Into<Moment>,
        worker: &mut Worker,
        wanted: &[Channel],
        out: &mut Channels,
    ) -> FrameStats {
        let settings = &self.desc.settings;
        let solid = solid(&self.materials);
        if wanted.contains(&Channel::Label) {
            let character = &self.asset.character;
            self.labels.get_or_init(|| character.instances().iter().map(|i| labels(character, i)).collect());
        }
        let stats = self.with_scene(moment.into(), worker, |scene, painter| {
            let stats = painter.draw_channels(scene, settings, wanted, out);
            if let Some(materials) = &solid {
                let mut all = Channels::default();
                let scene = Scene { materials, ..scene.clone() };
                painter.draw_channels(&scene, settings, wanted, &mut all);
                let empty = (0..all.objects.len()).filter(|&i| out.objects[i] == 0).collect::<Vec<_>>();
                empty.into_iter().for_each(|i| out.copy_pixel(i, &all, i));
            }
            stats
        });
        if self.center != DVec3::ZERO {
            let seen = out.positions.iter_mut().zip(&out.objects).filter(|p| *p.1 > 0);
            seen.for_each(|(p, _)| *p = (self.center + p.as_dvec3()).as_vec3());
        }
        stats
    }
}

/// Points that reach as far as a shape does, if it has an end.
fn ends(geometry: &Geometry) -> Vec<Vec3> {
    match *geometry {
        Geometry::Sphere { center, radius } => {
            let corner = |k: u32| DVec3::from_array([0, 1, 2].map(|c| f64::from(k >> c & 1) * 2.0 - 1.0));
            (0..8).map(|k| (center + corner(k) * radius).as_vec3()).collect()
        }
        Geometry::Plane { .. } => Vec::new(),
        Geometry::Triangle(corners) => corners.map(|c| c.as_vec3()).to_vec(),
    }
}

/// The materials with cut-offs instead of blending; `None` where nothing blends.
fn solid(materials: &[Material]) -> Option<Vec<Material>> {
    let cut = |m: &Material| match m.alpha {
        AlphaMode::Blend => Material { alpha: AlphaMode::Mask(VISIBLE), ..m.clone() },
        _ => m.clone(),
    };
    materials.iter().any(|m| m.alpha == AlphaMode::Blend).then(|| materials.iter().map(cut).collect())
}

/// The bone, from 1, that each vertex follows most, or that all follow.
fn labels(character: &Character, instance: &Instance) -> Vec<u32> {
    match &instance.binding {
        Binding::Bone(b) => vec![b.0 + 1],
        Binding::Skin { palette, weights } => {
            let vertices = 0..character.mesh(instance).positions.len();
            vertices.map(|v| weights.of(v).next().map_or(0, |(b, _)| palette[b].0.0 + 1)).collect()
        }
    }
}
