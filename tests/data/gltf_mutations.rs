//! Real files with bytes changed, cut off, or filled in: an asset or an error, never a panic.

use crate::rng::Rng;
use sinew::character::Scratch;
use sinew::io::{Options, gltf};
use sinew::skin::Deformed;
use std::path::Path;
use std::time::{Duration, Instant};

/// One file for each way that data can be stored.
const FILES: &[&str] = &[
    "RiggedSimple/glTF-Binary/RiggedSimple.glb",
    "RiggedSimple/glTF-Draco/RiggedSimple.gltf",
    "MorphPrimitivesTest/glTF-Draco/MorphPrimitivesTest.gltf",
    "SimpleSkin/glTF-Embedded/SimpleSkin.gltf",
    "AnimatedMorphCube/glTF-Quantized/AnimatedMorphCube.gltf",
    "derived/AnimatedMorphCube.sparse.glb",
    "derived/Fox.meshopt.glb",
    "derived/RiggedFigure.quantized.glb",
];

pub fn run(data: &Path) -> Result<(), String> {
    let rounds = std::env::var("ROUNDS").ok().and_then(|r| r.parse().ok()).unwrap_or(120);
    let mut rng = Rng::new(0x5eed);
    for name in FILES {
        let whole = pack(&data.join("gltf").join(name))?;
        try_import(&whole).map_err(|e| format!("{name}: {e}"))?;
        for round in 0..rounds {
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut rng, round);
            let start = Instant::now();
            if std::panic::catch_unwind(|| try_import(&bytes).is_ok()).is_err() {
                return Err(format!("{name}: round {round} panicked"));
            }
            if start.elapsed() > Duration::from_secs(2) {
                return Err(format!("{name}: round {round} took {:?}", start.elapsed()));
            }
        }
    }
    Ok(())
}

/// Import, then pose and deform everything.
fn try_import(bytes: &[u8]) -> Result<(), String> {
    let import = gltf::import_bytes(bytes, None, &Options { textures: true }).map_err(|e| e.to_string())?;
    let c = &import.asset.character;
    for clip in [None, Some(0)].into_iter().filter(|c2| c2.is_none_or(|i| i < c.clips().len())) {
        let pose = c.pose(clip, 0.3);
        let posed = c.posed(&pose);
        let center = c.center(&posed);
        let (mut scratch, mut out) = (Scratch::default(), Deformed::default());
        (0..c.instances().len()).for_each(|i| c.deform(i, &pose, &posed, center, &mut scratch, &mut out));
    }
    Ok(())
}

fn mutate(bytes: &mut Vec<u8>, rng: &mut Rng, round: usize) {
    let n = bytes.len();
    match round % 6 {
        0 => bytes.truncate(rng.below(n)),
        // One byte; a number of the JSON; four bytes of all ones; a run of noise; a run moved elsewhere.
        1 => bytes[rng.below(n)] = rng.next() as u8,
        2 => {
            let digits: Vec<usize> = (0..n).filter(|&i| bytes[i].is_ascii_digit()).collect();
            let at = digits[rng.below(digits.len())];
            bytes[at] = b'0' + rng.below(10) as u8;
        }
        3 => {
            let at = rng.below(n.saturating_sub(4).max(1));
            bytes[at..(at + 4).min(n)].fill(0xff);
        }
        4 => {
            let at = rng.below(n);
            let end = (at + 1 + rng.below(64)).min(n);
            bytes[at..end].iter_mut().for_each(|b| *b = rng.next() as u8);
        }
        _ => {
            let (from, to) = (rng.below(n), rng.below(n));
            let length = rng.below(64).min(n - from).min(n - to);
            bytes.copy_within(from..from + length, to);
        }
    }
}

/// A GLB of a `.gltf` and its one buffer; other files as they are.
fn pack(path: &Path) -> Result<Vec<u8>, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    if bytes.starts_with(b"glTF") {
        return Ok(bytes);
    }
    let mut json: serde_json::Value = serde_json::from_slice(&bytes).map_err(|e| e.to_string())?;
    let uri = json["buffers"][0]["uri"].as_str().unwrap_or("").to_string();
    if json["buffers"].as_array().map_or(0, Vec::len) != 1 || uri.starts_with("data:") {
        return Ok(bytes);
    }
    let mut bin = std::fs::read(path.with_file_name(uri)).map_err(|e| e.to_string())?;
    if let Some(buffer) = json["buffers"][0].as_object_mut() {
        buffer.remove("uri");
    }
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(0x4E4F_534A_u32, text), (0x004E_4942, bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend(chunk);
    }
    Ok(out)
}
