//! Any renderer, behind one door.

use super::channel::{Channel, Channels, IdImage};
use super::raster::{Rasterizer, Stats};
use super::ray::{Outcome, Progress, RaySettings, Tracer, undisturbed};
use super::{Settings, Window};
use crate::image::{Image, Rgba8};
use crate::math::simd::Isa;
use crate::scene::Scene;
use std::ops::ControlFlow;

/// Who draws. Where both can, the pictures agree but for the silhouettes, if nothing stands in the light.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Renderer {
    /// Triangles to pixels: fast; knows neither shapes nor mirrors nor glass, and shadows from maps alone.
    #[default]
    Raster,
    /// Rays from the eye.
    Ray(RaySettings),
    /// What is seen at pixels' centres is found by the rasterizer, where one sample is asked for and nothing blends; rays do the rest.
    Hybrid(RaySettings),
}

impl Renderer {
    /// How rays are sent, if any are.
    pub fn rays(&self) -> Option<&RaySettings> {
        match self {
            Self::Raster => None,
            Self::Ray(r) | Self::Hybrid(r) => Some(r),
        }
    }
}

/// [`Control`](super::ray::Control) that is kept.
pub type Watch = Box<dyn FnMut(&Progress) -> ControlFlow<()> + Send>;

/// Draws by any renderer, and keeps the buffers of all.
#[derive(Default)]
pub struct Painter {
    /// Who draws.
    pub renderer: Renderer,
    /// Told how pictures by rays come along.
    pub watch: Option<Watch>,
    /// What rays did for all pictures since it was cleared; the samples are those of the last one.
    pub outcome: Outcome,
    /// For what is always rasterized.
    pub rasterizer: Rasterizer,
    tracer: Tracer,
    ids: IdImage,
}

impl Painter {
    /// One that uses the given build of all kernels; the pictures are the same.
    pub fn with_isa(isa: Isa) -> Self {
        Self { rasterizer: Rasterizer::with_isa(isa), tracer: Tracer::with_isa(isa), ..Self::default() }
    }

    /// See [`Rasterizer::set_window`].
    pub fn set_window(&mut self, window: Option<Window>) {
        self.rasterizer.set_window(window);
        self.tracer.set_window(window);
    }

    /// See [`Rasterizer::draw`].
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw(&mut self, scene: &Scene, settings: &Settings, out: &mut Rgba8) -> Stats {
        if self.renderer == Renderer::Raster {
            return self.rasterizer.draw(scene, settings, out);
        }
        self.trace(scene, settings, |tracer, rays, seen, watch| {
            tracer.draw(scene, settings, rays, seen, watch, out)
        })
    }

    /// See [`Rasterizer::draw_linear`].
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_linear(&mut self, scene: &Scene, settings: &Settings, out: &mut Image) -> Stats {
        if self.renderer == Renderer::Raster {
            return self.rasterizer.draw_linear(scene, settings, out);
        }
        self.trace(scene, settings, |tracer, rays, seen, watch| {
            tracer.draw_linear(scene, settings, rays, seen, watch, out)
        })
    }

    /// See [`Rasterizer::draw_channels`]; only rays see shapes.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_channels(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        wanted: &[Channel],
        out: &mut Channels,
    ) -> Stats {
        let Some(ray) = self.renderer.rays() else {
            return self.rasterizer.draw_channels(scene, settings, wanted, out);
        };
        self.tracer.draw_channels(scene, settings, ray, wanted, out);
        Stats::default()
    }

    fn trace(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        draw: impl FnOnce(&mut Tracer, &RaySettings, Option<&IdImage>, &mut super::ray::Control) -> Outcome,
    ) -> Stats {
        let rays = *self.renderer.rays().expect("asked by those who trace");
        let mut stats = Stats::default();
        let hybrid = matches!(self.renderer, Renderer::Hybrid(_)) && rays.samples <= 1;
        if hybrid {
            // The whole picture: rays reach beyond a window to the ends of its tiles.
            let window = self.rasterizer.window();
            self.rasterizer.set_window(None);
            stats = self.rasterizer.draw_ids(scene, settings, &mut self.ids);
            self.rasterizer.set_window(window);
        }
        let seen = hybrid.then_some(&self.ids);
        let outcome = match &mut self.watch {
            Some(watch) => draw(&mut self.tracer, &rays, seen, watch),
            None => draw(&mut self.tracer, &rays, seen, &mut undisturbed),
        };
        self.outcome.samples = outcome.samples;
        self.outcome.count += outcome.count;
        stats
    }
}
