//! A glTF file with other clips: everything else is carried through, byte for byte where it is binary.

use super::carried;
use super::container;
use super::document::Document;
use super::error::{Result, value};
use super::influences;
use super::mend;
use super::uri::Source;
use super::warnings::Warnings;
use crate::clip::{Clip, Interpolation, Target, Track};
use crate::io::Import;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// A clip to be written.
#[derive(Clone, Copy, Debug)]
pub struct NewClip<'a> {
    /// Its tracks; angles about aim frames have no place in glTF.
    pub clip: &'a Clip,
    /// Tracks that are stored as normalised 16-bit integers; missing entries are not.
    pub short: &'a [bool],
    /// Which of the file's animations it replaces: it keeps that one's extras and extensions.
    pub replaces: Option<usize>,
}

/// A glTF asset in memory.
#[derive(Clone, Debug, Default)]
pub struct Rewritten {
    /// The JSON.
    pub json: Map<String, Value>,
    /// The binary chunk.
    pub bin: Vec<u8>,
}

/// Extensions that name accessors in places that are not known here keep every accessor alive.
const HARMLESS: [&str; 10] = [
    "KHR_animation_pointer",
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

/// The file of `bytes`, which `import` came from, with these clips instead of its own. `extras` are merged into the asset's.
///
/// # Errors
/// [`GltfError`](super::GltfError) as for importing, or if a clip moves what the file has no node for.
pub fn with_clips(
    bytes: &[u8],
    base_dir: Option<&Path>,
    name: &str,
    import: &Import,
    clips: &[NewClip],
    extras: Map<String, Value>,
) -> Result<Rewritten> {
    rewritten(bytes, base_dir, name, import, clips, extras, false)
}

/// [`with_clips`], and the influences of the import's vertices instead of the file's own.
///
/// # Errors
/// As [`with_clips`], or if the vertices are not those of the file.
pub fn with_clips_and_influences(
    bytes: &[u8],
    base_dir: Option<&Path>,
    name: &str,
    import: &Import,
    clips: &[NewClip],
    extras: Map<String, Value>,
) -> Result<Rewritten> {
    rewritten(bytes, base_dir, name, import, clips, extras, true)
}

fn rewritten(
    bytes: &[u8],
    base_dir: Option<&Path>,
    name: &str,
    import: &Import,
    clips: &[NewClip],
    extras: Map<String, Value>,
    influenced: bool,
) -> Result<Rewritten> {
    let parts = container::split(bytes, name)?;
    let mut w = Warnings::default();
    let doc = Document::new(mend::root(parts.json, &mut w)?, parts.bin, base_dir, &mut w)?;
    let mut json: Map<String, Value> =
        serde_json::from_slice(parts.json).map_err(|e| value("the JSON", "an object", e.to_string()))?;
    let old = json.remove("animations").unwrap_or_default();
    // Channels that nobody here can play keep their keys.
    json.insert("animations".into(), carried::kept(&old, clips).into());
    let mut unused = sampled(&old);
    if influenced {
        unused.extend(influences::strip(&mut json));
    }
    drop_accessors(&mut json, &unused);
    let mut out = Rewritten { bin: repack(&mut json, &doc), json };
    if influenced {
        influences::write(&mut out, import)?;
    }
    out.animate(&Places::of(import), clips, &old)?;
    out.json.entry("asset").or_insert(json!({"version": "2.0"}));
    let asset =
        out.json["asset"].as_object_mut().ok_or_else(|| value("asset", "an object", "something else"))?;
    asset.insert("generator".into(), concat!("sinew ", env!("CARGO_PKG_VERSION")).into());
    let kept = asset.entry("extras").or_insert(json!({}));
    if !kept.is_object() {
        *kept = json!({"before": kept.take()});
    }
    kept.as_object_mut().expect("just made").extend(extras);
    Ok(out)
}

impl Rewritten {
    /// Take pictures that lie beside the file into the binary chunk, for a result that goes elsewhere.
    ///
    /// # Errors
    /// [`GltfError`](super::GltfError) if one cannot be read.
    pub fn embed_pictures(&mut self, base_dir: Option<&Path>) -> Result<()> {
        for i in 0..self.json.get("images").and_then(Value::as_array).map_or(0, Vec::len) {
            let place = format!("images[{i}].uri");
            let Some(uri) = self.json["images"][i]["uri"].as_str().map(str::to_owned) else { continue };
            let source = Source::of(&uri, base_dir, &place)?;
            if matches!(source, Source::Data(_)) {
                continue;
            }
            let bytes = source.read(&place)?;
            let view = self.view(&bytes);
            if let Some(image) = self.json["images"][i].as_object_mut() {
                image.remove("uri");
                image.insert("bufferView".into(), view.into());
                image.insert("mimeType".into(), mime(&bytes).into());
            }
        }
        Ok(())
    }

    /// An entry of one of the file's lists; its index.
    pub(super) fn push(&mut self, name: &str, item: Value) -> usize {
        let list = list(&mut self.json, name);
        list.push(item);
        list.len() - 1
    }

    /// A buffer view of its own for bytes.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(8), 0);
        let range = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        if list(&mut self.json, "buffers").is_empty() {
            self.push("buffers", json!({}));
        }
        self.push("bufferViews", range)
    }

    /// An accessor of all of a view of its own.
    pub(super) fn accessor(&mut self, bytes: &[u8], mut accessor: Value) -> usize {
        accessor["bufferView"] = self.view(bytes).into();
        self.push("accessors", accessor)
    }

    /// Floats, `width` an element; with the smallest and largest of each component where they are asked for.
    pub(super) fn floats(&mut self, values: &[f32], kind: &str, width: usize, bounds: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut accessor = json!({"componentType": 5126, "count": values.len() / width, "type": kind});
        if bounds {
            let column = |c: usize| values.iter().skip(c).step_by(width).copied();
            let of = |least: f32, f: fn(f32, f32) -> f32| {
                (0..width).map(|c| column(c).fold(least, f)).collect::<Vec<_>>()
            };
            (accessor["min"], accessor["max"]) =
                (json!(of(f32::INFINITY, f32::min)), json!(of(f32::NEG_INFINITY, f32::max)));
        }
        self.accessor(&bytes, accessor)
    }

    /// As one GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.with_buffer(None);
        json.resize(json.len().next_multiple_of(4), b' ');
        let bin = self.bin.len().next_multiple_of(4);
        let body = if self.bin.is_empty() { 0 } else { 8 + bin };
        let mut out = Vec::with_capacity(20 + json.len() + body);
        let word = |out: &mut Vec<u8>, n: usize| out.extend((n as u32).to_le_bytes());
        out.extend(b"glTF");
        word(&mut out, 2);
        word(&mut out, 20 + json.len() + body);
        word(&mut out, json.len());
        out.extend(b"JSON");
        out.extend(&json);
        if body > 0 {
            word(&mut out, bin);
            out.extend(b"BIN\0");
            out.extend(&self.bin);
            out.resize(out.len() + bin - self.bin.len(), 0);
        }
        out
    }

    /// The JSON of a `.gltf` whose buffer lies in the file `uri` beside it.
    pub fn gltf(&self, uri: &str) -> Vec<u8> {
        self.with_buffer(Some(uri))
    }

    fn with_buffer(&self, uri: Option<&str>) -> Vec<u8> {
        let mut json = self.json.clone();
        if let Some(Value::Array(buffers)) = json.get_mut("buffers") {
            buffers[0]["byteLength"] = self.bin.len().into();
            if let Some(uri) = uri {
                buffers[0]["uri"] = uri.into();
            }
        }
        serde_json::to_vec(&json).expect("a map of strings and numbers")
    }

    /// Add the clips and their keys.
    pub(super) fn animate(&mut self, places: &Places, clips: &[NewClip], old: &Value) -> Result<()> {
        let (mut keys, mut animations) = (Keys::default(), vec![]);
        let kept = self.json.remove("animations").unwrap_or_default();
        if clips.is_empty() {
            return Ok(());
        }
        let first = list(&mut self.json, "accessors").len();
        for (c, new) in clips.iter().enumerate() {
            let (mut animation, before) = (kept[c].clone(), new.replaces.map_or(&Value::Null, |i| &old[i]));
            animation["name"] = new.clip.name.clone().into();
            let [mut samplers, mut channels] = ["samplers", "channels"].map(|k| match animation[k].take() {
                Value::Array(list) => list,
                _ => vec![],
            });
            for (i, track) in new.clip.tracks.iter().enumerate() {
                let mut sampler = keys.sampler(track, new.short.get(i) == Some(&true), first)?;
                for (node, path) in places.targets(&track.target)? {
                    let [mut channel, beside] = carried::beside(before, node, path);
                    channel.insert("sampler".into(), samplers.len().into());
                    let target = channel.entry("target").or_insert(json!({}));
                    (target["node"], target["path"]) = (node.into(), path.into());
                    channels.push(channel.into());
                    beside.into_iter().for_each(|(key, value)| sampler[key] = value);
                }
                samplers.push(sampler);
            }
            if channels.is_empty() {
                // An animation of nothing is against the specification.
                continue;
            }
            (animation["samplers"], animation["channels"]) = (samplers.into(), channels.into());
            animations.push(animation);
        }
        self.json.insert("animations".into(), animations.into());
        self.append(keys);
        Ok(())
    }

    /// Put the keys behind what is there.
    pub(super) fn append(&mut self, keys: Keys) {
        let views = list(&mut self.json, "bufferViews").len();
        // Four-byte numbers first, so that both parts are aligned.
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view_of = [0; 2];
        let mut next = views;
        for (i, part) in keys.parts.iter().enumerate() {
            if !part.is_empty() {
                let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": part.len()});
                list(&mut self.json, "bufferViews").push(view);
                self.bin.extend(part);
                (view_of[i], next) = (next, next + 1);
            }
        }
        for (mut accessor, part) in keys.accessors {
            accessor["bufferView"] = view_of[part].into();
            list(&mut self.json, "accessors").push(accessor);
        }
        if list(&mut self.json, "buffers").is_empty() {
            list(&mut self.json, "buffers").push(json!({}));
        }
    }
}

/// What kind of picture bytes are.
pub(super) fn mime(bytes: &[u8]) -> &'static str {
    let heads: [(&[u8], &str); 3] =
        [(b"\xff\xd8", "image/jpeg"), (b"RIFF", "image/webp"), (b"\xabKTX", "image/ktx2")];
    heads.into_iter().find(|h| bytes.starts_with(h.0)).map_or("image/png", |h| h.1)
}

/// A list of the file; made if there is none.
pub(super) fn list<'j>(json: &'j mut Map<String, Value>, name: &str) -> &'j mut Vec<Value> {
    let entry = json.entry(name).or_insert(Value::Array(vec![]));
    if !entry.is_array() {
        *entry = Value::Array(vec![]);
    }
    entry.as_array_mut().expect("just made")
}

/// The nodes that tracks move.
pub(super) struct Places {
    /// Of each bone; `u32::MAX` for one that is no node.
    pub bones: Vec<u32>,
    /// First morph weight of a run, and a node that it morphs.
    pub weights: Vec<(usize, u32)>,
}

impl Places {
    fn of(import: &Import) -> Self {
        let character = &import.asset.character;
        let instances = character.instances().iter().zip(&import.primitives);
        let morphed = instances.filter(|(i, _)| !character.mesh(i).targets.is_empty());
        let mut weights: Vec<(usize, u32)> = morphed.map(|(i, p)| (i.first_weight, p.node)).collect();
        weights.dedup();
        Self { bones: import.nodes.clone(), weights }
    }

    /// Nodes and the property that a track moves.
    fn targets(&self, target: &Target) -> Result<Vec<(u32, &'static str)>> {
        let (bone, path) = match target {
            Target::Translation(b) => (b, "translation"),
            Target::Rotation(b) => (b, "rotation"),
            Target::Scale(b) => (b, "scale"),
            Target::Xzx(b) => {
                let found = format!("angles of bone {}", b.0);
                return Err(value("a clip", "rotations", found));
            }
            Target::Weights { first } => {
                let of = self.weights.iter().filter(|w| w.0 == *first);
                return Ok(of.map(|w| (w.1, "weights")).collect());
            }
        };
        let node = self.bones.get(bone.index()).copied().filter(|&n| n != u32::MAX);
        let missing = || value("a clip", "bones that are nodes of the file", format!("bone {}", bone.0));
        Ok(vec![(node.ok_or_else(missing)?, path)])
    }
}

/// Keys of all clips: accessors, and the bytes of those with four-byte and with two-byte numbers.
#[derive(Default)]
pub(super) struct Keys {
    parts: [Vec<u8>; 2],
    accessors: Vec<(Value, usize)>,
    known: BTreeMap<(Vec<u8>, &'static str), usize>,
}

impl Keys {
    /// A sampler of a track, whose accessors will follow `first` others.
    pub fn sampler(&mut self, track: &Track, short: bool, first: usize) -> Result<Value> {
        let curve = &track.curve;
        let mode = match curve.interpolation() {
            Interpolation::Hold => "STEP",
            Interpolation::Linear => "LINEAR",
            Interpolation::Hermite => "CUBICSPLINE",
            Interpolation::CatmullRom(_) => {
                return Err(value("a clip", "holds, lines or cubics with slopes", "Catmull-Rom"));
            }
        };
        let kind = match track.target {
            Target::Weights { .. } => "SCALAR",
            Target::Rotation(_) => "VEC4",
            _ => "VEC3",
        };
        let times = increasing(curve.times());
        let input = self.floats(&times, "SCALAR", 1);
        let each = if kind == "SCALAR" { 1 } else { curve.width() };
        let output = match short {
            true => self.shorts(curve.values()),
            false => self.floats(curve.values(), kind, each),
        };
        let mut sampler = json!({"input": first + input, "output": first + output, "interpolation": mode});
        if mode == "LINEAR" {
            sampler.as_object_mut().expect("an object").remove("interpolation");
        }
        Ok(sampler)
    }

    /// Equal lists are stored once.
    fn floats(&mut self, values: &[f32], kind: &'static str, width: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut accessor = json!({"componentType": 5126, "count": values.len() / width, "type": kind});
        if kind == "SCALAR" {
            let (lo, hi) =
                values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            // A key's time has bounds by the specification; weights may.
            (accessor["min"], accessor["max"]) = (json!([lo]), json!([hi]));
        }
        self.put(bytes, kind, accessor, 0)
    }

    fn shorts(&mut self, values: &[f32]) -> usize {
        let bytes: Vec<u8> =
            values.iter().flat_map(|v| ((v * 32767.0).round() as i16).to_le_bytes()).collect();
        let accessor =
            json!({"componentType": 5122, "normalized": true, "count": values.len() / 4, "type": "VEC4"});
        self.put(bytes, "short", accessor, 1)
    }

    fn put(&mut self, bytes: Vec<u8>, kind: &'static str, mut accessor: Value, part: usize) -> usize {
        let next = self.accessors.len();
        let key = (bytes, kind);
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        if !self.parts[part].is_empty() {
            accessor["byteOffset"] = self.parts[part].len().into();
        }
        self.parts[part].extend(&key.0);
        self.known.insert(key, next);
        self.accessors.push((accessor, part));
        next
    }
}

/// Times in single precision, each after the one before: of two keys at one time the second moves on by the least step.
fn increasing(times: &[f64]) -> Vec<f32> {
    let mut out: Vec<f32> = Vec::with_capacity(times.len());
    for &t in times {
        let t = t as f32;
        out.push(out.last().map_or(t, |&last| if t > last { t } else { last.next_up() }));
    }
    out
}

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
fn sampled(animations: &Value) -> Vec<u64> {
    let samplers =
        animations.as_array().into_iter().flatten().filter_map(|a| a["samplers"].as_array()).flatten();
    samplers.flat_map(|s| ["input", "output"].map(|end| s[end].as_u64())).flatten().collect()
}

/// Take out accessors that only animations used, and the views that only those used.
fn drop_accessors(json: &mut Map<String, Value>, unused: &[u64]) {
    let known = |e: &Value| HARMLESS.iter().any(|h| e.as_str().is_some_and(|e| e.starts_with(h)));
    let places_known = list(json, "extensionsUsed").iter().all(known);
    let count = list(json, "accessors").len();
    let mut gone = vec![false; count];
    if places_known {
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
    view_places(json, &mut |v| mark(&mut unused, v, false));
    take(list(json, "bufferViews"), &unused);
    let new = renumbered(&unused);
    view_places(json, &mut |v| renumber(v, &new));
    // Lists that were empty or missing stay missing: empty ones are against the specification.
    json.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
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
fn repack(json: &mut Map<String, Value>, doc: &Document) -> Vec<u8> {
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
        let Some(bytes) = doc.raw(buffer as usize) else { continue };
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
