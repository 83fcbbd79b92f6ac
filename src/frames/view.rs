//! Which camera films, and how it holds the character in its picture.

use super::framing::Turns;
use crate::scene::CameraError;
use crate::skeleton::BoneId;
use glam::{DVec3, Vec3};

/// Which camera films.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// Around the character, so far away that it fits.
    Orbit {
        /// Radians about +y; 0 looks along −z at a character that faces +z, positive values walk to its left (+x).
        yaw: f32,
        /// Radians above the horizon; ±π/2 looks straight down or up.
        pitch: f32,
        /// Vertical field of view, radians; 0 projects in parallel.
        fov_y: f32,
    },
    /// From a place in the world at another one.
    LookAt {
        /// Where the camera stands, metres.
        eye: DVec3,
        /// What is in the middle of its picture, metres.
        target: DVec3,
        /// Which way is up.
        up: Vec3,
        /// Vertical field of view, radians; 0 projects in parallel, so high that the character fits.
        fov_y: f32,
    },
    /// One of the asset's cameras, by index.
    Mounted(usize),
}

impl Default for View {
    /// Half from the front, a little from above.
    fn default() -> Self {
        Self::Orbit { yaw: 30f32.to_radians(), pitch: 12f32.to_radians(), fov_y: 30f32.to_radians() }
    }
}

/// The vertical axis that an orbiting camera walks around.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Pivot {
    /// Through the origin of the scene: the first bone of the first mesh, at the start of the clip.
    #[default]
    Origin,
    /// Through the middle of the box that holds the character over the whole clip; with [`View::LookAt`] through its target.
    Middle,
    /// Through a point of the world.
    At(DVec3),
}

/// How a camera holds the character in its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramingDesc {
    /// Place the camera anew for each picture, instead of once for the whole clip.
    pub each_frame: bool,
    /// Share of the picture that stays free at each of its sides, 0 to 0.45; cameras with a place of their own have no use for it.
    pub margin: f32,
    /// Larger by this factor, about the picture's middle; whoever asks for more than 1 may lose what is at its sides.
    pub zoom: f32,
    /// Radians by which the camera leans to its right, so that the picture leans to the left.
    pub roll: f32,
    /// The camera keeps its offset to this bone's origin: the bone stays where it is in the picture.
    pub follow: Option<BoneId>,
    /// Which turns of an orbiting camera must be held, too.
    pub turns: Turns,
    /// What it turns around.
    pub pivot: Pivot,
}

impl Default for FramingDesc {
    /// Once for the whole clip, 4 % free at each side.
    fn default() -> Self {
        Self {
            each_frame: false,
            margin: 0.04,
            zoom: 1.0,
            roll: 0.0,
            follow: None,
            turns: Turns::None,
            pivot: Pivot::Origin,
        }
    }
}

impl FramingDesc {
    /// The largest margin.
    pub const MAX_MARGIN: f32 = 0.45;

    /// Share of the picture, from its middle to its edge, that the character may fill.
    pub(super) fn fill(&self) -> f32 {
        1.0 - 2.0 * self.margin
    }
}

/// Why there is no such camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// An index beyond the asset's cameras.
    #[error("there is no camera {camera}; the asset has {count}")]
    Camera {
        /// The index asked for.
        camera: usize,
        /// How many there are.
        count: usize,
    },
    /// A bone beyond the skeleton.
    #[error("there is no bone {bone} to {purpose}; the skeleton has {count}")]
    Bone {
        /// The bone asked for.
        bone: u32,
        /// What it is needed for.
        purpose: &'static str,
        /// How many there are.
        count: usize,
    },
    /// Eye, target and up direction that leave no picture plane.
    #[error(transparent)]
    Direction(#[from] CameraError),
    /// A number that no picture can be framed with.
    #[error("{what} is {found}; expected {expected}")]
    Number {
        /// Which one.
        what: &'static str,
        /// Its value.
        found: f32,
        /// What would do.
        expected: &'static str,
    },
}
