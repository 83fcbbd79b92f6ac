//! `sinew eval`: the numbers behind a picture.

use super::{Failure, find_clip, load_posed, print, say::Say};
use serde::Serialize;
use serde_json::json;
use sinew::character::Instance;
use sinew::fk;
use sinew::io::{Import, Options};
use sinew::skeleton::BoneId;
use std::collections::BTreeMap;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew eval fox.glb --rest
  sinew eval fox.glb --clip Run --times 0,0.25,0.5
  sinew eval rigs/pip.json --times 0

Prints one object: {\"schema\":1, \"asset\", \"samples\":[{\"clip\", \"t\", \"nodes\", \"prims\"}]}. Matrices are column-major,
world_from_node; positions are in world space and in the file's order. Everything is computed by the f64 reference, which the
drawing path follows within 1e-5 of the asset's size. Rigs without glTF nodes have \"bones\" instead, each with
its matrix, origin and tip. Times outside a clip hold its ends.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// Clip by name or index; the first by default.
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "rest")]
    clip: Option<String>,
    /// Clips from this file instead of the input's: poses (.json) or packed clips (.sinew).
    #[arg(long, value_name = "FILE", visible_alias = "motion")]
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
    #[serde(skip_serializing_if = "Option::is_none")]
    nodes: Option<BTreeMap<u32, [f64; 16]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bones: Option<BTreeMap<u32, Bone>>,
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
    let mut samples: Vec<Sample> = times.iter().map(|&t| sample(&import, clip, t)).collect();
    if args.rest {
        samples.iter_mut().for_each(|s| s.t = None);
    }
    let asset = args.input.file_name().unwrap_or_default().to_string_lossy();
    let mut text = json!({ "schema": 1, "asset": asset, "samples": samples }).to_string();
    text.push('\n');
    print(text.as_bytes())
}

fn sample(import: &Import, clip: Option<usize>, t: f64) -> Sample {
    let c = &import.asset.character;
    let skeleton = c.skeleton();
    let pose = c.pose(clip, t);
    let world = fk::forward_f64(skeleton, &pose);
    let matrix = |b: BoneId| glam::DMat4::from(world[b.index()]).to_cols_array();
    let bone = |b: BoneId| {
        let place = &world[b.index()];
        let tip = place.transform_point3(skeleton.tip(b).as_dvec3()).to_array();
        let origin = place.translation.to_array();
        (b.0, Bone { name: skeleton.name(b).to_string(), matrix: matrix(b), origin, tip })
    };
    let plain = import.format != "glTF";
    let nodes = import.nodes.iter().zip(skeleton.ids()).map(|(&n, b)| (n, matrix(b)));
    let nodes = (!plain).then(|| nodes.collect());
    let bones = plain.then(|| skeleton.ids().map(bone).collect());
    let primitive = |(i, inst): (usize, &Instance)| {
        let source = import.primitives.get(i);
        let positions = c.positions_f64(i, &pose, &world);
        Primitive {
            node: source.map(|s| s.node),
            mesh: source.map_or(inst.mesh.0, |s| s.mesh),
            primitive: source.map_or(0, |s| s.primitive),
            count: positions.len(),
            positions: positions.iter().flat_map(|p| p.to_array()).collect(),
        }
    };
    let prims = c.instances().iter().enumerate().map(primitive).collect();
    Sample { clip, t: Some(t), nodes, bones, prims }
}
