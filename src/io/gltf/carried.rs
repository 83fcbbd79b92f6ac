//! What of a file's animations goes on when their keys are replaced: extras, extensions, and channels that move what is no bone.

use super::clips;
use super::container;
use super::document::Document;
use super::error::{Result, value};
use super::keys::Keys;
use super::mend;
use super::warnings::Warnings;
use crate::clip::Curve;
use serde_json::{Map, Value, json};
use std::path::Path;

/// A channel that moves what is no bone (KHR_animation_pointer), and its keys.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// Its keys; integers that stand for parts of 1 are fractions.
    pub curve: Curve,
    channel: Value,
    sampler: Map<String, Value>,
    /// The accessor of its values.
    form: Value,
}

impl Carried {
    /// With other keys.
    pub fn with(&self, curve: Curve) -> Self {
        Self { curve, ..self.clone() }
    }

    /// Both move the same thing.
    pub fn moves_as(&self, other: &Self) -> bool {
        self.channel["target"] == other.channel["target"]
    }

    /// Its channel and its sampler, once more.
    pub(super) fn write(&self, keys: &mut Keys, first: usize, sampler: usize) -> [Value; 2] {
        let (mut channel, own) = (self.channel.clone(), self.sampler.clone());
        channel["sampler"] = sampler.into();
        [channel, keys.formed(&self.curve, &self.form, own, first)]
    }
}

/// For each animation of a file the channels that move what is no bone.
///
/// # Errors
/// [`GltfError`](super::GltfError) as for importing.
pub fn carried(bytes: &[u8], base_dir: Option<&Path>) -> Result<Vec<Vec<Carried>>> {
    let parts = container::split(bytes)?;
    let mut w = Warnings::default();
    let doc = Document::new(mend::root(parts.json, &mut w)?, parts.bin, base_dir, &mut w)?;
    let json: Value =
        serde_json::from_slice(parts.json).map_err(|e| value("the JSON", "an object", e.to_string()))?;
    (0..array(&json["animations"]).len()).map(|i| of(&doc, &json, i)).collect()
}

/// Those of one animation.
pub(super) fn of(doc: &Document, json: &Value, animation: usize) -> Result<Vec<Carried>> {
    let old = &json["animations"][animation];
    let mut out = vec![];
    for (c, channel) in array(&old["channels"]).iter().enumerate().filter(|c| moved(&c.1["target"]).is_none())
    {
        let place = format!("animations[{animation}].channels[{c}]");
        let Some(sampler) = sampler_of(old, channel) else { continue };
        let form = &json["accessors"][sampler["output"].as_u64().unwrap_or(u64::MAX) as usize];
        let curve =
            clips::any_curve(doc, animation, channel["sampler"].as_u64().unwrap_or(0) as usize, &place)?;
        let mut sampler = sampler.as_object().cloned().unwrap_or_default();
        KEYS.iter().for_each(|key| drop(sampler.remove(*key)));
        let form = json!({"componentType": form["componentType"], "type": form["type"], "normalized": form["normalized"] == true});
        out.push(Carried { curve, channel: channel.clone(), sampler, form });
    }
    Ok(out)
}

/// What a sampler says of its keys.
const KEYS: [&str; 3] = ["input", "output", "interpolation"];

/// The channel and the sampler of an animation that move a property of a node, without what a new track says itself.
pub(super) fn beside(old: &Value, node: u32, path: &str) -> [Map<String, Value>; 2] {
    let found = array(&old["channels"]).iter().find(|c| moved(&c["target"]) == Some((node as u64, path)));
    let Some(channel) = found else { return Default::default() };
    let mut own = channel.as_object().cloned().unwrap_or_default();
    let mut target = own.remove("target").unwrap_or_default();
    if target.get("node").is_none() {
        // It pointed to the node by its path, which is said by the node now.
        target = json!({});
    }
    own.insert("target".into(), target);
    let mut sampler = sampler_of(old, channel).and_then(Value::as_object).cloned().unwrap_or_default();
    KEYS.iter().for_each(|key| drop(sampler.remove(*key)));
    [own, sampler]
}

/// The indices of accessors in animations.
pub(super) fn accessors(json: &mut Map<String, Value>, visit: &mut impl FnMut(&mut Value)) {
    let animations = json.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten();
    for sampler in animations.filter_map(|a| a.get_mut("samplers")?.as_array_mut()).flatten() {
        for (_, v) in sampler
            .as_object_mut()
            .into_iter()
            .flatten()
            .filter(|(k, _)| ["input", "output"].contains(&k.as_str()))
        {
            visit(v);
        }
    }
}

fn sampler_of<'j>(animation: &'j Value, channel: &Value) -> Option<&'j Value> {
    array(&animation["samplers"]).get(channel["sampler"].as_u64()? as usize)
}

/// The node and the property that a channel moves, if both are ours to bake.
fn moved(target: &Value) -> Option<(u64, &str)> {
    let ours = |path: &&str| ["translation", "rotation", "scale", "weights"].contains(path);
    if let Some(node) = target.get("node") {
        return Some((node.as_u64()?, target["path"].as_str().filter(ours)?));
    }
    let pointer = target["extensions"]["KHR_animation_pointer"]["pointer"].as_str()?;
    let (node, path) = pointer.strip_prefix("/nodes/")?.split_once('/')?;
    Some((node.parse().ok()?, Some(path).filter(ours)?))
}

fn array(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}
