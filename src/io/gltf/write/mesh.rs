//! Meshes: vertices, influences and morph targets as accessors.

use crate::asset::Asset;
use crate::character::{Binding, Instance};
use crate::io::Warning;
use crate::io::gltf::rewrite::Rewritten;
use crate::mesh::{Mesh, MorphTarget};
use crate::skin::Weights;
use glam::{Vec3, Vec4};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// What was written of meshes that several instances share.
pub(super) struct Meshes<'a> {
    asset: &'a Asset,
    shared: BTreeMap<u32, Value>,
}

impl<'a> Meshes<'a> {
    pub fn new(asset: &'a Asset) -> Self {
        Self { asset, shared: BTreeMap::new() }
    }

    /// One glTF mesh of some instances; none where there are no triangles.
    pub fn write(
        &mut self,
        out: &mut Rewritten,
        group: &[usize],
        warnings: &mut Vec<Warning>,
    ) -> Option<usize> {
        let character = &self.asset.character;
        let mut primitives = vec![];
        for &i in group {
            let instance = &character.instances()[i];
            let mesh = character.mesh(instance);
            if mesh.positions.is_empty() || mesh.triangles.is_empty() {
                let message = "left out: it has no triangles".to_owned();
                warnings.push(Warning { place: format!("mesh `{}`", mesh.name), message });
                continue;
            }
            let mut primitive =
                self.shared.entry(instance.mesh.0).or_insert_with(|| surface(out, mesh)).clone();
            if let Binding::Skin { weights, .. } = &instance.binding {
                influences(out, weights, &mut primitive["attributes"]);
            }
            if let Some(m) = mesh.material.filter(|m| (m.0 as usize) < self.asset.materials.len()) {
                primitive["material"] = m.0.into();
            }
            primitives.push(primitive);
        }
        let first: &Instance = &character.instances()[group[0]];
        let mut json = json!({"primitives": primitives});
        if !character.mesh(first).name.is_empty() {
            json["name"] = character.mesh(first).name.clone().into();
        }
        let targets = character.mesh(first).targets.len();
        if targets > 0 {
            let rest = character.rest_pose().weights;
            json["weights"] = json!(rest[first.first_weight..first.first_weight + targets]);
            let names: Vec<&str> = character.mesh(first).targets.iter().map(|t| &t.name[..]).collect();
            if names.iter().any(|n| !n.is_empty()) {
                json["extras"] = json!({"targetNames": names});
            }
        }
        (!primitives.is_empty()).then(|| out.push("meshes", json))
    }
}

/// What does not depend on who carries the mesh.
fn surface(out: &mut Rewritten, mesh: &Mesh) -> Value {
    let mut a = Map::new();
    a.insert("POSITION".into(), out.floats(&flat(&mesh.positions), "VEC3", 3, true).into());
    if !mesh.normals.is_empty() {
        let unit: Vec<Vec3> = mesh.normals.iter().map(|n| n.normalize_or(Vec3::Y)).collect();
        a.insert("NORMAL".into(), out.floats(&flat(&unit), "VEC3", 3, false).into());
    }
    if !mesh.tangents.is_empty() && !mesh.normals.is_empty() {
        let unit = |t: &Vec4| t.truncate().normalize_or(Vec3::X).extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        let unit: Vec<f32> = mesh.tangents.iter().flat_map(|t| unit(t).to_array()).collect();
        a.insert("TANGENT".into(), out.floats(&unit, "VEC4", 4, false).into());
    }
    // The second set needs a first.
    for (k, uvs) in mesh.uvs.iter().enumerate().take_while(|(_, uvs)| !uvs.is_empty()) {
        let uvs: Vec<f32> = uvs.iter().flat_map(|p| p.to_array()).collect();
        a.insert(format!("TEXCOORD_{k}"), out.floats(&uvs, "VEC2", 2, false).into());
    }
    if !mesh.colors.is_empty() {
        let colors: Vec<f32> =
            mesh.colors.iter().flat_map(|c| c.clamp(Vec4::ZERO, Vec4::ONE).to_array()).collect();
        a.insert("COLOR_0".into(), out.floats(&colors, "VEC4", 4, false).into());
    }
    let mut json = json!({"attributes": a, "indices": indices(out, mesh)});
    if !mesh.targets.is_empty() {
        let targets = mesh.targets.iter().map(|t| target(out, t, mesh.positions.len()));
        json["targets"] = targets.collect::<Vec<_>>().into();
    }
    json
}

fn target(out: &mut Rewritten, t: &MorphTarget, vertices: usize) -> Value {
    let zeros = || vec![Vec3::ZERO; vertices];
    let positions = if t.positions.is_empty() { zeros() } else { t.positions.clone() };
    let mut a = json!({"POSITION": out.floats(&flat(&positions), "VEC3", 3, true)});
    for (key, list) in [("NORMAL", &t.normals), ("TANGENT", &t.tangents)] {
        if !list.is_empty() {
            a[key] = out.floats(&flat(list), "VEC3", 3, false).into();
        }
    }
    a
}

fn indices(out: &mut Rewritten, mesh: &Mesh) -> usize {
    let all = mesh.triangles.iter().flatten();
    // The largest number of each width is reserved.
    let (kind, bytes): (u32, Vec<u8>) = match mesh.positions.len() {
        ..=65_535 => (5123, all.flat_map(|i| (*i as u16).to_le_bytes()).collect()),
        _ => (5125, all.flat_map(|i| i.to_le_bytes()).collect()),
    };
    let accessor = json!({"componentType": kind, "count": 3 * mesh.triangles.len(), "type": "SCALAR"});
    out.accessor(&bytes, accessor)
}

/// Sets of four bones and weights.
pub(in crate::io::gltf) fn influences(out: &mut Rewritten, weights: &Weights, attributes: &mut Value) {
    let rows: Vec<Vec<(usize, f32)>> = (0..weights.vertex_count()).map(|v| row(weights, v)).collect();
    let most = rows.iter().map(Vec::len).max().unwrap_or(0);
    let wide = rows.iter().flatten().any(|w| w.0 > 255);
    for set in 0..most.div_ceil(4).max(1) {
        let (mut bones, mut values) = (vec![], vec![]);
        for row in &rows {
            for slot in 4 * set..4 * set + 4 {
                let (bone, weight) = row.get(slot).copied().unwrap_or((0, 0.0));
                bones.extend(&(bone as u16).to_le_bytes()[..if wide { 2 } else { 1 }]);
                values.push(weight);
            }
        }
        let kind = if wide { 5123 } else { 5121 };
        let accessor = json!({"componentType": kind, "count": rows.len(), "type": "VEC4"});
        attributes[format!("JOINTS_{set}")] = out.accessor(&bones, accessor).into();
        attributes[format!("WEIGHTS_{set}")] = out.floats(&values, "VEC4", 4, false).into();
    }
}

/// Each bone once.
fn row(weights: &Weights, vertex: usize) -> Vec<(usize, f32)> {
    let mut out: Vec<(usize, f32)> = vec![];
    for (bone, w) in weights.of(vertex).filter(|w| w.1 > 0.0) {
        match out.iter_mut().find(|o| o.0 == bone) {
            Some(known) => known.1 += w,
            None => out.push((bone, w)),
        }
    }
    out
}

fn flat(list: &[Vec3]) -> Vec<f32> {
    list.iter().flat_map(|p| p.to_array()).collect()
}
