//! Options of how pictures are made: by the rasterizer or by rays, and how well.

use crate::cli::Failure;
use sinew::frames::{Look, Props};
use sinew::io::scene::ours::SceneFile;
use sinew::render::ray::{Outcome, Precision, RaySettings};
use sinew::render::{Renderer, Watch};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Samples of rays that something other than their number ends.
const ENOUGH: u32 = 65536;

#[derive(clap::Args)]
#[command(next_help_heading = "Renderer")]
pub struct RendererArgs {
    /// raster (fast), ray (traced shadows, mirrors, glass and a scene's shapes), or hybrid (the rasterizer finds what one sample a pixel sees first,
    /// rays the rest); ray where a scene has shapes, mirrors or glass, else raster.
    #[arg(long, value_name = "WHICH")]
    renderer: Option<Kind>,
    /// Samples a pixel: 1 or 4 of coverage for the rasterizer (4 if not said), 1 to 65536 for rays (16 if not said, hybrid 1).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub samples: Option<u32>,
    /// Rays: place the samples elsewhere.
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u32>,
    /// Rays: compute in f32 (fast) or f64 (for reference; what scenes of the notes get if not said).
    #[arg(long, value_name = "f32|f64")]
    precision: Option<Width>,
    /// Rays: follow light through so many mirrors and glass surfaces, 0 to 64; 8 if not said, 10 for scenes of the notes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=64))]
    ray_depth: Option<u32>,
    /// Rays: leave a pixel once its standard error is below this share of white, as in 0.005; --samples is then the most.
    #[arg(long, value_name = "ERROR", value_parser = parse_error)]
    adaptive: Option<f64>,
    /// Rays: the best picture in this time, as in 2s or 500ms; the samples that were reached are printed.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub budget: Option<Duration>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    Raster,
    Ray,
    Hybrid,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Width {
    F32,
    F64,
}

impl RendererArgs {
    /// Whether pictures may have fewer samples than they could.
    pub fn ends_early(&self) -> bool {
        self.budget.is_some() || self.adaptive.is_some()
    }

    /// Samples of the rasterizer's, for whatever it draws.
    pub fn coverage(&self) -> u8 {
        if self.samples == Some(1) { 1 } else { 4 }
    }

    /// What draws a shot; `one_sample` where a pixel must not be mixed.
    pub fn renderer(
        &self,
        look: &Look,
        props: &Props,
        scene: Option<&SceneFile>,
        one_sample: bool,
        shadows: bool,
    ) -> Result<Renderer, Failure> {
        let optical =
            |mirror: glam::Vec3, glass: glam::Vec3| mirror.max_element().max(glass.max_element()) > 0.0;
        let patched = look
            .materials
            .iter()
            .any(|p| optical(p.mirror.unwrap_or_default(), p.transmission.unwrap_or_default()));
        let usual = if patched || !props.shapes.is_empty() { Kind::Ray } else { Kind::Raster };
        let kind = self.renderer.unwrap_or(usual);
        if kind == Kind::Raster {
            return self.check_raster().map(|()| Renderer::Raster);
        }
        let of_scene = scene.and_then(|s| s.samples).map(|n| n as u32);
        let usual = match kind {
            Kind::Hybrid => 1,
            _ => of_scene.unwrap_or(16),
        };
        let mut ray = self.rays(usual, Precision::F32);
        ray.depth = self.ray_depth.or(scene.and_then(|s| s.depth).map(|n| n as u32)).unwrap_or(ray.depth);
        ray.shadows = shadows;
        if one_sample {
            ray.samples = 1;
        }
        Ok(if kind == Kind::Hybrid { Renderer::Hybrid(ray) } else { Renderer::Ray(ray) })
    }

    /// How rays draw a scene of the notes.
    pub fn of_notes(&self) -> Result<RaySettings, Failure> {
        match self.renderer {
            // Nothing is too faint to be followed.
            None | Some(Kind::Ray) => Ok(RaySettings {
                cutoff: 0.0,
                depth: self.ray_depth.unwrap_or(10),
                ..self.rays(1, Precision::F64)
            }),
            Some(_) => Err(Failure::Usage(
                "--renderer: scenes of the notes are drawn by rays alone; expected ray, or leave it out"
                    .into(),
            )),
        }
    }

    fn rays(&self, usual: u32, precision: Precision) -> RaySettings {
        let plain = RaySettings::default();
        RaySettings {
            samples: self.samples.unwrap_or(if self.ends_early() { ENOUGH } else { usual }),
            seed: self.seed.unwrap_or(plain.seed),
            error: self.adaptive,
            depth: self.ray_depth.unwrap_or(plain.depth),
            precision: match self.precision {
                None => precision,
                Some(Width::F32) => Precision::F32,
                Some(Width::F64) => Precision::F64,
            },
            ..plain
        }
    }

    /// Refuse what the rasterizer cannot do.
    fn check_raster(&self) -> Result<(), Failure> {
        let given = [
            ("--seed", self.seed.is_some()),
            ("--precision", self.precision.is_some()),
            ("--ray-depth", self.ray_depth.is_some()),
            ("--adaptive", self.adaptive.is_some()),
            ("--budget", self.budget.is_some()),
        ];
        if let Some((name, _)) = given.iter().find(|g| g.1) {
            let message = format!("{name} is for rays, and the rasterizer draws this; add --renderer ray");
            return Err(Failure::Usage(message));
        }
        match self.samples {
            None | Some(1 | 4) => Ok(()),
            Some(n) => Err(Failure::Usage(format!(
                "--samples {n}: the rasterizer takes 1 or 4; --renderer ray takes up to 65536"
            ))),
        }
    }
}

/// Follows a picture from now on: shows how far it is, and ends it when its time is up.
pub fn watch(budget: Option<Duration>, bar: indicatif::ProgressBar) -> Watch {
    let start = Instant::now();
    Box::new(move |p| {
        let gone = start.elapsed();
        let (done, all) = match budget {
            Some(budget) => (gone.as_millis() as u64, budget.as_millis() as u64),
            None => {
                let tiles = p.tiles as u64;
                (
                    u64::from(p.samples) * tiles + u64::from(p.pass) * p.tiles_done as u64,
                    u64::from(p.wanted) * tiles,
                )
            }
        };
        bar.set_length(all);
        bar.set_position(done.min(all));
        // A picture without holes is the least.
        if p.samples > 0 && budget.is_some_and(|b| gone >= b) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    })
}

/// What to say of the samples that pictures got.
pub fn reached(rays: &Outcome, pixels: usize) -> Option<String> {
    let mean = rays.count.primary as f64 / pixels.max(1) as f64;
    (rays.samples > 0).then(|| format!("{mean:.1} samples a pixel on average"))
}

fn parse_error(text: &str) -> Result<f64, String> {
    let error = text.parse::<f64>().ok().filter(|e| (1e-6..=1.0).contains(e));
    error.ok_or_else(|| "expected a share of white from 0.000001 to 1, as in 0.005".into())
}

fn parse_time(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.strip_suffix("ms") {
        Some(n) => (n, 1e-3),
        None => match text.strip_suffix("min") {
            Some(n) => (n, 60.0),
            None => (text.strip_suffix('s').unwrap_or(text), 1.0),
        },
    };
    let seconds = number.trim().parse::<f64>().ok().map(|n| n * unit).filter(|s| (1e-3..=1e6).contains(s));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "expected a time as in 2s, 500ms or 1.5min".into())
}
