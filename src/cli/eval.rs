//! `sinew eval`: the numbers behind a picture.

use super::{Failure, find_clip, load_posed, print, say::Say};
use serde::Serialize;
use serde_json::json;
use sinew::character::{Character, Scratch};
use sinew::io::{Import, Options};
use sinew::skin::Deformed;
use std::collections::BTreeMap;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew eval fox.glb --rest
  sinew eval fox.glb --clip Run --times 0,0.25,0.5
  sinew eval rigs/biped.json --times 0

Prints one object: {\"schema\":1, \"asset\", \"samples\":[{\"clip\", \"t\", \"nodes\", \"prims\"}]}. Matrices are column-major,
world_from_node; positions are in world space and in the file's order. Rigs without glTF nodes have \"bones\" instead, each with
its matrix, origin and tip. Times outside a clip hold its ends.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// Clip by name or index; the first by default.
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "rest")]
    clip: Option<String>,
    /// Clips from this file instead of the input's.
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Seconds, separated by commas.
    #[arg(
        long,
        value_name = "T0,T1,…",
        value_delimiter = ',',
        allow_hyphen_values = true,
        default_value = "0"
    )]
    times: Vec<f64>,
    /// The rest pose, untouched by any clip.
    #[arg(long, conflicts_with = "times")]
    rest: bool,
    /// JSON is the only form there is; accepted for clarity.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Sample {
    clip: Option<usize>,
    t: Option<f64>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    nodes: BTreeMap<u32, [f64; 16]>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    bones: BTreeMap<u32, Bone>,
    prims: Vec<Primitive>,
}

#[derive(Serialize)]
struct Bone {
    name: String,
    matrix: [f64; 16],
    origin: [f64; 3],
    tip: [f64; 3],
}

#[derive(Serialize)]
struct Primitive {
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<u32>,
    mesh: u32,
    primitive: u32,
    count: usize,
    positions: Vec<f64>,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    if let Some(t) = args.times.iter().find(|t| !t.is_finite()) {
        return Err(Failure::Usage(format!("--times {t}: expected seconds")));
    }
    let import = load_posed(&args.input, args.poses.as_ref(), Options { textures: false }, say)?;
    let clip = if args.rest { None } else { find_clip(&import, args.clip.as_deref())? };
    let times = if args.rest { vec![0.0] } else { args.times.clone() };
    let samples: Vec<Sample> = times.iter().map(|&t| sample(&import, clip, t)).collect();
    let asset = args.input.file_name().unwrap_or_default().to_string_lossy();
    let mut text = json!({ "schema": 1, "asset": asset, "samples": samples }).to_string();
    text.push('\n');
    print(text.as_bytes())
}

fn sample(import: &Import, clip: Option<usize>, t: f64) -> Sample {
    let c = &import.asset.character;
    let pose = c.pose(clip, t);
    let posed = c.posed(&pose);
    let matrix = |b| glam::DMat4::from(posed.world_from_bone(b)).to_cols_array();
    let nodes = import.nodes.iter().zip(c.skeleton().ids()).map(|(&n, b)| (n, matrix(b))).collect();
    let bone = |b| {
        let tip = posed.world_from_bone(b).transform_point3(c.skeleton().tip(b).as_dvec3());
        let name = c.skeleton().name(b).to_string();
        (b.0, Bone { name, matrix: matrix(b), origin: posed.origin(b).to_array(), tip: tip.to_array() })
    };
    let plain = import.nodes.is_empty();
    let bones = if plain { c.skeleton().ids().map(bone).collect() } else { BTreeMap::new() };
    let prims = primitives(import, c, &pose, &posed);
    Sample { clip, t: clip.map(|_| t), nodes, bones, prims }
}

fn primitives(
    import: &Import,
    c: &Character,
    pose: &sinew::pose::Pose,
    posed: &sinew::fk::Posed,
) -> Vec<Primitive> {
    let center = c.center(posed);
    let (mut scratch, mut out) = (Scratch::default(), Deformed::default());
    let one = |(i, inst): (usize, &sinew::character::Instance)| {
        c.deform(i, pose, posed, center, &mut scratch, &mut out);
        let source = import.primitives.get(i);
        Primitive {
            node: source.map(|s| s.node),
            mesh: source.map_or(inst.mesh.0, |s| s.mesh),
            primitive: source.map_or(0, |s| s.primitive),
            count: out.positions.len(),
            positions: out.positions.iter().flat_map(|p| (center + p.as_dvec3()).to_array()).collect(),
        }
    };
    c.instances().iter().enumerate().map(one).collect()
}
