//! Scenes to pictures.

pub mod accel;
pub mod backdrop;
pub mod channel;
pub mod footprint;
mod material;
pub mod outline;
mod painter;
mod sample;
mod shade;
pub mod shadow;
mod styled;
mod varying;

// A loop that counts lanes is what becomes one vector instruction; iterators do not always.
#[allow(clippy::needless_range_loop)]
pub mod raster;

#[allow(clippy::needless_range_loop)]
pub mod ray;

pub use painter::{Painter, Renderer, Watch};

/// How a picture is made; what is on it is the [`Scene`](crate::scene::Scene).
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

/// Settings that no picture can be made with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Larger than a rasterizer's fixed-point range.
    #[error("a picture of {width}×{height} pixels is too large: at most {max} along each side", max = Settings::MAX_SIZE)]
    Size {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Neither 1 nor 4.
    #[error("{found} samples a pixel: 1 or 4 are possible")]
    Samples {
        /// What was asked for.
        found: u8,
    },
}

/// A part of a picture, in pixels from its top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Window {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Window {
    /// What of it lies in a picture of these sides.
    ///
    /// ```
    /// use sinew::render::Window;
    /// let w = Window { x: 6, y: 0, width: 4, height: 2 };
    /// assert_eq!(w.within(8, 8), Window { width: 2, ..w });
    /// assert_eq!(w.within(4, 4), Window { x: 4, width: 0, ..w });
    /// ```
    pub fn within(self, width: usize, height: usize) -> Self {
        let (x, y) = (self.x.min(width), self.y.min(height));
        Self { x, y, width: self.width.min(width - x), height: self.height.min(height - y) }
    }

    /// Leave of a list with `n` entries a pixel, in rows of `columns` pixels, those of the window.
    pub(crate) fn cut<T: Copy>(self, n: usize, columns: usize, list: &mut Vec<T>) {
        for row in 0..self.height {
            let from = n * ((self.y + row) * columns + self.x);
            list.copy_within(from..from + n * self.width, n * row * self.width);
        }
        list.truncate(n * self.width * self.height);
    }
}

impl Settings {
    /// The most pixels along a side.
    pub const MAX_SIZE: usize = 16384;

    /// Whether a picture can be made so. A picture without pixels can.
    ///
    /// # Errors
    /// [`SettingsError`]: too large, or a number of samples that is neither 1 nor 4.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.width > Self::MAX_SIZE || self.height > Self::MAX_SIZE {
            return Err(SettingsError::Size { width: self.width, height: self.height });
        }
        match self.samples {
            1 | 4 => Ok(()),
            found => Err(SettingsError::Samples { found }),
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self { width: 512, height: 512, samples: 4, threads: 1 }
    }
}

/// Do every task, the first on this thread and each other one on its own.
fn each<T: Send>(tasks: Vec<T>, work: impl Fn(T) + Sync) {
    std::thread::scope(|s| {
        let mut tasks = tasks.into_iter();
        let own = tasks.next();
        for task in tasks {
            s.spawn(|| work(task));
        }
        own.into_iter().for_each(&work);
    });
}

/// Samples of a pixel that has four, in 1/256 pixels from its centre: a rotated grid, so that near-horizontal and near-vertical edges
/// both get four steps.
pub(crate) const ROTATED: [[i32; 2]; 4] = [[-32, -96], [96, -32], [-96, 32], [32, 96]];
