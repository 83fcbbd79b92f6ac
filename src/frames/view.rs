//! Where the camera stands: orbiting the character so that all of it is seen, or riding on a bone.

use crate::scene::{Camera, Projection};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// Which camera films.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// Around the character, so far away that it fits.
    Orbit {
        /// Radians about +y; 0 looks along −z at a character that faces +z, positive values walk to its left (+x).
        yaw: f32,
        /// Radians above the horizon.
        pitch: f32,
        /// Vertical field of view, radians; 0 projects in parallel.
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

/// The asset has no such camera.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no camera {camera}; the asset has {count}")]
pub struct ViewError {
    /// The index asked for.
    pub camera: usize,
    /// How many there are.
    pub count: usize,
}

/// The nearest eye, of known direction, that sees every point it was shown.
///
/// In the camera's axes an eye `e` sees the point `p` when `|p_x − e_x| ≤ s_x (e_z − p_z)`, `s` being the slope of the picture's
/// edge, and so in y. Each edge is a half-space for `e`, so four running maxima hold all that many points say.
#[derive(Clone, Debug, PartialEq)]
pub struct Framing {
    scene_from_view: Mat3A,
    projection: Projection,
    slope: [f32; 2],
    /// Maxima of `x + s_x z`, `−x + s_x z`, `y + s_y z`, `−y + s_y z`.
    edges: [f32; 4],
    low: Vec3A,
    high: Vec3A,
}

impl Framing {
    /// Vertices looked at, over all moments of a clip: about a quarter of a second's work.
    pub const VERTICES: usize = 20_000_000;
    /// Moments that are looked at however large the mesh is.
    pub(super) const FEWEST: usize = 97;
    /// Moments that are looked at at most: forty minutes' worth.
    pub(super) const MOST: usize = 57_601;
    /// Share of the picture, from its middle to its edge, that the character may fill.
    const FILL: f32 = 0.92;

    /// A camera turned by `yaw` and `pitch` (see [`View::Orbit`]) for a picture of that `aspect` (width over height).
    pub fn new(yaw: f32, pitch: f32, fov_y: f32, aspect: f32) -> Self {
        let scene_from_view = Mat3A::from_rotation_y(yaw) * Mat3A::from_rotation_x(-pitch);
        let (projection, slope) = if fov_y > 0.0 {
            let s = (0.5 * fov_y).tan() * Self::FILL;
            (Projection::Perspective { fov_y }, [s * aspect, s])
        } else {
            (Projection::Orthographic { height: 1.0 }, [aspect * Self::FILL, Self::FILL])
        };
        let (low, high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        Self { scene_from_view, projection, slope, edges: [f32::NEG_INFINITY; 4], low, high }
    }

    /// Keep these points (scene space) in the picture; what is not finite is passed over.
    pub fn include(&mut self, points: &[Vec3]) {
        let view_from_scene = self.scene_from_view.transpose();
        let [sx, sy] = self.slope;
        for p in points.iter().filter(|p| p.is_finite()) {
            let p = view_from_scene * Vec3A::from(*p);
            let e = [p.x + sx * p.z, sx * p.z - p.x, p.y + sy * p.z, sy * p.z - p.y];
            for (max, e) in self.edges.iter_mut().zip(e) {
                *max = max.max(e);
            }
            self.low = self.low.min(p);
            self.high = self.high.max(p);
        }
    }

    /// The camera that sees all points; a unit box around the origin where there were none.
    pub fn camera(&self) -> Camera {
        if !self.low.is_finite() {
            let mut unit = self.clone();
            (unit.low, unit.high) = (Vec3A::splat(f32::MAX), Vec3A::splat(f32::MIN));
            unit.include(&[Vec3::splat(-0.5), Vec3::splat(0.5)]);
            return unit.camera();
        }
        // A lone point has no size; anything will do that is not zero.
        let extent = (self.high - self.low).max_element();
        let size = extent.max(self.high.abs().max_element() * 1e-4).max(1e-18);
        let middle = (self.low + self.high) * 0.5;
        let (eye, projection) = match self.projection {
            Projection::Perspective { .. } => {
                let [a, b, c, d] = self.edges;
                let z = ((a + b) / (2.0 * self.slope[0])).max((c + d) / (2.0 * self.slope[1]));
                let eye = Vec3A::new((a - b) * 0.5, (c - d) * 0.5, z.max(self.high.z + 1e-2 * size));
                (eye, self.projection)
            }
            Projection::Orthographic { .. } => {
                let extent = (self.high - self.low).max(Vec3A::splat(1e-3 * size));
                let height = (extent.x / self.slope[0]).max(extent.y / self.slope[1]);
                (middle.with_z(self.high.z + size), Projection::Orthographic { height })
            }
        };
        let distance = eye.z - middle.z;
        Camera {
            scene_from_view: Affine3A {
                matrix3: self.scene_from_view,
                translation: self.scene_from_view * eye,
            },
            projection,
            // Between the moments that were looked at the character may come nearer.
            near: distance * 1e-3,
            far: distance + 2.0 * size,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest |x|/w or |y|/w of the points in the picture.
    fn fill(f: &Framing, points: &[Vec3], aspect: f32) -> f32 {
        let clip = f.camera().clip_from_scene(aspect);
        let edge = |p: &Vec3| {
            let q = clip * p.extend(1.0);
            assert!(q.w > 0.0);
            (q.x / q.w).abs().max((q.y / q.w).abs())
        };
        points.iter().map(edge).fold(0.0, f32::max)
    }

    #[test]
    fn all_points_are_inside_and_some_touch_the_margin() {
        let mut rng = crate::test_rng::Rng::new(5);
        for k in 0..200 {
            let scale = 10_f64.powf(rng.range(-3.0, 3.0));
            let mut p = || Vec3::from_array([0; 3].map(|_| (scale * rng.range(-1.0, 3.0)) as f32));
            let points: Vec<Vec3> = (0..50).map(|_| p()).collect();
            let aspect = rng.range(0.3, 3.0) as f32;
            let fov = if k % 4 == 0 { 0.0 } else { rng.range(0.05, 2.0) as f32 };
            let mut f = Framing::new(rng.range(-7.0, 7.0) as f32, rng.range(-1.5, 1.5) as f32, fov, aspect);
            f.include(&points);
            let fill = fill(&f, &points, aspect);
            assert!(fill < Framing::FILL + 2e-3, "{k}: {fill}");
            // Only a very wide angle would want to stand inside the points.
            assert!(fov > 1.0 || fill > Framing::FILL - 2e-3, "{k}: {fill}");
        }
    }

    #[test]
    fn nothing_or_a_lone_point_still_gives_a_camera() {
        for points in [vec![], vec![Vec3::ZERO], vec![Vec3::splat(1e6)], vec![Vec3::NAN]] {
            for fov in [0.0, 0.6] {
                let mut f = Framing::new(0.5, 0.3, fov, 1.0);
                f.include(&points);
                let c = f.camera();
                assert!(c.scene_from_view.is_finite() && c.near > 0.0 && c.far > c.near, "{points:?} {c:?}");
            }
        }
    }

    #[test]
    fn yaw_zero_looks_at_the_face_and_positive_yaw_walks_to_its_left() {
        let eye = |yaw, pitch| {
            let mut f = Framing::new(yaw, pitch, 0.6, 1.0);
            f.include(&[Vec3::splat(-1.0), Vec3::splat(1.0)]);
            f.camera().eye()
        };
        assert!(eye(0.0, 0.0).z > 1.0);
        assert!(eye(1.0, 0.0).x > 1.0);
        assert!(eye(0.0, 1.0).y > 1.0);
    }
}
