//! Scenes to pictures.

mod shade;

pub mod raster;

use crate::image::{Image, Rgba8};
use crate::scene::Scene;

/// How a picture is made; what is on it is the [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Coverage samples a pixel: 1 or 4.
    pub samples: u8,
    /// Worker threads; the picture does not depend on them.
    pub threads: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { width: 512, height: 512, samples: 4, threads: 1 }
    }
}
