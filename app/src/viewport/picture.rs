//! The character as a texture: drawn by the library, and only when something changed.

use super::Cost;
use super::orbit::Orbit;
use crate::state::{BoneStyle, EditClip, Loose, Quality, State};
use egui::{Color32, ColorImage, ImageData, TextureHandle, TextureOptions};
use glam::DVec3;
use sinew::asset::Asset;
use sinew::fk::Posed;
use sinew::frames::{BonesDesc, Live, Look};
use sinew::image::Rgba8;
use sinew::pose::Pose;
use sinew::render::Settings;
use sinew::skeleton::BoneId;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Ghosts of other moments, and how much of each is seen.
const GHOSTS: [(i32, u8); 6] = [(-3, 50), (3, 50), (-2, 80), (2, 80), (-1, 120), (1, 120)];
/// Frames between two of them.
const GHOST_STEP: f64 = 4.0;

/// Pictures of one state from one place.
#[derive(Default)]
pub struct Picture {
    live: Option<(Arc<Asset>, Live)>,
    buffer: Rgba8,
    /// Far ghosts first, then the character, then its bones.
    pub layers: Vec<Layer>,
    of: Option<Seen>,
    /// Pictures drawn since the start.
    pub drawn: u64,
}

/// A picture that lies over others, kept while what it shows is the same.
pub struct Layer {
    /// The picture.
    pub texture: TextureHandle,
    image: Arc<ColorImage>,
    of: Shown,
}

impl Layer {
    /// What is seen on it.
    pub fn what(&self) -> &What {
        &self.of.what
    }
}

/// What is seen on a layer.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// The character at another moment; how much of it is seen.
    Ghost(i32, u8),
    /// The character.
    Body,
    /// Its bones; those that are chosen.
    Bones(Vec<BoneId>),
}

impl What {
    fn is_like(&self, o: &Self) -> bool {
        matches!((self, o), (Self::Body, Self::Body) | (Self::Bones(_), Self::Bones(_))) || self == o
    }
}

#[derive(Clone, PartialEq)]
struct Shown {
    what: What,
    pose: Pose,
    orbit: Orbit,
    settings: Settings,
}

/// All that the layers depend on; whatever else changes, nobody asks which are the same.
#[derive(Clone)]
struct Seen {
    clip: Arc<EditClip>,
    time: f64,
    frame: f64,
    loose: (BTreeMap<BoneId, Loose>, BTreeMap<usize, f32>),
    chosen: Vec<BoneId>,
    view: (Quality, BoneStyle, bool),
    orbit: Orbit,
    size: [usize; 2],
    moving: bool,
}

impl Seen {
    fn of(state: &State, orbit: &Orbit, size: [usize; 2], moving: bool) -> Self {
        let v = &state.view;
        Self {
            clip: state.document.clips[state.clip].clone(),
            time: state.time,
            frame: state.frame_seconds(),
            loose: (state.loose.clone(), state.loose_weights.clone()),
            chosen: state.selection.bones.clone(),
            view: (v.quality, v.bones, v.onion),
            orbit: *orbit,
            size,
            moving,
        }
    }

    fn same(&self, o: &Self) -> bool {
        Arc::ptr_eq(&self.clip, &o.clip)
            && (self.time, self.frame, self.view, self.orbit) == (o.time, o.frame, o.view, o.orbit)
            && (self.size, self.moving) == (o.size, o.moving)
            && self.loose == o.loose
            && self.chosen == o.chosen
    }
}

impl Picture {
    /// Where the bones stand; `None` before the first picture.
    pub fn posed(&self) -> Option<&Posed> {
        self.live.as_ref().map(|l| l.1.posed())
    }

    /// The asset is another one now.
    pub fn is_stale(&self, state: &State) -> bool {
        self.live.as_ref().is_none_or(|l| !Arc::ptr_eq(&l.0, &state.document.asset))
    }

    /// A box around the character as it was drawn last, or around its bones.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let (asset, live) = self.live.as_ref()?;
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let grow = |[low, high]: [DVec3; 2], p: DVec3| [low.min(p), high.max(p)];
        let points = live.positions().flatten().filter(|p| p.is_finite());
        let mesh = points.map(|p| live.center() + p.as_dvec3()).fold(none, grow);
        let skeleton = asset.character.skeleton();
        let ends = skeleton.ids().flat_map(|b| super::ends(skeleton, live.posed(), b));
        let all = if mesh[0].is_finite() { mesh } else { ends.fold(none, grow) };
        all[0].is_finite().then_some(all)
    }

    /// Make ready for an asset, posed as it is now.
    pub fn open(&mut self, state: &State) {
        let asset = state.document.asset.clone();
        let mut live = Live::new(&asset, Look::default());
        live.pose(&asset, &state.pose());
        *self = Self { live: Some((asset, live)), drawn: self.drawn, ..Self::default() };
    }

    /// The bone below a pixel of the pane.
    pub fn bone_at(&mut self, orbit: &Orbit, size: [usize; 2], at: [usize; 2]) -> Option<BoneId> {
        let (asset, live) = self.live.as_mut()?;
        let camera = orbit.camera(live.center());
        let settings = Settings { width: size[0], height: size[1], samples: 1, threads: 1 };
        live.bone_at(asset, &camera, &settings, at)
    }

    /// Draw anew if anything changed: the document, the pose, the view, the camera, the size, or that it came to rest.
    pub fn update(
        &mut self,
        ctx: &egui::Context,
        state: &State,
        orbit: &Orbit,
        size: [usize; 2],
        moving: bool,
    ) -> Option<Cost> {
        if self.is_stale(state) {
            self.open(state);
        }
        // Edges are smoothed at rest, or always.
        let quality = state.view.quality;
        let moving = moving && quality == Quality::Normal;
        let now = Seen::of(state, orbit, size, moving);
        if size.contains(&0) || self.of.as_ref().is_some_and(|of| of.same(&now)) {
            return None;
        }
        self.of = Some(now);
        let shrink = if quality == Quality::Draft { 2 } else { 1 };
        let [width, height] = size.map(|s| s.div_ceil(shrink).min(Settings::MAX_SIZE));
        let samples = if moving || quality == Quality::Draft { 1 } else { 4 };
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get().min(8));
        let settings = Settings { width, height, samples, threads };
        let cost = self.draw(ctx, state, orbit, &settings)?;
        let drew = cost.draw_ms > 0.0;
        self.drawn += u64::from(drew);
        drew.then_some(cost)
    }

    fn draw(
        &mut self,
        ctx: &egui::Context,
        state: &State,
        orbit: &Orbit,
        settings: &Settings,
    ) -> Option<Cost> {
        let Self { live, buffer, layers, .. } = self;
        let (asset, live) = live.as_mut()?;
        let cost = Cost { size: [settings.width, settings.height], ..Cost::default() };
        let old = std::mem::take(layers);
        let mut brush = Brush { ctx, asset, live, buffer, orbit, settings, old, cost };
        let step = GHOST_STEP * state.frame_seconds();
        let range = state.active().range;
        for (k, share) in GHOSTS.into_iter().filter(|_| state.view.onion) {
            let t = state.time + f64::from(k) * step;
            if (range.start - 1e-9..=range.end + 1e-9).contains(&t) {
                let pose = brush.evaluate(|| state.pose_at(t));
                layers.push(brush.layer(pose, What::Ghost(k, share)));
            }
        }
        let pose = brush.evaluate(|| state.pose());
        layers.push(brush.layer(pose.clone(), What::Body));
        if matches!(state.view.bones, BoneStyle::Pyramids | BoneStyle::XRay) {
            layers.push(brush.layer(pose, What::Bones(state.selection.bones.clone())));
        }
        Some(brush.cost)
    }
}

/// Draws the layers that changed.
struct Brush<'a> {
    ctx: &'a egui::Context,
    asset: &'a Asset,
    live: &'a mut Live,
    buffer: &'a mut Rgba8,
    orbit: &'a Orbit,
    settings: &'a Settings,
    old: Vec<Layer>,
    cost: Cost,
}

impl Brush<'_> {
    fn evaluate(&mut self, pose: impl FnOnce() -> Pose) -> Pose {
        let start = Instant::now();
        let pose = pose();
        self.cost.evaluate_ms += ms(start.elapsed());
        pose
    }

    /// A layer as it was, if it shows that; else drawn anew into its texture.
    fn layer(&mut self, pose: Pose, what: What) -> Layer {
        let of = Shown { what, pose, orbit: *self.orbit, settings: *self.settings };
        let old = self.old.iter().position(|l| l.of.what.is_like(&of.what));
        let old = old.map(|i| self.old.swap_remove(i));
        let same = old.as_ref().is_some_and(|l| l.of == of);

        // Whatever was drawn before, handles and bones stand where the character does.
        if of.what == What::Body || !(same || matches!(of.what, What::Bones(_))) {
            let stats = self.live.pose(self.asset, &of.pose);
            self.cost.evaluate_ms += ms(stats.times.pose);
            self.cost.skin_ms += ms(stats.times.deform);
            self.cost.vertices += stats.vertices;
        }
        match old {
            Some(layer) if same => layer,
            old => {
                self.draw(&of.what);
                let (texture, image) = upload(self.ctx, self.buffer, old.map(|l| (l.texture, l.image)));
                Layer { texture, image, of }
            }
        }
    }

    fn draw(&mut self, what: &What) {
        let camera = self.orbit.camera(self.live.center());
        let start = Instant::now();
        let stats = match what {
            What::Bones(chosen) => {
                let desc = BonesDesc { selected: chosen.clone() };
                self.live.draw_bones(self.asset, &desc, &camera, self.settings, self.buffer)
            }
            _ => self.live.draw(self.asset, &camera, [0.0; 4], self.settings, self.buffer),
        };
        self.cost.draw_ms += ms(start.elapsed());
        self.cost.triangles += stats.drawn as usize;
        if let What::Ghost(k, _) = what {
            let color = if *k < 0 { [70, 120, 255] } else { [255, 140, 40] };
            for p in self.buffer.data.chunks_exact_mut(4) {
                (0..3).for_each(|c| p[c] = ((u16::from(p[c]) + 3 * color[c]) / 4) as u8);
            }
        }
    }
}

fn ms(of: std::time::Duration) -> f32 {
    of.as_secs_f32() * 1e3
}

/// A picture as a texture, premultiplied; most pixels are either there or not.
fn upload(
    ctx: &egui::Context,
    picture: &Rgba8,
    old: Option<(TextureHandle, Arc<ColorImage>)>,
) -> (TextureHandle, Arc<ColorImage>) {
    let pixel = |p: &[u8; 4]| match p[3] {
        0 => Color32::TRANSPARENT,
        255 => Color32::from_rgb(p[0], p[1], p[2]),
        _ => Color32::from_rgba_unmultiplied(p[0], p[1], p[2], p[3]),
    };
    // The window has taken the picture before by now, so its memory serves again: new pages cost more than their pixels.
    let (texture, before) = old.unzip();
    let mut pixels = before.and_then(Arc::into_inner).map_or(vec![], |image| image.pixels);
    pixels.clear();
    pixels.extend(picture.data.as_chunks::<4>().0.iter().map(pixel));
    let image = Arc::new(ColorImage::new([picture.width, picture.height], pixels));
    let (data, options) = (ImageData::Color(image.clone()), TextureOptions::LINEAR);
    let texture = match texture {
        Some(mut texture) => {
            texture.set(data, options);
            texture
        }
        None => ctx.load_texture("layer", data, options),
    };
    (texture, image)
}
