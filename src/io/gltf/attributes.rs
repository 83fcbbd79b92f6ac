//! Vertex attributes of a primitive, its morph targets and its indices.

use super::accessor::Elements;
use super::document::Document;
use super::draco::{self, Decoded};
use super::error::Result;
use super::warnings::Warnings;
use crate::mesh::normals;
use crate::mesh::{MeshData, MorphTarget};
use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3, Vec4};

/// Index of the accessor of an attribute.
pub(super) fn accessor(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|i| i.value())
}

/// Where the vertices of a primitive come from: its accessors, or a compressed stream.
pub(super) struct Source<'a> {
    doc: &'a Document<'a>,
    primitive: &'a Primitive,
    place: &'a str,
    packed: Option<Decoded>,
}

impl<'a> Source<'a> {
    /// Decode the primitive's stream, if it has one.
    pub fn new(doc: &'a Document<'a>, primitive: &'a Primitive, place: &'a str) -> Result<Self> {
        Ok(Self { doc, primitive, place, packed: draco::decode(doc, primitive, place)? })
    }

    /// The vertices come from a compressed stream.
    pub fn is_packed(&self) -> bool {
        self.packed.is_some()
    }

    /// Fill in all lists but the triangles; `false` where the primitive has no positions.
    pub fn fill(&self, data: &mut MeshData, w: &mut Warnings) -> Result<bool> {
        let Some(positions) = self.floats(Semantic::Positions, &[Type::Vec3])? else { return Ok(false) };
        if positions.values.is_empty() {
            return Ok(false);
        }
        data.positions = positions.iter().map(Vec3::from_slice).collect();
        if let Some(v) = self.floats(Semantic::Normals, &[Type::Vec3])? {
            data.normals = v.iter().map(Vec3::from_slice).collect();
        }
        if let Some(v) = self.floats(Semantic::Tangents, &[Type::Vec4])? {
            data.tangents = v.iter().map(Vec4::from_slice).collect();
        }
        for set in 0..2 {
            if let Some(v) = self.floats(Semantic::TexCoords(set), &[Type::Vec2])? {
                data.uvs[set as usize] = v.iter().map(Vec2::from_slice).collect();
            }
        }
        if let Some(v) = self.floats(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? {
            // RGB means opaque.
            let one = |c: &[f32]| Vec4::new(c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0));
            data.colors = v.iter().map(one).collect();
        }
        data.targets = self.targets()?;
        sane(data, self.place, w);
        left_out(self.primitive, self.place, w);
        Ok(true)
    }

    /// The indices, if there are any.
    pub fn indices(&self) -> Result<Option<Vec<u32>>> {
        match (&self.packed, self.primitive.indices) {
            (Some(packed), _) => Ok(Some(packed.indices())),
            (None, Some(i)) => {
                let place = format!("{}.indices", self.place);
                Ok(Some(self.doc.integers(i.value(), &[Type::Scalar], &place)?.values))
            }
            (None, None) => Ok(None),
        }
    }

    /// An attribute as f32.
    pub fn floats(&self, semantic: Semantic, shapes: &[Type]) -> Result<Option<Elements<f32>>> {
        let Some(index) = accessor(self.primitive, semantic.clone()) else { return Ok(None) };
        let place = self.at(&semantic);
        if let Some(values) = self.unpacked(&semantic, index, shapes, &place)? {
            return Ok(Some(values));
        }
        Ok(Some(self.doc.floats(index, shapes, &place)?))
    }

    /// An attribute of whole numbers.
    pub fn integers(&self, semantic: Semantic, shapes: &[Type]) -> Result<Option<Elements<u32>>> {
        let Some(index) = accessor(self.primitive, semantic.clone()) else { return Ok(None) };
        let place = self.at(&semantic);
        if let Some(e) = self.unpacked(&semantic, index, shapes, &place)? {
            let values = e.values.iter().map(|&v| v as u32).collect();
            return Ok(Some(Elements { width: e.width, values }));
        }
        Ok(Some(self.doc.integers(index, shapes, &place)?))
    }

    fn at(&self, semantic: &Semantic) -> String {
        format!("{}.attributes.{}", self.place, semantic.to_string())
    }

    fn unpacked(
        &self,
        semantic: &Semantic,
        index: usize,
        shapes: &[Type],
        place: &str,
    ) -> Result<Option<Elements<f32>>> {
        let Some(packed) = &self.packed else { return Ok(None) };
        let width = self.doc.width(index, shapes, place)?;
        self.doc.charge((packed.count() * width) as u64 * 4, place)?;
        let values = packed.floats(self.doc, &semantic.to_string(), index, width);
        Ok(values.map(|values| Elements { width, values }))
    }

    fn targets(&self) -> Result<Vec<MorphTarget>> {
        let mut out = Vec::new();
        for (t, target) in self.primitive.targets.iter().flatten().enumerate() {
            let list = |index: Option<usize>, name: &str| match index {
                Some(i) => vec3s(self.doc, i, &format!("{}.targets[{t}].{name}", self.place)),
                None => Ok(Vec::new()),
            };
            out.push(MorphTarget {
                name: String::new(),
                positions: list(target.positions.map(|i| i.value()), "POSITION")?,
                normals: list(target.normals.map(|i| i.value()), "NORMAL")?,
                tangents: list(target.tangents.map(|i| i.value()), "TANGENT")?,
            });
        }
        Ok(out)
    }
}

fn vec3s(doc: &Document, index: usize, place: &str) -> Result<Vec<Vec3>> {
    Ok(doc.floats(index, &[Type::Vec3], place)?.iter().map(Vec3::from_slice).collect())
}

/// Repair what only affects the look: directions without a direction, and texture coordinates that are no numbers.
fn sane(data: &mut MeshData, place: &str, w: &mut Warnings) {
    let mut bad = 0;
    for n in &mut data.normals {
        bad += usize::from(!n.is_finite() || *n == Vec3::ZERO);
        *n = crate::math::unit_or(*n, Vec3::Z);
    }
    for t in &mut data.tangents {
        bad += usize::from(!t.is_finite());
        let side = if t.w < 0.0 { -1.0 } else { 1.0 };
        *t = crate::math::unit_or(t.truncate(), Vec3::X).extend(side);
    }
    for v in data.uvs.iter_mut().flatten().filter(|v| !v.is_finite()) {
        bad += 1;
        *v = Vec2::ZERO;
    }
    for c in data.colors.iter_mut().filter(|c| !c.is_finite()) {
        bad += 1;
        *c = Vec4::ONE;
    }
    if bad > 0 {
        w.push(
            place,
            "some normals, tangents, texture coordinates or colours are no usable numbers; replaced",
        );
    }
}

/// Add what follows from the rest: tangents where a normal map asks for them.
///
/// Without normals a surface is flat and given tangents mean nothing (section 3.7.2.1). A normal map that does not lie as the
/// texture coordinates do gets its frame where it is looked up.
pub(super) fn complete(doc: &Document, primitive: &Primitive, data: &mut MeshData) {
    if data.normals.is_empty() {
        data.tangents.clear();
        return;
    }
    let material = primitive.material.and_then(|m| doc.root.materials.get(m.value()));
    let Some(map) = material.and_then(|m| m.normal_texture.as_ref()) else { return };
    let moved = map.extensions.as_ref().is_some_and(|e| e.others.contains_key("KHR_texture_transform"));
    let Some(uvs) = data.uvs.get(map.tex_coord as usize).filter(|_| !moved) else { return };
    let count = data.positions.len();
    if data.tangents.is_empty() && uvs.len() == count && data.normals.len() == count {
        data.tangents = normals::tangents(&data.positions, &data.normals, uvs, &data.triangles);
    }
}

/// Say which attributes are left out.
fn left_out(primitive: &Primitive, place: &str, w: &mut Warnings) {
    let has = |semantic| accessor(primitive, semantic).is_some();
    let semantics = primitive.attributes.keys().filter_map(|k| match k {
        Checked::Valid(s) => Some(s),
        Checked::Invalid => None,
    });
    for semantic in semantics {
        let message = match *semantic {
            Semantic::Colors(1..) => "has further vertex colours; only COLOR_0 is read",
            Semantic::TexCoords(2..) => {
                "has further texture coordinates; only TEXCOORD_0 and TEXCOORD_1 are read"
            }
            Semantic::Joints(n) if !has(Semantic::Weights(n)) => {
                "has a set of joints but no weights; it and the sets after it are left out"
            }
            Semantic::Weights(n) if !has(Semantic::Joints(n)) => {
                "has a set of weights but no joints; it and the sets after it are left out"
            }
            _ => continue,
        };
        w.push(place, message);
    }
}
