//! What was reached, for people and for programs.

use super::Args;
use super::clips::Edited;
use crate::cli::say;
use serde_json::{Value, json};
use sinew::bake::{BakeDesc, Baked, Metric, Spot};
use sinew::io::Import;

/// A clip, and what was made of it.
pub(super) struct Done<'a> {
    pub edited: &'a Edited,
    pub baked: Baked,
    /// Metres that any point may be off; pins may less.
    pub allowed: f64,
    /// Metres that vertices are off besides, because they are stored in integers.
    pub mesh: f64,
}

impl Done<'_> {
    /// Metres that no point but pins exceeds, and those that are allowed.
    fn error(&self) -> [f64; 2] {
        [self.baked.report.ceiling, 1.0].map(|share| share * self.allowed + self.mesh)
    }

    /// Where the worst is a pin, how far it is off and how far it may, metres.
    fn pin(&self) -> Option<[f64; 2]> {
        let worst = &self.baked.report.worst;
        (worst.spot.is_some() && worst.limit != self.allowed).then_some([worst.distance, worst.limit])
    }
}

pub(super) fn bone_of(import: &Import, b: &Baked) -> String {
    let character = &import.asset.character;
    let bone = match b.report.worst.spot {
        Some(Spot::Vertex { instance, vertex }) => character.bones_of(instance, vertex).next(),
        Some(Spot::Bone(bone)) => Some(bone),
        None => None,
    };
    bone.map_or_else(String::new, |b| character.skeleton().name(b).into())
}

pub(super) fn line(import: &Import, done: &Done, diagonal: f64) -> String {
    let (clip, r) = (&done.edited.clip, &done.baked.report);
    let made = format!(
        "{}: {} → {} keys, {} → {} bytes",
        say::name(&clip.name),
        r.keys[0],
        r.keys[1],
        r.bytes[0],
        r.bytes[1]
    );
    let [error, _] = done.error();
    if r.worst.spot.is_none() && error == 0.0 {
        return format!("{made}; nothing is off");
    }
    let pin = done.pin().map(|p| p.map(|m| 1e3 * m));
    format!(
        "{made}; at most {:.4} mm off ({:.4}% of the diagonal), {} at {:.3} s on {}",
        1e3 * error,
        100.0 * error / diagonal.max(1e-30),
        pin.map_or("worst".into(), |[off, may]| format!("worst a pin, by {off:.4} of {may:.4} mm,")),
        r.worst.time,
        say::name(&bone_of(import, &done.baked)),
    )
}

pub(super) fn worst(import: &Import, b: &Baked) -> Value {
    let mut worst = json!({"time": b.report.worst.time, "bone": bone_of(import, b)});
    if let Some(Spot::Vertex { instance, vertex }) = b.report.worst.spot {
        (worst["instance"], worst["vertex"]) = (instance.into(), vertex.into());
    }
    worst
}

pub(super) fn report(import: &Import, done: &[Done], args: &Args, desc: &BakeDesc, diagonal: f64) -> Value {
    let metric_name = match desc.metric {
        Metric::Vertices => "vertices".to_owned(),
        Metric::Shell(radius) => format!("shell of {radius} m"),
    };
    let clips = done.iter().map(|d| {
        let (b, r) = (&d.baked, &d.baked.report);
        let [error, limit] = d.error();
        let mut told = json!({
            "clip": d.edited.clip.name,
            "error": error,
            "measured": r.worst.distance,
            "limit": limit,
            "worst": worst(import, b),
            "moments": r.moments,
            "keys": r.keys,
            "bytes": r.bytes,
            "loop": d.edited.cycle,
        });
        if let Some([off, may]) = d.pin() {
            told["pin"] = json!({"measured": off, "limit": may});
        }
        if let Some(motion) = &d.edited.motion {
            told["rootMotion"] = import.asset.character.skeleton().name(motion.bone).into();
        }
        if let Some(from) = args.edits.reference() {
            told["additive"] = from.into();
        }
        told
    });
    json!({"tolerance": desc.tolerance, "diagonal": diagonal, "metric": metric_name, "clips": clips.collect::<Vec<_>>()})
}
