//! KHR_draco_mesh_compression: all vertices and indices of a primitive in one stream.

use super::document::Document;
use super::error::{GltfError, Result, value};
use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, FaceIndex, Mesh, MeshDecoder};
use serde::Deserialize;
use std::collections::BTreeMap;

const NAME: &str = "KHR_draco_mesh_compression";
/// What a decoded vertex or triangle costs at its peak, roughly: attributes, maps and the corner table.
const BYTES_EACH: u64 = 40;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Packed {
    buffer_view: usize,
    attributes: BTreeMap<String, u32>,
}

/// A decoded primitive.
pub(super) struct Decoded {
    mesh: Mesh,
    ids: BTreeMap<String, u32>,
}

/// Decode the primitive, if it is compressed.
pub(super) fn decode(doc: &Document, primitive: &Primitive, place: &str) -> Result<Option<Decoded>> {
    let Some(json) = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME)) else { return Ok(None) };
    let at = format!("{place}.extensions.{NAME}");
    let packed =
        Packed::deserialize(json).map_err(|e| value(&at, "bufferView and attributes", e.to_string()))?;
    let (bytes, _) = doc.view(packed.buffer_view, &format!("{at}.bufferView"))?;

    // The accessors say how much will come out; seams may split a few vertices more.
    let declared = |index: Option<usize>| match index {
        Some(i) => doc.count(i, place),
        None => Ok(0),
    };
    let points = declared(super::attributes::accessor(primitive, Semantic::Positions))?;
    let corners = declared(primitive.indices.map(|i| i.value()))?;
    let (points, faces) = (points.saturating_mul(2).saturating_add(64), corners / 3 + 64);
    doc.charge(points.saturating_add(faces).saturating_mul(BYTES_EACH), &at)?;
    let limits = DecodeLimits::default()
        .with_max_points(points)
        .with_max_faces(faces)
        .with_max_decoded_bytes(points.saturating_mul(256));

    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    MeshDecoder::new().decode(&mut buffer, &mut mesh).map_err(|e| GltfError::Codec {
        place: at,
        codec: "Draco",
        why: e.to_string(),
    })?;
    Ok(Some(Decoded { mesh, ids: packed.attributes }))
}

impl Decoded {
    /// Number of vertices.
    pub fn count(&self) -> usize {
        self.mesh.num_points()
    }

    /// An attribute, `width` numbers a vertex; `None` where the stream does not have it.
    pub fn floats(&self, doc: &Document, semantic: &str, accessor: usize, width: usize) -> Option<Vec<f32>> {
        let attribute = self.mesh.attribute_by_unique_id(*self.ids.get(semantic)?)?;
        let mut values = attribute.read_f32s(self.count(), width);
        let json = doc.root.accessors.get(accessor)?;

        // Integers are fractions if the accessor says so, or if it wants floats and the stream says so.
        let float = matches!(json.component_type, Checked::Valid(c) if c.0 == ComponentType::F32);
        if json.normalized || (float && attribute.normalized()) {
            let one = unit(attribute.data_type());
            values.iter_mut().for_each(|v| *v = (*v / one).max(-1.0));
        }
        Some(values)
    }

    /// Triangles, corner by corner.
    pub fn indices(&self) -> Vec<u32> {
        let face = |i: usize| self.mesh.face(FaceIndex(i as u32)).map(|p| p.0);
        (0..self.mesh.num_faces()).flat_map(face).collect()
    }
}

fn unit(kind: DataType) -> f32 {
    match kind {
        DataType::Int8 => 127.0,
        DataType::Uint8 => 255.0,
        DataType::Int16 => 32767.0,
        DataType::Uint16 => 65535.0,
        _ => 1.0,
    }
}
