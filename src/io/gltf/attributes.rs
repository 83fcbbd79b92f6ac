//! Vertex attributes of a primitive, its morph targets and its indices.

use super::document::Document;
use super::error::Result;
use super::warnings::Warnings;
use crate::mesh::normals::{self, Weighting};
use crate::mesh::{MeshData, MorphTarget};
use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3, Vec4};

/// Index of the accessor of an attribute.
pub(super) fn accessor(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|i| i.value())
}

/// Fill `data`; returns the indices, or `None` where the primitive has no positions.
#[allow(clippy::type_complexity)]
pub(super) fn read(
    doc: &Document,
    primitive: &Primitive,
    data: &mut MeshData,
    place: &str,
    w: &mut Warnings,
) -> Result<Option<Option<Vec<u32>>>> {
    let Some(positions) = accessor(primitive, Semantic::Positions) else { return Ok(None) };
    let source = Source { doc, primitive, place };
    data.positions = vec3s(doc, positions, &format!("{place}.attributes.POSITION"))?;
    if data.positions.is_empty() {
        return Ok(None);
    }
    if let Some(v) = source.floats(Semantic::Normals, &[Type::Vec3])? {
        data.normals = v.chunks_exact(3).map(Vec3::from_slice).collect();
    }
    if let Some(v) = source.floats(Semantic::Tangents, &[Type::Vec4])? {
        data.tangents = v.chunks_exact(4).map(Vec4::from_slice).collect();
    }
    for set in 0..2 {
        if let Some(v) = source.floats(Semantic::TexCoords(set), &[Type::Vec2])? {
            data.uvs[set as usize] = v.chunks_exact(2).map(Vec2::from_slice).collect();
        }
    }
    data.colors = source.colors()?;
    data.targets = source.targets()?;
    sane(data, place, w);
    let indices = match primitive.indices {
        Some(i) => Some(doc.integers(i.value(), &[Type::Scalar], &format!("{place}.indices"))?.values),
        None => None,
    };
    Ok(Some(indices))
}

struct Source<'a> {
    doc: &'a Document<'a>,
    primitive: &'a Primitive,
    place: &'a str,
}

impl Source<'_> {
    fn floats(&self, semantic: Semantic, shapes: &[Type]) -> Result<Option<Vec<f32>>> {
        let Some(index) = accessor(self.primitive, semantic.clone()) else { return Ok(None) };
        let place = format!("{}.attributes.{}", self.place, semantic.to_string());
        Ok(Some(self.doc.floats(index, shapes, &place)?.values))
    }

    /// RGB means opaque.
    fn colors(&self) -> Result<Vec<Vec4>> {
        let Some(index) = accessor(self.primitive, Semantic::Colors(0)) else { return Ok(Vec::new()) };
        let place = format!("{}.attributes.COLOR_0", self.place);
        let elements = self.doc.floats(index, &[Type::Vec3, Type::Vec4], &place)?;
        let one = |c: &[f32]| Vec4::new(c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0));
        Ok(elements.iter().map(one).collect())
    }

    fn targets(&self) -> Result<Vec<MorphTarget>> {
        let mut out = Vec::new();
        for (t, target) in self.primitive.targets.iter().flatten().enumerate() {
            let list = |index: Option<usize>, name: &str| match index {
                Some(i) => vec3s(self.doc, i, &format!("{}.targets[{t}].{name}", self.place)),
                None => Ok(Vec::new()),
            };
            out.push(MorphTarget {
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
pub(super) fn complete(doc: &Document, primitive: &Primitive, data: &mut MeshData) {
    let material = primitive.material.and_then(|m| doc.root.materials.get(m.value()));
    let Some(map) = material.and_then(|m| m.normal_texture.as_ref()) else { return };
    let uvs = &data.uvs[(map.tex_coord as usize).min(1)];
    if !data.tangents.is_empty() || uvs.len() != data.positions.len() {
        return;
    }
    if data.normals.is_empty() {
        data.normals = normals::vertex(&data.positions, &data.triangles, Weighting::Angle);
    }
    if data.normals.len() == data.positions.len() {
        data.tangents = normals::tangents(&data.positions, &data.normals, uvs, &data.triangles);
    }
}
