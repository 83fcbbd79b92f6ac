//! Keys of clips as glTF stores them: nodes, samplers, accessors.

use super::error::{Result, value};
use crate::clip::{Curve, Integers, Interpolation, Target, Track};
use crate::io::Import;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// The nodes that tracks move.
pub(super) struct Places {
    /// Of each bone; `u32::MAX` for one that is no node.
    pub bones: Vec<u32>,
    /// First morph weight of a run, and a node that it morphs.
    pub weights: Vec<(usize, u32)>,
}

impl Places {
    pub fn of(import: &Import) -> Self {
        let character = &import.asset.character;
        let instances = character.instances().iter().zip(&import.primitives);
        let morphed = instances.filter(|(i, _)| !character.mesh(i).targets.is_empty());
        let mut weights: Vec<(usize, u32)> = morphed.map(|(i, p)| (i.first_weight, p.node)).collect();
        weights.dedup();
        Self { bones: import.nodes.clone(), weights }
    }

    /// Nodes and the property that a track moves.
    pub fn targets(&self, target: &Target) -> Result<Vec<(u32, &'static str)>> {
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

/// Bytes, what they make up, the type of their numbers, and whether those stand for parts of 1.
type Form = (Vec<u8>, &'static str, usize, bool);

/// Keys of all clips: accessors, and the bytes of those with four-byte, with two-byte and with one-byte numbers.
#[derive(Default)]
pub(super) struct Keys {
    pub parts: [Vec<u8>; 3],
    /// Each with its part.
    pub accessors: Vec<(Value, usize)>,
    known: BTreeMap<Form, usize>,
}

impl Keys {
    /// A sampler of a track, whose accessors will follow `first` others. Slopes by a rule are written as numbers.
    pub fn sampler(&mut self, track: &Track, short: bool, first: usize) -> Value {
        let curve = &track.curve.with_slopes();
        let kind = match track.target {
            Target::Weights { .. } => "SCALAR",
            Target::Rotation(_) => "VEC4",
            _ => "VEC3",
        };
        let times = increasing(curve.times());
        let input = self.floats(&times, "SCALAR", 1);
        let each = if kind == "SCALAR" { 1 } else { curve.width() };
        let form = match kind {
            "SCALAR" => curve.integers(),
            _ => Some(Integers { bits: 16, signed: true }),
        };
        let output = match form.filter(|_| short) {
            Some(form) => self.integers(curve.values(), kind, each, form, true),
            None => self.floats(curve.values(), kind, each),
        };
        let mut sampler = json!({"input": first + input, "output": first + output});
        mode(curve).into_iter().for_each(|mode| sampler["interpolation"] = mode.into());
        sampler
    }

    /// A sampler of a curve whose values have the form of this accessor.
    pub fn formed(
        &mut self,
        curve: &Curve,
        form: &Value,
        mut sampler: Map<String, Value>,
        first: usize,
    ) -> Value {
        let input = self.floats(&increasing(curve.times()), "SCALAR", 1);
        let each =
            [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT2", 4), ("MAT3", 9), ("MAT4", 16)];
        let (kind, width) = each.into_iter().find(|e| form["type"] == e.0).unwrap_or(each[0]);
        let (code, normalized) = (form["componentType"].as_u64().unwrap_or(5126), form["normalized"] == true);
        let output = match code {
            5120..=5123 => {
                let form = Integers { bits: if code < 5122 { 8 } else { 16 }, signed: code % 2 == 0 };
                self.integers(curve.values(), kind, width, form, normalized)
            }
            _ => self.floats(curve.values(), kind, width),
        };
        sampler
            .extend([("input".into(), (first + input).into()), ("output".into(), (first + output).into())]);
        if let Some(mode) = mode(curve) {
            sampler.insert("interpolation".into(), mode.into());
        }
        sampler.into()
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
        self.put((bytes, kind, 5126, false), accessor, 0)
    }

    fn integers(
        &mut self,
        values: &[f32],
        kind: &'static str,
        width: usize,
        form: Integers,
        normalized: bool,
    ) -> usize {
        let (size, unit) = (form.bits / 8, if normalized { form.unit() } else { 1.0 });
        let number = |v: &f32| ((v * unit).round() as i32).to_le_bytes().into_iter().take(size);
        let bytes: Vec<u8> = values.iter().flat_map(number).collect();
        let code = 5118 + 2 * size + usize::from(!form.signed);
        let mut accessor = json!({"componentType": code, "count": values.len() / width, "type": kind});
        if normalized {
            accessor["normalized"] = true.into();
        }
        self.put((bytes, kind, code, normalized), accessor, 3 - size)
    }

    fn put(&mut self, key: Form, mut accessor: Value, part: usize) -> usize {
        let next = self.accessors.len();
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

/// The interpolation's name, if it is not the usual.
fn mode(curve: &Curve) -> Option<&'static str> {
    match curve.interpolation() {
        Interpolation::Hold => Some("STEP"),
        Interpolation::Linear => None,
        Interpolation::Hermite | Interpolation::CatmullRom(_) => Some("CUBICSPLINE"),
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
