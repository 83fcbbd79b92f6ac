//! Documents as text for people: one bone, vertex, triangle or key a line.

use super::document::{Bind, Mesh, Rig};
use super::poses::{Clip, Poses, Track};
use serde::Serialize;
use serde_json::ser::Formatter;
use std::fmt::Write;
use std::io;

/// A rig file.
pub fn rig(rig: &Rig) -> String {
    let mut out = format!("{{\n  \"sinew_rig\": {},\n  \"name\": {}", rig.sinew_rig, json(&rig.name));
    if let Some(poses) = &rig.poses {
        let _ = write!(out, ",\n  \"poses\": {}", json(poses));
    }
    list(&mut out, 2, "bones", &rig.bones);
    list(&mut out, 2, "materials", &rig.materials);
    out.push_str(",\n  \"meshes\": [");
    for (i, m) in rig.meshes.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        mesh(&mut out, m);
    }
    out.push_str(if rig.meshes.is_empty() { "]\n}\n" } else { "\n  ]\n}\n" });
    out
}

fn mesh(out: &mut String, m: &Mesh) {
    let _ = write!(out, "    {{\n      \"name\": {}", json(&m.name));
    if let Some(material) = &m.material {
        let _ = write!(out, ",\n      \"material\": {}", json(material));
    }
    match &m.bind {
        Bind::Weights(w) => {
            let _ =
                write!(out, ",\n      \"bind\": {{\"weights\": {{\n        \"bones\": {}", json(&w.bones));
            if !w.inverse_bind.is_empty() {
                list(out, 8, "inverse_bind", &w.inverse_bind);
            }
            list(out, 8, "vertices", &w.vertices);
            out.push_str("\n      }}");
        }
        simple => {
            let _ = write!(out, ",\n      \"bind\": {}", json(simple));
        }
    }
    if let Some(crease) = m.crease_deg {
        let _ = write!(out, ",\n      \"crease_deg\": {}", json(&crease));
    }
    list(out, 6, "positions", &m.positions);
    if !m.normals.is_empty() {
        list(out, 6, "normals", &m.normals);
    }
    if !m.uvs.is_empty() {
        list(out, 6, "uvs", &m.uvs);
    }
    if !m.colors.is_empty() {
        list(out, 6, "colors", &m.colors);
    }
    list(out, 6, "triangles", &m.triangles);
    if !m.targets.is_empty() {
        list(out, 6, "targets", &m.targets);
    }
    if let Some(run) = m.morph {
        let _ = write!(out, ",\n      \"morph\": {run}");
    }
    if !m.weights.is_empty() {
        let _ = write!(out, ",\n      \"weights\": {}", json(&m.weights));
    }
    out.push_str("\n    }");
}

/// A file of poses.
pub fn poses(poses: &Poses) -> String {
    let mut out = format!("{{\n  \"sinew_poses\": {}", poses.sinew_poses);
    field(&mut out, 2, "rate", &poses.rate);
    out.push_str(",\n  \"clips\": [");
    for (i, c) in poses.clips.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        clip(&mut out, c);
    }
    out.push_str(if poses.clips.is_empty() { "]\n}\n" } else { "\n  ]\n}\n" });
    out
}

fn clip(out: &mut String, c: &Clip) {
    let _ = write!(out, "    {{\n      \"name\": {}", json(&c.name));
    if c.repeats {
        out.push_str(",\n      \"loop\": true");
    }
    let _ = write!(out, ",\n      \"interpolation\": {}", json(&c.interpolation));
    let _ = write!(out, ",\n      \"tangents\": {}", json(&c.tangents));
    field(out, 6, "range", &c.range);
    field(out, 6, "preview", &c.preview);
    field(out, 6, "markers", &Some(&c.markers).filter(|m| !m.is_empty()));
    out.push_str(",\n      \"tracks\": [");
    for (i, t) in c.tracks.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        track(out, t);
    }
    out.push_str(if c.tracks.is_empty() { "]\n    }" } else { "\n      ]\n    }" });
}

fn track(out: &mut String, t: &Track) {
    let _ = match t.morph {
        Some(run) => write!(out, "        {{\"morph\": {run}"),
        None => write!(out, "        {{\"bone\": {}", json(&t.bone)),
    };
    if let Some(i) = &t.interpolation {
        let _ = write!(out, ", \"interpolation\": {}", json(i));
    }
    if let Some(i) = &t.tangents {
        let _ = write!(out, ", \"tangents\": {}", json(i));
    }
    for (key, rows) in t.channels() {
        let _ = write!(out, ", \"{key}\": [");
        for (i, row) in rows.iter().enumerate() {
            let _ = write!(out, "{}\n          {}", if i == 0 { "" } else { "," }, json(row));
        }
        out.push(']');
    }
    out.push('}');
}

/// A field on a line of its own, if it is there.
fn field<T: Serialize>(out: &mut String, indent: usize, key: &str, value: &Option<T>) {
    if let Some(value) = value {
        let _ = write!(out, ",\n{:indent$}\"{key}\": {}", "", json(value));
    }
}

/// A field whose items stand on a line each.
fn list<T: Serialize>(out: &mut String, indent: usize, key: &str, items: &[T]) {
    let _ = write!(out, ",\n{:indent$}\"{key}\": [", "");
    for (i, item) in items.iter().enumerate() {
        let _ = write!(out, "{}\n{:indent$}  {}", if i == 0 { "" } else { "," }, "", json(item));
    }
    if !items.is_empty() {
        let _ = write!(out, "\n{:indent$}", "");
    }
    out.push(']');
}

/// One value on one line.
fn json<T: Serialize>(value: &T) -> String {
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Line);
    match value.serialize(&mut serializer) {
        Ok(()) => String::from_utf8_lossy(&bytes).into_owned(),
        // Documents are plain data: neither their maps nor the buffer can refuse.
        Err(e) => unreachable!("a document is always serialisable: {e}"),
    }
}

/// Compact, but a space after commas of objects and colons; whole numbers without `.0`.
struct Line;

impl Formatter for Line {
    fn write_f32<W: ?Sized + io::Write>(&mut self, to: &mut W, value: f32) -> io::Result<()> {
        write!(to, "{value}")
    }

    fn write_f64<W: ?Sized + io::Write>(&mut self, to: &mut W, value: f64) -> io::Result<()> {
        write!(to, "{value}")
    }

    fn begin_object_key<W: ?Sized + io::Write>(&mut self, to: &mut W, first: bool) -> io::Result<()> {
        to.write_all(if first { b"" } else { b", " })
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, to: &mut W) -> io::Result<()> {
        to.write_all(b": ")
    }
}
