//! Primitives become meshes, and nodes that show them become instances.

use super::attributes::{self, Source};
use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use super::nodes::{Nodes, bone};
use super::skins::{self, Influences};
use super::triangles::triangles;
use super::warnings::Warnings;
use crate::character::{Binding, Instance, MeshId};
use crate::io::PrimitiveSource;
use crate::mesh::{MaterialId, Mesh, MeshData};
use ::gltf::json::mesh::{Mode, Primitive};
use ::gltf::json::validation::Checked;
use std::collections::{BTreeMap, BTreeSet};

/// Bytes that a frame keeps for each vertex of an instance: position, normal, tangent.
const INSTANCE_BYTES: u64 = 40;

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
    /// Materials that primitives with triangles use.
    pub drawn: BTreeSet<usize>,
    done: BTreeMap<(usize, usize), Option<Built>>,
}

/// A primitive that was read.
struct Built {
    mesh: MeshId,
    influences: Option<Influences>,
}

/// Build all instances of the scene, nodes in the order of the file.
pub(super) fn build(doc: &Document, nodes: &Nodes, w: &mut Warnings) -> Result<Geometry> {
    let mut out = Geometry::default();
    let mut skins = skins::Skins::default();
    let mut shown = vec![false; doc.root.meshes.len()];
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
        shown[mesh] = true;
        out.node(doc, nodes, &mut skins, node, mesh, w)?;
    }
    for (i, _) in doc.root.meshes.iter().enumerate().filter(|(i, _)| !shown[*i]) {
        w.push(format!("meshes[{i}]"), "no node of the scene shows it; left out");
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
            self.read(doc, mesh, p, primitive, &place, w)?;
            let Some(Some(built)) = self.done.get(&(mesh, p)) else { continue };
            let count = self.meshes[built.mesh.0 as usize].positions.len();
            let skin = doc.root.nodes[node].skin.map(|s| s.value());
            let binding = match (skin, &built.influences) {
                (Some(skin), Some(i)) => skins.bind(doc, nodes, (node, skin), i, count, &place, w)?,
                (skin, _) => {
                    if skin.is_some() {
                        w.push(&place, "has a skin but no joints and weights; it moves with its node");
                    }
                    Binding::Bone(bone(nodes, node, || place.clone())?)
                }
            };
            let bytes = 256 + count as u64 * INSTANCE_BYTES;
            doc.charge(bytes, &format!("nodes[{node}] (an instance of {count} vertices of {place})"))?;
            self.instances.push(Instance { mesh: built.mesh, binding, first_weight: run });
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
        doc.charge(count as u64 * 4, &format!("nodes[{node}].weights"))?;
        let first = self.rest_weights.len();
        self.rest_weights.extend((0..count).map(|k| given.get(k).copied().unwrap_or(0.0)));
        self.runs.0.insert(node, (first, count));
        Ok(first)
    }

    /// Read a primitive, once.
    fn read(
        &mut self,
        doc: &Document,
        mesh: usize,
        p: usize,
        primitive: &Primitive,
        place: &str,
        w: &mut Warnings,
    ) -> Result<()> {
        if self.done.contains_key(&(mesh, p)) {
            return Ok(());
        }
        let name = doc.root.meshes[mesh].name.clone().unwrap_or_else(|| format!("mesh_{mesh}"));
        let mut data = MeshData { name: format!("{name}.{p}"), ..Default::default() };
        let source = Source::new(doc, primitive, place)?;
        let built = match source.fill(&mut data, w)? {
            true => {
                let names = target_names(&doc.root.meshes[mesh]);
                data.targets.iter_mut().zip(names).for_each(|(target, name)| target.name = name);
                let influences = skins::influences(doc, &source, place)?;
                let mut mode = primitive.mode;
                if source.is_packed() {
                    // Compressed streams hold whole triangles, whatever the primitive says.
                    mode = Checked::Valid(Mode::Triangles);
                }
                let mesh = self.mesh(doc, primitive, mode, data, source.indices()?, place, w)?;
                self.meshes.push(mesh);
                Some(Built { mesh: MeshId(self.meshes.len() as u32 - 1), influences })
            }
            false => {
                w.push(place, "has no positions; left out");
                None
            }
        };
        self.done.insert((mesh, p), built);
        Ok(())
    }

    /// Triangles, material and what follows from them.
    fn mesh(
        &mut self,
        doc: &Document,
        primitive: &Primitive,
        mode: Checked<Mode>,
        mut data: MeshData,
        indices: Option<Vec<u32>>,
        place: &str,
        w: &mut Warnings,
    ) -> Result<Mesh> {
        let Checked::Valid(mode) = mode else {
            return Err(value(format!("{place}.mode"), "0 to 6", "another number"));
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            w.push(place, "is made of points or lines, which are not drawn; its vertices were kept");
        }
        data.triangles = triangles(mode, indices, data.positions.len(), place, w)?;
        let material = self.material(doc, primitive, place)?;
        if !data.triangles.is_empty() {
            self.drawn.insert(material.0 as usize);
        }
        data.material = Some(material);
        attributes::complete(doc, primitive, &mut data);
        Mesh::new(data).map_err(|source| GltfError::Mesh { place: place.into(), source })
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

/// What programs call the shapes of a mesh, in the place that they agree on: `extras.targetNames`.
fn target_names(mesh: &::gltf::json::Mesh) -> Vec<String> {
    #[derive(serde::Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Extras {
        target_names: Vec<String>,
    }
    let read = |text: &str| serde_json::from_str(text).ok();
    let extras: Option<Extras> = mesh.extras.as_ref().and_then(|e| read(e.get()));
    extras.map_or(vec![], |e| e.target_names)
}
