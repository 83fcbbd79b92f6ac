//! Which meshes lie on one grid, and on which.

use super::Grid;
use crate::io::gltf::document::Document;
use crate::io::gltf::error::Result;
use ::gltf::json::accessor::Type;
use glam::Vec3;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// For each mesh the first of those that share positions or a skin with it, or with one that does.
pub(super) fn groups(json: &Map<String, Value>) -> Vec<usize> {
    let meshes = array(json, "meshes");
    let mut group: Vec<usize> = (0..meshes.len()).collect();
    let mut owner: BTreeMap<(bool, u64), usize> = BTreeMap::new();
    let mut join = |what: (bool, u64), mesh: usize| {
        let [a, b] = [group[*owner.entry(what).or_insert(mesh)], group[mesh]];
        group.iter_mut().filter(|g| **g == a.max(b)).for_each(|g| *g = a.min(b));
    };
    for (m, mesh) in meshes.iter().enumerate() {
        positions(mesh).for_each(|(accessor, _)| accessor.into_iter().for_each(|a| join((false, a), m)));
    }
    for (mesh, node) in shown(json).filter(|(m, _)| *m < meshes.len()) {
        node["skin"].as_u64().into_iter().for_each(|s| join((true, s), mesh));
    }
    group
}

/// Accessors of positions, and whether they are differences.
fn positions(mesh: &Value) -> impl Iterator<Item = (Option<u64>, bool)> {
    let primitives = mesh["primitives"].as_array().into_iter().flatten();
    primitives.flat_map(|p| {
        let targets = p["targets"].as_array().into_iter().flatten().filter_map(|t| t.get("POSITION"));
        let own = (p["attributes"]["POSITION"].as_u64(), false);
        std::iter::once(own).chain(targets.map(|t| (t.as_u64(), true)))
    })
}

fn array<'j>(json: &'j Map<String, Value>, key: &str) -> &'j [Value] {
    json.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// Nodes that have a mesh, behind it.
fn shown(json: &Map<String, Value>) -> impl Iterator<Item = (usize, &Value)> {
    array(json, "nodes").iter().filter_map(|n| Some((n["mesh"].as_u64()? as usize, n)))
}

/// The grid of a group; none if some of it must stay as it is.
pub(super) fn grid(
    json: &Map<String, Value>,
    doc: &Document,
    groups: &[usize],
    group: usize,
) -> Result<Option<Grid>> {
    let float =
        |index: u64| array(json, "accessors").get(index as usize).is_some_and(|a| a["componentType"] == 5126);
    let (mut low, mut high, mut shift) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0_f32);
    for (m, mesh) in array(json, "meshes").iter().enumerate().filter(|(m, _)| groups[*m] == group) {
        let bound = |p: &Value| ["JOINTS_0", "WEIGHTS_0"].iter().all(|k| p["attributes"].get(k).is_some());
        let draco = |p: &Value| p.pointer("/extensions/KHR_draco_mesh_compression").is_some();
        let primitives = array(mesh.as_object().unwrap_or(&Map::new()), "primitives").to_vec();
        let placed = |node: &Value| {
            let skin = node["skin"].as_u64().map(|s| array(json, "skins").get(s as usize));
            let matrices = |s: &Value| s["inverseBindMatrices"].as_u64().is_none_or(float);
            node.pointer("/extensions/EXT_mesh_gpu_instancing").is_none()
                && skin.is_none_or(|s| s.is_some_and(matrices) && primitives.iter().all(bound))
        };
        if primitives.iter().any(draco) || !shown(json).filter(|n| n.0 == m).all(|n| placed(n.1)) {
            return Ok(None);
        }
        for (accessor, difference) in positions(mesh) {
            let Some(accessor) = accessor.filter(|a| float(*a)) else { return Ok(None) };
            for p in doc.floats(accessor as usize, &[Type::Vec3], "POSITION")?.iter().map(Vec3::from_slice) {
                if !p.is_finite() {
                    return Ok(None);
                } else if difference {
                    shift = shift.max(p.abs().max_element());
                } else {
                    (low, high) = (low.min(p), high.max(p));
                }
            }
        }
    }
    let center = 0.5 * (low + high);
    let reach = (high - center).max(center - low).max_element().max(shift);
    // Rounding must not put the farthest beyond 1.
    let scale = if reach > 0.0 { reach.next_up() } else { 1.0 };
    Ok((center.is_finite() && scale.is_normal()).then_some(Grid { center, scale }))
}
