//! Taking accessors and views out of a file, and what is left into one buffer.

use super::carried;
use super::rewrite::list;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Extensions that name accessors in places that are not known here keep every accessor alive.
const HARMLESS: [&str; 12] = [
    "KHR_animation_pointer",
    "KHR_node_",
    "KHR_xmp",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_punctual",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
];

/// The primitives of all meshes.
pub(super) fn primitives(json: &mut Map<String, Value>) -> impl Iterator<Item = &mut Value> {
    let meshes = json.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten();
    meshes.filter_map(|m| m.get_mut("primitives")?.as_array_mut()).flatten()
}

/// Call `visit` on every index of an accessor, of animations only in what is kept of them.
fn accessor_places(json: &mut Map<String, Value>, visit: &mut impl FnMut(&mut Value)) {
    carried::accessors(json, visit);
    let mut each =
        |v: &mut Value| v.as_object_mut().into_iter().flat_map(|o| o.values_mut()).for_each(&mut *visit);
    for p in primitives(json) {
        p.get_mut("attributes").into_iter().for_each(&mut each);
        p.get_mut("targets").and_then(Value::as_array_mut).into_iter().flatten().for_each(&mut each);
    }
    for n in json.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten() {
        n.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes").into_iter().for_each(&mut each);
    }
    primitives(json).filter_map(|p| p.get_mut("indices")).for_each(&mut *visit);
    for s in json.get_mut("skins").and_then(Value::as_array_mut).into_iter().flatten() {
        s.get_mut("inverseBindMatrices").into_iter().for_each(&mut *visit);
    }
}

/// Accessors of the keys of animations.
pub(super) fn sampled(animations: &Value) -> Vec<u64> {
    let samplers =
        animations.as_array().into_iter().flatten().filter_map(|a| a["samplers"].as_array()).flatten();
    samplers.flat_map(|s| ["input", "output"].map(|end| s[end].as_u64())).flatten().collect()
}

/// An extension that may name accessors and views where nobody here looks for them.
pub(super) fn stranger(json: &Map<String, Value>) -> Option<&str> {
    let used = json.get("extensionsUsed").and_then(Value::as_array).into_iter().flatten();
    used.filter_map(Value::as_str).find(|e| !HARMLESS.iter().any(|h| e.starts_with(h)))
}

/// Take out those of these accessors that nothing uses any more, and the views that only those used. The views that others use as well.
pub(super) fn drop_accessors(json: &mut Map<String, Value>, unused: &[u64]) -> BTreeSet<u64> {
    let count = list(json, "accessors").len();
    let mut gone = vec![false; count];
    if stranger(json).is_none() {
        for &i in unused {
            gone.get_mut(i as usize).into_iter().for_each(|g| *g = true);
        }
    }
    accessor_places(json, &mut |v| {
        if let Some(g) = v.as_u64().and_then(|i| gone.get_mut(i as usize)) {
            *g = false;
        }
    });
    let dropped = take(list(json, "accessors"), &gone);
    let new = renumbered(&gone);
    accessor_places(json, &mut |v| renumber(v, &new));

    let mut unused = vec![false; list(json, "bufferViews").len()];
    let mark = |unused: &mut Vec<bool>, v: &Value, to: bool| {
        if let Some(u) = v.as_u64().and_then(|i| unused.get_mut(i as usize)) {
            *u = to;
        }
    };
    for mut a in dropped {
        view_places_of(&mut a, &mut |v| mark(&mut unused, v, true));
    }
    let touched = unused.clone();
    view_places(json, &mut |v| mark(&mut unused, v, false));
    take(list(json, "bufferViews"), &unused);
    let new = renumbered(&unused);
    view_places(json, &mut |v| renumber(v, &new));
    // Lists that were empty or missing stay missing: empty ones are against the specification.
    json.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
    let torn = (0..new.len()).filter(|&v| touched[v] && !unused[v]);
    torn.map(|v| new[v]).collect()
}

fn take(items: &mut Vec<Value>, gone: &[bool]) -> Vec<Value> {
    let mut dropped = vec![];
    let mut i = 0;
    items.retain_mut(|v| {
        let keep = !gone[i];
        i += 1;
        if !keep {
            dropped.push(v.take());
        }
        keep
    });
    dropped
}

fn renumbered(gone: &[bool]) -> Vec<u64> {
    let mut next = 0;
    gone.iter()
        .map(|g| {
            let k = next;
            next += !g as u64;
            k
        })
        .collect()
}

pub(super) fn renumber(v: &mut Value, new: &[u64]) {
    if let Some(&k) = v.as_u64().and_then(|i| new.get(i as usize)) {
        *v = k.into();
    }
}

/// Indices of buffer views in an accessor.
fn view_places_of(accessor: &mut Value, visit: &mut impl FnMut(&mut Value)) {
    for place in ["/bufferView", "/sparse/indices/bufferView", "/sparse/values/bufferView"] {
        accessor.pointer_mut(place).into_iter().for_each(&mut *visit);
    }
}

/// All indices of buffer views.
pub(super) fn view_places(json: &mut Map<String, Value>, visit: &mut impl FnMut(&mut Value)) {
    list(json, "accessors").iter_mut().for_each(|a| view_places_of(a, visit));
    for i in list(json, "images") {
        i.get_mut("bufferView").into_iter().for_each(&mut *visit);
    }
    for p in primitives(json) {
        p.pointer_mut("/extensions/KHR_draco_mesh_compression/bufferView").into_iter().for_each(&mut *visit);
    }
}

/// Where a packed view says what its bytes are.
pub(super) fn packing(view: &Value) -> Option<&'static str> {
    let places = ["/extensions/EXT_meshopt_compression", "/extensions/KHR_meshopt_compression"];
    places.into_iter().find(|p| view.pointer(p).is_some())
}

/// A buffer without data, for the unpacked bytes of packed views, by the names of the extensions that pack them.
pub(super) fn fallback_buffer(views: &[Value], length: u64) -> Value {
    let names = views.iter().filter_map(packing).filter_map(|p| p.rsplit('/').next());
    let extensions: Map<String, Value> = names.map(|n| (n.to_owned(), json!({"fallback": true}))).collect();
    json!({"byteLength": length, "extensions": extensions})
}

/// What names a view's bytes: buffer, offset and length.
pub(super) fn source(view: &mut Value) -> &mut Value {
    match packing(view) {
        Some(place) => view.pointer_mut(place).expect("just seen"),
        None => view,
    }
}

/// All bytes that views name into one buffer; those that overlap go on doing so.
pub(super) fn repack<'b>(json: &mut Map<String, Value>, raw: impl Fn(usize) -> Option<&'b [u8]>) -> Vec<u8> {
    let number = |v: &Value, name: &str| v.get(name).and_then(Value::as_u64).unwrap_or(0);
    let mut wanted: BTreeMap<u64, Vec<[u64; 2]>> = BTreeMap::new();
    let mut empty = vec![];
    let views = json.get_mut("bufferViews").and_then(Value::as_array_mut).unwrap_or(&mut empty);
    for view in views.iter_mut() {
        let r = source(view);
        let (from, length) = (number(r, "byteOffset"), number(r, "byteLength"));
        wanted.entry(number(r, "buffer")).or_default().push([from, from.saturating_add(length)]);
    }
    // Merge ranges that meet, and say where each goes.
    let mut bin = vec![];
    let mut moved: BTreeMap<u64, Vec<([u64; 2], u64)>> = BTreeMap::new();
    for (buffer, mut list) in wanted {
        list.sort();
        let mut merged: Vec<[u64; 2]> = vec![];
        for r in list {
            match merged.last_mut() {
                Some(last) if r[0] <= last[1] => last[1] = last[1].max(r[1]),
                _ => merged.push(r),
            }
        }
        let Some(bytes) = raw(buffer as usize) else { continue };
        for r in merged {
            // The same place modulo 8, so that what was aligned stays so.
            while bin.len() as u64 % 8 != r[0] % 8 {
                bin.push(0);
            }
            moved.entry(buffer).or_default().push((r, bin.len() as u64));
            let end = (r[1] as usize).min(bytes.len());
            bin.extend(&bytes[(r[0] as usize).min(end)..end]);
        }
    }
    let mut fallback = 0;
    for view in views.iter_mut() {
        let packed = packing(view).is_some();
        let r = source(view);
        let from = number(r, "byteOffset");
        let place = moved
            .get(&number(r, "buffer"))
            .and_then(|m| m.iter().find(|(r, _)| r[0] <= from && from <= r[1]));
        if let Some((range, to)) = place {
            (r["buffer"], r["byteOffset"]) = (0.into(), (to + from - range[0]).into());
        }
        if packed {
            // Unpacked bytes have a buffer without data.
            view["buffer"] = 1.into();
            view["byteOffset"] = fallback.into();
            fallback = (fallback + number(view, "byteLength")).next_multiple_of(8);
        }
    }
    let mut buffers = vec![json!({"byteLength": bin.len()})];
    if fallback > 0 {
        buffers.push(fallback_buffer(list(json, "bufferViews"), fallback));
    }
    if bin.is_empty() {
        json.remove("buffers")
    } else {
        json.insert("buffers".into(), buffers.into())
    };
    bin
}
