//! What lies behind the character: a colour, a gradient, the ground.

use super::footprint::Footprint;
use crate::image::Image;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::scene::{Camera, Projection};
use glam::Vec3;

/// The plane that a character stands on. Everything drawn is above it, so that it is behind everything in every pixel.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// Scene-space y of the plane.
    pub height: f32,
    /// Linear RGB in full light; `None` shows nothing but the shadows.
    pub color: Option<Vec3>,
    /// Where it begins to fade, x and z, metres.
    pub center: [f32; 2],
    /// Distance from the centre within which it is whole, and from which on it is gone, metres; between the two it fades by
    /// `1 − (3t²−2t³)`. So it has neither an edge nor a horizon.
    pub fade: [f32; 2],
    /// What darkens it, and by how much at most, 0…1: together `1 − Π (1 − strength·dark)`.
    pub shadows: [Option<(&'a Footprint, f32)>; 2],
}

/// What lies behind, for one picture.
#[derive(Clone, Copy, Debug)]
pub struct Backdrop<'a> {
    /// Linear RGBA at the top, premultiplied.
    pub top: [f32; 4],
    /// At the bottom; between the two sRGB values run straight, which looks even.
    pub bottom: [f32; 4],
    /// The ground before it.
    pub ground: Option<Ground<'a>>,
}

impl Backdrop<'_> {
    /// Put it behind a picture that `camera` has taken.
    pub fn put_behind(&self, camera: &Camera, picture: &mut Image) {
        let (width, height) = (picture.width, picture.height);
        if width == 0 {
            return;
        }
        let rays = Rays::new(camera, width, height);
        let ground = self.ground.filter(|g| rays.above(g.height));
        for (y, row) in picture.pixels.chunks_exact_mut(width).enumerate() {
            let plain = self.row((y as f32 + 0.5) / height as f32);
            for (x, p) in row.iter_mut().enumerate() {
                if p[3] >= 1.0 {
                    continue;
                }
                let behind =
                    match ground.as_ref().and_then(|g| Some(g.over(rays.hit(x, y, g.height)?, plain))) {
                        Some(c) => c,
                        None => plain,
                    };
                let open = 1.0 - p[3];
                *p = std::array::from_fn(|c| p[c] + open * behind[c]);
            }
        }
    }

    /// The gradient's colour at a height of 0 (top) to 1.
    fn row(&self, t: f32) -> [f32; 4] {
        if self.top == self.bottom {
            return self.top;
        }
        let alpha = self.top[3] + (self.bottom[3] - self.top[3]) * t;
        let signal = |p: [f32; 4], c: usize| srgb_from_linear(if p[3] > 0.0 { p[c] / p[3] } else { 0.0 });
        let mix = |c: usize| {
            let (a, b) = (signal(self.top, c), signal(self.bottom, c));
            alpha * linear_from_srgb(a + (b - a) * t)
        };
        [mix(0), mix(1), mix(2), alpha]
    }
}

impl Ground<'_> {
    /// The ground at a place, over what lies behind it.
    fn over(&self, place: Vec3, behind: [f32; 4]) -> [f32; 4] {
        let light = self.light(place);
        let (color, alpha) = match self.color {
            Some(color) => (color * light, self.cover(place)),
            None => (Vec3::ZERO, 1.0 - light),
        };
        let mix = |c: f32, b: f32| alpha * c + (1.0 - alpha) * b;
        [
            mix(color.x, behind[0]),
            mix(color.y, behind[1]),
            mix(color.z, behind[2]),
            alpha + (1.0 - alpha) * behind[3],
        ]
    }

    /// The share of the light that arrives.
    fn light(&self, place: Vec3) -> f32 {
        self.shadows.iter().flatten().fold(1.0, |light, (f, strength)| light * (1.0 - strength * f.at(place)))
    }

    fn cover(&self, place: Vec3) -> f32 {
        let [x, z] = self.center;
        let distance = (place.x - x).hypot(place.z - z);
        let [whole, gone] = self.fade;
        let t = ((distance - whole) / (gone - whole).max(1e-30)).clamp(0.0, 1.0);
        1.0 - t * t * (3.0 - 2.0 * t)
    }
}

/// Sight rays through pixel centres: origin and direction change linearly along both axes.
struct Rays {
    origin: [Vec3; 3],
    direction: [Vec3; 3],
}

impl Rays {
    fn new(camera: &Camera, width: usize, height: usize) -> Self {
        let m = &camera.scene_from_view.matrix3;
        let [right, up, back] = [m.x_axis, m.y_axis, m.z_axis].map(Vec3::from);
        let half = match camera.projection {
            Projection::Perspective { fov_y } => (0.5 * fov_y).tan(),
            Projection::Orthographic { height } => 0.5 * height,
        };
        let pixel = 2.0 * half / height as f32;
        let (dx, dy) = (right * pixel, up * -pixel);
        let first = dx * (0.5 - 0.5 * width as f32) + dy * (0.5 - 0.5 * height as f32);
        match camera.projection {
            Projection::Perspective { .. } => {
                Self { origin: [camera.eye(), Vec3::ZERO, Vec3::ZERO], direction: [first - back, dx, dy] }
            }
            Projection::Orthographic { .. } => {
                Self { origin: [camera.eye() + first, dx, dy], direction: [-back, Vec3::ZERO, Vec3::ZERO] }
            }
        }
    }

    /// Whether the eye looks down on a plane at this height; in parallel projection it always stands far enough away.
    fn above(&self, height: f32) -> bool {
        if self.origin[1] == Vec3::ZERO { self.origin[0].y > height } else { self.direction[0].y < 0.0 }
    }

    /// Where a pixel's ray meets a plane at this height from above.
    #[inline]
    fn hit(&self, x: usize, y: usize, height: f32) -> Option<Vec3> {
        let at = |v: &[Vec3; 3]| v[0] + v[1] * x as f32 + v[2] * y as f32;
        let (o, d) = (at(&self.origin), at(&self.direction));
        if d.y >= 0.0 {
            return None;
        }
        let p = o + d * ((height - o.y) / d.y);
        p.is_finite().then_some(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_the_plane_where_the_camera_sees_it() {
        for projection in [Projection::Perspective { fov_y: 0.7 }, Projection::Orthographic { height: 3.0 }] {
            let camera =
                Camera::look_at(Vec3::new(2.0, 3.0, 4.0), Vec3::Y * 0.3, Vec3::Y, projection).unwrap();
            let (w, h) = (30, 20);
            let rays = Rays::new(&camera, w, h);
            assert!(rays.above(0.5));
            let clip = camera.clip_from_scene(1.5);
            for (x, y) in [(0, 0), (29, 19), (14, 7)] {
                let p = rays.hit(x, y, 0.5).unwrap();
                let c = clip * p.extend(1.0);
                let px = (0.5 + 0.5 * c.x / c.w) * w as f32 - 0.5;
                let py = (0.5 - 0.5 * c.y / c.w) * h as f32 - 0.5;
                assert!((p.y - 0.5).abs() < 1e-5);
                assert!((px - x as f32).abs() < 1e-3 && (py - y as f32).abs() < 1e-3, "{px} {py}");
            }
        }
    }

    #[test]
    fn a_gradient_runs_straight_in_srgb() {
        let b = Backdrop { top: [0.0, 0.0, 0.0, 1.0], bottom: [1.0; 4], ground: None };
        let row = b.row(0.25);
        assert!((srgb_from_linear(row[0]) - 0.25).abs() < 1e-6 && row[3] == 1.0);
        let clear = Backdrop { top: [0.0; 4], ..b };
        assert!((clear.row(0.5)[3] - 0.5).abs() < 1e-6);
    }
}
