//! A window of a picture: the whole's own tiles, as far as they show any of it, and then the pixels that do.
//!
//! Vertices keep their places in the whole picture, and tiles theirs in its grid, so nothing is computed otherwise than for the whole and
//! the window's pixels are the whole's, bit for bit.

use super::TILE;
use crate::render::{Settings, Window};

/// What is asked for, and the whole tiles around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    window: Window,
    pub tiles: Window,
}

impl View {
    /// All of a picture for `None`.
    pub fn new(window: Option<Window>, settings: &Settings) -> Self {
        let (width, height) = (settings.width, settings.height);
        let whole = Window { x: 0, y: 0, width, height };
        let Some(window) = window else { return Self { window: whole, tiles: whole } };
        let window = window.within(width, height);
        let (x, y) = (window.x / TILE * TILE, window.y / TILE * TILE);
        let end =
            |start: usize, size: usize| if size == 0 { start } else { (start + size).next_multiple_of(TILE) };
        let (right, bottom) = (end(window.x, window.width), end(window.y, window.height));
        // A window without pixels has no tiles.
        let tiles = match window.width.min(window.height) {
            0 => Window { x, y, width: 0, height: 0 },
            _ => Window { x, y, width: right - x, height: bottom - y }.within(width, height),
        };
        Self { window, tiles }
    }

    /// Sides of what comes out.
    pub fn size(&self) -> [usize; 2] {
        [self.window.width, self.window.height]
    }

    /// Leave of a list with `n` entries a pixel of the tiles those of the window.
    pub fn cut<T: Copy>(&self, n: usize, list: &mut Vec<T>) {
        let (w, t) = (self.window, self.tiles);
        if w == t || list.is_empty() {
            return;
        }
        Window { x: w.x - t.x, y: w.y - t.y, ..w }.cut(n, t.width, list);
    }
}
