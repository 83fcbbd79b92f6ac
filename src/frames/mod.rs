//! Times to pictures: the one place where animation meets rendering.

mod bones;
mod channels;
mod effects;
mod fit;
mod foresight;
mod framing;
mod live;
mod look;
mod onion;
mod ordered;
mod overlay;
mod path;
mod pivot;
mod stand;
mod stroke;
mod view;
mod worker;

pub use channels::Extent;
pub use foresight::Foresight;
pub use framing::{Framing, Turns};
pub use live::Live;
pub use look::{GroundLook, Look, Shading, Shadows};
pub use ordered::{Stop, in_order, in_order_pairs};
pub use overlay::{BonesDesc, Onion, Overlays, PathDesc};
pub use pivot::ground_point;
pub use view::{FramingDesc, Pivot, View, ViewError};
pub use worker::Worker;

use crate::asset::Asset;
use crate::character::Instance;
use crate::fk::Posed;
use crate::image::develop::Developer;
use crate::image::{Image, Rgba8};
use crate::render::raster::{IdImage, Stats};
use crate::render::ray::Outcome;
use crate::render::{Painter, Renderer, Settings, Window};
use crate::scene::{Camera, Material, Object, Scene, Shape};
use crate::skin::Deformed;
use crate::time::{self, Range, Wrap};
use effects::Stage;
use fit::Span;
use glam::DVec3;
use overlay::Layers;
use stand::Stand;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What is filmed, from where, and how it looks.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotDesc {
    /// Which clip; the rest pose for `None`.
    pub clip: Option<usize>,
    /// What times outside the clip show.
    pub wrap: Wrap,
    /// Which camera.
    pub view: View,
    /// How it holds the character in its picture.
    pub framing: FramingDesc,
    /// Light and background.
    pub look: Look,
    /// What stands around the character.
    pub props: Props,
    /// What is drawn with the character.
    pub overlays: Overlays,
    /// Who draws the character.
    pub renderer: Renderer,
    /// Size and samples of the pictures.
    pub settings: Settings,
    /// The part of the pictures that is drawn: to the same bytes as in the whole.
    pub crop: Option<Window>,
}

impl Default for ShotDesc {
    /// The rest pose from the front, a little from above, before nothing.
    fn default() -> Self {
        Self {
            clip: None,
            wrap: Wrap::Clamp,
            view: View::default(),
            framing: FramingDesc::default(),
            look: Look::default(),
            props: Props::default(),
            overlays: Overlays::default(),
            renderer: Renderer::default(),
            settings: Settings::default(),
            crop: None,
        }
    }
}

/// Shapes around a character, world space, and what they are made of. The rasterizer does not draw them.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Props {
    /// Spheres, planes and triangles; their materials index `materials`.
    pub shapes: Vec<Shape>,
    /// Not touched by the look.
    pub materials: Vec<Material>,
}

/// One picture of a shot.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Moment {
    /// Seconds in the clip.
    pub time: f64,
    /// Radians by which an orbiting camera has walked on, its lights with it: turntables and sheets of directions. What it walks
    /// around says [`FramingDesc::pivot`].
    pub turn: f32,
}

impl From<f64> for Moment {
    /// A time, without a turn.
    fn from(time: f64) -> Self {
        Self { time, turn: 0.0 }
    }
}

/// A shot that was set up: draws any of its moments.
#[derive(Clone, Debug)]
pub struct Shot<'a> {
    /// Tells shots apart to workers, which remember what they deformed.
    number: u64,
    asset: &'a Asset,
    desc: ShotDesc,
    stand: Stand<'a>,
    layers: Layers,
    range: Range,
    /// The asset's materials, the one that meshes without a material wear, and those of the props.
    materials: Vec<Material>,
    /// The props, scene space.
    shapes: Vec<Shape>,
    /// The world point that the scene's frame has its origin at.
    center: DVec3,
    /// What the look needs beside the scene itself.
    stage: Option<Stage>,
    developer: Developer,
    /// For each instance the bones, from 1, that its vertices follow most; made when they are asked for.
    labels: OnceLock<Vec<Vec<u32>>>,
}

/// What a frame cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// Bones evaluated.
    pub bones: usize,
    /// Vertices deformed; those that did not move since the worker's last moment are not.
    pub vertices: usize,
    /// What the rasterizer counted.
    pub raster: Stats,
    /// What rays did.
    pub rays: Outcome,
    /// Where the time went.
    pub times: Times,
}

/// Time a stage, by the wall's clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// Sampling the clip and forward kinematics.
    pub pose: Duration,
    /// Morphing and skinning.
    pub deform: Duration,
    /// Scene to pixels.
    pub draw: Duration,
}

impl std::ops::AddAssign for FrameStats {
    fn add_assign(&mut self, o: Self) {
        self.bones += o.bones;
        self.vertices += o.vertices;
        self.raster += o.raster;
        // The fewest of any picture.
        self.rays.samples = match self.rays.samples {
            0 => o.rays.samples,
            n => n.min(o.rays.samples.max(1)),
        };
        self.rays.count += o.rays.count;
        self.times.pose += o.times.pose;
        self.times.deform += o.times.deform;
        self.times.draw += o.times.draw;
    }
}

impl<'a> Shot<'a> {
    /// Set up a shot. With [`View::Orbit`] the camera stands so that no vertex leaves the picture
    /// at any of the moments looked at: each 24th of a second of the whole clip, more thinly spread only where that would be
    /// more than [`Framing::VERTICES`] vertices in all. Which frames are drawn later makes no difference.
    ///
    /// # Errors
    /// [`ViewError`] if the asset has no such camera or bone, or if the view leaves no picture plane.
    ///
    /// # Panics
    /// If the asset has no such clip.
    pub fn new(asset: &'a Asset, desc: ShotDesc) -> Result<Self, ViewError> {
        Self::foreseen(asset, desc, None)
    }

    /// The same with what was found of this asset beforehand.
    ///
    /// # Errors
    /// Those of [`Shot::new`].
    ///
    /// # Panics
    /// As [`Shot::new`].
    pub fn foreseen(
        asset: &'a Asset,
        desc: ShotDesc,
        foresight: Option<&Foresight>,
    ) -> Result<Self, ViewError> {
        let mut materials = look::materials(asset, &desc.look);
        let own = materials.len();
        materials.extend(desc.props.materials.iter().cloned());
        let aspect = aspect(&desc.settings);
        let range = desc.clip.map(|c| asset.character.clips()[c].playback()).unwrap_or_default();
        let mut worker = Worker::default();
        worker.evaluate(asset, desc.clip, range.start);
        let center = asset.character.center(&worker.posed);
        let placed = |s: &Shape| Shape { geometry: s.geometry.moved(-center), material: own + s.material };
        let shapes: Vec<Shape> = desc.props.shapes.iter().map(placed).collect();
        let span = Span { asset, clip: desc.clip, center, shapes: Shape::bounds(&shapes) };
        let stand = Stand::new(&span, &desc.view, desc.framing, aspect, foresight, &mut worker)?;
        let stage = Stage::new(&span, &desc.look, &materials, &mut worker);
        let layers = Layers::new(&span, &desc.overlays, &mut worker)?;
        let developer = desc.look.grade.developer();
        static SHOTS: AtomicU64 = AtomicU64::new(1);
        let (number, labels) = (SHOTS.fetch_add(1, Ordering::Relaxed), OnceLock::new());
        Ok(Self {
            number,
            asset,
            desc,
            stand,
            range,
            materials,
            shapes,
            center,
            stage,
            layers,
            developer,
            labels,
        })
    }

    /// What was asked for.
    pub fn desc(&self) -> &ShotDesc {
        &self.desc
    }

    /// Seconds of the clip.
    pub fn range(&self) -> Range {
        self.range
    }

    /// Where the character stands in the world over the shot's clip: [`ground_point`].
    pub fn ground_point(&self) -> DVec3 {
        ground_point(self.asset, self.desc.clip)
    }

    /// Names of the objects that pixels may show, in order: those of the meshes that the character's instances wear, and, where rays
    /// draw, shapes.
    pub fn object_names(&self) -> Vec<String> {
        let character = &self.asset.character;
        let meshes = character.instances().iter().map(|i| character.mesh(i).name.clone());
        let shapes = if self.desc.renderer == Renderer::Raster { 0 } else { self.shapes.len() };
        meshes.chain((1..=shapes).map(|i| format!("shape {i}"))).collect()
    }

    /// Pixels a row, and rows, of its pictures.
    pub fn size(&self) -> [usize; 2] {
        let part = self.part(self.desc.crop);
        [part.width, part.height]
    }

    /// What of a window is in the picture; all of it for `None`.
    fn part(&self, window: Option<Window>) -> Window {
        let Settings { width, height, .. } = self.desc.settings;
        window.unwrap_or(Window { x: 0, y: 0, width, height }).within(width, height)
    }

    /// Draw a moment with the buffers of `worker`.
    pub fn draw(&self, moment: impl Into<Moment>, worker: &mut Worker, out: &mut Rgba8) -> FrameStats {
        if self.desc.look.is_direct() && self.desc.overlays.is_empty() {
            return self
                .with_scene(moment.into(), worker, |scene, w| w.draw(scene, &self.desc.settings, out));
        }
        // What a grade makes of a pixel may depend on its neighbours and on its place.
        let window = self.desc.crop.filter(|_| self.desc.look.is_direct());
        let mut light = std::mem::take(&mut worker.light);
        let stats = self.draw_layers(moment.into(), worker, window, &mut light);
        self.developer.develop(&light, out);
        worker.light = light;
        if window != self.desc.crop {
            self.part(self.desc.crop).cut(4, out.width, &mut out.data);
            [out.width, out.height] = self.size();
        }
        stats
    }

    /// Draw a moment in linear light, alpha premultiplied. The look's grade is not applied.
    pub fn draw_linear(&self, moment: impl Into<Moment>, worker: &mut Worker, out: &mut Image) -> FrameStats {
        let window = self.desc.crop.filter(|_| self.stage.is_none());
        let stats = self.draw_layers(moment.into(), worker, window, out);
        if window != self.desc.crop {
            self.part(self.desc.crop).cut(1, out.width, &mut out.pixels);
            [out.width, out.height] = self.size();
        }
        stats
    }

    /// Which object and triangle is seen at the centre of each pixel of a moment, and how far away.
    ///
    /// Objects are the character's mesh instances, in order.
    pub fn draw_ids(&self, moment: impl Into<Moment>, worker: &mut Worker, out: &mut IdImage) -> FrameStats {
        self.with_scene(moment.into(), worker, |scene, w| {
            w.rasterizer.draw_ids(scene, &self.desc.settings, out)
        })
    }

    /// Pose and deform the character, and hand the scene of the moment to a renderer.
    fn with_scene(
        &self,
        moment: Moment,
        worker: &mut Worker,
        draw: impl FnOnce(&Scene, &mut Painter) -> Stats,
    ) -> FrameStats {
        let mut stats = FrameStats::default();
        self.pose(moment.time, worker, &mut stats);
        let start = Instant::now();
        let camera = self.stand.camera(moment, &worker.posed, &worker.deformed);
        let scene = self.scene(camera, &worker.posed, &worker.deformed);
        let painter = &mut worker.painter;
        painter.set_window(self.desc.crop);
        (painter.renderer, painter.outcome) = (self.desc.renderer, Outcome::default());
        stats.raster = draw(&scene, painter);
        stats.rays = painter.outcome;
        stats.times.draw = start.elapsed();
        stats
    }

    /// Pose and deform the character.
    fn pose(&self, time: f64, worker: &mut Worker, stats: &mut FrameStats) {
        let start = Instant::now();
        worker.evaluate(self.asset, self.desc.clip, time::wrap(time, self.range, self.desc.wrap));
        let posed = Instant::now();
        stats.vertices += worker.deform(self.asset, self.center, self.number);
        stats.bones += worker.posed.len();
        stats.times.pose += posed - start;
        stats.times.deform += posed.elapsed();
    }

    /// Width over height.
    fn aspect(&self) -> f32 {
        aspect(&self.desc.settings)
    }

    fn scene<'s>(&'s self, camera: Camera, posed: &Posed, deformed: &'s [Deformed]) -> Scene<'s> {
        let character = &self.asset.character;
        let plain = self.asset.materials.len();
        let labels = self.labels.get();
        let object = |(i, (inst, d)): (usize, (&Instance, &'s Deformed))| {
            let mesh = &character.meshes()[inst.mesh.0 as usize];
            let material = mesh.material.map_or(plain, |m| (m.0 as usize).min(plain));
            Object {
                mesh,
                positions: &d.positions,
                normals: if self.desc.look.shading == Shading::Facets { &[] } else { &d.normals },
                tangents: &d.tangents,
                material,
                mirrored: d.mirrored,
                labels: labels.map_or(&[], |l| &l[i]),
            }
        };
        let look = &self.desc.look;
        let lit = look::lights(look, &self.asset.lights, posed, self.center, &camera);
        Scene {
            camera,
            ambient: lit.ambient,
            lights: lit.lights,
            style: lit.style,
            background: look.background,
            objects: character.instances().iter().zip(deformed).enumerate().map(object).collect(),
            shapes: &self.shapes,
            materials: &self.materials,
            textures: &self.asset.textures,
        }
    }
}

/// Width over height of a picture.
fn aspect(settings: &Settings) -> f32 {
    settings.width as f32 / settings.height.max(1) as f32
}
