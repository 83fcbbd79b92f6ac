//! Rays from the eye (notes §2.3–2.6).

use super::wave::Path;
use crate::scene::{Camera, Pinhole, Projection};
use glam::{DVec3, Vec3};

/// Where rays start that nothing has sent.
pub(super) const NOTHING: u32 = u32::MAX;

/// A camera for pictures of a size: points of the sensor, `focal` before the eye, along which rays run from the eye or, in
/// parallel projection, straight on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    pub eye: DVec3,
    /// Right, up, backwards.
    pub axes: [DVec3; 3],
    focal: f64,
    /// A pixel's sides on the sensor.
    pixel: [f64; 2],
    size: [f64; 2],
    pixels: [f64; 2],
    parallel: bool,
    near: f64,
}

impl Eye {
    /// Rays of a scene's camera: `t` is the distance along the view direction.
    pub fn of_camera(camera: &Camera, width: usize, height: usize) -> Self {
        let m = &camera.scene_from_view.matrix3;
        let (half, parallel) = match camera.projection {
            Projection::Perspective { fov_y } => ((0.5 * f64::from(fov_y)).tan(), false),
            Projection::Orthographic { height } => (0.5 * f64::from(height), true),
        };
        let size = [2.0 * half * width as f64 / height.max(1) as f64, 2.0 * half];
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(|a| Vec3::from(a).as_dvec3());
        Self::new(camera.eye().as_dvec3(), axes, 1.0, size, [width, height], parallel, f64::from(camera.near))
    }

    /// Rays of the notes: `t = 1` is on the sensor.
    pub fn of_pinhole(c: &Pinhole, width: usize, height: usize) -> Self {
        Self::new(c.eye, c.axes, c.focal, [c.width, c.height], [width, height], false, 1.0)
    }

    fn new(
        eye: DVec3,
        axes: [DVec3; 3],
        focal: f64,
        size: [f64; 2],
        [w, h]: [usize; 2],
        parallel: bool,
        near: f64,
    ) -> Self {
        let pixels = [w as f64, h as f64];
        let pixel = [size[0] / pixels[0], size[1] / pixels[1]];
        Self { eye, axes, focal, pixel, size, pixels, parallel, near }
    }

    /// A ray through a point of the picture, pixels from its top left corner, for a pixel of a tile.
    pub fn path(&self, [x, y]: [f64; 2], place: u32) -> Path {
        let [u, v, w] = self.axes;
        let at = u * (self.size[0] * x / self.pixels[0] - 0.5 * self.size[0])
            + v * (0.5 * self.size[1] - self.size[1] * y / self.pixels[1]);
        let (origin, direction) =
            if self.parallel { (self.eye + at, -w) } else { (self.eye, at - w * self.focal) };
        let [dx, dy] = [u * self.pixel[0], v * -self.pixel[1]].map(|d| d.as_vec3());
        let still = Vec3::ZERO;
        Path {
            place,
            bounce: 0,
            origin,
            direction,
            near: self.near,
            weight: DVec3::ONE,
            cover: 1.0,
            left: NOTHING,
            spread: if self.parallel { [dx, dy, still, still] } else { [still, still, dx, dy] },
        }
    }
}
