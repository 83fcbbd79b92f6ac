//! New accessors and their bytes: those of one stride lie in one view.

use crate::io::gltf::rewrite::{Rewritten, list};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Integers that stand for parts of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Int {
    I8,
    U8,
    I16,
    U16,
}

impl Int {
    pub fn signed(self) -> bool {
        matches!(self, Self::I8 | Self::I16)
    }

    /// The one that means 1.
    pub fn unit(self) -> i32 {
        match self {
            Self::I8 => 127,
            Self::U8 => 255,
            Self::I16 => 32_767,
            Self::U16 => 65_535,
        }
    }

    pub fn of(self, v: f64) -> i32 {
        (v * self.unit() as f64).round() as i32
    }

    fn code(self) -> u32 {
        match self {
            Self::I8 => 5120,
            Self::U8 => 5121,
            Self::I16 => 5122,
            Self::U16 => 5123,
        }
    }

    fn bytes(self, v: i32) -> impl Iterator<Item = u8> {
        let size = if matches!(self, Self::I8 | Self::U8) { 1 } else { 2 };
        v.to_le_bytes().into_iter().take(size)
    }
}

/// What makes new accessors the same: the old ones, the form, the group of meshes, and whether they are positions.
pub(super) type Tag = (Vec<u64>, Int, usize, bool);

/// Bytes an element and what the view is for.
type Kind = (u64, u64);

const VERTICES: u64 = 34_962;
const INDICES: u64 = 34_963;

/// Where an accessor names its view.
const PLACES: [&str; 3] = ["", "/sparse/indices", "/sparse/values"];

#[derive(Default)]
pub(super) struct Pool {
    parts: BTreeMap<Kind, (Vec<u8>, Vec<(u64, &'static str)>)>,
    made: BTreeMap<Tag, Vec<u64>>,
}

impl Pool {
    /// The accessors that were made for this.
    pub fn known(&self, tag: &Tag) -> Option<&Vec<u64>> {
        self.made.get(tag)
    }

    pub fn remember(&mut self, tag: Tag, made: Vec<u64>) {
        self.made.insert(tag, made);
    }

    /// Accessors in whose place others stand.
    pub fn replaced(&self) -> impl Iterator<Item = u64> {
        self.made.keys().flat_map(|t| t.0.iter().copied())
    }

    /// Elements of `width` integers, padded to four bytes; `sparse`ly, if that is shorter.
    pub fn vertices(
        &mut self,
        index: u64,
        numbers: &[i32],
        width: usize,
        int: Int,
        bounds: bool,
        sparse: bool,
    ) -> Value {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        let mut accessor = json!({"componentType": int.code(), "normalized": true, "count": numbers.len() / width, "type": kind});
        if bounds {
            let column = |k: usize| numbers.iter().skip(k).step_by(width).copied();
            accessor["min"] = (0..width).map(|k| column(k).min()).collect::<Vec<_>>().into();
            accessor["max"] = (0..width).map(|k| column(k).max()).collect::<Vec<_>>().into();
        }
        let tight = |row: &[i32]| row.iter().flat_map(|v| int.bytes(*v)).collect::<Vec<u8>>();
        let rows = numbers.chunks_exact(width);
        let size = tight(&numbers[..width.min(numbers.len())]).len();
        let stride = size.next_multiple_of(4);
        let some: Vec<usize> =
            rows.clone().enumerate().filter(|r| r.1.iter().any(|v| *v != 0)).map(|r| r.0).collect();
        if sparse && some.len() * (4 + size) < rows.len() * stride {
            if some.is_empty() {
                // Without a view all is zero.
                return accessor;
            }
            let at: Vec<u8> = some.iter().flat_map(|i| (*i as u32).to_le_bytes()).collect();
            let values: Vec<u8> =
                some.iter().flat_map(|i| tight(&numbers[i * width..(i + 1) * width])).collect();
            accessor["sparse"] = json!({
                "count": some.len(),
                "indices": {"byteOffset": self.put((4, 0), &at, index, PLACES[1]), "componentType": 5125},
                "values": {"byteOffset": self.put((2, 0), &values, index, PLACES[2])},
            });
            return accessor;
        }
        let mut bytes: Vec<u8> = Vec::with_capacity(rows.len() * stride);
        for row in rows {
            bytes.extend(tight(row));
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        accessor["byteOffset"] = self.put((stride as u64, VERTICES), &bytes, index, PLACES[0]).into();
        accessor
    }

    /// Joints of influences, four a vertex.
    pub fn joints(&mut self, index: u64, joints: &[u32]) -> Value {
        let int = if joints.iter().all(|j| *j < 256) { Int::U8 } else { Int::U16 };
        let numbers: Vec<i32> = joints.iter().map(|j| *j as i32).collect();
        let mut accessor = self.vertices(index, &numbers, 4, int, false, false);
        accessor.as_object_mut().expect("just made").remove("normalized");
        accessor
    }

    pub fn indices(&mut self, index: u64, all: &[u32]) -> Value {
        let bytes: Vec<u8> = all.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect();
        let offset = self.put((2, INDICES), &bytes, index, PLACES[0]);
        json!({"componentType": 5123, "count": all.len(), "type": "SCALAR", "byteOffset": offset})
    }

    /// Matrices.
    pub fn floats(&mut self, index: u64, values: &[f32]) -> Value {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let offset = self.put((64, 0), &bytes, index, PLACES[0]);
        json!({"componentType": 5126, "count": values.len() / 16, "type": "MAT4", "byteOffset": offset})
    }

    fn put(&mut self, kind: Kind, bytes: &[u8], accessor: u64, place: &'static str) -> usize {
        let (all, users) = self.parts.entry(kind).or_default();
        all.resize(all.len().next_multiple_of(4), 0);
        users.push((accessor, place));
        all.extend(bytes);
        all.len() - bytes.len()
    }

    /// Put all bytes behind those of a file, and let the accessors name their views.
    pub fn append(self, out: &mut Rewritten) {
        for ((stride, target), (bytes, users)) in self.parts {
            let view = out.view(&bytes);
            if target != 0 {
                let json = &mut list(&mut out.json, "bufferViews")[view];
                json["target"] = target.into();
                if target == VERTICES {
                    json["byteStride"] = stride.into();
                }
            }
            for (accessor, place) in users {
                let json = list(&mut out.json, "accessors")[accessor as usize].pointer_mut(place);
                json.expect("it was made with its places")["bufferView"] = view.into();
            }
        }
    }
}
