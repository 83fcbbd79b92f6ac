//! What a picture needs beside its scene: shadows, ground, contours, finer sampling.

use super::fit::{self, Span};
use super::look::{GroundLook, Look, Shadows};
use super::{ShotDesc, Worker};
use crate::image::Image;
use crate::render::backdrop::{Backdrop, Ground};
use crate::render::footprint::Footprint;
use crate::render::raster::{IdImage, Stats};
use crate::render::shadow::{ShadowDesc, ShadowMaker};
use crate::render::{Painter, Renderer, Settings};
use crate::scene::{AlphaMode, Camera, LightKind, Material, Projection, Scene, ShadowMap};
use glam::Vec3;

/// Pixels along a side for each pixel of the picture, where tones and lines have edges that samples do not smooth.
const FINER: usize = 2;
/// Texels along a side of the map that contact shadows are made from: they are blurred far more than this.
const CONTACT_SIZE: usize = 256;
/// How far an edge at a height of 1 blurs: a lamp 7° across.
const SPREAD: f32 = 0.06;
/// Share of the light that the key light's shadow takes from the ground.
const CAST: f32 = 0.5;

/// Buffers of one thread.
#[derive(Default)]
pub(super) struct Effects {
    maker: ShadowMaker,
    key: ShadowMap,
    near: ShadowMap,
    cast: Footprint,
    contact: Footprint,
    fine: Image,
    ids: IdImage,
}

/// What stays the same over a shot.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    /// Corners of a box that holds the character over the whole clip, scene space.
    bounds: [Vec3; 2],
    /// The shot's materials as they throw shadows and have contours: on both sides, and where they are more than half there.
    solid: Vec<Material>,
}

impl Stage {
    /// `None` where the scene is all there is to the picture.
    pub fn new(span: &Span, look: &Look, materials: &[Material], worker: &mut Worker) -> Option<Self> {
        if !look.needs_stage() {
            return None;
        }
        let stands = look.ground.is_some() || look.shadows != Shadows::None;
        let found = stands.then(|| fit::bounds(span, None, worker)).filter(|[low, _]| low.is_finite());
        let bounds = found.unwrap_or([Vec3::splat(-0.5), Vec3::splat(0.5)]);
        let solid = |m: &Material| Material {
            double_sided: true,
            alpha: if m.alpha == AlphaMode::Blend { AlphaMode::Mask(0.5) } else { m.alpha },
            ..m.clone()
        };
        Some(Self { bounds, solid: materials.iter().map(solid).collect() })
    }

    /// Half of the box's diagonal.
    fn radius(&self) -> f32 {
        (0.5 * self.bounds[0].distance(self.bounds[1])).max(1e-9)
    }

    /// Draw a scene with all that the look wants, before nothing.
    pub fn draw(
        &self,
        desc: &ShotDesc,
        scene: &Scene,
        painter: &mut Painter,
        effects: &mut Effects,
        out: &mut Image,
    ) -> Stats {
        let (look, settings) = (&desc.look, &desc.settings);
        let caster = Scene { materials: &self.solid, ..scene.clone() };
        let mut stats = self.shadows(look, settings, &caster, effects);
        let mut scene = Scene { background: [0.0; 4], ..scene.clone() };
        let Effects { key, fine, ids, .. } = effects;
        if look.shadows == Shadows::Map && key.size > 0 && desc.renderer == Renderer::Raster {
            scene.style.shadow = Some(key);
        }

        // Tones and lines are drawn finer and averaged.
        let finer = if look.tones().is_some() || look.outline.is_some() { FINER } else { 1 };
        let large = Settings { width: finer * settings.width, height: finer * settings.height, ..*settings };
        if finer == 1 || large.check().is_err() {
            stats += self.figure(look, &scene, &caster, settings, 1.0, painter, ids, out);
        } else {
            stats += self.figure(look, &scene, &caster, &large, finer as f32, painter, ids, fine);
            average(fine, finer, out);
        }
        stats
    }

    /// Put background and ground, with the shadows of the last scene that was drawn, behind a picture.
    pub fn put_behind(&self, look: &Look, camera: &Camera, effects: &Effects, out: &mut Image) {
        let Effects { cast, contact, .. } = effects;
        let backdrop = Backdrop {
            top: look.background,
            bottom: look.background_bottom.unwrap_or(look.background),
            ground: look.ground.map(|g| self.ground(g, contact, cast)),
        };
        backdrop.put_behind(camera, out);
    }

    /// The ground around the character.
    fn ground<'e>(&self, look: GroundLook, contact: &'e Footprint, cast: &'e Footprint) -> Ground<'e> {
        let middle = (self.bounds[0] + self.bounds[1]) * 0.5;
        let r = self.radius();
        Ground {
            height: self.bounds[0].y,
            color: look.color,
            center: [middle.x, middle.z],
            fade: [1.2 * r, 5.0 * r],
            shadows: [(contact.size > 0).then_some((contact, 1.0)), (cast.size > 0).then_some((cast, CAST))],
        }
    }

    /// The scene, and its contours `scale` times as wide as asked for.
    fn figure(
        &self,
        look: &Look,
        scene: &Scene,
        caster: &Scene,
        settings: &Settings,
        scale: f32,
        painter: &mut Painter,
        ids: &mut IdImage,
        out: &mut Image,
    ) -> Stats {
        let mut stats = painter.draw_linear(scene, settings, out);
        if let Some(mut line) = look.outline {
            stats += painter.rasterizer.draw_ids(caster, settings, ids);
            line.width *= scale;
            let (slope, perspective) = match scene.camera.projection {
                Projection::Perspective { fov_y } => (2.0 * (0.5 * fov_y).tan(), true),
                Projection::Orthographic { height } => (height, false),
            };
            line.draw(ids, slope / settings.height as f32, perspective, out);
        }
        stats
    }

    /// Draw the maps that the look asks for; what it does not ask for is left empty.
    fn shadows(&self, look: &Look, settings: &Settings, caster: &Scene, effects: &mut Effects) -> Stats {
        let Effects { maker, key, near, cast, contact, .. } = effects;
        (key.size, cast.size, contact.size) = (0, 0, 0);
        let mut stats = Stats::default();
        let r = self.radius();
        let desc = ShadowDesc {
            direction: Vec3::Y,
            bounds: self.bounds,
            margin: 0.3 * r,
            size: CONTACT_SIZE,
            radius: 1.5,
            bias: 0.012 * r,
            threads: settings.threads,
        };
        let ground = look.ground.is_some();
        if ground && look.shadows != Shadows::None {
            stats += maker.draw(caster, &desc, near);
            // The map's near plane lies a little below the ground.
            let below = near.texel_from_scene.transform_point3(self.bounds[0]).z;
            near.depth.iter_mut().for_each(|z| *z -= below);
            let strength = if look.shadows == Shadows::Map { 0.7 } else { 1.0 };
            let parts = [[0.12 * r, 0.035 * r, 0.8 * strength], [0.7 * r, 0.2 * r, 0.65 * strength]];
            contact.contact(near, &parts);
        }
        if look.shadows == Shadows::Map
            && let Some(direction) = self.key_direction(caster)
        {
            let finest = settings.width.max(settings.height).next_multiple_of(64);
            let desc = ShadowDesc { direction, size: finest.clamp(256, 1024), ..desc };
            stats += maker.draw(caster, &desc, key);
            if ground && direction.y < -0.1 {
                cast.cast(key, self.bounds[0].y, SPREAD);
            }
        }
        stats
    }

    /// The way the key light travels, at the character's middle.
    fn key_direction(&self, scene: &Scene) -> Option<Vec3> {
        let middle = (self.bounds[0] + self.bounds[1]) * 0.5;
        match scene.lights.first()?.kind {
            LightKind::Directional { direction } => Some(direction),
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                (middle - position).try_normalize()
            }
        }
    }
}

/// Each pixel is the mean of a square of `n²`.
fn average(fine: &Image, n: usize, out: &mut Image) {
    (out.width, out.height) = (fine.width / n, fine.height / n);
    out.pixels.clear();
    let scale = 1.0 / (n * n) as f32;
    for y in 0..out.height {
        for x in 0..out.width {
            let mut sum = [0.0f32; 4];
            for j in 0..n {
                for p in &fine.pixels[(y * n + j) * fine.width + x * n..][..n] {
                    (0..4).for_each(|c| sum[c] += p[c]);
                }
            }
            out.pixels.push(sum.map(|s| s * scale));
        }
    }
}
