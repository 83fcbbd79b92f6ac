//! Which renderer draws, and what that took.

use super::FrameStats;
use crate::image::{Image, Rgba8};
use crate::render::channel::{Channel, Channels, IdImage};
use crate::render::raster::Rasterizer;
use crate::render::ray::{self, Control, Outcome, Progress, RaySettings, Tracer};
use crate::render::{Renderer, Settings, Window};
use crate::scene::Scene;
use std::ops::ControlFlow;

/// Told how far a picture by rays has come; ends it as it stands with [`ControlFlow::Break`].
pub type Watch = dyn FnMut(&Progress) -> ControlFlow<()> + Send;

/// Both renderers of one thread.
#[derive(Default)]
pub(super) struct Brush {
    pub rasterizer: Rasterizer,
    tracer: Tracer,
    visible: IdImage,
    window: Option<Window>,
    pub watch: Option<Box<Watch>>,
}

impl Brush {
    /// Draw this part of pictures alone.
    pub fn set_window(&mut self, window: Option<Window>) {
        self.window = window;
        self.rasterizer.set_window(window);
        self.tracer.set_window(window);
    }

    /// Draw to 8 bits.
    pub fn draw(&mut self, by: &Renderer, scene: &Scene, settings: &Settings, out: &mut Rgba8) -> FrameStats {
        match by {
            Renderer::Raster => raster(self.rasterizer.draw(scene, settings, out)),
            _ => self.trace(by, scene, settings, |t, ray, ids, c| t.draw(scene, settings, ray, ids, c, out)),
        }
    }

    /// Draw to linear light.
    pub fn draw_linear(
        &mut self,
        by: &Renderer,
        scene: &Scene,
        settings: &Settings,
        out: &mut Image,
    ) -> FrameStats {
        match by {
            Renderer::Raster => raster(self.rasterizer.draw_linear(scene, settings, out)),
            _ => self.trace(by, scene, settings, |t, ray, ids, c| {
                t.draw_linear(scene, settings, ray, ids, c, out)
            }),
        }
    }

    /// Draw what pixels show beside their colour.
    pub fn draw_channels(
        &mut self,
        by: &Renderer,
        scene: &Scene,
        settings: &Settings,
        wanted: &[Channel],
        out: &mut Channels,
    ) -> FrameStats {
        match by {
            Renderer::Raster => raster(self.rasterizer.draw_channels(scene, settings, wanted, out)),
            _ => {
                self.tracer.draw_channels(scene, settings, wanted, out);
                FrameStats::default()
            }
        }
    }

    fn trace(
        &mut self,
        by: &Renderer,
        scene: &Scene,
        settings: &Settings,
        draw: impl FnOnce(&mut Tracer, &RaySettings, Option<&IdImage>, &mut Control) -> Outcome,
    ) -> FrameStats {
        let mut stats = FrameStats::default();
        let (Renderer::Ray(ray) | Renderer::Hybrid(ray)) = by else { return stats };
        let hybrid = matches!(by, Renderer::Hybrid(_)) && ray.samples <= 1;
        if hybrid {
            self.rasterizer.set_window(None);
            stats.raster = self.rasterizer.draw_ids(scene, settings, &mut self.visible);
            self.rasterizer.set_window(self.window);
        }
        let mut on = ray::undisturbed;
        let control: &mut Control = match &mut self.watch {
            Some(watch) => &mut **watch,
            None => &mut on,
        };
        let outcome = draw(&mut self.tracer, ray, hybrid.then_some(&self.visible), control);
        (stats.rays, stats.samples) = (outcome.count, [outcome.samples; 2]);
        stats
    }
}

fn raster(raster: crate::render::raster::Stats) -> FrameStats {
    FrameStats { raster, ..FrameStats::default() }
}
