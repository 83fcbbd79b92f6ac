//! Triangles to pixels: a visibility buffer first, then shading once a pixel and surface, many at a time.
//!
//! 1. `vertex`: each vertex to the picture plane, once, in 1/256 pixels.
//! 2. `setup`: each triangle is culled, clipped, and put into the lists of the 64×64 tiles that it meets; triangles of a
//!    few pixels become single samples there and then.
//! 3. `tile`: each tile finds what is visible at each sample (`fill`), lists it by triangle (`scan`), and shades that
//!    (`resolve`); `colors` and `encode` write.
//!
//! Samples are decided in integers and ties by the order of submission, so the picture does not depend on the number of
//! threads, on the vector instructions that the machine has, or on the order in which tiles are drawn.
//!
//! At four samples a pixel is shaded once for each surface in it and not for each triangle (`merge`); what is covered stays
//! exact. A walking figure of 2,100 visible triangles in 30,000 pixels takes 30,000 evaluations then instead of 41,800. Most of the pixels
//! that several triangles share are found out about without a branch (`mend`).
//!
//! What else makes it fast, measured on that figure: samples of a pixel side by side, only touched 8×8 blocks cleared and read,
//! pixels listed by triangle through the whole tile, and colours encoded as they are shaded took 26 % off; texels decoded once,
//! four bytes each and two in one load (`sample`), another 15 %.
//!
//! What is lit by nothing but lamps has kernels that are as wide as the machine (`clay`). Opaque triangles at four samples are walked with
//! as many lanes (7 % of a figure's picture); at one sample a pixel most are narrower, and eight are faster.
//!
//! Two things slow the processor where it would do four instructions a cycle. Numbers that are looked up one by one and computed with at
//! once, which the compiler then leaves single: they go through memory (`setup`, `surface`), and better wait there (`sample`). And long
//! loops, of which it sees one turn at a time, with operations that wait for each other: `clay` takes a point through three short ones and
//! `scan` lists pixels after all triangles of the tile are walked, not while. A sphere of 10,000 triangles in 1920×1080 went from 5.3 to
//! 3.5 ms with this and with a background that is cleared a band at a time; listing while walking alone costs 6 % of that.

mod blend;
mod channels;
mod clay;
mod clip;
mod colors;
mod encode;
mod fill;
mod frame;
mod mend;
mod merge;
mod resolve;
mod scan;
mod setup;
mod surface;
mod tile;
mod vertex;
mod window;

pub use super::channel::IdImage;
use super::channel::{Channel, Channels};
use super::{Settings, Window, each};
use crate::image::{Image, Rgba8};
use crate::math::simd::{self, Isa};
use crate::scene::Scene;
use encode::Target;
use frame::Frame;
use setup::Bins;
use tile::TileScratch;
use window::View;

/// Triangles from which on another thread is worth its start.
const SHARE: usize = 1 << 14;

/// Pixels along a tile's side.
pub(crate) const TILE: usize = 64;

/// What was done for a picture, counted exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Stats {
    /// Triangles submitted.
    pub triangles: u64,
    /// Vertices carried to the picture plane.
    pub vertices: u64,
    /// Triangles left out because a coordinate is not finite, or because their object's lists do not fit its mesh.
    pub skipped: u64,
    /// Triangles seen from behind or edge-on.
    pub culled: u64,
    /// Triangles whose bounds hold no sample of the picture, or that lie before the near plane.
    pub missed: u64,
    /// Triangles cut by the near plane or by the bounds of the fixed-point range.
    pub clipped: u64,
    /// Triangles drawn: what is left of `triangles` after `skipped`, `culled` and `missed`.
    pub drawn: u64,
    /// Samples where something opaque is seen.
    pub samples: u64,
    /// Evaluations of the shading equation: one for each surface in a pixel, one for each layer of what blends.
    pub shaded: u64,
}

impl std::ops::AddAssign for Stats {
    fn add_assign(&mut self, o: Self) {
        self.triangles += o.triangles;
        self.vertices += o.vertices;
        self.skipped += o.skipped;
        self.culled += o.culled;
        self.missed += o.missed;
        self.clipped += o.clipped;
        self.drawn += o.drawn;
        self.samples += o.samples;
        self.shaded += o.shaded;
    }
}

/// Draws scenes; keeps its buffers from one picture to the next.
///
/// ```
/// use glam::Vec3;
/// use sinew::image::Rgba8;
/// use sinew::mesh::{Mesh, MeshData};
/// use sinew::render::{Settings, raster::Rasterizer};
/// use sinew::scene::{Camera, Material, Object, Projection, Scene};
///
/// let positions = vec![Vec3::new(-2.0, -2.0, 0.0), Vec3::new(2.0, -2.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
/// let mesh = Mesh::new(MeshData { positions, triangles: vec![[0, 1, 2]], ..Default::default() }).unwrap();
/// let object = Object {
///     mesh: &mesh, positions: &mesh.positions, normals: &[], tangents: &[], material: 0, mirrored: false, labels: &[],
/// };
/// let camera = Camera::look_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, Projection::Orthographic { height: 1.0 });
/// let scene = Scene {
///     camera: camera.unwrap(), ambient: Vec3::ONE, lights: vec![], style: Default::default(), background: [0.0; 4],
///     objects: vec![object], shapes: &[], materials: &[Material::default()], textures: &[],
/// };
/// let mut picture = Rgba8::default();
/// let settings = Settings { width: 4, height: 4, samples: 4, threads: 1 };
/// let stats = Rasterizer::default().draw(&scene, &settings, &mut picture);
/// assert_eq!((stats.drawn, stats.shaded, stats.samples), (1, 16, 64));
/// // sRGB of 0.8.
/// assert_eq!(picture.data[..4], [231, 231, 231, 255]);
/// ```
#[derive(Debug, Default)]
pub struct Rasterizer {
    isa: Isa,
    window: Option<Window>,
    vertices: vertex::Vertices,
    bins: Vec<Bins>,
    tiles: Vec<TileScratch>,
}

impl Rasterizer {
    /// One that uses the given build of its kernels; the pictures are the same.
    pub fn with_isa(isa: Isa) -> Self {
        Self { isa, ..Self::default() }
    }

    /// Draw this part of pictures alone, or all of them again for `None`: `settings` go on to speak of the whole, outputs take the
    /// window's size, and its pixels are the whole picture's, bit for bit. What of it lies outside the picture is left out.
    pub fn set_window(&mut self, window: Option<Window>) {
        self.window = window;
    }

    /// What [`Rasterizer::set_window`] was told last.
    pub fn window(&self) -> Option<Window> {
        self.window
    }

    /// Draw to 8-bit sRGB with straight alpha; `out` takes the size of `settings`.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw(&mut self, scene: &Scene, settings: &Settings, out: &mut Rgba8) -> Stats {
        let view = View::new(self.window, settings);
        (out.width, out.height) = (view.tiles.width, view.tiles.height);
        out.data.resize(4 * out.width * out.height, 0);
        let stats = self.paint(scene, settings, view.tiles, encode::rgba8_bands(out));
        view.cut(4, &mut out.data);
        [out.width, out.height] = view.size();
        stats
    }

    /// Draw to linear light with premultiplied alpha; `out` takes the size of `settings`.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_linear(&mut self, scene: &Scene, settings: &Settings, out: &mut Image) -> Stats {
        let view = View::new(self.window, settings);
        (out.width, out.height) = (view.tiles.width, view.tiles.height);
        out.pixels.resize(out.width * out.height, [0.0; 4]);
        let stats = self.paint(scene, settings, view.tiles, encode::linear_bands(out));
        view.cut(1, &mut out.pixels);
        [out.width, out.height] = view.size();
        stats
    }

    /// Draw what is where, at pixel centres; masks and transparency count as in a picture, but nothing that blends is
    /// in it.
    ///
    /// # Panics
    /// If `settings` do not pass [`Settings::check`].
    pub fn draw_ids(&mut self, scene: &Scene, settings: &Settings, out: &mut IdImage) -> Stats {
        let view = View::new(self.window, settings);
        let n = view.tiles.width * view.tiles.height;
        (out.width, out.height) = (view.tiles.width, view.tiles.height);
        out.objects.resize(n, 0);
        out.triangles.resize(n, 0);
        out.depth.resize(n, f32::INFINITY);
        let settings = Settings { samples: 1, ..*settings };
        let stats = self.paint(scene, &settings, view.tiles, encode::id_bands(out));
        view.cut(1, &mut out.objects);
        view.cut(1, &mut out.triangles);
        view.cut(1, &mut out.depth);
        [out.width, out.height] = view.size();
        stats
    }

    /// Draw what the pixels show beside their colour: the channels that are asked for, and objects always; nothing that
    /// blends is in them. `out` takes the size of `settings`.
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
        let view = View::new(self.window, settings);
        out.reset(view.tiles.width, view.tiles.height, wanted);
        let stats = self.paint(scene, settings, view.tiles, encode::channel_bands(out));
        view.cut(1, &mut out.objects);
        view.cut(1, &mut out.depth);
        view.cut(1, &mut out.normals);
        view.cut(1, &mut out.labels);
        view.cut(1, &mut out.positions);
        view.cut(1, &mut out.uvs);
        [out.width, out.height] = view.size();
        stats
    }

    /// All stages; `bands` are the rows of tiles of the output, which shows the whole tiles `tiles`.
    fn paint(&mut self, scene: &Scene, settings: &Settings, tiles: Window, bands: Vec<Target>) -> Stats {
        settings.check().expect("settings are checked by the caller");
        let frame = Frame::new(self.isa, scene, settings);
        let threads = settings.threads.max(1);
        let mut stats = frame.stats;
        if bands.is_empty() {
            return stats;
        }

        // Carry the vertices, then sort the triangles into tiles: one contiguous share of the list a thread.
        self.vertices.fill(self.isa, &frame, threads);
        self.bins.resize_with(threads.max(self.bins.len()), Bins::default);
        let (isa, vertices) = (self.isa, &self.vertices);
        let shares = threads.min(1 + frame.triangle_count as usize / SHARE);
        let tasks: Vec<(usize, &mut Bins)> = self.bins[..shares].iter_mut().enumerate().collect();
        each(tasks, |(k, bins)| bins.fill(isa, &frame, vertices, k, shares));

        // Draw the rows of tiles.
        self.tiles.resize_with(threads.max(self.tiles.len()), TileScratch::default);
        let bins = &self.bins[..shares];
        let rows = std::sync::Mutex::new((tiles.y / TILE..).zip(bands));
        let workers: Vec<&mut TileScratch> = self.tiles[..threads].iter_mut().collect();
        each(workers, |scratch| {
            scratch.stats = Stats::default();
            loop {
                let next = rows.lock().expect("no worker panics").next();
                let Some((row, mut target)) = next else { break };
                simd::run(isa, tile::Row { frame: &frame, bins, row, tiles, scratch, target: &mut target });
            }
        });
        bins.iter().for_each(|b| stats += b.stats);
        self.tiles[..threads].iter().for_each(|t| stats += t.stats);
        stats
    }
}
