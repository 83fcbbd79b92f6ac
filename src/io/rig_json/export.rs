//! Assets to rig files and files of poses.

use super::Color;
use super::document::{self, Bind, Bone, Rig};
use super::meshes::bone_from_rest;
use super::poses::{Clip, Interpolation, Poses, Tangents, Track};
use crate::asset::Asset;
use crate::character::{Binding, Character, Instance};
use crate::clip::{self, Curve, Target};
use crate::fk::Posed;
use crate::image::color::LINEAR_OF_SRGB8;
use crate::io::Warning;
use crate::math::spline;
use crate::mesh::MorphTarget;
use crate::scene::{Filter, Material, Texture, TextureRef, WrapMode};
use crate::skeleton::{BoneId, Skeleton};
use glam::{Affine3A, Quat, Vec3};

/// A document, and what the format could not hold.
#[derive(Clone, Debug)]
pub struct Exported<T> {
    /// To be written by its `to_text`.
    pub document: T,
    /// Everything that was left out or renamed.
    pub warnings: Vec<Warning>,
}

/// The rig of an asset. `textures` are the file names under which the caller stores `asset.textures`, in their order;
/// clips go to a file of their own by [`export_poses`].
///
/// Importing the text gives the same character, up to what the warnings name.
pub fn export(name: &str, asset: &Asset, textures: &[String]) -> Exported<Rig> {
    let character = &asset.character;
    let skeleton = character.skeleton();
    let mut warnings = Vec::new();
    let names = unique_names(skeleton, &mut warnings);
    let posed = character.posed(&character.rest_pose());
    let materials = material_names(&asset.materials, &mut warnings);
    let meshes = character.instances().iter().map(|i| {
        let mut mesh = mesh(asset, i, &names, &posed, &mut warnings);
        let id = character.mesh(i).material.map(|m| m.0 as usize);
        mesh.material = id.and_then(|m| materials.get(m).cloned());
        mesh
    });
    let meshes = meshes.collect();
    let documents = asset.materials.iter().zip(&materials);
    let materials = documents.map(|(m, name)| material(m, name, asset, textures, &mut warnings)).collect();
    for (n, what) in [(asset.cameras.len(), "cameras"), (asset.lights.len(), "lights")] {
        if n > 0 {
            warn(&mut warnings, what, format!("{n} left out: a rig has none"));
        }
    }
    let bones = skeleton.ids().map(|b| bone(skeleton, b, &names)).collect();
    let document = Rig { sinew_rig: 1, name: name.into(), poses: None, bones, materials, meshes };
    Exported { document, warnings }
}

/// The clips of an asset, or any others for its character.
pub fn export_poses(character: &Character, clips: &[clip::Clip]) -> Exported<Poses> {
    let mut warnings = Vec::new();
    let names = unique_names(character.skeleton(), &mut warnings);
    let runs = character.weight_runs();
    let clips = clips.iter().map(|c| one_clip(c, &names, &runs, &mut warnings)).collect();
    Exported { document: Poses { sinew_poses: 1, clips, ..Poses::default() }, warnings }
}

fn warn(warnings: &mut Vec<Warning>, place: impl Into<String>, message: impl Into<String>) {
    warnings.push(Warning { place: place.into(), message: message.into() });
}

/// Names that stand for one bone each: repeated ones get their bone's number.
fn unique_names(skeleton: &Skeleton, warnings: &mut Vec<Warning>) -> Vec<String> {
    let mut taken = std::collections::BTreeSet::new();
    let mut names = Vec::with_capacity(skeleton.len());
    for b in skeleton.ids() {
        let mut name = skeleton.name(b).to_string();
        while !taken.insert(name.clone()) {
            name = format!("{name}.{}", b.0);
            warn(warnings, format!("bone {}", b.0), format!("renamed to `{name}`: names must be unique"));
        }
        names.push(name);
    }
    names
}

fn material_names(all: &[Material], warnings: &mut Vec<Warning>) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(all.len());
    for (i, m) in all.iter().enumerate() {
        let mut name = m.name.clone();
        while names.contains(&name) {
            name = format!("{name}.{i}");
            warn(warnings, format!("material {i}"), format!("renamed to `{name}`: names must be unique"));
        }
        names.push(name);
    }
    names
}

fn bone(skeleton: &Skeleton, b: BoneId, names: &[String]) -> Bone {
    let rest = skeleton.rest(b);
    let limits = skeleton.limits(b);
    let some = |is: bool| is.then_some(());
    let side = |v: Vec3| v.to_array().map(|x| x.is_finite().then(|| shortest_degrees(x)));
    let fixed = skeleton.fixed(b);
    Bone {
        name: names[b.index()].clone(),
        parent: skeleton.parent(b).map(|p| names[p.index()].clone()),
        translation: some(rest.translation != Vec3::ZERO).map(|()| rest.translation.to_array()),
        rotation: some(rest.rotation != Quat::IDENTITY).map(|()| rest.rotation.to_array()),
        scale: some(rest.scale != Vec3::ONE).map(|()| rest.scale.to_array()),
        length: some(skeleton.length(b) != 0.0).map(|()| skeleton.length(b)),
        aim: some(skeleton.aim(b) != Quat::IDENTITY).map(|()| skeleton.aim(b).to_array()),
        fixed: fixed.map(rows),
        min_deg: limits.map(|l| side(l.min)),
        max_deg: limits.map(|l| side(l.max)),
        ..Default::default()
    }
}

fn rows(m: &Affine3A) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|r| {
        let a = m.matrix3;
        [a.x_axis[r], a.y_axis[r], a.z_axis[r], m.translation[r]]
    })
}

fn mesh(
    asset: &Asset,
    instance: &Instance,
    names: &[String],
    posed: &Posed,
    warnings: &mut Vec<Warning>,
) -> document::Mesh {
    let mesh = asset.character.mesh(instance);
    let width = mesh.targets.len();
    let run = asset.character.weight_runs().iter().position(|r| *r == (instance.first_weight, width));
    let weights = asset.character.rest_pose().weights;
    let rest = run.map_or(&[][..], |_| &weights[instance.first_weight..][..width]);
    let lost = [
        (!mesh.uvs[1].is_empty(), "the second set of texture coordinates"),
        (!mesh.tangents.is_empty(), "tangents"),
    ];
    for (_, what) in lost.iter().filter(|l| l.0) {
        warn(warnings, format!("mesh `{}`", mesh.name), format!("{what} left out: a rig has none"));
    }
    document::Mesh {
        name: mesh.name.clone(),
        material: None,
        bind: bind(&instance.binding, names, posed),
        crease_deg: None,
        positions: mesh.positions.iter().map(|p| p.to_array()).collect(),
        normals: mesh.normals.iter().map(|p| p.to_array()).collect(),
        uvs: mesh.uvs[0].iter().map(|p| p.to_array()).collect(),
        colors: mesh.colors.iter().map(|c| Color(*c)).collect(),
        triangles: mesh.triangles.clone(),
        targets: mesh.targets.iter().map(target).collect(),
        morph: run,
        weights: if rest.iter().any(|w| *w != 0.0) { rest.to_vec() } else { vec![] },
    }
}

fn target(t: &MorphTarget) -> document::Target {
    let list = |of: &[Vec3]| of.iter().map(|d| d.to_array()).collect();
    document::Target { name: t.name.clone(), positions: list(&t.positions), normals: list(&t.normals) }
}

fn bind(binding: &Binding, names: &[String], posed: &Posed) -> Bind {
    let (palette, weights) = match binding {
        Binding::Bone(b) => return Bind::Rigid(names[b.index()].clone()),
        Binding::Skin { palette, weights } => (palette, weights),
    };
    // Say the inverse bind matrices only where they are not those that the reader computes.
    let usual = palette.iter().all(|(b, m)| *m == bone_from_rest(posed, *b));
    let influences = |v: usize| {
        let pairs = weights.of(v).filter(|w| w.1 > 0.0);
        pairs.map(|(b, w)| (b as u32, w)).collect()
    };
    Bind::Weights(document::Weights {
        bones: palette.iter().map(|(b, _)| names[b.index()].clone()).collect(),
        inverse_bind: if usual { Vec::new() } else { palette.iter().map(|(_, m)| rows(m)).collect() },
        vertices: (0..weights.vertex_count()).map(influences).collect(),
    })
}

fn material(
    m: &Material,
    name: &str,
    asset: &Asset,
    textures: &[String],
    warnings: &mut Vec<Warning>,
) -> document::Material {
    let base = Material::default();
    let rgb = |c: Vec3, usual: Vec3| (c != usual).then(|| Color(c.extend(1.0)));
    let map = m.diffuse_map.and_then(|t| textures.get(t.texture.0 as usize).cloned());
    let texture = |t: &TextureRef| asset.textures.get(t.texture.0 as usize);
    let (specular, shininess) = highlight(m, m.specular_map.as_ref().and_then(texture));
    let document = document::Material {
        name: name.into(),
        diffuse: (m.diffuse != base.diffuse).then_some(Color(m.diffuse)),
        specular: rgb(specular, base.specular),
        shininess: (shininess != base.shininess).then_some(shininess),
        emissive: rgb(m.emissive, base.emissive),
        texture: map,
        double_sided: m.double_sided,
        unlit: m.unlit,
    };
    let maps = [m.specular_map, m.emissive_map, m.normal_map, m.occlusion_map];
    let odd_map = m.diffuse_map.is_some_and(|t| t.uv_set != 0 || t.transform != glam::Affine2::IDENTITY);
    let sampled = |t: &Texture| (t.wrap(), t.filter());
    let usual = ([WrapMode::Repeat; 2], Filter::Trilinear);
    if m.diffuse_map.as_ref().and_then(texture).is_some_and(|t| sampled(t) != usual) {
        let what = "its texture's sampler left out: a rig's textures repeat and are filtered linearly";
        warn(warnings, format!("material `{name}`"), what);
    }
    if maps.iter().any(Option::is_some) || odd_map || (m.diffuse_map.is_some() && document.texture.is_none())
    {
        warn(warnings, format!("material `{name}`"), "maps left out: a rig has one plain diffuse texture");
    }
    let alpha = if m.diffuse.w < 1.0 { crate::scene::AlphaMode::Blend } else { base.alpha };
    if m.alpha != alpha {
        warn(
            warnings,
            format!("material `{name}`"),
            format!("{:?} left out: a rig blends by diffuse alpha", m.alpha),
        );
    }
    document
}

/// `k_s` and `p` without their map: with its mean.
fn highlight(m: &Material, map: Option<&Texture>) -> (Vec3, f32) {
    let Some(map) = map else { return (m.specular, m.shininess) };
    let coarsest = map.levels().last().map_or(&[][..], Vec::as_slice);
    let code = |c: usize| coarsest.get(c).copied().unwrap_or(255);
    let light = Vec3::from_array([0, 1, 2].map(|c| LINEAR_OF_SRGB8[usize::from(code(c))]));
    (m.specular * light, m.shininess.powf(f32::from(code(3)) / 255.0))
}

fn one_clip(c: &clip::Clip, names: &[String], runs: &[(usize, usize)], warnings: &mut Vec<Warning>) -> Clip {
    let mut tracks = Vec::with_capacity(c.tracks.len());
    for (i, t) in c.tracks.iter().enumerate() {
        match one_track(t, names, runs) {
            Some(track) => tracks.push(track),
            None => {
                let place = format!("clip `{}`, track {i}", c.name);
                warn(warnings, place, "weights of no mesh left out");
            }
        }
    }
    Clip { name: c.name.clone(), tracks, ..Default::default() }
}

fn one_track(t: &clip::Track, names: &[String], runs: &[(usize, usize)]) -> Option<Track> {
    let name = |b: &BoneId| names[b.index()].clone();
    let (interpolation, tangents) = match t.curve.interpolation() {
        clip::Interpolation::Hold => (Interpolation::Hold, None),
        clip::Interpolation::Linear => (Interpolation::Linear, None),
        clip::Interpolation::Hermite => (Interpolation::Hermite, None),
        clip::Interpolation::CatmullRom(rule) => (
            Interpolation::CatmullRom,
            Some(match rule {
                spline::Tangents::Notes => Tangents::Notes,
                spline::Tangents::ThreePoint => Tangents::ThreePoint,
                spline::Tangents::Monotone => Tangents::Monotone,
            }),
        ),
    };
    let track = Track { interpolation: Some(interpolation), tangents, ..Default::default() };
    Some(match &t.target {
        Target::Xzx(b) => {
            Track { bone: name(b), xzx_deg: Some(key_rows(&t.curve, shortest_degrees)), ..track }
        }
        Target::Rotation(b) => Track { bone: name(b), rotation: Some(key_rows(&t.curve, shortest)), ..track },
        Target::Translation(b) => {
            Track { bone: name(b), translation: Some(key_rows(&t.curve, shortest)), ..track }
        }
        Target::Scale(b) => Track { bone: name(b), scale: Some(key_rows(&t.curve, shortest)), ..track },
        Target::Weights { first } => {
            let run = runs.iter().position(|r| *r == (*first, t.curve.width()))?;
            Track { morph: Some(run), weights: Some(key_rows(&t.curve, shortest)), ..track }
        }
    })
}

fn key_rows(curve: &Curve, number: fn(f32) -> f64) -> Vec<Vec<f64>> {
    let each = curve.values().len() / curve.times().len();
    let row =
        |(t, values): (&f64, &[f32])| std::iter::once(*t).chain(values.iter().map(|v| number(*v))).collect();
    curve.times().iter().zip(curve.values().chunks(each)).map(row).collect()
}

/// The f64 of the shortest decimal that reads as this f32.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(value as f64)
}

/// The shortest number of degrees that reads as these radians.
fn shortest_degrees(radians: f32) -> f64 {
    let exact = (radians as f64).to_degrees();
    let short = (0..17).find_map(|digits| {
        let d: f64 = format!("{exact:.digits$e}").parse().ok()?;
        (d.to_radians() as f32 == radians).then_some(d)
    });
    short.unwrap_or(exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_short_and_come_back_exactly() {
        assert_eq!(shortest_degrees(30.0_f32.to_radians()), 30.0);
        let mut rng = crate::test_rng::Rng::new(9);
        for _ in 0..10_000 {
            let r = rng.range(-7.0, 7.0) as f32;
            assert_eq!(shortest_degrees(r).to_radians() as f32, r);
            assert_eq!(shortest(r) as f32, r);
        }
    }
}
