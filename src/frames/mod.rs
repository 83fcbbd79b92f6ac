//! Times to pictures: the one place where animation meets rendering.

mod ordered;
mod view;

pub use ordered::{Stop, in_order, in_order_pairs};
pub use view::{Framing, View, ViewError};

use crate::asset::Asset;
use crate::character::{Instance, Scratch};
use crate::fk::{self, Posed};
use crate::image::Rgba8;
use crate::pose::Pose;
use crate::render::Settings;
use crate::render::raster::{IdImage, Rasterizer, Stats};
use crate::scene::{Camera, Light, LightKind, Material, Object, Scene};
use crate::skin::Deformed;
use crate::time::{self, Range, Wrap};
use glam::{Affine3A, DVec3, Vec3};

/// What is filmed and from where; fixed for all its frames.
#[derive(Clone, Debug)]
pub struct Shot<'a> {
    asset: &'a Asset,
    clip: Option<usize>,
    view: View,
    orbit: Camera,
    background: [f32; 4],
    settings: Settings,
    wrap: Wrap,
    range: Range,
    /// The asset's materials, and the one that meshes without a material wear.
    materials: Vec<Material>,
    /// The world point that the scene's frame has its origin at.
    center: DVec3,
}

/// What a frame cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Bones evaluated.
    pub bones: usize,
    /// Vertices deformed.
    pub vertices: usize,
    /// What the rasterizer counted.
    pub raster: Stats,
}

impl<'a> Shot<'a> {
    /// Set up a shot of `clip` (rest for `None`). With [`View::Orbit`] the camera stands so that no vertex leaves the picture
    /// at any of the moments looked at: each 24th of a second of the whole clip, more thinly spread only where that would be
    /// more than [`Framing::VERTICES`] vertices in all. Which frames are drawn later makes no difference.
    ///
    /// `background` is linear RGBA, alpha premultiplied.
    ///
    /// # Errors
    /// [`ViewError`] if the asset has no such camera.
    ///
    /// # Panics
    /// If the asset has no such clip.
    pub fn new(
        asset: &'a Asset,
        clip: Option<usize>,
        view: View,
        background: [f32; 4],
        settings: Settings,
    ) -> Result<Self, ViewError> {
        let mut materials = asset.materials.clone();
        materials.push(Material::default());
        let aspect = settings.width as f32 / settings.height.max(1) as f32;
        let range = clip.map(|c| asset.character.clips()[c].playback()).unwrap_or_default();
        let mut worker = Worker::default();
        worker.evaluate(asset, clip, range.start);
        let center = asset.character.center(&worker.posed);
        let framing = match view {
            View::Orbit { yaw, pitch, fov_y } => {
                let mut framing = Framing::new(yaw, pitch, fov_y, aspect);
                fit(asset, clip, center, &mut worker, &mut framing);
                framing
            }
            View::Mounted(camera) if camera >= asset.cameras.len() => {
                return Err(ViewError { camera, count: asset.cameras.len() });
            }
            View::Mounted(_) => Framing::new(0.0, 0.0, 1.0, aspect),
        };
        let orbit = framing.camera();
        Ok(Self {
            asset,
            clip,
            view,
            orbit,
            background,
            settings,
            wrap: Wrap::Clamp,
            range,
            materials,
            center,
        })
    }

    /// The same shot with another meaning of times outside the clip; they hold its ends otherwise.
    pub fn wrapped(self, wrap: Wrap) -> Self {
        Self { wrap, ..self }
    }

    /// Draw the moment `t` (seconds) with the buffers of `worker`.
    pub fn draw(&self, t: f64, worker: &mut Worker, out: &mut Rgba8) -> FrameStats {
        worker.evaluate(self.asset, self.clip, time::wrap(t, self.range, self.wrap));
        worker.deform(self.asset, self.center);
        let scene = self.scene(&worker.posed, &worker.deformed);
        let raster = worker.rasterizer.draw(&scene, &self.settings, out);
        let vertices = worker.deformed.iter().map(|d| d.positions.len()).sum();
        FrameStats { bones: worker.posed.len(), vertices, raster }
    }

    /// Which object and triangle is seen at the centre of each pixel of the moment `t`, and how far away.
    ///
    /// Objects are the character's mesh instances, in order.
    pub fn draw_ids(&self, t: f64, worker: &mut Worker, out: &mut IdImage) -> FrameStats {
        worker.evaluate(self.asset, self.clip, time::wrap(t, self.range, self.wrap));
        worker.deform(self.asset, self.center);
        let scene = self.scene(&worker.posed, &worker.deformed);
        let raster = worker.rasterizer.draw_ids(&scene, &self.settings, out);
        let vertices = worker.deformed.iter().map(|d| d.positions.len()).sum();
        FrameStats { bones: worker.posed.len(), vertices, raster }
    }

    fn scene<'s>(&'s self, posed: &Posed, deformed: &'s [Deformed]) -> Scene<'s> {
        let character = &self.asset.character;
        let plain = self.materials.len() - 1;
        let object = |(inst, d): (&Instance, &'s Deformed)| {
            let mesh = &character.meshes()[inst.mesh.0 as usize];
            let material = mesh.material.map_or(plain, |m| (m.0 as usize).min(plain));
            Object {
                mesh,
                positions: &d.positions,
                normals: &d.normals,
                tangents: &d.tangents,
                material,
                mirrored: d.mirrored,
            }
        };
        let camera = self.camera(posed);
        let (ambient, lights) = self.lights(posed, &camera);
        Scene {
            camera,
            ambient,
            lights,
            background: self.background,
            objects: character.instances().iter().zip(deformed).map(object).collect(),
            materials: &self.materials,
            textures: &self.asset.textures,
        }
    }

    fn camera(&self, posed: &Posed) -> Camera {
        let View::Mounted(index) = self.view else { return self.orbit };
        let mounted = &self.asset.cameras[index];
        // A scaled bone carries its camera, but does not distort it.
        let (_, rotation, translation) =
            posed.near(mounted.bone, self.center).to_scale_rotation_translation();
        Camera {
            scene_from_view: Affine3A::from_rotation_translation(rotation, translation),
            projection: mounted.projection,
            near: mounted.near,
            far: mounted.near * 1e6,
        }
    }

    /// The asset's lamps under a faint sky, or a key and a fill light that stand with the camera.
    fn lights(&self, posed: &Posed, camera: &Camera) -> (Vec3, Vec<Light>) {
        if !self.asset.lights.is_empty() {
            let carried = self.asset.lights.iter().map(|m| carry(&m.light, &posed.near(m.bone, self.center)));
            return (Vec3::splat(0.08), carried.collect());
        }
        let lamp = |from: Vec3, color: Vec3| {
            let direction = -camera.scene_from_view.transform_vector3(from.normalize());
            Light { kind: LightKind::Directional { direction }, color }
        };
        let key = lamp(Vec3::new(-0.55, 0.75, 0.65), Vec3::new(0.92, 0.9, 0.86));
        let fill = lamp(Vec3::new(0.9, 0.15, 0.5), Vec3::new(0.2, 0.22, 0.26));
        (Vec3::new(0.25, 0.26, 0.28), vec![key, fill])
    }
}

/// Widen `framing` until it holds the whole clip.
fn fit(asset: &Asset, clip: Option<usize>, center: DVec3, worker: &mut Worker, framing: &mut Framing) {
    let range = clip.map(|c| asset.character.clips()[c].playback()).unwrap_or_default();
    // A moment each 24th of a second, both ends included; long clips of large meshes are looked at more thinly.
    let vertices: usize =
        asset.character.instances().iter().map(|i| asset.character.mesh(i).positions.len()).sum();
    let most = (Framing::VERTICES / vertices.max(1)).clamp(Framing::FEWEST, Framing::MOST);
    let moments = (range.duration() * 24.0).clamp(0.0, (most - 1) as f64).ceil() as usize + 1;
    let mut positions = Vec::new();
    for k in 0..moments {
        let t = range.start + range.duration() * k as f64 / (moments - 1).max(1) as f64;
        worker.evaluate(asset, clip, t);
        for (i, inst) in asset.character.instances().iter().enumerate() {
            if !asset.character.mesh(inst).triangles.is_empty() {
                let Worker { pose, posed, scratch, .. } = worker;
                asset.character.positions(i, pose, posed, center, scratch, &mut positions);
                framing.include(&positions);
            }
        }
    }
}

/// A lamp in the frame of a bone, in the scene's frame.
fn carry(light: &Light, scene_from_bone: &Affine3A) -> Light {
    let turn = |d: Vec3| scene_from_bone.transform_vector3(d).normalize_or(Vec3::NEG_Z);
    let mut light = *light;
    match &mut light.kind {
        LightKind::Directional { direction } => *direction = turn(*direction),
        LightKind::Point { position, .. } => *position = scene_from_bone.transform_point3(*position),
        LightKind::Spot { position, direction, .. } => {
            *position = scene_from_bone.transform_point3(*position);
            *direction = turn(*direction);
        }
    }
    light
}

/// Buffers that one thread uses again from frame to frame.
#[derive(Default)]
pub struct Worker {
    pose: Pose,
    posed: Posed,
    scratch: Scratch,
    deformed: Vec<Deformed>,
    rasterizer: Rasterizer,
}

impl Worker {
    fn evaluate(&mut self, asset: &Asset, clip: Option<usize>, t: f64) {
        let character = &asset.character;
        self.pose = character.pose(clip, t);
        fk::forward(character.skeleton(), &self.pose, &mut self.posed);
    }

    fn deform(&mut self, asset: &Asset, center: DVec3) {
        let character = &asset.character;
        self.deformed.resize_with(character.instances().len(), Deformed::default);
        for (i, out) in self.deformed.iter_mut().enumerate() {
            character.deform(i, &self.pose, &self.posed, center, &mut self.scratch, out);
        }
    }
}
