//! What is drawn with a character for those who animate it: ghosts of other moments, paths of bones, the bones themselves.
//!
//! A picture with overlays is a stack of layers in linear light, each with its own coverage, put on each other by the regions of
//! the notes §1.4. From the bottom: background, ghosts from far to near, with an x-ray the bones, the character, without one the
//! bones, paths.

use super::bones::Figure;
use super::fit::Span;
use super::onion;
use super::path::Trail;
use super::view::ViewError;
use super::{FrameStats, Moment, Shot, Worker};
use crate::image::Image;
use crate::image::composite::Operator;
use crate::render::Window;
use crate::scene::Camera;
use crate::skeleton::BoneId;
use std::time::Instant;

/// What is drawn with a character. The default is nothing, and costs nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlays {
    /// Ghosts of other moments.
    pub onion: Option<Onion>,
    /// Ways that bones take over the whole clip.
    pub paths: Vec<PathDesc>,
    /// The skeleton.
    pub bones: Option<BonesDesc>,
    /// Opacity of the character, through which bones and ghosts are seen; without it bones are drawn on the character.
    pub xray: Option<f32>,
    /// Linear colours of what was and of what will be.
    pub colors: [[f32; 3]; 2],
}

impl Default for Overlays {
    /// Nothing; the past would be blue and the future orange.
    fn default() -> Self {
        let colors = [[0.03, 0.2, 0.85], [1.0, 0.19, 0.01]];
        Self { onion: None, paths: Vec::new(), bones: None, xray: None, colors }
    }
}

impl Overlays {
    /// Nothing is asked for.
    pub fn is_empty(&self) -> bool {
        self.onion.is_none() && self.paths.is_empty() && self.bones.is_none() && self.xray.is_none()
    }
}

/// Ghosts of moments before and after, seen by the camera of now.
///
/// The `k`-th of `n` ghosts on a side covers `opacity·(n + 1 − k)/n` of what its character covers. Where past and future of one
/// distance overlap, the region `A_both` shows the mean of the two; the nearer distance lies on the farther one, the character on
/// all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onion {
    /// Ghosts before now, at most [`Onion::MOST`]; none is shown before the clip's start unless the clip is repeated.
    pub before: u32,
    /// Ghosts after now.
    pub after: u32,
    /// Seconds from one to the next.
    pub step: f64,
    /// Coverage of the nearest ghost, 0…1.
    pub opacity: f32,
    /// How far ghosts take the colour of past or future, 0…1.
    pub tint: f32,
}

impl Onion {
    /// Ghosts on one side.
    pub const MOST: u32 = 100;
}

/// The way that a bone takes over the whole clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathDesc {
    /// Which bone.
    pub bone: BoneId,
    /// Its origin instead of its tip.
    pub head: bool,
    /// Seconds from one dot to the next.
    pub step: f64,
    /// Width of the line, pixels.
    pub width_px: f32,
}

/// How the skeleton is drawn: each bone as in the notes §7.1, in a colour of its own.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct BonesDesc {
    /// These stand out and the others are grey, if there are any.
    pub selected: Vec<BoneId>,
}

/// Overlays that are ready to be drawn.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    figure: Option<Figure>,
    trails: Vec<Trail>,
}

impl Layers {
    pub fn new(span: &Span, overlays: &Overlays, worker: &mut Worker) -> Result<Self, ViewError> {
        check(span, overlays)?;
        let figure = overlays.bones.as_ref().map(|b| Figure::new(span, b, worker));
        let trails = overlays.paths.iter().map(|p| Trail::new(span, p, worker)).collect();
        Ok(Self { figure, trails })
    }
}

/// Refuse bones and numbers that mean nothing.
fn check(span: &Span, overlays: &Overlays) -> Result<(), ViewError> {
    let count = span.asset.character.skeleton().len();
    let of_paths = overlays.paths.iter().map(|p| (p.bone, "draw the path of"));
    let of_bones = overlays.bones.iter().flat_map(|b| &b.selected).map(|&b| (b, "select"));
    for (bone, purpose) in of_paths.chain(of_bones) {
        if bone.index() >= count {
            return Err(ViewError::Bone { bone: bone.0, purpose, count });
        }
    }
    let share = |what, found: f32| (what, found, (0.0..=1.0).contains(&found), "0 to 1");
    let step = |what, found: f64| (what, found as f32, found > 0.0 && found.is_finite(), "seconds above 0");
    let mut numbers = vec![share("the opacity of the character", overlays.xray.unwrap_or(1.0))];
    if let Some(o) = &overlays.onion {
        numbers.extend([share("the opacity of ghosts", o.opacity), share("the tint of ghosts", o.tint)]);
        numbers.push(step("the step of ghosts", o.step));
        let most = o.before.max(o.after);
        numbers.push(("the number of ghosts on a side", most as f32, most <= Onion::MOST, "at most 100"));
    }
    for p in &overlays.paths {
        numbers.push(step("the step of a path", p.step));
        numbers.push((
            "the width of a path",
            p.width_px,
            (0.0..=1000.0).contains(&p.width_px),
            "0 to 1000 pixels",
        ));
    }
    match numbers.into_iter().find(|n| !n.2) {
        Some((what, found, _, expected)) => Err(ViewError::Number { what, found, expected }),
        None => Ok(()),
    }
}

impl Shot<'_> {
    /// Draw a window of a moment with its overlays.
    pub(super) fn draw_layers(
        &self,
        moment: Moment,
        worker: &mut Worker,
        window: Option<Window>,
        out: &mut Image,
    ) -> FrameStats {
        let overlays = &self.desc.overlays;
        let mut layer = std::mem::take(&mut worker.layer);
        let mut stats = FrameStats::default();
        self.pose(moment.time, worker, &mut stats);
        let camera = self.stand.camera(moment, &worker.posed, &worker.deformed);

        worker.painter.set_window(window);
        (worker.painter.renderer, worker.painter.outcome) = (self.desc.renderer, Default::default());
        let whole = overlays.onion.is_none() && overlays.xray.is_none();
        let background = self.desc.look.background;
        if whole && self.stage.is_none() {
            self.character(&camera, background, worker, out, &mut stats);
        } else if whole {
            self.character(&camera, [0.0; 4], worker, out, &mut stats);
            self.put_behind(&camera, worker, out);
        } else {
            self.clear(window, out);
            if let Some(o) = &overlays.onion {
                onion::ghosts(self, o, moment.time, &camera, worker, out, &mut stats);
                self.pose(moment.time, worker, &mut stats);
            }
            if overlays.xray.is_some() {
                self.bones(&camera, worker, &mut layer, out, &mut stats);
            }
            self.character(&camera, [0.0; 4], worker, &mut layer, &mut stats);
            Operator::OVER.apply(&layer, overlays.xray.unwrap_or(1.0), out);
            self.put_behind(&camera, worker, out);
        }
        if overlays.xray.is_none() {
            self.bones(&camera, worker, &mut layer, out, &mut stats);
        }
        let corner = window.map_or([0, 0], |w| [w.x, w.y]);
        for trail in &self.layers.trails {
            trail.draw(self, moment.time, &camera, &worker.posed, [&mut layer, out], corner);
        }
        worker.layer = layer;
        stats.rays = worker.painter.outcome;
        stats
    }

    /// An empty picture of a window's size.
    fn clear(&self, window: Option<Window>, out: &mut Image) {
        let part = self.part(window);
        (out.width, out.height) = (part.width, part.height);
        out.pixels.clear();
        out.pixels.resize(out.width * out.height, [0.0; 4]);
    }

    /// Put the look's background, and its ground if it has one, behind a picture.
    fn put_behind(&self, camera: &Camera, worker: &Worker, out: &mut Image) {
        let background = self.desc.look.background;
        match &self.stage {
            Some(stage) => stage.put_behind(&self.desc.look, camera, &worker.effects, out),
            None => out.pixels.iter_mut().for_each(|p| *p = Operator::OVER.pixel(*p, background)),
        }
    }

    /// The character as it is posed, before a colour; a look with effects of its own takes none.
    pub(super) fn character(
        &self,
        camera: &Camera,
        background: [f32; 4],
        worker: &mut Worker,
        out: &mut Image,
        stats: &mut FrameStats,
    ) {
        let start = Instant::now();
        let mut scene = self.scene(*camera, &worker.posed, &worker.deformed);
        scene.background = background;
        let (painter, effects) = (&mut worker.painter, &mut worker.effects);
        stats.raster += match &self.stage {
            Some(stage) => stage.draw(&self.desc, &scene, painter, effects, out),
            None => painter.draw_linear(&scene, &self.desc.settings, out),
        };
        stats.times.draw += start.elapsed();
    }

    /// The skeleton as it is posed, on a picture.
    fn bones(
        &self,
        camera: &Camera,
        worker: &mut Worker,
        layer: &mut Image,
        out: &mut Image,
        stats: &mut FrameStats,
    ) {
        let Some(figure) = &self.layers.figure else { return };
        let positions = figure.positions(self.asset.character.skeleton(), &worker.posed, self.center);
        let scene = figure.scene(self.scene(*camera, &worker.posed, &[]), &positions);
        stats.raster += worker.painter.rasterizer.draw_linear(&scene, &self.desc.settings, layer);
        Operator::OVER.apply(layer, 1.0, out);
    }
}
