//! Where samples are gathered: tiles, from the middle of the picture outwards, pass by pass.

use super::sampler;
use super::stage::{Hit, Real, Stage};
use super::wave::{Here, Path, Wave};
use super::{Control, Outcome, Progress, RayCount, RaySettings};
use crate::render::Window;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Pixels along a tile's side.
const TILE: usize = 32;

/// Samples that a pixel has at least before it may stop: fewer have no spread to speak of.
const LEAST: u32 = 16;

/// The pixels of a tile.
#[derive(Debug, Default)]
pub(super) struct Tile {
    corner: [usize; 2],
    size: [usize; 2],
    /// Light, premultiplied, and alpha, summed over samples.
    sums: Vec<[f64; 4]>,
    counts: Vec<u32>,
    /// Sums of brightness, as far as it shows, and of its square; empty if nobody asks for them.
    moments: Vec<[f64; 2]>,
    /// Pixels that need more; empty if all do.
    active: Vec<bool>,
}

/// All tiles that meet a window.
#[derive(Debug, Default)]
pub(super) struct Film {
    tiles: Vec<Tile>,
}

impl Film {
    /// Empty tiles around a window of a picture.
    pub fn reset(&mut self, window: Window, [width, height]: [usize; 2]) {
        self.tiles.clear();
        let (right, bottom) = (window.x + window.width, window.y + window.height);
        let down = |n: usize| n / TILE * TILE;
        for y in (down(window.y)..bottom).step_by(TILE) {
            for x in (down(window.x)..right).step_by(TILE) {
                let size = [TILE.min(width - x), TILE.min(height - y)];
                let n = size[0] * size[1];
                self.tiles.push(Tile {
                    corner: [x, y],
                    size,
                    sums: vec![[0.0; 4]; n],
                    counts: vec![0; n],
                    ..Tile::default()
                });
            }
        }
        let middle = [window.x + window.width / 2, window.y + window.height / 2];
        self.tiles.sort_by_key(|t| {
            let off = |k: usize| (t.corner[k] + t.size[k] / 2).abs_diff(middle[k]);
            (off(0) * off(0) + off(1) * off(1), t.corner[1], t.corner[0])
        });
    }

    /// Draw, pass by pass: one sample a pixel, then as many again as there are, up to 16 at a time.
    pub fn expose<R: Real>(
        &mut self,
        stage: &Stage<R>,
        settings: &RaySettings,
        waves: &mut [Wave],
        known: impl Fn(&Stage<R>, &Path, [usize; 2]) -> Option<Option<Hit>> + Sync,
        control: &mut Control,
    ) -> Outcome {
        let wanted = settings.samples.max(1);
        let (stop, control) = (AtomicBool::new(false), Mutex::new(control));
        let (mut done, tiles) = (0, self.tiles.len());
        waves.iter_mut().for_each(|w| w.count = RayCount::default());
        while done < wanted && !stop.load(Ordering::Relaxed) {
            let n = done.clamp(1, 16).min(wanted - done);
            let finished = AtomicUsize::new(0);
            let queue = Mutex::new(self.tiles.iter_mut());
            let work = |wave: &mut Wave| {
                while !stop.load(Ordering::Relaxed) {
                    let Some(tile) = queue.lock().expect("no worker panics").next() else { break };
                    for index in done..done + n {
                        tile.sample(stage, settings, index, wave, &known);
                    }
                    tile.settle(settings);
                    let tiles_done = finished.fetch_add(1, Ordering::Relaxed) + 1;
                    let progress = Progress { samples: done, pass: n, wanted, tiles_done, tiles };
                    let mut control = control.lock().expect("no worker panics");
                    if (*control)(&progress).is_break() {
                        stop.store(true, Ordering::Relaxed);
                    }
                }
            };
            crate::render::each(waves.iter_mut().collect(), work);
            if finished.into_inner() == tiles {
                done += n;
            }
            if settings.error.is_some() && self.tiles.iter().all(|t| !t.active.contains(&true)) {
                break;
            }
        }
        let mut count = RayCount::default();
        waves.iter().for_each(|w| count += w.count);
        Outcome { samples: done, count }
    }

    /// Show each pixel of the window: its place in it, light premultiplied and alpha.
    pub fn each_pixel(&self, window: Window, mut show: impl FnMut(usize, [f64; 4])) {
        for tile in &self.tiles {
            for (i, (sum, &n)) in tile.sums.iter().zip(&tile.counts).enumerate() {
                let (x, y) = (tile.corner[0] + i % tile.size[0], tile.corner[1] + i / tile.size[0]);
                let (Some(x), Some(y)) = (x.checked_sub(window.x), y.checked_sub(window.y)) else { continue };
                if x < window.width && y < window.height {
                    let scale = f64::from(n.max(1));
                    show(y * window.width + x, sum.map(|s| s / scale));
                }
            }
        }
    }
}

impl Tile {
    fn needs(&self, place: usize) -> bool {
        self.active.get(place).is_none_or(|a| *a)
    }

    /// One more sample of each pixel that needs it.
    fn sample<R: Real>(
        &mut self,
        stage: &Stage<R>,
        settings: &RaySettings,
        index: u32,
        wave: &mut Wave,
        known: &impl Fn(&Stage<R>, &Path, [usize; 2]) -> Option<Option<Hit>>,
    ) {
        let width = self.size[0];
        let pixel = |place: usize| [self.corner[0] + place % width, self.corner[1] + place / width];
        wave.sums.clear();
        wave.sums.resize(self.sums.len(), [0.0; 4]);
        wave.paths.clear();
        for place in (0..self.sums.len()).filter(|&p| self.needs(p)) {
            let [x, y] = pixel(place);
            let [dx, dy] = match settings.samples {
                0 | 1 => [0.5; 2],
                _ => sampler::sample(settings.seed, [x as u32, y as u32], index, 0),
            };
            wave.paths.push(stage.eye.path([x as f64 + dx, y as f64 + dy], place as u32));
        }
        let here = Here { settings, corner: self.corner, width, index };
        wave.run(stage, here, |path| known(stage, path, pixel(path.place as usize)));
        for place in 0..self.sums.len() {
            if !self.needs(place) {
                continue;
            }
            let light = wave.sums[place];
            for c in 0..4 {
                self.sums[place][c] += light[c];
            }
            self.counts[place] += 1;
            if settings.error.is_some() {
                self.moments.resize(self.sums.len(), [0.0; 2]);
                let shown = light[..3].iter().map(|c| c.clamp(0.0, 1.0)).sum::<f64>() / 3.0;
                self.moments[place][0] += shown;
                self.moments[place][1] += shown * shown;
            }
        }
    }

    /// Which pixels need more: those whose standard error, or a neighbour's in the tile, is above the one that is asked for.
    fn settle(&mut self, settings: &RaySettings) {
        let Some(error) = settings.error else { return };
        let [w, h] = self.size;
        let open = |p: usize| {
            let (n, [sum, square]) = (f64::from(self.counts[p]), self.moments[p]);
            let spread = (square - sum * sum / n).max(0.0) / (n - 1.0).max(1.0);
            self.counts[p] < LEAST || spread / n > error * error
        };
        let open: Vec<bool> = (0..w * h).map(open).collect();
        self.active.resize(w * h, true);
        for p in 0..w * h {
            let (x, y) = (p % w, p / w);
            let mut near = (y.saturating_sub(1)..(y + 2).min(h))
                .flat_map(|j| (x.saturating_sub(1)..(x + 2).min(w)).map(move |i| j * w + i));
            self.active[p] = near.any(|q| open[q]);
        }
    }
}

/// Goes on to the end.
pub fn undisturbed(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
