//! What of a file's animations goes on when their keys are replaced: extras, extensions, and channels that move what is no bone.

use super::rewrite::NewClip;
use serde_json::{Map, Value, json};

/// For each new clip the animation that it replaces, without the channels that it makes anew: what is left are those that point elsewhere
/// (KHR_animation_pointer), and their samplers.
pub(super) fn kept(old: &Value, clips: &[NewClip]) -> Vec<Value> {
    let one = |clip: &NewClip| {
        let Some(old) = clip.replaces.map(|i| &old[i]).filter(|a| a.is_object()) else { return json!({}) };
        let mut animation = old.clone();
        let (mut samplers, mut channels) = (vec![], vec![]);
        for channel in array(&old["channels"]).iter().filter(|c| moved(&c["target"]).is_none()) {
            let Some(sampler) = sampler_of(old, channel) else { continue };
            let mut channel = channel.clone();
            channel["sampler"] = samplers.len().into();
            samplers.push(sampler.clone());
            channels.push(channel);
        }
        (animation["samplers"], animation["channels"]) = (samplers.into(), channels.into());
        animation
    };
    clips.iter().map(one).collect()
}

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
    for key in ["input", "output", "interpolation"] {
        sampler.remove(key);
    }
    [own, sampler]
}

/// The indices of accessors in what is kept.
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
