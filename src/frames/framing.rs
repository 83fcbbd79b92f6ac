//! The nearest eye that sees all it must.

use super::fit::Sight;
use crate::scene::{Camera, Projection};
use glam::{Affine3A, Mat3A, Vec3, Vec3A, Vec4};
use std::f32::consts::TAU;

/// Which turns of the camera around its axis a framing holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Turns {
    /// No turn: the character may leave the picture when the camera walks around it.
    #[default]
    None,
    /// `n` directions, equally spread, the first without a turn: sheets. Beyond 64 they are taken as all.
    Each(u32),
    /// Every turn: turntables.
    All,
}

/// The nearest eye, of known direction, that sees every point it was shown.
///
/// In the camera's axes an eye `e` sees the point `p` when `|p_x − e_x| ≤ s_x (e_z − p_z)`, `s` being the slope of the picture's
/// edge, and so in y. Each edge is a half-space for `e`, so four running maxima hold all that many points say.
///
/// A camera that walks around the vertical axis sees each point anywhere on a circle. The farthest that a circle of radius `r` at
/// height `y` reaches along a direction `n` is `n_y y + r √(n_x² + n_z²)`, so that all turns together cost no more than one.
#[derive(Clone, Debug, PartialEq)]
pub struct Framing {
    scene_from_view: Mat3A,
    projection: Projection,
    slope: [f32; 2],
    turns: Turns,
    axis: Vec3A,
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
    /// Share of the picture, from its middle to its edge, that the character may fill if nothing else is asked for.
    pub(super) const FILL: f32 = 0.92;
    /// Directions that are looked at one by one.
    const MOST_DIRECTIONS: u32 = 64;

    /// A camera turned by `yaw` and `pitch` (see [`View::Orbit`](super::View::Orbit)) for a picture of that `aspect` (width over
    /// height).
    pub fn new(yaw: f32, pitch: f32, fov_y: f32, aspect: f32) -> Self {
        Self::along(orbit_axes(yaw, pitch, 0.0), fov_y, aspect, Self::FILL)
    }

    /// A camera with these axes; points fill `fill` of the picture's half.
    pub(super) fn along(scene_from_view: Mat3A, fov_y: f32, aspect: f32, fill: f32) -> Self {
        let (projection, slope) = if fov_y > 0.0 {
            let s = (0.5 * fov_y).tan() * fill;
            (Projection::Perspective { fov_y }, [s * aspect, s])
        } else {
            (Projection::Orthographic { height: 1.0 }, [aspect * fill, fill])
        };
        let (low, high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        Self {
            scene_from_view,
            projection,
            slope,
            turns: Turns::None,
            axis: Vec3A::ZERO,
            edges: [f32::NEG_INFINITY; 4],
            low,
            high,
        }
    }

    /// Hold these turns around the vertical axis through `axis` (scene space).
    pub fn turning(self, turns: Turns, axis: Vec3) -> Self {
        let turns = match turns {
            Turns::Each(0) => Turns::None,
            Turns::Each(n) if n > Self::MOST_DIRECTIONS => Turns::All,
            turns => turns,
        };
        Self { turns, axis: axis.into(), ..self }
    }

    /// Keep these points (scene space) in the picture; what is not finite is passed over.
    pub fn include(&mut self, points: &[Vec3]) {
        match self.turns {
            Turns::None | Turns::Each(1) => self.include_at(points, 0.0),
            Turns::Each(n) => {
                (0..n).for_each(|k| self.include_at(points, TAU * k as f32 / n as f32));
            }
            Turns::All => self.include_circles(points),
        }
    }

    /// Keep points in the picture after the camera walked on by `turn`.
    fn include_at(&mut self, points: &[Vec3], turn: f32) {
        let back = Mat3A::from_rotation_y(-turn);
        let view_from_scene = self.scene_from_view.transpose() * back;
        let shift = self.scene_from_view.transpose() * (self.axis - back * self.axis);
        let [sx, sy] = self.slope;
        let (slope, sign) = (Vec4::new(sx, sx, sy, sy), Vec4::new(1.0, -1.0, 1.0, -1.0));
        // All edges at once, and the maxima in registers: this sees every vertex at every moment.
        let (mut edges, mut low, mut high) = (Vec4::from_array(self.edges), self.low, self.high);
        for p in points.iter().filter(|p| p.is_finite()) {
            let p = view_from_scene * Vec3A::from(*p) + shift;
            edges = (Vec4::new(p.x, p.x, p.y, p.y) * sign + slope * p.z).max(edges);
            low = p.min(low);
            high = p.max(high);
        }
        (self.edges, self.low, self.high) = (edges.to_array(), low, high);
    }

    /// Keep in the picture all circles that points run on.
    fn include_circles(&mut self, points: &[Vec3]) {
        let [sx, sy] = self.slope;
        let m = &self.scene_from_view;
        // Four edges, then both ways along each of the three axes.
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let normals = [sx * z + x, sx * z - x, sy * z + y, sy * z - y, x, y, z, -x, -y, -z];
        let reach = normals.map(|n| (n.dot(self.axis), n.y, n.x.hypot(n.z)));
        let mut far = [f32::NEG_INFINITY; 10];
        for p in points.iter().filter(|p| p.is_finite()) {
            let q = Vec3A::from(*p) - self.axis;
            let radius = (q.x * q.x + q.z * q.z).sqrt();
            for (far, (start, up, out)) in far.iter_mut().zip(reach) {
                *far = far.max(start + up * q.y + out * radius);
            }
        }
        for (max, far) in self.edges.iter_mut().zip(far) {
            *max = max.max(far);
        }
        self.high = self.high.max(Vec3A::new(far[4], far[5], far[6]));
        self.low = self.low.min(-Vec3A::new(far[7], far[8], far[9]));
    }

    /// The camera that sees all points; a unit box around the origin where there were none.
    pub fn camera(&self) -> Camera {
        let some = self.or_unit();
        let (size, middle) = (some.size(), (some.low + some.high) * 0.5);
        let (eye, projection) = match some.projection {
            Projection::Perspective { .. } => {
                let [a, b, c, d] = some.edges;
                let z = ((a + b) / (2.0 * some.slope[0])).max((c + d) / (2.0 * some.slope[1]));
                let eye = Vec3A::new((a - b) * 0.5, (c - d) * 0.5, z.max(some.high.z + 1e-2 * size));
                (eye, some.projection)
            }
            Projection::Orthographic { .. } => some.parallel(middle, (some.high - some.low) * 0.5),
        };
        some.at(eye, projection, eye.z - middle.z)
    }

    /// The parallel camera that has `eye` (scene space) in the middle of its picture and sees all points.
    pub(super) fn parallel_from(&self, eye: Vec3) -> Camera {
        let some = self.or_unit();
        let eye = some.scene_from_view.transpose() * Vec3A::from(eye);
        let (place, projection) = some.parallel(eye, (some.high - eye).max(eye - some.low));
        some.at(place, projection, place.z - 0.5 * (some.low.z + some.high.z))
    }

    fn at(&self, eye: Vec3A, projection: Projection, distance: f32) -> Camera {
        Camera {
            scene_from_view: Affine3A {
                matrix3: self.scene_from_view,
                translation: self.scene_from_view * eye,
            },
            projection,
            // Between the moments that were looked at the character may come nearer.
            near: distance * 1e-3,
            far: distance + 2.0 * self.size(),
        }
    }

    /// Place, before all points, and height of a parallel picture that reaches `half` from its middle.
    fn parallel(&self, middle: Vec3A, half: Vec3A) -> (Vec3A, Projection) {
        let size = self.size();
        let half = half.max(Vec3A::splat(0.5e-3 * size));
        let height = 2.0 * (half.x / self.slope[0]).max(half.y / self.slope[1]);
        (middle.with_z(self.high.z + size), Projection::Orthographic { height })
    }

    /// A lone point has no size; anything will do that is not zero.
    fn size(&self) -> f32 {
        let extent = (self.high - self.low).max_element();
        extent.max(self.high.abs().max_element() * 1e-4).max(1e-18)
    }

    /// Itself, or what holds a unit box if it was shown no point.
    fn or_unit(&self) -> Self {
        let mut some = self.clone();
        if !(some.low.is_finite() && some.high.is_finite()) {
            (some.low, some.high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
            some.edges = [f32::NEG_INFINITY; 4];
            some.include(&[Vec3::splat(-0.5), Vec3::splat(0.5)]);
        }
        some
    }
}

impl Sight for Framing {
    fn see(&mut self, points: &[Vec3]) {
        self.include(points);
    }

    fn join(&mut self, later: &Self) {
        self.edges = Vec4::from(later.edges).max(self.edges.into()).into();
        (self.low, self.high) = (later.low.min(self.low), later.high.max(self.high));
    }
}

/// `scene_from_view` of an orbiting camera; `roll` turns it clockwise, so that the picture turns the other way.
pub(super) fn orbit_axes(yaw: f32, pitch: f32, roll: f32) -> Mat3A {
    let axes = Mat3A::from_rotation_y(yaw) * Mat3A::from_rotation_x(-pitch);
    if roll == 0.0 { axes } else { axes * Mat3A::from_rotation_z(-roll) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rng::Rng;

    /// Largest |x|/w or |y|/w of the points in the picture.
    fn fill(camera: &Camera, points: &[Vec3], aspect: f32) -> f32 {
        let clip = camera.clip_from_scene(aspect);
        let edge = |p: &Vec3| {
            let q = clip * p.extend(1.0);
            assert!(q.w > 0.0);
            (q.x / q.w).abs().max((q.y / q.w).abs())
        };
        points.iter().map(edge).fold(0.0, f32::max)
    }

    fn cloud(rng: &mut Rng, scale: f64) -> Vec<Vec3> {
        let mut p = || Vec3::from_array([0; 3].map(|_| (scale * rng.range(-1.0, 3.0)) as f32));
        (0..50).map(|_| p()).collect()
    }

    #[test]
    fn all_points_are_inside_and_some_touch_the_margin() {
        let mut rng = Rng::new(5);
        for k in 0..200 {
            let scale = 10_f64.powf(rng.range(-3.0, 3.0));
            let points = cloud(&mut rng, scale);
            let aspect = rng.range(0.3, 3.0) as f32;
            let fov = if k % 4 == 0 { 0.0 } else { rng.range(0.05, 2.0) as f32 };
            let mut f = Framing::new(rng.range(-7.0, 7.0) as f32, rng.range(-1.6, 1.6) as f32, fov, aspect);
            f.include(&points);
            let fill = fill(&f.camera(), &points, aspect);
            assert!(fill < Framing::FILL + 2e-3, "{k}: {fill}");
            // Only a very wide angle would want to stand inside the points.
            assert!(fov > 1.0 || fill > Framing::FILL - 2e-3, "{k}: {fill}");
        }
    }

    #[test]
    fn over_all_turns_no_point_is_outside_and_some_point_touches() {
        let mut rng = Rng::new(6);
        for k in 0..60 {
            let points = cloud(&mut rng, 1.0);
            let axis = Vec3::new(rng.range(-1.0, 2.0) as f32, 5.0, rng.range(-1.0, 2.0) as f32);
            let aspect = rng.range(0.3, 3.0) as f32;
            let fov = if k % 4 == 0 { 0.0 } else { rng.range(0.05, 0.9) as f32 };
            let (turns, steps) = [(Turns::All, 720), (Turns::Each(8), 8)][k % 2];
            let pitch = rng.range(-1.57, 1.57) as f32;
            let mut f = Framing::new(rng.range(-7.0, 7.0) as f32, pitch, fov, aspect).turning(turns, axis);
            f.include(&points);
            let camera = f.camera();
            let most = (0..steps).map(|s| {
                let turned = super::super::stand::turned(camera, TAU * s as f32 / steps as f32, axis);
                fill(&turned, &points, aspect)
            });
            let most = most.fold(0.0, f32::max);
            assert!((most - Framing::FILL).abs() < 2e-3, "{k}: {turns:?} {most}");
        }
    }

    #[test]
    fn a_parallel_camera_keeps_its_middle() {
        let mut rng = Rng::new(7);
        let points = cloud(&mut rng, 1.0);
        let mut f = Framing::new(0.4, 0.3, 0.0, 1.5);
        f.include(&points);
        let target = Vec3::new(0.3, -0.2, 0.9);
        let camera = f.parallel_from(target);
        let q = camera.clip_from_scene(1.5) * target.extend(1.0);
        assert!(q.x.abs() < 1e-5 && q.y.abs() < 1e-5, "{q}");
        assert!((fill(&camera, &points, 1.5) - Framing::FILL).abs() < 1e-4);
    }

    #[test]
    fn nothing_or_a_lone_point_still_gives_a_camera() {
        for points in [vec![], vec![Vec3::ZERO], vec![Vec3::splat(1e6)], vec![Vec3::NAN]] {
            for (fov, turns) in
                [(0.0, Turns::None), (0.6, Turns::None), (0.6, Turns::All), (0.0, Turns::Each(3))]
            {
                let mut f = Framing::new(0.5, 0.3, fov, 1.0).turning(turns, Vec3::ZERO);
                f.include(&points);
                for c in [f.camera(), f.parallel_from(Vec3::ONE)] {
                    assert!(
                        c.scene_from_view.is_finite() && c.near > 0.0 && c.far > c.near,
                        "{points:?} {c:?}"
                    );
                }
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
