//! From JSON text to the typed schema. What the schema crate refuses although files have it is mended first.

use super::error::{self, GltfError, Result};
use super::warnings::Warnings;
use ::gltf::json::{self, Root};
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// The node of a channel that is left out.
pub(super) const NO_NODE: u32 = u32::MAX;

/// Parse, check the version, mend, and give the JSON its types.
pub(super) fn root(text: &[u8], warnings: &mut Warnings) -> Result<Root> {
    serde_json::from_value(mended(text, warnings)?).or_else(|source| {
        // Read it again to find the misfit: keeping both forms would double the memory of every good file.
        let value = mended(text, &mut Warnings::default())?;
        Err(misfit(&value).unwrap_or(GltfError::Json { place: "JSON".into(), source }))
    })
}

fn mended(text: &[u8], warnings: &mut Warnings) -> Result<Value> {
    let syntax = |source| GltfError::Json { place: "JSON".into(), source };
    let mut value: Value = serde_json::from_slice(trim_padding(text)).map_err(syntax)?;
    version(&mut value, warnings)?;
    strip_extras(&mut value);
    if let Some((place, found)) = wide_index(&value, "") {
        return Err(error::value(place.trim_start_matches('.'), "an index below 2³²", found));
    }
    optional_lists(&mut value);
    texture_sources(&mut value);
    channels_without_node(&mut value, warnings);
    Ok(value)
}

/// An index that the schema crate would cut to 32 bits, and so take for another: its place and what it is.
fn wide_index(value: &Value, key: &str) -> Option<(String, String)> {
    const INDICES: [&str; 20] = [
        "attributes",
        "buffer",
        "bufferView",
        "camera",
        "children",
        "index",
        "indices",
        "input",
        "inverseBindMatrices",
        "joints",
        "material",
        "mesh",
        "node",
        "nodes",
        "output",
        "sampler",
        "scene",
        "skeleton",
        "skin",
        "source",
    ];
    let found = |(step, (rest, found)): (String, (String, String))| (step + &rest, found);
    match value {
        Value::Number(n) => {
            let wide = n.as_u64().is_some_and(|n| n > u32::MAX.into()) && INDICES.contains(&key);
            wide.then(|| (String::new(), n.to_string()))
        }
        Value::Array(list) => {
            let mut at = list.iter().enumerate();
            at.find_map(|(i, v)| Some((format!("[{i}]"), wide_index(v, key)?))).map(found)
        }
        Value::Object(map) => {
            // Attributes and shapes name accessors by names of their own.
            let named = key == "attributes" || key == "targets";
            let of = |k| if named { "attributes" } else { k };
            map.iter().find_map(|(k, v)| Some((format!(".{k}"), wide_index(v, of(k))?))).map(found)
        }
        _ => None,
    }
}

/// Which entry of which list does not have the schema's shape.
fn misfit(value: &Value) -> Option<GltfError> {
    fn first<T: for<'a> Deserialize<'a>>(value: &Value, key: &str) -> Option<GltfError> {
        let list = value.get(key)?.as_array()?;
        list.iter().enumerate().find_map(|(i, v)| {
            let source = T::deserialize(v).err()?;
            Some(GltfError::Json { place: format!("{key}[{i}]"), source })
        })
    }
    None.or_else(|| first::<json::Accessor>(value, "accessors"))
        .or_else(|| first::<json::Animation>(value, "animations"))
        .or_else(|| first::<json::Buffer>(value, "buffers"))
        .or_else(|| first::<json::buffer::View>(value, "bufferViews"))
        .or_else(|| first::<json::Camera>(value, "cameras"))
        .or_else(|| first::<json::Image>(value, "images"))
        .or_else(|| first::<json::Material>(value, "materials"))
        .or_else(|| first::<json::Mesh>(value, "meshes"))
        .or_else(|| first::<json::Node>(value, "nodes"))
        .or_else(|| first::<json::texture::Sampler>(value, "samplers"))
        .or_else(|| first::<json::Scene>(value, "scenes"))
        .or_else(|| first::<json::Skin>(value, "skins"))
        .or_else(|| first::<json::Texture>(value, "textures"))
}

/// GLB pads its JSON with spaces; some writers pad with zeros.
fn trim_padding(text: &[u8]) -> &[u8] {
    let end = text.iter().rposition(|&b| b != 0).map_or(0, |i| i + 1);
    &text[..end]
}

fn version(value: &mut Value, warnings: &mut Warnings) -> Result<()> {
    let Some(root) = value.as_object_mut() else { return Ok(()) };
    let asset = root.entry("asset").or_insert_with(|| json!({}));
    let Some(asset) = asset.as_object_mut() else { return Ok(()) };
    for (key, place) in [("version", "asset.version"), ("minVersion", "asset.minVersion")] {
        match asset.get(key).and_then(Value::as_str) {
            Some(v) if v.split('.').next() != Some("2") => {
                return Err(GltfError::Version { place, found: v.into() });
            }
            Some("2.0") | None => {}
            Some(v) if key == "minVersion" => {
                return Err(GltfError::Version { place, found: v.into() });
            }
            Some(_) => {}
        }
    }
    if !asset.contains_key("version") {
        warnings.push("asset", "says no version; read as 2.0");
        asset.insert("version".into(), json!("2.0"));
    }
    Ok(())
}

/// Extras mean nothing to us but for the names of shapes, and some of them are not what the schema crate expects.
fn strip_extras(value: &mut Value) {
    let names = |mesh: &mut Map<String, Value>| mesh.get("extras")?.get("targetNames").cloned();
    let names: Vec<Option<Value>> = objects(value, "meshes").map(names).collect();
    strip_all(value);
    for (mesh, names) in objects(value, "meshes").zip(names) {
        names.map(|n| mesh.insert("extras".into(), json!({"targetNames": n})));
    }
}

fn strip_all(value: &mut Value) {
    // An explicit stack: the parser bounds the depth, but a walk needs no recursion.
    let mut stack = vec![value];
    while let Some(v) = stack.pop() {
        match v {
            Value::Array(list) => stack.extend(list.iter_mut()),
            Value::Object(map) => {
                map.remove("extras");
                stack.extend(map.values_mut());
            }
            _ => {}
        }
    }
}

/// Lists that the specification leaves optional.
fn optional_lists(value: &mut Value) {
    for scene in objects(value, "scenes") {
        scene.entry("nodes").or_insert_with(|| json!([]));
    }
}

fn texture_sources(value: &mut Value) {
    for texture in objects(value, "textures") {
        texture.entry("source").or_insert_with(|| json!(u32::MAX));
    }
}

/// A channel without a node points by path (KHR_animation_pointer). A path to a node's transform or weights is as good as a
/// node; of anything else we have nothing that could move. Such channels keep their place and get [`NO_NODE`].
fn channels_without_node(value: &mut Value, warnings: &mut Warnings) {
    for (a, animation) in objects(value, "animations").enumerate() {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        for (c, channel) in channels.iter_mut().enumerate() {
            let Some(target) = channel.get_mut("target") else { continue };
            let named = target.get("node").is_some_and(|n| n.as_u64() != Some(NO_NODE as u64));
            if !named && !follow_pointer(target) {
                let place = format!("animations[{a}].channels[{c}]");
                warnings.push(place, "its target is no node; the channel is left out");
                *target = json!({ "node": NO_NODE, "path": "translation" });
            }
        }
    }
}

fn follow_pointer(target: &mut Value) -> bool {
    let pointer = target["extensions"]["KHR_animation_pointer"]["pointer"].as_str().unwrap_or("");
    let mut parts = pointer.strip_prefix("/nodes/").unwrap_or("").split('/');
    let node = parts.next().and_then(|n| n.parse::<u32>().ok());
    let path = parts.next().filter(|p| ["translation", "rotation", "scale", "weights"].contains(p));
    match (node, path, parts.next()) {
        (Some(node), Some(path), None) => {
            *target = json!({ "node": node, "path": path });
            true
        }
        _ => false,
    }
}

fn objects<'a>(value: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Map<String, Value>> {
    let list = value.get_mut(key).and_then(Value::as_array_mut);
    list.into_iter().flatten().filter_map(Value::as_object_mut)
}
