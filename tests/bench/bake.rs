//! `sinew bake`, which checks its bound on the skin, beside `gltf-transform resample`, which checks nothing: whole processes, taking turns.
//!
//! ```text
//! cargo bench --bench bake -- [ROUNDS]
//! ```
//!
//! The other program is `GLTF_TRANSFORM`, or `gltf-transform` where PATH has it; without it only ours is timed. Inputs are the Fox and CesiumMan
//! of `SINEW_DATA` (or `../shared/data`), and a figure made here: 10⁶ bytes of keys and 60,000 vertices. Printed are medians.

mod process;

use nix::sys::resource::{UsageWho, getrusage};
use process::run;
use serde_json::{Value, json};
use sinew::bake::{BakeDesc, Gauge, Stage, bake, bake_watched, pack};
use sinew::io::gltf::Rewritten;
use sinew::io::{self, Options};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

fn main() {
    let rounds = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(5);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let large = folder.path().join("large.glb");
    std::fs::write(&large, figure(40, 60_000, 1130)).expect("written");
    let data = std::env::var_os("SINEW_DATA").map_or("../shared/data".into(), PathBuf::from).join("gltf");
    let files =
        [data.join("Fox/glTF-Binary/Fox.glb"), data.join("CesiumMan/glTF-Binary/CesiumMan.glb"), large];
    for file in files.iter().filter(|f| f.is_file()) {
        compare(file, &folder.path().join("out.glb"), rounds);
        breakdown(file);
        sampling(file, rounds);
    }
}

/// Nanoseconds of processor time a pose, out of the clip as it came, as it was baked and packed: at random moments, and 60 times a second.
fn sampling(file: &Path, rounds: usize) {
    let import = io::import(file, &Options::default()).expect("a glTF file");
    let c = &import.asset.character;
    let desc = BakeDesc { tolerance: 1e-3 * Gauge::new(c, 1).diagonal(), ..BakeDesc::default() };
    for clip in c.clips() {
        let packed = pack(c, clip, &desc).expect("a bound that holds").packed;
        let baked = bake(c, clip, &desc).expect("a bound that holds").clip;
        let mut pose = c.rest_pose();
        let (start, length) = (clip.range().start, clip.range().duration());
        let mut state = 1u64;
        let random: Vec<f64> = (0..4000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                start + (state >> 11) as f64 / (1u64 << 53) as f64 * length
            })
            .collect();
        let forward: Vec<f64> = (0..4000).map(|k| start + (k as f64 / 60.0) % length.max(1e-9)).collect();
        let mut cost = [[f64::INFINITY; 2]; 3];
        for _ in 0..rounds.max(3) {
            for (k, times) in [&random, &forward].into_iter().enumerate() {
                cost[0][k] = cost[0][k].min(each(times, |t| clip.sample(c.skeleton(), t, &mut pose)));
                cost[1][k] = cost[1][k].min(each(times, |t| baked.sample(c.skeleton(), t, &mut pose)));
                cost[2][k] = cost[2][k].min(each(times, |t| packed.sample(c.skeleton(), t, &mut pose)));
            }
        }
        let ns = |c: [f64; 2]| format!("{:6.0} / {:6.0} ns", c[0], c[1]);
        println!(
            "  {:12} a pose, random / forward: source {}, baked {}, packed {} ({} tracks, {} bytes packed)",
            clip.name,
            ns(cost[0]),
            ns(cost[1]),
            ns(cost[2]),
            clip.tracks.len(),
            packed.bytes().len(),
        );
    }
}

/// Processor nanoseconds of each call.
fn each(times: &[f64], mut work: impl FnMut(f64)) -> f64 {
    let cpu = || {
        let time = getrusage(UsageWho::RUSAGE_SELF).expect("the system counts").user_time();
        time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6
    };
    let before = cpu();
    times.iter().for_each(|t| work(std::hint::black_box(*t)));
    1e9 * (cpu() - before) / times.len() as f64
}

fn compare(file: &Path, out: &Path, rounds: usize) {
    let words = |w: [&str; 2]| w.map(String::from).to_vec();
    let (input, output) = (file.display().to_string(), out.display().to_string());
    let mut ours = words([env!("CARGO_BIN_EXE_sinew"), "bake"]);
    ours.extend([&input, "-o", &output, "-f", "-q"].map(String::from));
    let program = std::env::var("GLTF_TRANSFORM").unwrap_or("gltf-transform".into());
    let theirs = [vec![program, "resample".into()], words([&input, &output])].concat();
    let mut runs = [vec![], vec![]];
    let other = std::process::Command::new(&theirs[0]).arg("--version").output().is_ok();
    for round in 0..=rounds {
        for (command, runs) in [&ours, &theirs].into_iter().zip(&mut runs).take(1 + usize::from(other)) {
            let cost = run(command);
            // The first round warms caches.
            runs.extend((round > 0).then_some(cost));
        }
    }
    let median = |of: fn(&(f64, f64)) -> f64, runs: &[(f64, f64)]| {
        let mut all: Vec<f64> = runs.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    println!("{}", file.file_name().unwrap_or_default().to_string_lossy());
    let mut costs = vec![];
    for (name, runs) in
        ["sinew bake", "gltf-transform resample"].iter().zip(&runs).filter(|r| !r.1.is_empty())
    {
        let cost = (median(|r| r.0, runs), median(|r| r.1, runs));
        println!("  {name:24} wall {:8.3} s   cpu {:8.3} s", cost.0, cost.1);
        costs.push(cost);
    }
    if let [ours, theirs] = costs[..] {
        println!("  {:24} wall {:8.2}     cpu {:8.2}", "ratio", ours.0 / theirs.0, ours.1 / theirs.1);
    }
}

/// Where the time of all clips goes, in this process, on one thread.
fn breakdown(file: &Path) {
    let start = Instant::now();
    let import = io::import(file, &Options::default()).expect("a glTF file");
    print!("  one thread: import {:.1} ms", 1e3 * start.elapsed().as_secs_f64());
    let character = &import.asset.character;
    let desc = BakeDesc { tolerance: 1e-4 * Gauge::new(character, 1).diagonal(), ..BakeDesc::default() };
    let stages = [Stage::Levers, Stage::Search, Stage::Check];
    let spent = Mutex::new(([0.0; 3], Stage::Levers, Instant::now()));
    let (mut keys, mut moments) = ([0; 2], 0);
    for clip in character.clips() {
        let enter = |stage: Stage| {
            let mut s = spent.lock().expect("one thread");
            if let Some(i) = stages.iter().position(|x| *x == s.1) {
                s.0[i] += s.2.elapsed().as_secs_f64();
            }
            (s.1, s.2) = (stage, Instant::now());
        };
        {
            let mut s = spent.lock().expect("one thread");
            (s.1, s.2) = (Stage::Levers, Instant::now());
        }
        let baked =
            bake_watched(character, clip, &desc, &|stage, _| enter(stage)).expect("a bound that holds");
        enter(Stage::Levers);
        (0..2).for_each(|i| keys[i] += baked.report.keys[i]);
        moments += baked.report.moments;
    }
    for (stage, seconds) in stages.iter().zip(spent.into_inner().expect("one thread").0) {
        print!(", {stage:?} {:.1} ms", 1e3 * seconds);
    }
    println!("; {} of {} keys, {moments} moments checked", keys[1], keys[0]);
}

/// A figure of `bones` in a tree and a skin of `vertices`, all of whose bones turn, and every other one moves, at `keys` keys.
fn figure(bones: usize, vertices: usize, keys: usize) -> Vec<u8> {
    let mut bin: Vec<u8> = vec![];
    let (mut views, mut accessors): (Vec<Value>, Vec<Value>) = (vec![], vec![]);
    let mut put = |bytes: Vec<u8>, mut accessor: Value| {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
        bin.extend(bytes);
        bin.resize(bin.len().next_multiple_of(4), 0);
        accessor["bufferView"] = (views.len() - 1).into();
        accessors.push(accessor);
        accessors.len() - 1
    };
    let floats = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let typed = |n: usize, kind: &str| json!({"componentType": 5126, "count": n, "type": kind});
    // A spine with limbs of eight bones, 12 cm each.
    let parent = |b: usize| if b.is_multiple_of(8) { b.checked_sub(8) } else { Some(b - 1) };
    let offset = |b: usize| {
        if b == 0 {
            [0.0, 1.0, 0.0]
        } else if b.is_multiple_of(8) {
            [0.0, 0.12, 0.0]
        } else {
            [0.12, 0.0, 0.0]
        }
    };
    let mut origin = vec![[0.0_f32; 3]; bones];
    for b in 0..bones {
        let up = parent(b).map_or([0.0; 3], |p| origin[p]);
        origin[b] = std::array::from_fn(|c| up[c] + offset(b)[c]);
    }
    let of = |v: usize| v * bones / vertices;
    let spot = |v: usize| {
        let (s, c) = (v as f32 * 2.4).sin_cos();
        let along = (v * bones % vertices) as f32 / vertices as f32 * 0.12;
        let o = origin[of(v)];
        [o[0] + along, o[1] + 0.05 * s, o[2] + 0.05 * c]
    };
    let positions: Vec<f32> = (0..vertices).flat_map(spot).collect();
    let mut position = typed(vertices, "VEC3");
    (position["min"], position["max"]) = (json!([-1, 0, -1]), json!([2, 3, 1]));
    let joints: Vec<u8> =
        (0..vertices).flat_map(|v| [of(v) as u8, parent(of(v)).unwrap_or(0) as u8, 0, 0]).collect();
    let weights: Vec<f32> = (0..vertices)
        .flat_map(|v| [0.6 + 0.4 * (v % 7) as f32 / 7.0, 0.4 - 0.4 * (v % 7) as f32 / 7.0, 0.0, 0.0])
        .collect();
    let inverse: Vec<f32> = origin
        .iter()
        .flat_map(|o| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., -o[0], -o[1], -o[2], 1.])
        .collect();
    let indices: Vec<u8> =
        (0..vertices as u32 - 2).flat_map(|v| [v, v + 1, v + 2]).flat_map(u32::to_le_bytes).collect();
    let position = put(floats(&positions), position);
    let joints = put(joints, json!({"componentType": 5121, "count": vertices, "type": "VEC4"}));
    let weights = put(floats(&weights), typed(vertices, "VEC4"));
    let inverse = put(floats(&inverse), typed(bones, "MAT4"));
    let indices = put(indices, json!({"componentType": 5125, "count": 3 * (vertices - 2), "type": "SCALAR"}));
    let times: Vec<f32> = (0..keys).map(|k| k as f32 / 30.0).collect();
    let mut time = typed(keys, "SCALAR");
    (time["min"], time["max"]) = (json!([0.0]), json!([times[keys - 1]]));
    let time = put(floats(&times), time);
    let (mut samplers, mut channels) = (vec![], vec![]);
    for b in 0..bones {
        let wave = |t: f32, k: usize| (t * (0.9 + 0.31 * ((b + k) % 5) as f32) + (3 * b + k) as f32).sin();
        let turn = |t: &f32| {
            let (a, b) = (
                glam::Quat::from_rotation_z(0.3 * wave(*t, 0)),
                glam::Quat::from_rotation_y(0.2 * wave(*t, 1)),
            );
            (a * b * glam::Quat::from_rotation_x(0.004 * wave(7.0 * *t, 2))).to_array()
        };
        let way = |t: &f32| {
            let o = offset(b);
            [o[0], o[1] + 0.002 * wave(*t, 3), o[2] + 0.002 * wave(1.7 * *t, 4)]
        };
        let tracks = [
            ("rotation", "VEC4", times.iter().flat_map(turn).collect::<Vec<f32>>()),
            ("translation", "VEC3", times.iter().flat_map(way).collect()),
        ];
        for (path, kind, values) in tracks.into_iter().take(if b % 2 == 0 { 2 } else { 1 }) {
            let output = put(floats(&values), typed(keys, kind));
            channels.push(json!({"sampler": samplers.len(), "target": {"node": b, "path": path}}));
            samplers.push(json!({"input": time, "output": output}));
        }
    }
    let children = |p: usize| (0..bones).filter(|b| parent(*b) == Some(p)).collect::<Vec<_>>();
    let node = |b: usize| {
        let mut node = json!({"name": format!("b{b}"), "translation": offset(b)});
        if !children(b).is_empty() {
            node["children"] = json!(children(b));
        }
        node
    };
    let mut nodes: Vec<Value> = (0..bones).map(node).collect();
    nodes.push(json!({"name": "body", "mesh": 0, "skin": 0}));
    let json = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, bones]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": indices}]}],
        "skins": [{"joints": (0..bones).collect::<Vec<_>>(), "inverseBindMatrices": inverse}],
        "animations": [{"name": "move", "samplers": samplers, "channels": channels}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": bin.len()}],
    });
    Rewritten { json: json.as_object().expect("an object").clone(), bin, ..Default::default() }.glb()
}
