//! How a shot looks: its light and what lies behind it.

use crate::asset::MountedLight;
use crate::fk::Posed;
use crate::scene::{Camera, Light, LightKind};
use glam::{Affine3A, DVec3, Vec3};

/// What a shot has of its own beside the asset's materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Linear RGBA behind everything, alpha premultiplied.
    pub background: [f32; 4],
}

impl Default for Look {
    /// Nothing behind the character.
    fn default() -> Self {
        Self { background: [0.0; 4] }
    }
}

/// The asset's lamps under a faint sky, or a key and a fill light that stand with the camera.
pub(super) fn lights(
    mounted: &[MountedLight],
    posed: &Posed,
    center: DVec3,
    camera: &Camera,
) -> (Vec3, Vec<Light>) {
    if !mounted.is_empty() {
        let carried = mounted.iter().map(|m| carry(&m.light, &posed.near(m.bone, center)));
        return (Vec3::splat(0.08), carried.collect());
    }
    let lamp = |from: Vec3, color: Vec3| {
        let direction = -camera.scene_from_view.transform_vector3(from.normalize());
        Light { kind: LightKind::Directional { direction }, color }
    };
    let key = lamp(Vec3::new(-0.55, 0.75, 0.65), Vec3::new(0.92, 0.9, 0.86));
    let fill = lamp(Vec3::new(0.9, 0.15, 0.5), Vec3::new(0.2, 0.22, 0.26));
    (Vec3::new(0.25, 0.26, 0.28), vec![key, fill])
}

/// A lamp in the frame of a bone, in the scene's frame.
fn carry(light: &Light, scene_from_bone: &Affine3A) -> Light {
    let turn = |d: Vec3| scene_from_bone.transform_vector3(d).normalize_or(Vec3::NEG_Z);
    let mut light = *light;
    match &mut light.kind {
        LightKind::Directional { direction } => *direction = turn(*direction),
        LightKind::Point { position, .. } => *position = scene_from_bone.transform_point3(*position),
        LightKind::Spot { position, direction, .. } => {
            *position = scene_from_bone.transform_point3(*position);
            *direction = turn(*direction);
        }
    }
    light
}
