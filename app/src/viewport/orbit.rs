//! The camera: around a point, by pixels of a drag. No toolkit.

use glam::{DVec2, DVec3, Vec3};
use sinew::scene::{Camera, Projection};

/// A camera that looks at a point from a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// What it looks at and turns around, world space.
    pub target: DVec3,
    /// Radians about +y; 0 looks along −z.
    pub yaw: f64,
    /// Radians above the horizon.
    pub pitch: f64,
    /// Metres from the target.
    pub distance: f64,
}

/// Radians a pixel.
const TURN: f64 = 0.008;

impl Default for Orbit {
    fn default() -> Self {
        Self { target: DVec3::ZERO, yaw: 0.5, pitch: 0.2, distance: 3.0 }
    }
}

impl Orbit {
    /// Vertical field of view, radians.
    pub const FOV: f64 = 0.6;

    /// Right, up, and towards the eye.
    pub fn axes(&self) -> [DVec3; 3] {
        let back = DVec3::new(
            self.pitch.cos() * self.yaw.sin(),
            self.pitch.sin(),
            self.pitch.cos() * self.yaw.cos(),
        );
        let right = DVec3::new(self.yaw.cos(), 0.0, -self.yaw.sin());
        [right, back.cross(right), back]
    }

    /// Where the eye is.
    pub fn eye(&self) -> DVec3 {
        self.target + self.axes()[2] * self.distance
    }

    /// Look around, by a drag in pixels.
    pub fn turn(&mut self, [x, y]: [f32; 2]) {
        self.yaw = (self.yaw - TURN * f64::from(x)).rem_euclid(std::f64::consts::TAU);
        self.pitch = (self.pitch + TURN * f64::from(y)).clamp(-1.57, 1.57);
    }

    /// Move sideways, so that the target's plane follows the pointer in a picture of that height.
    pub fn pan(&mut self, [x, y]: [f32; 2], height: f32) {
        let metres = 2.0 * self.distance * (0.5 * Orbit::FOV).tan() / f64::from(height.max(1.0));
        let [right, up, _] = self.axes();
        self.target += (up * f64::from(y) - right * f64::from(x)) * metres;
    }

    /// Nearer by a factor; what is under the pointer, at the target's distance, stays there. `at` is in half heights from the middle,
    /// y up.
    pub fn zoom(&mut self, factor: f64, at: [f32; 2]) {
        let new = (self.distance / factor.clamp(0.1, 10.0)).clamp(1e-4, 1e7);
        let [right, up, _] = self.axes();
        let shift = (self.distance - new) * (0.5 * Orbit::FOV).tan();
        self.target += (right * f64::from(at[0]) + up * f64::from(at[1])) * shift;
        self.distance = new;
    }

    /// Look at a box from where the camera is turned.
    pub fn frame(&mut self, [low, high]: [DVec3; 2]) {
        if low.is_finite() && high.is_finite() && high.cmpge(low).all() {
            self.target = 0.5 * (low + high);
            self.distance = (0.55 * (high - low).length() / (0.5 * Orbit::FOV).sin()).clamp(1e-4, 1e7);
        }
    }

    /// The library's camera; the scene has its origin at `center`.
    pub fn camera(&self, center: DVec3) -> Camera {
        let projection = Projection::Perspective { fov_y: Self::FOV as f32 };
        let (eye, target) = ((self.eye() - center).as_vec3(), (self.target - center).as_vec3());
        let up = self.axes()[1].as_vec3();
        let fallback = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, projection);
        Camera::look_at(eye, target, up, projection).or(fallback).expect("z and y are apart")
    }
}

/// Between points of a pane and rays of the world.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// The camera.
    pub orbit: Orbit,
    /// Left, top, width and height of the pane.
    pub pane: [f32; 4],
}

impl Lens {
    fn half(&self) -> (DVec2, f64) {
        let [x, y, w, h] = self.pane.map(f64::from);
        (DVec2::new(x + 0.5 * w, y + 0.5 * h), 0.5 * h.max(1.0))
    }

    /// Where a point is in the pane; `None` behind the eye.
    pub fn project(&self, p: DVec3) -> Option<[f32; 2]> {
        let [right, up, back] = self.orbit.axes();
        let v = p - self.orbit.eye();
        let depth = -v.dot(back);
        let (middle, half) = self.half();
        let scale = half / (depth * (0.5 * Orbit::FOV).tan());
        let at = middle + DVec2::new(v.dot(right), -v.dot(up)) * scale;
        (depth > 1e-3 * self.orbit.distance && at.is_finite()).then(|| at.as_vec2().to_array())
    }

    /// Origin and unit direction of what is seen at a point of the pane.
    pub fn ray(&self, [x, y]: [f32; 2]) -> (DVec3, DVec3) {
        let (middle, half) = self.half();
        let at = (DVec2::new(f64::from(x), f64::from(y)) - middle) / half * (0.5 * Orbit::FOV).tan();
        let [right, up, back] = self.orbit.axes();
        (self.orbit.eye(), (right * at.x - up * at.y - back).normalize())
    }

    /// Metres a point of the pane, at a place.
    pub fn metres(&self, at: DVec3) -> f64 {
        let depth = (self.orbit.eye() - at).dot(self.orbit.axes()[2]).max(1e-6);
        depth * (0.5 * Orbit::FOV).tan() / self.half().1
    }

    /// Where the ray of a point meets a plane; `None` where it runs along it or away.
    pub fn on_plane(&self, at: [f32; 2], origin: DVec3, normal: DVec3) -> Option<DVec3> {
        let (eye, along) = self.ray(at);
        let t = (origin - eye).dot(normal) / along.dot(normal);
        (t.is_finite() && t > 0.0 && along.dot(normal).abs() > 1e-3).then(|| eye + along * t)
    }

    /// The point of a line that is nearest to the ray of a point.
    pub fn on_line(&self, at: [f32; 2], origin: DVec3, line: DVec3) -> Option<DVec3> {
        let (eye, along) = self.ray(at);
        let (b, w) = (line.dot(along), origin - eye);
        let t = (b * along.dot(w) - line.dot(w)) / (1.0 - b * b);
        (t.is_finite() && 1.0 - b * b > 1e-4).then(|| origin + line * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens() -> Lens {
        let orbit = Orbit { target: DVec3::new(1.0, 2.0, 3.0), yaw: 0.7, pitch: 0.4, distance: 5.0 };
        Lens { orbit, pane: [10.0, 20.0, 400.0, 300.0] }
    }

    #[test]
    fn rays_go_where_points_are_seen_and_the_librarys_camera_agrees() {
        let lens = lens();
        for p in [DVec3::new(1.3, 2.1, 2.8), DVec3::ZERO, lens.orbit.target] {
            let at = lens.project(p).unwrap();
            let (eye, along) = lens.ray(at);
            assert!((p - eye).normalize().distance(along) < 1e-6);
            let center = DVec3::splat(0.5);
            let clip = lens.orbit.camera(center).clip_from_scene(400.0 / 300.0);
            let q = clip * (p - center).as_vec3().extend(1.0);
            let seen = [210.0 + 200.0 * q.x / q.w, 170.0 - 150.0 * q.y / q.w];
            assert!((seen[0] - at[0]).abs() < 1e-2 && (seen[1] - at[1]).abs() < 1e-2, "{seen:?} {at:?}");
        }
    }

    #[test]
    fn zooming_keeps_what_is_under_the_pointer() {
        let mut lens = lens();
        let at = [300.0, 60.0];
        let under = lens.on_plane(at, lens.orbit.target, lens.orbit.axes()[2]).unwrap();
        lens.orbit.zoom(1.7, [(300.0 - 210.0) / 150.0, (170.0 - 60.0) / 150.0]);
        let now = lens.project(under).unwrap();
        assert!((now[0] - at[0]).abs() < 1e-2 && (now[1] - at[1]).abs() < 1e-2, "{now:?}");
        lens.orbit.pan([30.0, -20.0], 300.0);
        let now = lens.project(under).unwrap();
        assert!((now[0] - 330.0).abs() < 1e-2 && (now[1] - 40.0).abs() < 1e-2, "{now:?}");
    }
}
