//! `sinew info`: what is in a file.

use super::{Failure, find_clip, load_posed, print, say, say::Say};
use serde_json::{Value, json};
use sinew::character::{Binding, Character, Scratch};
use sinew::io::{Import, Options};
use sinew::mesh::topology;
use sinew::render::accel::{Accel, Kind};
use std::fmt::Write;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew info fox.glb
  sinew info rigs/pip.json --json
  sinew info rigs/pip.json --poses poses/pip.json --clip wave --at 0.5 --intersections   what goes through what

V, E, F count the surface behind a mesh: vertices at one place are one, degenerate triangles none. A surface is closed when every
edge has exactly two faces.

--intersections counts pairs of triangles that pass through or touch each other at a time: of one mesh, and of two. Neighbours
count where they meet beyond their common corners; triangles that only lie on each other in one plane do not.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// One JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Which triangles pass through each other at a time.
    #[arg(long, requires = "at")]
    intersections: bool,
    /// Seconds.
    #[arg(long, value_name = "T", requires = "intersections", allow_hyphen_values = true)]
    at: Option<f64>,
    /// Clip by name or index; the first by default.
    #[arg(long, value_name = "NAME|INDEX", requires = "intersections")]
    clip: Option<String>,
    /// Clips from this file instead of the input's.
    #[arg(long, value_name = "FILE", requires = "intersections")]
    poses: Option<PathBuf>,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    // Textures are read too, so that what is wrong with them is told.
    let import = load_posed(&args.input, args.poses.as_ref(), Options { textures: true }, say)?;
    let mut report = report(&import);
    if let Some(t) = args.at.filter(|_| args.intersections) {
        if !t.is_finite() {
            return Err(Failure::Usage(format!("--at {t}: expected seconds")));
        }
        let clip = find_clip(&import, args.clip.as_deref())?;
        report["intersections"] = intersections(&import, clip, t);
    }
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

/// Pairs of triangles that meet at a time, by pairs of instances; the first of each with the bones that move them most.
fn intersections(import: &Import, clip: Option<usize>, t: f64) -> Value {
    let c = &import.asset.character;
    let pose = c.pose(clip, t);
    let posed = c.posed(&pose);
    let (center, mut scratch) = (c.center(&posed), Scratch::default());
    let accel = |i: usize| {
        let mut positions = Vec::new();
        c.positions(i, &pose, &posed, center, &mut scratch, &mut positions);
        Accel::new(Kind::Tree, &positions, &c.mesh(&c.instances()[i]).triangles, 1)
    };
    let accels: Vec<Accel> = (0..c.instances().len()).map(accel).collect();
    let mesh = |i: usize| c.instances()[i].mesh;
    let mut total = 0;
    let mut pairs = Vec::new();
    for (i, j) in (0..accels.len()).flat_map(|i| (i..accels.len()).map(move |j| (i, j))) {
        let found = if i == j { accels[i].self_crossings() } else { accels[i].crossings(&accels[j]) };
        total += found.len();
        let first = found
            .iter()
            .take(3)
            .map(|&[a, b]| json!({ "triangles": [a, b], "bones": [bone(c, i, a), bone(c, j, b)] }));
        let names = [mesh(i), mesh(j)].map(|m| c.meshes()[m.0 as usize].name.clone());
        if !found.is_empty() {
            let first: Vec<Value> = first.collect();
            pairs.push(json!({ "instances": [i, j], "meshes": names, "count": found.len(), "first": first }));
        }
    }
    json!({ "clip": clip, "t": t, "count": total, "pairs": pairs })
}

/// The bone that moves a triangle most: the largest sum of its corners' weights.
fn bone(c: &Character, instance: usize, triangle: u32) -> &str {
    let inst = &c.instances()[instance];
    let id = match &inst.binding {
        Binding::Bone(b) => Some(*b),
        Binding::Skin { palette, weights } => {
            let mut sums = vec![0.0; palette.len()];
            for &v in &c.mesh(inst).triangles[triangle as usize] {
                weights.of(v as usize).for_each(|(k, w)| sums[k] += w);
            }
            let most = (0..sums.len()).rev().max_by(|&a, &b| f32::total_cmp(&sums[a], &sums[b]));
            most.map(|k| palette[k].0)
        }
    };
    id.map_or("", |b| c.skeleton().name(b))
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
    if let Some(found) = r.get("intersections") {
        let _ = writeln!(t, "meeting    {} pairs of triangles at {} s", found["count"], found["t"]);
        for p in found["pairs"].as_array().into_iter().flatten() {
            let first = &p["first"][0];
            let side = |k: usize| {
                format!(
                    "{} ({}, triangle {})",
                    name(&p["meshes"][k]),
                    name(&first["bones"][k]),
                    first["triangles"][k]
                )
            };
            let _ = writeln!(t, "           {}: first {} and {}", p["count"], side(0), side(1));
        }
    }
    let _ = write!(t, "warnings   {}", list("warnings").len());
    t
}
