//! Imports against an independent evaluator: every asset, every clip and time that it recorded.

use crate::sha256;
use serde_json::Value;
use sinew::character::{Character, Scratch};
use sinew::io::{Import, Options, gltf};
use sinew::skin::Deformed;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest difference. Of vertices and of the translations of nodes: in diagonals of the pose's bounding box. Of the linear
/// parts of nodes' matrices: in their largest entry, or 1 where that is smaller.
const TOLERANCE: f64 = 1e-5;

pub fn run(data: &Path) -> Result<(), String> {
    let mut by_hash = BTreeMap::new();
    for file in files(&data.join("gltf")) {
        let bytes = std::fs::read(&file).map_err(|e| e.to_string())?;
        by_hash.entry(sha256::hex(&bytes)).or_insert(file);
    }
    let (mut bad, mut count, mut samples, mut worst) = (Vec::new(), 0, 0, 0.0_f64);
    for answers in files(&data.join("gltf-oracle")) {
        let text = std::fs::read_to_string(&answers).map_err(|e| e.to_string())?;
        let recorded: Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
        let Some(file) = by_hash.get(recorded["sha256"].as_str().unwrap_or("")) else {
            bad.push(format!("{}: no asset has the bytes that it was recorded of", answers.display()));
            count += 1;
            continue;
        };
        count += 1;
        match asset(file, &recorded) {
            Ok((n, w)) => {
                samples += n;
                worst = worst.max(w);
                if w.is_nan() || w > TOLERANCE {
                    bad.push(format!("{}: {w:.3e} of the diagonal", file.display()));
                }
            }
            Err(e) => bad.push(format!("{}: {e}", file.display())),
        }
    }
    println!("{} of {count} assets agree, {samples} samples, worst {worst:.2e}", count - bad.len());
    if count == 0 {
        return Err("no asset has recorded answers".into());
    }
    if bad.is_empty() { Ok(()) } else { Err(bad.join("\n")) }
}

/// glTF and answer files below a folder, sorted.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut stack = vec![dir.to_path_buf()];
    while let Some(d) = stack.pop() {
        for entry in std::fs::read_dir(&d).into_iter().flatten().flatten() {
            let path = entry.path();
            let known = |e: &std::ffi::OsStr| e == "gltf" || e == "glb" || e == "json";
            if path.is_dir() {
                stack.push(path);
            } else if path.extension().is_some_and(known) {
                out.push(path);
            }
        }
    }
    out.sort();
    out
}

fn asset(file: &Path, recorded: &Value) -> Result<(usize, f64), String> {
    let import = gltf::import(file, &Options { textures: false }).map_err(|e| e.to_string())?;
    let (mut n, mut worst) = (0, 0.0_f64);
    let mut check = |clip: Option<usize>, sample: &Value| -> Result<(), String> {
        let e = compare(&import, clip, sample)?;
        n += 1;
        worst = if e.is_nan() { f64::NAN } else { worst.max(e) };
        Ok(())
    };
    if !recorded["rest"].is_null() {
        check(None, &recorded["rest"])?;
    }
    for clip in recorded["clips"].as_array().into_iter().flatten() {
        let index = clip["index"].as_u64().ok_or("no clip index")? as usize;
        for sample in clip["samples"].as_array().into_iter().flatten() {
            check(Some(index), sample)?;
        }
    }
    Ok((n, worst))
}

fn compare(import: &Import, clip: Option<usize>, sample: &Value) -> Result<f64, String> {
    let character = &import.asset.character;
    if clip.is_some_and(|c| c >= character.clips().len()) {
        return Err(format!("clip {clip:?} is missing"));
    }
    let pose = character.pose(clip, sample["t"].as_f64().unwrap_or(0.0));
    let posed = character.posed(&pose);
    let (mut lo, mut hi) = ([f64::MAX; 3], [f64::MIN; 3]);
    let prims = sample["prims"].as_array().ok_or("no prims")?;
    for p in prims {
        for k in 0..3 {
            lo[k] = lo[k].min(number(&p["min"][k])?);
            hi[k] = hi[k].max(number(&p["max"][k])?);
        }
    }
    let diagonal = distance(&lo, &hi);
    let mut worst = 0.0_f64;
    for p in prims {
        let e = primitive(import, character, &pose, &posed, p)?;
        worst = worst.max(e / if diagonal > 0.0 { diagonal } else { 1.0 });
    }
    for (node, m) in sample["nodes"].as_object().ok_or("no nodes")? {
        let node: u32 = node.parse().map_err(|_| "node index")?;
        let bone = import.nodes.iter().position(|&n| n == node).ok_or(format!("node {node} is missing"))?;
        let found = posed.world_from_bone(sinew::skeleton::BoneId(bone as u32));
        let found = glam::DMat4::from(found).to_cols_array();
        let want: Vec<f64> = (0..16).map(|k| number(&m[k])).collect::<Result<_, _>>()?;
        let linear = want[..12].iter().fold(1.0_f64, |a, x| a.max(x.abs()));
        let far = if diagonal > 0.0 { diagonal } else { 1.0 };
        for k in 0..16 {
            let e = (found[k] - want[k]).abs() / if k < 12 { linear } else { far };
            worst = if e.is_nan() { f64::NAN } else { worst.max(e) };
        }
    }
    Ok(worst)
}

fn primitive(
    import: &Import,
    character: &Character,
    pose: &sinew::pose::Pose,
    posed: &sinew::fk::Posed,
    p: &Value,
) -> Result<f64, String> {
    let id = |k: &str| p[k].as_u64().unwrap_or(u64::MAX) as u32;
    let want = (id("node"), id("mesh"), id("primitive"));
    let found = import.primitives.iter().position(|s| (s.node, s.mesh, s.primitive) == want);
    let instance = found.ok_or(format!("primitive {want:?} is missing"))?;
    let center = character.center(posed);
    let (mut scratch, mut out) = (Scratch::default(), Deformed::default());
    character.deform(instance, pose, posed, center, &mut scratch, &mut out);
    let world = |i: usize| (out.positions[i].as_dvec3() + center).to_array();

    let n = out.positions.len();
    if p["count"].as_u64() != Some(n as u64) {
        return Err(format!("primitive {want:?} has {n} vertices instead of {}", p["count"]));
    }
    let mut worst = 0.0_f64;
    let list = p["pos"].as_array().ok_or("no positions")?;
    let k = list.len() / 3;
    for i in 0..k {
        let w = [number(&list[3 * i])?, number(&list[3 * i + 1])?, number(&list[3 * i + 2])?];
        worst = worst.max(distance(&world(i * n / k), &w));
    }
    for axis in 0..3 {
        let all = || (0..n).map(|i| world(i)[axis]);
        worst = worst.max((all().fold(f64::MAX, f64::min) - number(&p["min"][axis])?).abs());
        worst = worst.max((all().fold(f64::MIN, f64::max) - number(&p["max"][axis])?).abs());
    }
    Ok(worst)
}

fn number(v: &Value) -> Result<f64, String> {
    v.as_f64().ok_or_else(|| format!("{v} is no number"))
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
