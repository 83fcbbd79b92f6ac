//! Rays to pixels: what a rasterizer cannot draw, and the slow reference that it is held against.
//!
//! 1. `stage`: whatever is drawn, in the one form that rays know: triangles in trees of boxes ([`accel`](super::accel)), shapes in
//!    closed form (`solid`), lamps, and what surfaces are made of (`coat`), by the code that every renderer shares.
//! 2. `wave`: the rays of a tile, all that are of one kind at once: from the eye (`eye`), then eight hits of one object at a
//!    time to their light, with a ray to each lamp, then what is mirrored, refracted (`optics`) or seen through something, until
//!    nothing is left or it counts too little. Nothing recurses.
//! 3. `film`: samples (`sampler`) are gathered tile by tile and pass by pass, until there are enough.
//!
//! No number says how far rays must start from what they leave: see `Stage::spot`.

mod coat;
mod eye;
mod film;
mod optics;
mod sampler;
mod solid;
mod stage;
mod tell;
mod wave;

pub use film::undisturbed;

use super::accel::{Kind, Motion, Placed, Surface, World};
use super::channel::{Channel, Channels, IdImage};
use super::{Settings, Window};
use crate::image::{Image, Rgba8, color};
use crate::math::simd::Isa;
use crate::scene::{Scene, ShapeScene};
use film::Film;
use glam::DVec3;
use stage::{Body, Real, Stage};
use std::ops::ControlFlow;
use wave::Wave;

/// What rays are computed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// Fast.
    #[default]
    F32,
    /// For reference. A scene's materials are evaluated in `f32` all the same, those of a [`ShapeScene`] are not.
    F64,
}

/// How rays make a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySettings {
    /// Samples a pixel; 1 is its centre, more lie anywhere in it.
    pub samples: u32,
    /// Samples of another seed lie elsewhere.
    pub seed: u32,
    /// A pixel has enough samples, of which 16 at least, once the standard error of its brightness is not above this, nor that of
    /// its neighbours; `None`: all have the same number.
    pub error: Option<f64>,
    /// How often light is mirrored or refracted on its way to the eye, at most.
    pub depth: u32,
    /// Light that counts no more than this in its pixel, as a factor, is not followed further.
    pub cutoff: f64,
    /// Whether anything stands in the light.
    pub shadows: bool,
    /// What it is computed in.
    pub precision: Precision,
}

impl Default for RaySettings {
    /// One sample, shadows, eight mirrors in a row, what counts less than a 512th left out.
    fn default() -> Self {
        Self {
            samples: 1,
            seed: 0,
            error: None,
            depth: 8,
            cutoff: 1.0 / 512.0,
            shadows: true,
            precision: Precision::F32,
        }
    }
}

/// How far a picture has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples that every pixel has, unless it needs no more: 0 until the first pass is done.
    pub samples: u32,
    /// How many this pass adds.
    pub pass: u32,
    /// How many are asked for.
    pub wanted: u32,
    /// Tiles of this pass that are done.
    pub tiles_done: usize,
    /// Tiles of a pass.
    pub tiles: usize,
}

/// Told after each tile, from any thread, one at a time; ends the picture as it stands with [`ControlFlow::Break`]. Before
/// [`Progress::samples`] is 1 there are pixels that nothing is known of.
pub type Control<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// Rays that were sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct RayCount {
    /// From the eye.
    pub primary: u64,
    /// To lamps.
    pub shadow: u64,
    /// Mirrored, refracted, or through what blends.
    pub secondary: u64,
    /// Evaluations of the shading equation.
    pub shaded: u64,
}

impl std::ops::AddAssign for RayCount {
    fn add_assign(&mut self, o: Self) {
        self.primary += o.primary;
        self.shadow += o.shadow;
        self.secondary += o.secondary;
        self.shaded += o.shaded;
    }
}

/// What became of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Samples that every pixel has, unless it needed no more; 0 if the picture was stopped in its first pass.
    pub samples: u32,
    /// Rays that were sent.
    pub count: RayCount,
}

/// Linear light in `f64`, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ShapePicture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Light.
    pub light: Vec<DVec3>,
}

/// What rays through the pixels' centres meet first, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ShapeCast {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Index of the object (shapes first, then soups) plus one; 0 where nothing is.
    pub objects: Vec<u32>,
    /// Distance over the sensor's: `t‖D‖/d`; infinite where nothing is.
    pub distances: Vec<f64>,
    /// Unit geometric normals on the shapes' own side, in the scene's frame; zero where nothing is.
    pub normals: Vec<DVec3>,
}

/// Draws scenes by rays; keeps its buffers, and the trees of what only moves, from one picture to the next.
#[derive(Default)]
pub struct Tracer {
    isa: Isa,
    window: Option<Window>,
    world: Option<World>,
    film: Film,
    waves: Vec<Wave>,
}

impl Tracer {
    /// One that uses the given build of its kernels; the pictures are the same.
    pub fn with_isa(isa: Isa) -> Self {
        Self { isa, ..Self::default() }
    }

    /// Draw this part of pictures alone, as [`Painter::set_window`](super::Painter::set_window) does.
    pub fn set_window(&mut self, window: Option<Window>) {
        self.window = window;
    }

    /// Draw to 8-bit sRGB with straight alpha; `out` takes the size of `settings` (of which the number of samples is the
    /// rasterizer's). `visible` is what the rasterizer found at the centres of all pixels of the picture, if it did: with one
    /// sample, only what it cannot know is looked for then.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        ray: &RaySettings,
        visible: Option<&IdImage>,
        control: &mut Control,
        out: &mut Rgba8,
    ) -> Outcome {
        let (outcome, window) = self.expose(scene, settings, ray, visible, control);
        (out.width, out.height) = (window.width, window.height);
        out.data.clear();
        out.data.resize(4 * window.width * window.height, 0);
        let pixels = out.data.as_chunks_mut::<4>().0;
        self.film.each_pixel(window, |at, p| pixels[at] = color::encode_srgb8(p.map(|c| c as f32)));
        outcome
    }

    /// Draw to linear light with premultiplied alpha, as [`Tracer::draw`] does otherwise.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_linear(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        ray: &RaySettings,
        visible: Option<&IdImage>,
        control: &mut Control,
        out: &mut Image,
    ) -> Outcome {
        let (outcome, window) = self.expose(scene, settings, ray, visible, control);
        *out = Image::filled(window.width, window.height, [0.0; 4]);
        self.film.each_pixel(window, |at, p| out.pixels[at] = p.map(|c| c as f32));
        outcome
    }

    /// Draw what the pixels show beside their colour, as [`Painter::draw_channels`](super::Painter::draw_channels)
    /// does: where a picture by `ray` has its samples, 64 at most, or by the rasterizer's samples where it has one. Shapes are numbered
    /// after the scene's objects.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_channels(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        ray: &RaySettings,
        wanted: &[Channel],
        out: &mut Channels,
    ) {
        let window = self.prepare(settings);
        let bodies = stage::bodies_of(scene);
        let world = follow(&mut self.world, &bodies, settings.threads.max(1));
        let size = [settings.width, settings.height];
        let stage = Stage::<f32>::of_scene(self.isa, scene, bodies, world, size);
        tell::tell(&stage, scene, settings, ray, window, wanted, out);
    }

    /// Draw the notes' scenes.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_shapes(
        &mut self,
        scene: &ShapeScene,
        settings: &Settings,
        ray: &RaySettings,
        control: &mut Control,
        out: &mut ShapePicture,
    ) -> Outcome {
        let window = self.prepare(settings);
        let outcome = match ray.precision {
            Precision::F32 => self.expose_shapes::<f32>(scene, settings, ray, window, control),
            Precision::F64 => self.expose_shapes::<f64>(scene, settings, ray, window, control),
        };
        (out.width, out.height) = (window.width, window.height);
        out.light = vec![DVec3::ZERO; window.width * window.height];
        self.film.each_pixel(window, |at, [r, g, b, _]| out.light[at] = DVec3::new(r, g, b));
        outcome
    }

    /// What the rays through the pixels' centres of one of the notes' scenes meet.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn cast_shapes(
        &mut self,
        scene: &ShapeScene,
        settings: &Settings,
        precision: Precision,
        out: &mut ShapeCast,
    ) {
        let window = self.prepare(settings);
        match precision {
            Precision::F32 => self.cast::<f32>(scene, settings, window, out),
            Precision::F64 => self.cast::<f64>(scene, settings, window, out),
        }
    }

    fn cast<R: Real>(
        &mut self,
        scene: &ShapeScene,
        settings: &Settings,
        window: Window,
        out: &mut ShapeCast,
    ) {
        self.with_shapes::<R, _>(scene, settings, |stage, _, _| {
            tell::cast(stage, window, scene.camera.focal, out)
        });
    }

    /// Make a stage of one of the notes' scenes.
    fn with_shapes<R: Real, T>(
        &mut self,
        scene: &ShapeScene,
        settings: &Settings,
        work: impl FnOnce(&Stage<R>, &mut Film, &mut [Wave]) -> T,
    ) -> T {
        let meshes: Vec<_> = scene.soups.iter().map(stage::soup_mesh).collect();
        let bodies = stage::bodies_of_soups(scene, &meshes);
        let threads = settings.threads.max(1);
        let world = follow(&mut self.world, &bodies, threads);
        let stage = Stage::<R>::of_shapes(self.isa, scene, bodies, world, [settings.width, settings.height]);
        work(&stage, &mut self.film, &mut self.waves[..threads])
    }

    fn expose_shapes<R: Real>(
        &mut self,
        scene: &ShapeScene,
        settings: &Settings,
        ray: &RaySettings,
        window: Window,
        control: &mut Control,
    ) -> Outcome {
        let size = [settings.width, settings.height];
        self.with_shapes::<R, _>(scene, settings, |stage, film, waves| {
            film.reset(window, size);
            film.expose(stage, ray, waves, |_, _, _| None, control)
        })
    }

    /// Fill the film.
    fn expose(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        ray: &RaySettings,
        visible: Option<&IdImage>,
        control: &mut Control,
    ) -> (Outcome, Window) {
        let window = self.prepare(settings);
        self.film.reset(window, [settings.width, settings.height]);
        let visible =
            visible.filter(|v| ray.samples <= 1 && [v.width, v.height] == [settings.width, settings.height]);
        let outcome = match ray.precision {
            Precision::F32 => self.expose_scene::<f32>(scene, settings, ray, visible, control),
            Precision::F64 => self.expose_scene::<f64>(scene, settings, ray, visible, control),
        };
        (outcome, window)
    }

    fn expose_scene<R: Real>(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        ray: &RaySettings,
        visible: Option<&IdImage>,
        control: &mut Control,
    ) -> Outcome {
        let threads = settings.threads.max(1);
        let bodies = stage::bodies_of(scene);
        let world = follow(&mut self.world, &bodies, threads);
        let size = [settings.width, settings.height];
        let stage = Stage::<R>::of_scene(self.isa, scene, bodies, world, size);
        let known = |stage: &Stage<R>, path: &wave::Path, [x, y]: [usize; 2]| {
            let ids = visible?;
            let at = y * ids.width + x;
            stage.known(path, ids.objects[at], ids.triangles[at])
        };
        self.film.expose(&stage, ray, &mut self.waves[..threads], known, control)
    }

    /// The window, and a wave a thread.
    fn prepare(&mut self, settings: &Settings) -> Window {
        settings.check().expect("settings are checked by the caller");
        let Settings { width, height, threads, .. } = *settings;
        self.waves.resize_with(threads.max(1).max(self.waves.len()), Wave::default);
        self.window.unwrap_or(Window { x: 0, y: 0, width, height }).within(width, height)
    }
}

/// Trees for bodies as they stand: fitted again if the triangles are the same as last time, else built.
fn follow<'w>(world: &'w mut Option<World>, bodies: &[Body], threads: usize) -> &'w World {
    let same = |w: &World| {
        w.objects().zip(bodies).all(|(p, b)| p.mirrored == b.mirrored)
            && w.surfaces().len() == bodies.len()
            && w.surfaces().iter().zip(bodies).all(|(s, b)| s.is_of(b.triangles))
    };
    let kept = world.take().filter(same);
    world.insert(match kept {
        Some(mut w) => {
            let motions: Vec<Motion> = bodies
                .iter()
                .enumerate()
                .map(|(surface, b)| Motion::Deformed { surface, positions: b.positions })
                .collect();
            w.update(&motions, threads);
            w
        }
        None => {
            let surfaces: Vec<Surface> =
                bodies.iter().map(|b| Surface { positions: b.positions, triangles: b.triangles }).collect();
            let placed =
                |(surface, b): (usize, &Body)| Placed { surface, mirrored: b.mirrored, ..Placed::default() };
            let placed: Vec<Placed> = bodies.iter().enumerate().map(placed).collect();
            World::new(Kind::Tree, &surfaces, &placed, threads)
        }
    })
}
