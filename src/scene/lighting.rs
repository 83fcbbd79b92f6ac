//! Lamps as a whole, before anybody knows where the camera stands.

use super::{Camera, Light, LightKind};
use glam::{Mat3, Vec3};

/// What a lamp's place and direction are told against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LampFrame {
    /// The world: positions in metres, +y up.
    #[default]
    World,
    /// A trolley that goes round with the camera: +x is the camera's right, +y the world's up, +z from the subject towards
    /// the camera; the origin is where the world's is. However far the camera looks down, lamps do not rise or sink.
    Camera,
}

/// A lamp and its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The lamp, in that frame.
    pub light: Light,
    /// Which frame.
    pub frame: LampFrame,
}

/// All light of a picture: `I_a(n) = ½(1+n_y)·above + ½(1−n_y)·below`, and lamps, the key light first.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Lighting {
    /// Ambient light on what faces up, linear RGB.
    pub above: Vec3,
    /// Ambient light on what faces down.
    pub below: Vec3,
    /// Lamps; the first one is the key light, whose shadows can be drawn.
    pub lamps: Vec<Lamp>,
}

impl Lamp {
    /// A lamp infinitely far away in the direction `from`.
    pub fn directional(from: Vec3, color: Vec3, frame: LampFrame) -> Self {
        let direction = -from.normalize_or(Vec3::Y);
        Self { light: Light::new(LightKind::Directional { direction }, color), frame }
    }
}

impl Lighting {
    /// Key, fill and rim: a warm key light high on the left, a cool and faint fill light low on the right, and a rim light from
    /// behind that draws the outline. They go round with the camera.
    pub fn studio() -> Self {
        let lamp = |from: [f32; 3], color: [f32; 3]| {
            Lamp::directional(Vec3::from_array(from), Vec3::from_array(color), LampFrame::Camera)
        };
        Self {
            above: Vec3::new(0.25, 0.26, 0.29),
            below: Vec3::new(0.15, 0.13, 0.12),
            lamps: vec![
                lamp([-0.65, 0.8, 0.6], [0.9, 0.86, 0.79]),
                lamp([0.95, 0.2, 0.5], [0.13, 0.16, 0.21]),
                lamp([0.6, 0.55, -1.0], [0.95, 0.98, 1.05]),
            ],
        }
    }

    /// One strong sun, fixed in the world, high before a character that faces +z, under a blue sky and over warm ground.
    pub fn sun() -> Self {
        let sun = Lamp::directional(Vec3::new(-0.2, 0.85, 0.6), Vec3::new(1.0, 0.93, 0.8), LampFrame::World);
        Self { above: Vec3::new(0.22, 0.28, 0.38), below: Vec3::new(0.19, 0.16, 0.13), lamps: vec![sun] }
    }

    /// No lamps, and the same light from everywhere: surfaces are as bright as their texture.
    pub fn flat() -> Self {
        Self { above: Vec3::ONE, below: Vec3::ONE, lamps: vec![] }
    }

    /// Whether light comes from everywhere alike.
    pub fn is_flat(&self) -> bool {
        self.lamps.is_empty() && self.above == self.below
    }
}

impl LampFrame {
    /// Its axes in the scene.
    pub fn axes(self, camera: &Camera) -> Mat3 {
        let axes = &camera.scene_from_view.matrix3;
        match self {
            LampFrame::World => Mat3::IDENTITY,
            LampFrame::Camera => trolley(axes.x_axis.into(), axes.z_axis.into()),
        }
    }
}

/// The axes of [`LampFrame::Camera`] for a camera whose right and backward directions are given: the vertical stays.
fn trolley(right: Vec3, back: Vec3) -> Mat3 {
    // Whoever looks along the vertical has a right hand, whoever lies on the side has a back.
    let level = |v: Vec3| v.with_y(0.0).try_normalize();
    let x = if right.y.abs() < 0.9 { level(right) } else { level(back).map(|z| Vec3::Y.cross(z)) };
    let x = x.unwrap_or(Vec3::X);
    Mat3::from_cols(x, Vec3::Y, x.cross(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trolley_keeps_the_vertical() {
        let down = 0.8_f32;
        let yaw = 0.7_f32;
        let right = Vec3::new(yaw.cos(), 0.0, -yaw.sin());
        let back = Vec3::new(yaw.sin() * down.cos(), down.sin(), yaw.cos() * down.cos());
        let m = trolley(right, back);
        assert!((m.x_axis - right).length() < 1e-6);
        assert_eq!(m.y_axis, Vec3::Y);
        assert!((m.z_axis - Vec3::new(yaw.sin(), 0.0, yaw.cos())).length() < 1e-6);
        assert!((m.determinant() - 1.0).abs() < 1e-6);
        // Straight down, and rolled by a quarter.
        assert!((trolley(Vec3::X, Vec3::Y).z_axis - Vec3::Z).length() < 1e-6);
        assert!((trolley(Vec3::Y, Vec3::Z).z_axis - Vec3::Z).length() < 1e-6);
    }
}
