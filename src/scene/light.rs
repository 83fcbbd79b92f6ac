//! Lamps.

use glam::{Affine3A, Vec3};

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// From infinitely far away, travelling along `direction` (unit).
    Directional {
        /// The way light travels.
        direction: Vec3,
    },
    /// From a point in all directions, without fall-off (as in the notes §3.1) unless `range` is given.
    Point {
        /// Scene space.
        position: Vec3,
        /// Inverse-square fall-off with unit intensity at 1 m: `1/d²`, faded out at the range (KHR_lights_punctual);
        /// `None`: the same at every distance.
        falloff: Option<f32>,
    },
    /// A cone (KHR_lights_punctual spot).
    Spot {
        /// Scene space.
        position: Vec3,
        /// The axis along which light travels, unit.
        direction: Vec3,
        /// As for a point light.
        falloff: Option<f32>,
        /// Cosine of the angle where it begins to fade.
        cos_inner: f32,
        /// Cosine of the angle where it ends.
        cos_outer: f32,
    },
}

/// A lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is.
    pub kind: LightKind,
    /// `I`: linear RGB.
    pub color: Vec3,
    /// Half its size, for soft shadows: metres for a point or spot, radians as seen from the scene for a directional light; 0
    /// throws hard ones. Nothing else depends on it.
    pub radius: f32,
}

impl Light {
    /// One without size.
    pub fn new(kind: LightKind, color: Vec3) -> Self {
        Self { kind, color, radius: 0.0 }
    }

    /// The lamp carried from one frame into another. Directions keep unit length; one without length points along −z.
    pub fn carried(&self, frame: &Affine3A) -> Self {
        let turn = |d: Vec3| frame.transform_vector3(d).normalize_or(Vec3::NEG_Z);
        let mut light = *self;
        match &mut light.kind {
            LightKind::Directional { direction } => *direction = turn(*direction),
            LightKind::Point { position, .. } => *position = frame.transform_point3(*position),
            LightKind::Spot { position, direction, .. } => {
                *position = frame.transform_point3(*position);
                *direction = turn(*direction);
            }
        }
        light
    }
}
