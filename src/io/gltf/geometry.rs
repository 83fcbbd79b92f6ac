//! Primitives become meshes, and nodes that show them become instances.

use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use super::nodes::{Nodes, bone};
use super::triangles::triangles;
use super::warnings::Warnings;
use super::{attributes, skins};
use crate::character::{Binding, Instance, MeshId};
use crate::io::PrimitiveSource;
use crate::mesh::{MaterialId, Mesh, MeshData};
use ::gltf::json::mesh::{Mode, Primitive};
use ::gltf::json::validation::Checked;
use std::collections::BTreeMap;

/// Where the morph weights of each node start, and how many it has.
#[derive(Default)]
pub(super) struct Runs(BTreeMap<usize, (usize, usize)>);

impl Runs {
    /// First weight and number of weights of a node's mesh.
    pub fn of(&self, node: usize) -> Option<(usize, usize)> {
        self.0.get(&node).copied()
    }
}

/// Everything that has vertices.
#[derive(Default)]
pub(super) struct Geometry {
    pub meshes: Vec<Mesh>,
    pub instances: Vec<Instance>,
    pub sources: Vec<PrimitiveSource>,
    pub rest_weights: Vec<f32>,
    pub runs: Runs,
    /// A primitive has no material of its own, so the default one is needed.
    pub default_material: bool,
    done: BTreeMap<(usize, usize), Option<MeshId>>,
}

/// Build all instances of the scene, nodes in the order of the file.
pub(super) fn build(doc: &Document, nodes: &Nodes, w: &mut Warnings) -> Result<Geometry> {
    let mut out = Geometry::default();
    let mut skins = skins::Skins::default();
    for &node in &nodes.in_scene {
        let json = &doc.root.nodes[node];
        let Some(mesh) = json.mesh else {
            if json.skin.is_some() {
                w.push(format!("nodes[{node}].skin"), "the node has no mesh; the skin is ignored");
            }
            continue;
        };
        let mesh = mesh.value();
        entry(&doc.root.meshes, mesh, "mesh", || format!("nodes[{node}].mesh"))?;
        out.node(doc, nodes, &mut skins, node, mesh, w)?;
    }
    Ok(out)
}

impl Geometry {
    fn node(
        &mut self,
        doc: &Document,
        nodes: &Nodes,
        skins: &mut skins::Skins,
        node: usize,
        mesh: usize,
        w: &mut Warnings,
    ) -> Result<()> {
        let json = &doc.root.meshes[mesh];
        let run = self.rest_run(doc, node, mesh, w)?;
        for (p, primitive) in json.primitives.iter().enumerate() {
            let place = format!("meshes[{mesh}].primitives[{p}]");
            let Some(id) = self.mesh(doc, mesh, p, primitive, &place, w)? else { continue };
            let skin = doc.root.nodes[node].skin.map(|s| s.value());
            let binding = match skin {
                Some(skin) => {
                    skins.bind(doc, nodes, node, skin, primitive, &self.meshes[id.0 as usize], &place, w)?
                }
                None => None,
            };
            let binding = match binding {
                Some(b) => b,
                None => Binding::Bone(bone(nodes, node, || place.clone())?),
            };
            self.instances.push(Instance { mesh: id, binding, first_weight: run });
            self.sources.push(PrimitiveSource { node: node as u32, mesh: mesh as u32, primitive: p as u32 });
        }
        Ok(())
    }

    /// The run of morph weights that all primitives of a node share: the node's own, else the mesh's, else zeros.
    fn rest_run(&mut self, doc: &Document, node: usize, mesh: usize, w: &mut Warnings) -> Result<usize> {
        let json = &doc.root.meshes[mesh];
        let counts = json.primitives.iter().map(|p| p.targets.as_ref().map_or(0, Vec::len));
        let count = counts.clone().max().unwrap_or(0);
        if counts.min().unwrap_or(0) != count {
            w.push(format!("meshes[{mesh}]"), "its primitives have unequal numbers of morph targets");
        }
        let own = &doc.root.nodes[node].weights;
        let given = own.as_ref().or(json.weights.as_ref()).map_or(&[][..], Vec::as_slice);
        if !given.is_empty() && given.len() != count {
            let message = format!("{} morph weights for {count} targets; missing ones are 0", given.len());
            w.push(format!("nodes[{node}]"), message);
        }
        if let Some(k) = given.iter().take(count).position(|x| !x.is_finite()) {
            return Err(value(format!("nodes[{node}].weights[{k}]"), "a finite number", "infinity"));
        }
        let first = self.rest_weights.len();
        self.rest_weights.extend((0..count).map(|k| given.get(k).copied().unwrap_or(0.0)));
        self.runs.0.insert(node, (first, count));
        Ok(first)
    }

    /// The mesh of a primitive, built once; `None` where there are no positions.
    fn mesh(
        &mut self,
        doc: &Document,
        mesh: usize,
        p: usize,
        primitive: &Primitive,
        place: &str,
        w: &mut Warnings,
    ) -> Result<Option<MeshId>> {
        if let Some(done) = self.done.get(&(mesh, p)) {
            return Ok(*done);
        }
        let built = self.build_mesh(doc, mesh, p, primitive, place, w)?;
        let id = built.map(|m| {
            self.meshes.push(m);
            MeshId(self.meshes.len() as u32 - 1)
        });
        self.done.insert((mesh, p), id);
        Ok(id)
    }

    fn build_mesh(
        &mut self,
        doc: &Document,
        mesh: usize,
        p: usize,
        primitive: &Primitive,
        place: &str,
        w: &mut Warnings,
    ) -> Result<Option<Mesh>> {
        let name = doc.root.meshes[mesh].name.clone().unwrap_or_else(|| format!("mesh_{mesh}"));
        let mut data = MeshData { name: format!("{name}.{p}"), ..Default::default() };
        let indices = attributes::read(doc, primitive, &mut data, place, w)?;
        let Some(indices) = indices else {
            w.push(place, "has no positions; left out");
            return Ok(None);
        };
        let Checked::Valid(mode) = primitive.mode else {
            return Err(value(format!("{place}.mode"), "0 to 6", "another number"));
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            w.push(place, "is made of points or lines, which are not drawn; its vertices were kept");
        }
        data.triangles = triangles(mode, indices, data.positions.len(), place, w)?;
        data.material = Some(self.material(doc, primitive, place)?);
        attributes::complete(doc, primitive, &mut data);
        Mesh::new(data).map(Some).map_err(|source| GltfError::Mesh { place: place.into(), source })
    }

    fn material(&mut self, doc: &Document, primitive: &Primitive, place: &str) -> Result<MaterialId> {
        let materials = &doc.root.materials;
        let Some(m) = primitive.material else {
            self.default_material = true;
            return Ok(MaterialId(materials.len() as u32));
        };
        entry(materials, m.value(), "material", || format!("{place}.material"))?;
        Ok(MaterialId(m.value() as u32))
    }
}
