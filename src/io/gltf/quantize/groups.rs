//! Which meshes lie on one grid, and on which.

use super::Grid;
use crate::io::gltf::document::Document;
use crate::io::gltf::error::Result;
use ::gltf::json::accessor::Type;
use glam::Vec3;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};

/// For each mesh the first of those that share positions or a skin with it, or with one that does.
pub(super) fn groups(json: &Map<String, Value>) -> Vec<usize> {
    let meshes = array(json, "meshes");
    let mut above: Vec<usize> = (0..meshes.len()).collect();
    let mut owner: BTreeMap<(bool, u64), usize> = BTreeMap::new();
    let mut join = |what: (bool, u64), mesh: usize| {
        let [a, b] = [*owner.entry(what).or_insert(mesh), mesh].map(|m| first(&mut above, m));
        above[a.max(b)] = a.min(b);
    };
    for (m, mesh) in meshes.iter().enumerate() {
        positions(mesh).for_each(|(accessor, _)| accessor.into_iter().for_each(|a| join((false, a), m)));
    }
    for (mesh, node) in shown(json).filter(|(m, _)| *m < meshes.len()) {
        node["skin"].as_u64().into_iter().for_each(|s| join((true, s), mesh));
    }
    (0..above.len()).map(|m| first(&mut above, m)).collect()
}

/// The end of a chain, which is shortened on the way.
fn first(above: &mut [usize], mut m: usize) -> usize {
    while above[m] != m {
        above[m] = above[above[m]];
        m = above[m];
    }
    m
}

fn primitives(mesh: &Value) -> impl Iterator<Item = &Value> {
    mesh["primitives"].as_array().into_iter().flatten()
}

/// Accessors of positions, and whether they are differences.
fn positions(mesh: &Value) -> impl Iterator<Item = (Option<u64>, bool)> {
    primitives(mesh).flat_map(|p| {
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

/// How far a group of meshes reaches.
#[derive(Clone)]
struct Reach {
    low: Vec3,
    high: Vec3,
    /// The largest difference that a morph target adds.
    shift: f32,
    /// All of it can lie on a grid.
    fits: bool,
}

/// The grid of each group; none if some of it must stay as it is.
pub(super) fn grids(
    json: &Map<String, Value>,
    doc: &Document,
    groups: &[usize],
) -> Result<Vec<Option<Grid>>> {
    let float =
        |index: u64| array(json, "accessors").get(index as usize).is_some_and(|a| a["componentType"] == 5126);
    let none = Reach { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, shift: 0.0, fits: true };
    let mut reaches = vec![none; groups.len()];
    let meshes = array(json, "meshes");
    let mut seen = BTreeSet::new();
    for (m, mesh) in meshes.iter().enumerate() {
        let reach = &mut reaches[groups[m]];
        reach.fits &=
            !primitives(mesh).any(|p| p.pointer("/extensions/KHR_draco_mesh_compression").is_some());
        for (accessor, difference) in positions(mesh) {
            match accessor.filter(|a| float(*a)) {
                Some(accessor) if seen.insert((accessor, difference)) => {
                    reach.add(doc, accessor, difference)?
                }
                Some(_) => (),
                None => reach.fits = false,
            }
        }
    }
    for (m, node) in shown(json).filter(|(m, _)| *m < meshes.len()) {
        let skin = node["skin"].as_u64().map(|s| array(json, "skins").get(s as usize));
        let matrices = |s: &Value| s["inverseBindMatrices"].as_u64().is_none_or(float);
        let bound = |p: &Value| ["JOINTS_0", "WEIGHTS_0"].iter().all(|k| p["attributes"].get(k).is_some());
        // Instances have transforms of their own between the node and the mesh.
        reaches[groups[m]].fits &= node.pointer("/extensions/EXT_mesh_gpu_instancing").is_none()
            && skin.is_none_or(|s| s.is_some_and(matrices) && primitives(&meshes[m]).all(bound));
    }
    Ok(reaches.iter().map(Reach::grid).collect())
}

impl Reach {
    fn add(&mut self, doc: &Document, accessor: u64, difference: bool) -> Result<()> {
        for p in doc.floats(accessor as usize, &[Type::Vec3], "POSITION")?.iter().map(Vec3::from_slice) {
            self.fits &= p.is_finite();
            if difference {
                self.shift = self.shift.max(p.abs().max_element());
            } else {
                (self.low, self.high) = (self.low.min(p), self.high.max(p));
            }
        }
        Ok(())
    }

    fn grid(&self) -> Option<Grid> {
        let center = 0.5 * (self.low + self.high);
        let reach = (self.high - center).max(center - self.low).max_element().max(self.shift);
        // Rounding must not put the farthest beyond 1.
        let scale = if reach > 0.0 { reach.next_up() } else { 1.0 };
        (self.fits && center.is_finite() && scale.is_normal()).then_some(Grid { center, scale })
    }
}
