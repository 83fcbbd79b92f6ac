//! How a shot looks: its light, how light becomes colour, and what lies behind.

use crate::asset::{Asset, MountedLight};
use crate::fk::Posed;
use crate::image::color::linear_from_srgb;
use crate::image::develop::Grade;
use crate::render::outline::Outline;
use crate::scene::{Camera, Lamp, Light, LightKind, Lighting, Material, MaterialPatch, Style};
use glam::{Affine3A, DVec3, Vec3};

/// How surfaces are shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Shading {
    /// By interpolated normals.
    #[default]
    Smooth,
    /// In so many tones, from 2 on, with hard highlights (see [`Style::toon`]).
    Toon(u32),
    /// Each triangle by its own normal.
    Facets,
}

/// What throws shadows on what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Shadows {
    /// Nothing on nothing.
    #[default]
    None,
    /// What is near the ground darkens it softly, wherever the lamps stand.
    Contact,
    /// The key light, the first lamp, throws shadows on the ground and on the character itself, and what is near the ground
    /// darkens it a little. A lamp that is no sun throws them as if it were one in its direction from the character's middle.
    Map,
}

/// The plane below the lowest point of the whole clip.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct GroundLook {
    /// Linear RGB; it fades into the background with distance. `None` is seen by its shadows alone: black, with their darkness as
    /// alpha.
    pub color: Option<Vec3>,
}

/// What a shot has of its own beside the asset's materials.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Look {
    /// Linear RGBA behind everything, alpha premultiplied.
    pub background: [f32; 4],
    /// The same at the picture's bottom, if it changes on the way down; between the two, sRGB values run straight.
    pub background_bottom: Option<[f32; 4]>,
    /// All light; `None` is the asset's lamps, or a key and a fill light that stand with the camera where it has none.
    pub lighting: Option<Lighting>,
    /// How surfaces are shaded.
    pub shading: Shading,
    /// Contours.
    pub outline: Option<Outline>,
    /// What the character stands on; seen from above only.
    pub ground: Option<GroundLook>,
    /// What throws shadows on the ground, and by the rasterizer; rays throw all lamps' shadows.
    pub shadows: Shadows,
    /// Changes of the asset's materials, in order.
    pub materials: Vec<MaterialPatch>,
    /// How light becomes 8 bits.
    pub grade: Grade,
}

impl Look {
    /// Before what pictures of characters stand if nothing else is said, #e8eaed.
    pub fn paper() -> [f32; 4] {
        let [r, g, b] = [0xe8, 0xea, 0xed].map(|c| linear_from_srgb(c as f32 / 255.0));
        [r, g, b, 1.0]
    }

    /// Whether the rasterizer's own bytes are the picture.
    pub(super) fn is_direct(&self) -> bool {
        self.grade.is_plain() && !self.needs_stage()
    }

    /// Whether there is more to a picture than its scene.
    pub(super) fn needs_stage(&self) -> bool {
        let toon = matches!(self.shading, Shading::Toon(_));
        let ground = self.ground.is_some() || self.shadows == Shadows::Map;
        toon || ground || self.outline.is_some() || self.background_bottom.is_some()
    }

    /// What mirrored rays see where nothing is; a background that is not there is black.
    pub(super) fn sky(&self) -> Option<[Vec3; 2]> {
        let of = |c: [f32; 4]| (c[3] >= 1.0).then(|| Vec3::new(c[0], c[1], c[2]));
        of(self.background_bottom?).and_then(|below| Some([of(self.background)?, below]))
    }

    /// Steps of the tone ramp.
    pub(super) fn tones(&self) -> Option<u32> {
        match self.shading {
            Shading::Toon(steps) => Some(steps),
            _ => None,
        }
    }
}

/// The asset's materials as the look has them, and the one that meshes without a material wear.
pub(super) fn materials(asset: &Asset, look: &Look) -> Vec<Material> {
    let mut materials = asset.materials.clone();
    materials.push(Material::default());
    for m in &mut materials {
        for patch in &look.materials {
            if patch.matches(&m.name) {
                patch.apply(m);
            }
        }
        // Light from everywhere alike is not to be darkened in corners.
        if look.lighting.as_ref().is_some_and(Lighting::is_flat) {
            m.occlusion_map = None;
        }
    }
    materials
}

/// Light of one moment, in the scene's frame.
pub(super) struct Lit {
    pub ambient: Vec3,
    pub style: Style<'static>,
    pub lights: Vec<Light>,
}

/// The light that the look asks for, at one moment.
pub(super) fn lights(
    look: &Look,
    mounted: &[MountedLight],
    posed: &Posed,
    center: DVec3,
    camera: &Camera,
) -> Lit {
    let (toon, sky) = (look.tones(), look.sky());
    let Some(lighting) = &look.lighting else {
        let (ambient, lights) = of_asset(mounted, posed, center, camera);
        return Lit { ambient, style: Style { toon, sky, ..Style::default() }, lights };
    };
    let below = (lighting.below != lighting.above).then_some(lighting.below);
    Lit {
        ambient: lighting.above,
        style: Style { below, toon, sky, ..Style::default() },
        lights: lighting.lamps.iter().map(|l| placed(l, center, camera)).collect(),
    }
}

/// A lamp in the scene's frame.
fn placed(lamp: &Lamp, center: DVec3, camera: &Camera) -> Light {
    let frame = Affine3A::from_mat3_translation(lamp.frame.axes(camera), -center.as_vec3());
    lamp.light.carried(&frame)
}

/// The asset's lamps under a faint sky, or a key and a fill light that stand with the camera.
fn of_asset(mounted: &[MountedLight], posed: &Posed, center: DVec3, camera: &Camera) -> (Vec3, Vec<Light>) {
    if !mounted.is_empty() {
        let lamps = mounted.iter().map(|m| m.light.carried(&posed.near(m.bone, center)));
        return (Vec3::splat(0.08), lamps.collect());
    }
    let lamp = |from: Vec3, color: Vec3| {
        let direction = -camera.scene_from_view.transform_vector3(from.normalize());
        Light::new(LightKind::Directional { direction }, color)
    };
    let key = lamp(Vec3::new(-0.55, 0.75, 0.65), Vec3::new(0.92, 0.9, 0.86));
    let fill = lamp(Vec3::new(0.9, 0.15, 0.5), Vec3::new(0.2, 0.22, 0.26));
    (Vec3::new(0.25, 0.26, 0.28), vec![key, fill])
}
