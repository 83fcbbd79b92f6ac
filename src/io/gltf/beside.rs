//! What a file says beside its clips: notes in an animation's extras, and a node that moves alone.

use super::keys::Keys;
use super::rewrite::{Rewritten, list};
use crate::clip::{Curve, Interpolation, Target, Track};
use crate::skeleton::BoneId;
use glam::Quat;
use serde_json::{Value, json};

impl Rewritten {
    /// Put `value` into `extras.sinew` of what became of a clip.
    pub fn note(&mut self, clip: usize, key: &str, value: Value) {
        let Some(animation) = self.animation(clip) else { return };
        if !animation["extras"].is_object() {
            let before = animation["extras"].take();
            animation["extras"] = if before.is_null() { json!({}) } else { json!({"before": before}) };
        }
        if !animation["extras"]["sinew"].is_object() {
            animation["extras"]["sinew"] = json!({});
        }
        animation["extras"]["sinew"][key] = value;
    }

    /// Let an empty node of this name move with a clip: `T(translation) · R_y(yaw)`, straight between keys. Animations share
    /// the node; whoever hangs something below it takes it along.
    ///
    /// # Panics
    /// If the three lists differ in length, or a number is not finite.
    pub fn add_moving_node(
        &mut self,
        clip: usize,
        name: &str,
        times: &[f64],
        translations: &[[f64; 3]],
        yaw: &[f64],
    ) {
        let node = self.empty_node(name);
        let way = translations.iter().flatten().map(|v| *v as f32).collect();
        let turn = yaw.iter().flat_map(|y| Quat::from_rotation_y(*y as f32).to_array()).collect();
        let mut tracks = vec![("translation", Target::Translation(BoneId(0)), way, 3)];
        if yaw.iter().any(|y| *y != 0.0) {
            tracks.push(("rotation", Target::Rotation(BoneId(0)), turn, 4));
        }
        let (mut keys, first) = (Keys::default(), list(&mut self.json, "accessors").len());
        for (path, target, values, width) in tracks {
            let curve = Curve::new(times.to_vec(), values, width, Interpolation::Linear);
            let track = Track { target, curve: curve.expect("finite keys in order") };
            let sampler = keys.sampler(&track, false, first);
            let Some(animation) = self.animation(clip) else { return };
            let samplers = animation["samplers"].as_array_mut().expect("written before");
            samplers.push(sampler);
            let channel = json!({"sampler": samplers.len() - 1, "target": {"node": node, "path": path}});
            animation["channels"].as_array_mut().expect("written before").push(channel);
        }
        self.append(keys);
    }

    /// The last node, if it is one that was made here; else a new one in the scene.
    fn empty_node(&mut self, name: &str) -> usize {
        let nodes = list(&mut self.json, "nodes");
        let own = json!({"name": name});
        if nodes.last() == Some(&own) {
            return nodes.len() - 1;
        }
        nodes.push(own);
        let node = nodes.len() - 1;
        let scene = self.json.get("scene").and_then(Value::as_u64).unwrap_or(0) as usize;
        if let Some(scene) = list(&mut self.json, "scenes").get_mut(scene) {
            match scene["nodes"].as_array_mut() {
                Some(roots) => roots.push(node.into()),
                None => scene["nodes"] = json!([node]),
            }
        }
        node
    }
}
