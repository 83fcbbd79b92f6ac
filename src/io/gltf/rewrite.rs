//! A glTF file with other clips: everything else is carried through, byte for byte where it is binary.

use super::carried::{self, Carried};
use super::container;
use super::document::Document;
use super::error::{Result, value};
use super::influences;
use super::keys::{Keys, Places};
use super::mend;
use super::prune;
use super::uri::Source;
use super::warnings::Warnings;
use crate::clip::Clip;
use crate::io::Import;
use serde_json::{Map, Value, json};
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
    /// Channels that move what is no bone; those of the animation that it replaces, as they are, if none are given.
    pub carried: Option<&'a [Carried]>,
}

/// A glTF asset in memory.
#[derive(Clone, Debug, Default)]
pub struct Rewritten {
    /// The JSON.
    pub json: Map<String, Value>,
    /// The binary chunk.
    pub bin: Vec<u8>,
    /// The animation of each clip that was written; none where nothing moves.
    pub animations: Vec<Option<usize>>,
}

/// What is to become of a file.
#[derive(Clone, Debug, Default)]
pub struct Change<'a> {
    /// Clips in place of its own.
    pub clips: &'a [NewClip<'a>],
    /// Merged into those of the asset.
    pub extras: Map<String, Value>,
    /// Vertices get the import's influences, which are fewer than the file's own.
    pub influences: bool,
}

/// The file of `bytes`, which `import` came from, with a change.
///
/// # Errors
/// [`GltfError`](super::GltfError) as for importing, or if a clip moves what the file has no node for, or influences are not of its vertices.
pub fn changed(bytes: &[u8], base_dir: Option<&Path>, import: &Import, change: Change) -> Result<Rewritten> {
    let Change { clips, extras, influences: influenced } = change;
    let parts = container::split(bytes)?;
    let mut w = Warnings::default();
    let doc = Document::new(mend::root(parts.json, &mut w)?, parts.bin, base_dir, &mut w)?;
    let mut json: Map<String, Value> =
        serde_json::from_slice(parts.json).map_err(|e| value("the JSON", "an object", e.to_string()))?;
    let whole = Value::Object(std::mem::take(&mut json));
    let of = |c: &NewClip| match (c.carried, c.replaces) {
        (Some(given), _) => Ok(given.to_vec()),
        (None, Some(i)) => carried::of(&doc, &whole, i),
        _ => Ok(vec![]),
    };
    let carried: Vec<Vec<Carried>> = clips.iter().map(of).collect::<Result<_>>()?;
    if let Value::Object(all) = whole {
        json = all;
    }
    let old = json.remove("animations").unwrap_or_default();
    let mut unused = prune::sampled(&old);
    if influenced {
        unused.extend(influences::strip(&mut json));
    }
    let torn = prune::drop_accessors(&mut json, &unused);
    let bin = prune::repack(&mut json, |buffer| doc.raw(buffer));
    let mut out = Rewritten { bin, json, ..Rewritten::default() };
    out.split(&torn, false)?;
    if influenced {
        influences::write(&mut out, import)?;
    }
    out.animate(&Places::of(import), clips, &carried, &old)?;
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

    /// Say that nobody reads this file without an extension.
    pub(super) fn requires(&mut self, extension: &str) {
        for key in ["extensionsUsed", "extensionsRequired"] {
            let names = list(&mut self.json, key);
            if !names.iter().any(|e| e == extension) {
                names.push(extension.into());
            }
        }
    }

    pub(super) fn with_buffer(&self, uri: Option<&str>) -> Vec<u8> {
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
    pub(super) fn animate(
        &mut self,
        places: &Places,
        clips: &[NewClip],
        carried: &[Vec<Carried>],
        old: &Value,
    ) -> Result<()> {
        let (mut keys, mut animations) = (Keys::default(), vec![]);
        if clips.is_empty() {
            return Ok(());
        }
        let first = list(&mut self.json, "accessors").len();
        for (c, new) in clips.iter().enumerate() {
            let before = new.replaces.map_or(&Value::Null, |i| &old[i]);
            let mut animation = if before.is_object() { before.clone() } else { json!({}) };
            animation["name"] = new.clip.name.clone().into();
            let (mut samplers, mut channels): (Vec<Value>, Vec<Value>) = (vec![], vec![]);
            for one in carried.get(c).into_iter().flatten() {
                let [channel, sampler] = one.write(&mut keys, first, samplers.len());
                channels.push(channel);
                samplers.push(sampler);
            }
            for (i, track) in new.clip.tracks.iter().enumerate() {
                let mut sampler = keys.sampler(track, new.short.get(i) == Some(&true), first);
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
                self.animations.push(None);
                continue;
            }
            self.animations.push(Some(animations.len()));
            (animation["samplers"], animation["channels"]) = (samplers.into(), channels.into());
            animations.push(animation);
        }
        if !animations.is_empty() {
            self.json.insert("animations".into(), animations.into());
        }
        self.append(keys);
        Ok(())
    }

    /// What became of a clip.
    pub(super) fn animation(&mut self, clip: usize) -> Option<&mut Value> {
        let animation = (*self.animations.get(clip)?)?;
        self.json.get_mut("animations")?.get_mut(animation)
    }

    /// Put the keys behind what is there.
    pub(super) fn append(&mut self, keys: Keys) {
        let views = list(&mut self.json, "bufferViews").len();
        // Wider numbers first, so that all parts are aligned.
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view_of = [0; 3];
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
