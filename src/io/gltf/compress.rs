//! Each accessor in a view of its own: so that the rest of a view can go, and to be packed by EXT_meshopt_compression where that is smaller.

use super::error::{GltfError, Result};
use super::prune::{fallback_buffer, packing, primitives, renumber, source, stranger, view_places};
use super::rewrite::Rewritten;
use meshoptimizer_rs::codec;
use meshoptimizer_rs::{Limits, Workspace};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

const NAME: &str = "EXT_meshopt_compression";

/// Bytes of JSON that say how a view is packed.
const SAID: usize = 140;

/// What an accessor's numbers are for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    Indices,
    Vertices,
    Other,
}

/// Where an accessor's bytes were: view, offset, bytes an element, elements, what for.
type Place = (u64, u64, usize, usize, Use);

impl Rewritten {
    /// Pack what accessors point at, losslessly. What is packed already, sparse or read by a decoder of its own stays as it is.
    ///
    /// # Errors
    /// [`GltfError`] if bytes lie beyond the file's.
    pub fn compress(&mut self) -> Result<()> {
        let all = 0..self.json.get("bufferViews").and_then(Value::as_array).map_or(0, Vec::len) as u64;
        self.split(&all.collect(), true)
    }

    /// Give each accessor of these views a view of its own, packed or not.
    pub(super) fn split(&mut self, these: &BTreeSet<u64>, pack: bool) -> Result<()> {
        if these.is_empty() || stranger(&self.json).is_some() {
            return Ok(());
        }
        let uses = self.uses();
        let old: Vec<Value> =
            self.json.get("bufferViews").and_then(Value::as_array).cloned().unwrap_or_default();
        let accessors = self.json.get("accessors").and_then(Value::as_array).cloned().unwrap_or_default();
        let places: Vec<Option<Place>> = accessors
            .iter()
            .enumerate()
            .map(|(i, a)| place(a, uses.get(&(i as u64)).copied(), &old))
            .collect();
        let mut stay = self.staying(&places, &old);
        stay.extend((0..old.len() as u64).filter(|v| !these.contains(v)));

        let bin = std::mem::take(&mut self.bin);
        let (mut views, mut moved, mut fallback) = (vec![], vec![0; old.len()], 0);
        for (i, view) in old.iter().enumerate().filter(|(i, _)| stay.contains(&(*i as u64))) {
            let mut view = view.clone();
            let from = source(&mut view);
            let bytes = slice(&bin, number(from, "byteOffset"), number(from, "byteLength"))?;
            from["byteOffset"] = self.place(bytes).into();
            if packing(&view).is_some() {
                view["byteOffset"] = fallback.into();
                fallback = (fallback + number(&view, "byteLength")).next_multiple_of(8);
            }
            moved[i] = views.len() as u64;
            views.push(view);
        }
        view_places(&mut self.json, &mut |v| renumber(v, &moved));
        let mut known: BTreeMap<Place, usize> = BTreeMap::new();
        let mut any = fallback > 0;
        for (i, place) in places.into_iter().enumerate() {
            let Some(place) = place.filter(|p| !stay.contains(&p.0)) else { continue };
            let index = match known.get(&place) {
                Some(known) => *known,
                None => {
                    let view = self.packed(&bin, place, &old[place.0 as usize], &mut fallback, pack)?;
                    any |= packing(&view).is_some();
                    views.push(view);
                    known.insert(place, views.len() - 1);
                    views.len() - 1
                }
            };
            let accessor = self.json["accessors"][i].as_object_mut().expect("it has a view");
            accessor.remove("byteOffset");
            accessor.insert("bufferView".into(), index.into());
        }
        if views.is_empty() {
            return Ok(());
        }
        let mut buffers = vec![json!({"byteLength": self.bin.len()})];
        if fallback > 0 {
            buffers.push(fallback_buffer(&views, fallback));
        }
        self.json.insert("bufferViews".into(), views.into());
        self.json.insert("buffers".into(), buffers.into());
        if any {
            self.requires(NAME);
        }
        // Empty lists are against the specification.
        self.json.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
        Ok(())
    }

    /// What accessors of meshes are for.
    fn uses(&mut self) -> BTreeMap<u64, Use> {
        let mut out = BTreeMap::new();
        for p in primitives(&mut self.json) {
            let targets = p["targets"].as_array().into_iter().flatten();
            let lists = targets.chain([&p["attributes"]]).filter_map(Value::as_object);
            out.extend(lists.flat_map(|o| o.values()).filter_map(Value::as_u64).map(|a| (a, Use::Vertices)));
            let triangles = p.get("mode").and_then(Value::as_u64).unwrap_or(4) == 4;
            let kind = if triangles { Use::Indices } else { Use::Other };
            out.extend(p["indices"].as_u64().map(|a| (a, kind)));
        }
        out
    }

    /// Views that must not change: those that anything but a plain accessor points at.
    fn staying(&mut self, places: &[Option<Place>], old: &[Value]) -> BTreeSet<u64> {
        let mut plain: BTreeMap<u64, i64> = BTreeMap::new();
        places.iter().flatten().for_each(|p| *plain.entry(p.0).or_default() += 1);
        let mut all: BTreeMap<u64, i64> = BTreeMap::new();
        view_places(&mut self.json, &mut |v| {
            v.as_u64().into_iter().for_each(|v| *all.entry(v).or_default() += 1)
        });
        let packed = |v: u64| old.get(v as usize).is_some_and(|v| packing(v).is_some());
        (0..old.len() as u64).filter(|v| packed(*v) || plain.get(v) != all.get(v)).collect()
    }

    /// Bytes at the end of the buffer; where they begin.
    fn place(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(8), 0);
        self.bin.extend(bytes);
        self.bin.len() - bytes.len()
    }

    /// A view of an accessor's bytes alone.
    fn packed(
        &mut self,
        bin: &[u8],
        (_, offset, size, count, what): Place,
        view: &Value,
        fallback: &mut u64,
        pack: bool,
    ) -> Result<Value> {
        let stride = view.get("byteStride").and_then(Value::as_u64).map_or(size, |s| s as usize);
        let start = number(view, "byteOffset") + offset;
        let span = if count > 0 { (count - 1) * stride + size } else { 0 };
        let bytes = slice(bin, start, span as u64)?;
        // Vertices begin at multiples of four.
        let step = if what == Use::Vertices { size.next_multiple_of(4) } else { size };
        let mut tight = vec![0; count * step];
        for k in 0..count {
            tight[k * step..k * step + size].copy_from_slice(&bytes[k * stride..k * stride + size]);
        }
        let mut out = json!({"buffer": 0, "byteLength": tight.len()});
        if let Some(target) = view.get("target") {
            out["target"] = target.clone();
        }
        if what == Use::Vertices {
            out["byteStride"] = step.into();
        }
        let short = if pack { encode(&tight, count, step, what) } else { None };
        let short = short.filter(|b| b.len() + SAID < tight.len());
        let Some(short) = short else {
            out["byteOffset"] = self.place(&tight).into();
            return Ok(out);
        };
        let mode = if what == Use::Indices { "TRIANGLES" } else { "ATTRIBUTES" };
        (out["buffer"], out["byteOffset"]) = (1.into(), (*fallback).into());
        *fallback = (*fallback + tight.len() as u64).next_multiple_of(8);
        out["extensions"] = json!({NAME: {
            "buffer": 0, "byteOffset": self.place(&short), "byteLength": short.len(), "byteStride": step, "count": count, "mode": mode,
        }});
        Ok(out)
    }
}

fn number(v: &Value, key: &str) -> u64 {
    v.get(key).and_then(Value::as_u64).unwrap_or(0)
}

fn slice(bin: &[u8], start: u64, length: u64) -> Result<&[u8]> {
    let end = start.saturating_add(length) as usize;
    bin.get((start as usize).min(end)..end).ok_or_else(|| GltfError::Codec {
        place: "a buffer view".into(),
        codec: "meshopt",
        why: format!("bytes {start} to {end} of {}", bin.len()),
    })
}

/// Where a plain accessor's bytes are.
fn place(a: &Value, what: Option<Use>, views: &[Value]) -> Option<Place> {
    let view =
        a["bufferView"].as_u64().filter(|v| (*v as usize) < views.len() && a.get("sparse").is_none())?;
    let each = [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT4", 16)];
    let width = each.iter().find(|e| a["type"] == e.0)?.1;
    let bytes = match a["componentType"].as_u64()? {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => 4,
    };
    let count = usize::try_from(a["count"].as_u64()?).ok()?;
    Some((view, number(a, "byteOffset"), width * bytes, count, what.unwrap_or(Use::Other)))
}

fn encode(bytes: &[u8], count: usize, step: usize, what: Use) -> Option<Vec<u8>> {
    let mut work = Workspace::new(Limits { max_bytes: 1 << 30, max_work: 1 << 32 });
    if what == Use::Indices {
        let index = |c: &[u8]| {
            if step == 2 {
                u16::from_le_bytes([c[0], c[1]]).into()
            } else {
                u32::from_le_bytes([c[0], c[1], c[2], c[3]])
            }
        };
        let indices: Vec<u32> =
            if step >= 2 { bytes.chunks_exact(step).map(index).collect() } else { return None };
        let short =
            codec::encode_index_buffer_generic(&indices, codec::IndexEncoding::default(), &mut work).ok()?;
        // The codec may turn triangles; whoever counts on their first corner finds it changed.
        return Some(short);
    }
    if !step.is_multiple_of(4) || step > 256 || count == 0 {
        return None;
    }
    let encoding = codec::VertexEncoding::new(0, 2).ok()?;
    codec::encode_vertex_buffer(bytes, count, step, encoding, &mut work).ok()
}
