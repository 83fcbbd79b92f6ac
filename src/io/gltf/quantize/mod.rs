//! Vertices in small integers: KHR_mesh_quantization.
//!
//! Meshes that share positions or a skin lie on one grid, `position = center + scale · q`. What undoes it is folded into the inverse bind
//! matrices of skins, and elsewhere stands on a node of its own between the mesh and the node that carried it, so that nothing but the mesh
//! notices.

mod groups;
mod influences;
mod measured;
mod pool;

use super::document::Document;
use super::error::Result;
use super::mend;
use super::prune;
use super::rewrite::{Rewritten, list};
use super::warnings::Warnings;
pub use measured::vertices_of;

use ::gltf::json::accessor::Type;
use glam::{Affine3A, DVec3, DVec4, Vec3};
use pool::{Int, Pool};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

const NAME: &str = "KHR_mesh_quantization";

/// How finely the vertices of a mesh are stored; whatever has no bound of its own (directions, colours, texture coordinates) always is in integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshForm {
    /// Positions and what morph targets add to them are 16-bit integers.
    pub positions: bool,
    /// Bits of an influence's weight: 8, 16 or 32.
    pub weights: u8,
}

impl Default for MeshForm {
    /// The coarsest.
    fn default() -> Self {
        Self { positions: true, weights: 8 }
    }
}

/// Where integers of a group of meshes stand for which positions.
#[derive(Clone, Copy)]
struct Grid {
    center: Vec3,
    scale: f32,
}

impl Rewritten {
    /// Store vertices in integers, and what was stored as floats no more. `forms` are by groups, those that are missing the coarsest; returned
    /// is the group of each mesh. What cannot be (compressed by Draco, instanced, integers already) stays as it is.
    ///
    /// # Errors
    /// [`GltfError`](super::GltfError) if what the file says of its vertices does not hold.
    pub fn quantize(&mut self, forms: &BTreeMap<usize, MeshForm>) -> Result<Vec<usize>> {
        let groups = groups::groups(&self.json);
        if groups.is_empty() || self.stranger().is_some() {
            return Ok(groups);
        }
        let mut w = Warnings::default();
        let root = mend::root(&self.with_buffer(None), &mut w)?;
        let bin = std::mem::take(&mut self.bin);
        let doc = Document::new(root, Some(&bin), None, &mut w)?;
        let form = |group: usize| forms.get(&group).copied().unwrap_or_default();
        let mut work = Work { doc: &doc, json: &mut self.json, pool: Pool::default(), quantized: false };
        let mut grids = BTreeMap::new();
        for group in groups.iter().copied().filter(|&g| form(g).positions) {
            if !grids.contains_key(&group) {
                grids.insert(group, groups::grid(work.json, &doc, &groups, group)?);
            }
        }
        let grid = |mesh: usize| grids.get(&groups[mesh]).copied().flatten().map(|g| (groups[mesh], g));
        for mesh in 0..groups.len() {
            for p in 0..work.json["meshes"][mesh]["primitives"].as_array().map_or(0, Vec::len) {
                let mut primitive = work.json["meshes"][mesh]["primitives"][p].take();
                work.primitive(&mut primitive, grid(mesh), form(groups[mesh]).weights)?;
                work.json["meshes"][mesh]["primitives"][p] = primitive;
            }
        }
        work.nodes(&grid)?;
        let Work { pool, quantized, .. } = work;
        let old: Vec<u64> = pool.replaced().collect();
        drop(doc);
        self.bin = bin;
        pool.append(self);
        let torn = prune::drop_accessors(&mut self.json, &old);
        let bin = std::mem::take(&mut self.bin);
        self.bin = prune::repack(&mut self.json, |buffer| (buffer == 0).then_some(&bin[..]));
        self.split(&torn, false)?;
        if quantized {
            self.requires(NAME);
        }
        Ok(groups)
    }

    /// An extension that this file uses and that may name accessors where nobody here looks for them: its vertices stay as they are.
    pub fn stranger(&self) -> Option<&str> {
        prune::stranger(&self.json)
    }
}

/// A file on its way.
struct Work<'a> {
    doc: &'a Document<'a>,
    json: &'a mut Map<String, Value>,
    pool: Pool,
    /// Something is stored as only the extension allows.
    quantized: bool,
}

impl Work<'_> {
    fn primitive(&mut self, primitive: &mut Value, grid: Option<(usize, Grid)>, weights: u8) -> Result<()> {
        if primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some() {
            return Ok(());
        }
        if let Some((group, grid)) = grid {
            let (center, scale) = (grid.center.as_dvec3().extend(0.0), grid.scale as f64);
            let of = move |v: DVec4| (v - center) / scale;
            self.integers(&mut primitive["attributes"], "POSITION", Int::I16, group, true, of)?;
            let of = move |v: DVec4| v / scale;
            for target in primitive.get_mut("targets").and_then(Value::as_array_mut).into_iter().flatten() {
                self.integers(target, "POSITION", Int::I16, group, true, of)?;
            }
            self.quantized = true;
        }
        let plain = |v: DVec4| v;
        let unit = |v: DVec4| v.truncate().normalize_or(v.truncate()).extend(v.w);
        let lists = [&primitive["attributes"]]
            .into_iter()
            .chain(primitive["targets"].as_array().into_iter().flatten());
        let mut lists: Vec<Value> = lists.cloned().collect();
        for (i, list) in lists.iter_mut().enumerate() {
            for key in keys(list) {
                let is = |name: &str| key.starts_with(name);
                if is("NORMAL") || is("TANGENT") {
                    // What morph targets add has any length.
                    let of: &dyn Fn(DVec4) -> DVec4 = if i == 0 { &unit } else { &plain };
                    self.quantized |= self.integers(list, &key, Int::I8, usize::from(i > 0), false, of)?;
                } else if i == 0 && (is("TEXCOORD_") || is("COLOR_")) {
                    self.integers(list, &key, Int::U16, 0, false, plain)?;
                }
            }
        }
        if weights < 32 {
            self.influences(&mut lists[0], if weights == 8 { Int::U8 } else { Int::U16 })?;
        }
        primitive["attributes"] = lists[0].take();
        if primitive.get("targets").is_some() {
            primitive["targets"] = lists.drain(1..).collect::<Vec<_>>().into();
        }
        self.indices(primitive)
    }

    /// Replace an attribute that is floats, none of which leaves what the integers hold; whether it is integers now.
    fn integers(
        &mut self,
        attributes: &mut Value,
        key: &str,
        int: Int,
        group: usize,
        bounds: bool,
        of: impl Fn(DVec4) -> DVec4,
    ) -> Result<bool> {
        let Some(from) = self.float(&attributes[key]) else { return Ok(false) };
        let tag = (vec![from], int, group, key.starts_with("POSITION"));
        if let Some(known) = self.pool.known(&tag) {
            attributes[key] = known[0].into();
            return Ok(true);
        }
        let shapes = [Type::Vec2, Type::Vec3, Type::Vec4];
        let elements = self.doc.floats(from as usize, &shapes, key)?;
        let least = if int.signed() { -1.0 } else { 0.0 };
        let width = elements.width;
        let row = |v: &[f32]| {
            let at = |k: usize| v.get(k).copied().unwrap_or(0.0) as f64;
            of(DVec4::new(at(0), at(1), at(2), at(3))).to_array().into_iter().take(width)
        };
        let values: Vec<f64> = elements.iter().flat_map(row).collect();
        // Rounding alone may lead a little beyond.
        if !values.iter().all(|v| (least - 1e-6..=1.0 + 1e-6).contains(v)) {
            return Ok(false);
        }
        let numbers: Vec<i32> = values.iter().map(|v| int.of(v.clamp(least, 1.0))).collect();
        // Few differences stay few.
        let accessor = self.accessor(from);
        let sparse = accessor.get("sparse").is_some() && accessor.get("bufferView").is_none();
        let base = self.count();
        let done = self.pool.vertices(base, &numbers, width, int, bounds, sparse);
        list(self.json, "accessors").push(done);
        self.pool.remember(tag, vec![base]);
        attributes[key] = base.into();
        Ok(true)
    }

    /// Triangles' indices, in 16 bits where they fit; fewer are no format of graphics processors.
    fn indices(&mut self, primitive: &mut Value) -> Result<()> {
        let Some(from) = primitive["indices"].as_u64() else { return Ok(()) };
        if self.accessor(from)["componentType"] != 5125 {
            return Ok(());
        }
        let tag = (vec![from], Int::U16, 0, false);
        if let Some(known) = self.pool.known(&tag) {
            primitive["indices"] = known[0].into();
            return Ok(());
        }
        let all = self.doc.integers(from as usize, &[Type::Scalar], "indices")?.values;
        // The largest number is reserved.
        if all.iter().any(|i| *i >= 65_535) {
            return Ok(());
        }
        let base = self.count();
        let done = self.pool.indices(base, &all);
        list(self.json, "accessors").push(done);
        self.pool.remember(tag, vec![base]);
        primitive["indices"] = base.into();
        Ok(())
    }

    /// The index of an accessor of floats.
    fn float(&self, index: &Value) -> Option<u64> {
        let index = index.as_u64()?;
        (self.accessor(index)["componentType"] == 5126).then_some(index)
    }

    fn accessor(&self, index: u64) -> &Value {
        self.json.get("accessors").map_or(&Value::Null, |all| &all[index as usize])
    }

    fn count(&mut self) -> u64 {
        list(self.json, "accessors").len() as u64
    }

    /// Undo the grids where meshes are shown.
    fn nodes(&mut self, grid: &impl Fn(usize) -> Option<(usize, Grid)>) -> Result<()> {
        let mut skins = BTreeMap::new();
        for n in 0..list(self.json, "nodes").len() {
            let node = &mut self.json["nodes"][n];
            let Some((_, grid)) = node["mesh"].as_u64().and_then(|m| grid(m as usize)) else { continue };
            if let Some(skin) = node["skin"].as_u64() {
                skins.insert(skin as usize, grid);
                continue;
            }
            let mut own = json!({"scale": Vec3::splat(grid.scale).to_array()});
            if grid.center != Vec3::ZERO {
                own["translation"] = json!(grid.center.to_array());
            }
            let node = node.as_object_mut().expect("it has a mesh");
            for key in ["mesh", "weights"] {
                node.remove(key).into_iter().for_each(|v| own[key] = v);
            }
            let nodes = list(self.json, "nodes");
            let child = nodes.len();
            nodes.push(own);
            super::write::adopt(&mut nodes[n], child);
            self.follow(n, child);
        }
        for (skin, grid) in skins {
            self.skin(skin, grid)?;
        }
        Ok(())
    }

    /// What moves the morph weights of a node moves those of its child.
    fn follow(&mut self, node: usize, child: usize) {
        let old = format!("/nodes/{node}/weights");
        for animation in list(self.json, "animations") {
            for target in animation
                .get_mut("channels")
                .and_then(Value::as_array_mut)
                .into_iter()
                .flatten()
                .filter_map(|c| c.get_mut("target"))
            {
                if target["path"] == "weights" && target["node"] == node {
                    target["node"] = child.into();
                }
                let Some(pointer) = target.pointer_mut("/extensions/KHR_animation_pointer/pointer") else {
                    continue;
                };
                let rest = pointer.as_str().and_then(|p| p.strip_prefix(&old)).map(str::to_owned);
                if let Some(rest) = rest.filter(|r| r.is_empty() || r.starts_with('/')) {
                    *pointer = format!("/nodes/{child}/weights{rest}").into();
                }
            }
        }
    }

    /// Inverse bind matrices behind which vertices lie on a grid.
    fn skin(&mut self, skin: usize, grid: Grid) -> Result<()> {
        let place = format!("skins[{skin}].inverseBindMatrices");
        let from = self.json["skins"][skin]["inverseBindMatrices"].as_u64();
        let joints = self.json["skins"][skin]["joints"].as_array().map_or(0, Vec::len);
        let mut matrices = match from {
            Some(from) => self.doc.floats(from as usize, &[Type::Mat4], &place)?.values,
            None => (0..joints).flat_map(|_| super::write::columns(&Affine3A::IDENTITY)).collect(),
        };
        for m in matrices.chunks_exact_mut(16) {
            let column = |k: usize| DVec3::new(m[4 * k] as f64, m[4 * k + 1] as f64, m[4 * k + 2] as f64);
            let c = grid.center.as_dvec3();
            let (s, moved) =
                (grid.scale as f64, column(0) * c.x + column(1) * c.y + column(2) * c.z + column(3));
            let columns = [column(0) * s, column(1) * s, column(2) * s, moved];
            for (k, v) in columns.into_iter().enumerate() {
                m[4 * k..4 * k + 3].copy_from_slice(&v.as_vec3().to_array());
            }
        }
        let base = self.count();
        let done = self.pool.floats(base, &matrices);
        list(self.json, "accessors").push(done);
        self.pool.remember((from.into_iter().collect(), Int::I16, skin, false), vec![base]);
        self.json["skins"][skin]["inverseBindMatrices"] = base.into();
        Ok(())
    }
}

fn keys(list: &Value) -> Vec<String> {
    list.as_object().into_iter().flat_map(|o| o.keys().cloned()).collect()
}
