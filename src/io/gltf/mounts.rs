//! Cameras and lamps, riding on the bones that their nodes became.

use super::document::Document;
use super::error::{Result, entry};
use super::warnings::Warnings;
use crate::asset::{MountedCamera, MountedLight};
use crate::character::{Binding, Character};
use crate::scene::{Light, LightKind, Projection};
use crate::skeleton::BoneId;
use ::gltf::json;
use ::gltf::json::extensions::scene::khr_lights_punctual as punctual;
use ::gltf::json::validation::Checked;
use glam::{DVec3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Cameras of the scene.
pub(super) fn cameras(
    doc: &Document,
    scene: &[usize],
    bones: &[BoneId],
    w: &mut Warnings,
) -> Result<Vec<MountedCamera>> {
    let mut out = Vec::new();
    for &node in scene {
        let json = &doc.root.nodes[node];
        let Some(index) = json.camera.map(|c| c.value()) else { continue };
        let camera = entry(&doc.root.cameras, index, "camera", || format!("nodes[{node}].camera"))?;
        ignored(camera, &format!("cameras[{index}]"), w);
        let Some((projection, near)) = projection(camera) else {
            w.push(format!("cameras[{index}]"), "has no usable projection; left out");
            continue;
        };
        let name =
            camera.name.clone().or_else(|| json.name.clone()).unwrap_or_else(|| format!("camera_{index}"));
        let near = if near.is_finite() && near > 0.0 { near } else { 0.01 };
        out.push(MountedCamera { name, bone: bones[node], projection, near });
    }
    Ok(out)
}

/// Pictures have their own shape, so a camera says only how much is seen from bottom to top.
fn ignored(camera: &json::Camera, place: &str, w: &mut Warnings) {
    if camera.perspective.as_ref().is_some_and(|p| p.aspect_ratio.is_some()) {
        w.push(place, "its aspectRatio is ignored; that of the picture counts");
    }
    if camera.perspective.is_none() && camera.orthographic.as_ref().is_some_and(|o| o.xmag != o.ymag) {
        w.push(place, "its xmag is ignored; ymag and the shape of the picture count");
    }
}

fn projection(camera: &json::Camera) -> Option<(Projection, f32)> {
    if let Some(p) = &camera.perspective {
        let ok = p.yfov > 0.0 && p.yfov < PI;
        return ok.then_some((Projection::Perspective { fov_y: p.yfov }, p.znear));
    }
    let o = camera.orthographic.as_ref()?;
    let height = 2.0 * o.ymag.abs();
    (height > 0.0 && height.is_finite()).then_some((Projection::Orthographic { height }, o.znear))
}

/// Lamps of the scene, with one exposure for all of them.
///
/// A matt surface of albedo `ρ` sends `ρ/π` of its illuminance to the eye, and our `k_d` is `ρ`; so `I = intensity/π` (lux, or
/// candela with the inverse square of the distance). Files hold anything from 1 to full daylight; if the brightest lamp,
/// at the distance of what is drawn, gives more than 1 or less than 1/20, all are scaled so that it gives 1.
pub(super) fn lights(
    doc: &Document,
    scene: &[usize],
    bones: &[BoneId],
    character: &Character,
) -> Result<Vec<MountedLight>> {
    let all: &[punctual::Light] = doc.root.as_ref();
    let posed = character.posed(&character.rest_pose());
    let middle = middle(character, &posed);
    let (mut out, mut brightest) = (Vec::new(), 0.0_f32);
    for &node in scene {
        let extension = doc.root.nodes[node].extensions.as_ref();
        let Some(l) = extension.and_then(|e| e.khr_lights_punctual.as_ref()) else { continue };
        let place = || format!("nodes[{node}].extensions.KHR_lights_punctual.light");
        let json = entry(all, l.light.value(), "light", place)?;
        let bone = bones[node];
        let Some(light) = light(json) else { continue };
        let distance = match light.kind {
            LightKind::Directional { .. } => 1.0,
            _ => (posed.origin(bone).distance(middle) as f32).max(0.1),
        };
        brightest = brightest.max(light.color.max_element() / (distance * distance));
        out.push(MountedLight { bone, light });
    }
    if brightest.is_finite() && brightest > 0.0 && !(0.05..=1.0).contains(&brightest) {
        out.iter_mut().for_each(|l| l.light.color /= brightest);
    }
    Ok(out)
}

fn light(json: &punctual::Light) -> Option<Light> {
    let color = Vec3::from_array(json.color) * (json.intensity / PI);
    if !color.is_finite() || color.min_element() < 0.0 {
        return None;
    }
    let (position, direction) = (Vec3::ZERO, Vec3::NEG_Z);
    let falloff = Some(json.range.filter(|r| *r > 0.0).unwrap_or(f32::INFINITY));
    let kind = match json.type_ {
        Checked::Valid(punctual::Type::Directional) => LightKind::Directional { direction },
        Checked::Valid(punctual::Type::Point) => LightKind::Point { position, falloff },
        Checked::Valid(punctual::Type::Spot) => {
            let spot = json.spot.clone().unwrap_or_default();
            let outer =
                if spot.outer_cone_angle > 0.0 { spot.outer_cone_angle.min(FRAC_PI_2) } else { PI / 4.0 };
            let inner = spot.inner_cone_angle.clamp(0.0, outer);
            LightKind::Spot { position, direction, falloff, cos_inner: inner.cos(), cos_outer: outer.cos() }
        }
        Checked::Invalid => return None,
    };
    Some(Light::new(kind, color))
}

/// Roughly the middle of what is drawn: the mean of the boxes' centres, each carried by its first bone.
fn middle(character: &Character, posed: &crate::fk::Posed) -> DVec3 {
    let mut sum = (DVec3::ZERO, 0.0);
    for instance in character.instances() {
        let Some((lo, hi)) = character.mesh(instance).bounds() else { continue };
        let center = ((lo + hi) * 0.5).as_dvec3();
        let at = match &instance.binding {
            Binding::Bone(b) => posed.world_from_bone(*b).transform_point3(center),
            Binding::Skin { palette, .. } => match palette.first() {
                Some((b, m)) => {
                    let p = m.transform_point3(center.as_vec3());
                    posed.world_from_bone(*b).transform_point3(p.as_dvec3())
                }
                None => continue,
            },
        };
        sum = (sum.0 + at, sum.1 + 1.0);
    }
    if sum.1 > 0.0 { sum.0 / sum.1 } else { DVec3::ZERO }
}
