//! Other influences for the vertices of a file.

use super::error::{Result, value};
use super::prune::primitives;
use super::rewrite::Rewritten;
use super::write::influences;
use crate::character::Binding;
use crate::io::Import;
use serde_json::{Map, Value};

/// Take the influences out of all primitives; the accessors that they were in.
pub(super) fn strip(json: &mut Map<String, Value>) -> Vec<u64> {
    let mut out = vec![];
    let is = |key: &str| key.starts_with("JOINTS_") || key.starts_with("WEIGHTS_");
    for p in primitives(json) {
        // A compressed stream may hold more than what is used of it.
        let streamed = p.pointer_mut("/extensions/KHR_draco_mesh_compression/attributes");
        streamed.and_then(Value::as_object_mut).into_iter().for_each(|a| a.retain(|k, _| !is(k)));
        let Some(attributes) = p.get_mut("attributes").and_then(Value::as_object_mut) else { continue };
        out.extend(attributes.iter().filter(|a| is(a.0)).filter_map(|a| a.1.as_u64()));
        attributes.retain(|k, _| !is(k));
    }
    out
}

/// Give skinned primitives the influences that the import has.
pub(super) fn write(out: &mut Rewritten, import: &Import) -> Result<()> {
    let mut done = vec![];
    for (instance, from) in import.asset.character.instances().iter().zip(&import.primitives) {
        let Binding::Skin { weights, .. } = &instance.binding else { continue };
        let place = (from.mesh as usize, from.primitive as usize);
        if done.contains(&place) {
            continue;
        }
        done.push(place);
        let at =
            |json: &Map<String, Value>| json["meshes"][place.0]["primitives"][place.1]["attributes"].clone();
        let mut attributes = at(&out.json);
        let count =
            attributes["POSITION"].as_u64().and_then(|a| out.json["accessors"][a as usize]["count"].as_u64());
        if count != Some(weights.vertex_count() as u64) {
            let found = format!("{} vertices after the import", weights.vertex_count());
            let place = format!("meshes[{}].primitives[{}]", place.0, place.1);
            return Err(value(place, "its own vertices, to give them other influences", found));
        }
        influences(out, weights, &mut attributes);
        out.json["meshes"][place.0]["primitives"][place.1]["attributes"] = attributes;
    }
    Ok(())
}
