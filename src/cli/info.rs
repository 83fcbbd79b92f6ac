//! `sinew info`: what is in a file.

use super::{Failure, load, print, say, say::Say};
use serde_json::{Value, json};
use sinew::character::Binding;
use sinew::io::{Import, Options};
use sinew::mesh::topology;
use std::fmt::Write;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew info fox.glb
  sinew info rigs/pip.json --json

V, E, F count the surface behind a mesh: vertices at one place are one, degenerate triangles none. A surface is closed when every
edge has exactly two faces.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    // Textures are read too, so that what is wrong with them is told.
    let import = load(&args.input, Options { textures: true }, say)?;
    let report = report(&import);
    let mut text = if args.json { report.to_string() } else { as_text(&report) };
    text.push('\n');
    print(text.as_bytes())
}

fn report(import: &Import) -> Value {
    let c = &import.asset.character;
    let skeleton = c.skeleton();
    let bones = skeleton.ids().map(|b| {
        json!({
            "name": skeleton.name(b),
            "parent": skeleton.parent(b).map(|p| p.0),
            "length": skeleton.length(b),
            "node": import.nodes.get(b.index()),
        })
    });
    let meshes = c.meshes().iter().map(|m| {
        let s = topology::surface(&m.positions, &m.triangles);
        json!({
            "name": m.name,
            "positions": m.positions.len(),
            "triangles": m.triangles.len(),
            "V": s.vertices, "E": s.edges, "F": s.faces,
            "closed": s.closed(),
            "boundary_edges": s.boundary_edges,
            "tangled_edges": s.tangled_edges,
            "components": s.components,
            "euler": s.euler,
            "morph_targets": m.targets.len(),
        })
    });
    let instances = c.instances().iter().map(|i| match &i.binding {
        Binding::Bone(b) => json!({ "mesh": i.mesh.0, "bone": skeleton.name(*b) }),
        Binding::Skin { palette, weights } => {
            json!({ "mesh": i.mesh.0, "skin_bones": palette.len(), "influences": weights.per_vertex() })
        }
    });
    let clips = c.clips().iter().map(|k| {
        let r = k.range();
        json!({ "name": k.name, "start": r.start, "end": r.end, "duration": r.duration(),
                "tracks": k.tracks.len(), "keys": k.key_count() })
    });
    let asset = &import.asset;
    json!({
        "schema": 1,
        "format": import.format,
        "generator": import.generator,
        "bones": bones.collect::<Vec<_>>(),
        "meshes": meshes.collect::<Vec<_>>(),
        "instances": instances.collect::<Vec<_>>(),
        "clips": clips.collect::<Vec<_>>(),
        "materials": asset.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
        "cameras": asset.cameras.iter().map(|c| &c.name).collect::<Vec<_>>(),
        "lights": asset.lights.len(),
        "extensions": import.extensions,
        "warnings": import.warnings.iter().map(|w| w.to_string()).collect::<Vec<_>>(),
    })
}

/// The same report for people.
fn as_text(r: &Value) -> String {
    let list = |key: &str| r[key].as_array().cloned().unwrap_or_default();
    let name = |v: &Value| match v.as_str() {
        None | Some("") => "(unnamed)".to_string(),
        Some(s) => say::name(s),
    };
    let mut t = String::new();
    let generator = r["generator"].as_str().filter(|g| !g.is_empty());
    let generator = generator.map(|g| format!(", by {}", say::name(g)));
    let _ = writeln!(t, "{}{}", r["format"].as_str().unwrap_or_default(), generator.unwrap_or_default());
    let roots = list("bones").iter().filter(|b| b["parent"].is_null()).count();
    let _ = writeln!(
        t,
        "bones      {} ({} root{})",
        list("bones").len(),
        roots,
        if roots == 1 { "" } else { "s" }
    );
    for (i, m) in list("meshes").iter().enumerate() {
        let closed = match (m["closed"].as_bool(), m["F"].as_u64()) {
            (Some(true), _) => "closed".to_string(),
            (_, Some(0)) => "no faces".to_string(),
            _ => format!("open, {} boundary edges, {} tangled", m["boundary_edges"], m["tangled_edges"]),
        };
        let targets = m["morph_targets"].as_u64().filter(|&n| n > 0);
        let targets = targets.map_or(String::new(), |n| format!(", {n} morph targets"));
        let _ = writeln!(
            t,
            "mesh {i:<5} {}: V {} E {} F {}, Euler {}, {closed}, {} parts{targets}",
            name(&m["name"]),
            m["V"],
            m["E"],
            m["F"],
            m["euler"],
            m["components"]
        );
    }
    let _ = writeln!(t, "instances  {}", list("instances").len());
    for (i, c) in list("clips").iter().enumerate() {
        let second = |key: &str| c[key].as_f64().unwrap_or_default();
        let (start, end, tracks, keys) = (second("start"), second("end"), &c["tracks"], &c["keys"]);
        let name = name(&c["name"]);
        let _ = writeln!(t, "clip {i:<5} {name}: {start:.3}…{end:.3} s, {tracks} tracks, {keys} keys");
    }
    for (key, many) in [("materials", "materials "), ("cameras", "cameras   "), ("extensions", "extensions")]
    {
        let all: Vec<String> = list(key).iter().map(name).collect();
        if !all.is_empty() {
            let _ = writeln!(t, "{many} {}", all.join(", "));
        }
    }
    if r["lights"] != 0 {
        let _ = writeln!(t, "lights     {}", r["lights"]);
    }
    let _ = write!(t, "warnings   {}", list("warnings").len());
    t
}
