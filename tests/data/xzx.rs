//! There and back: quaternions to angles to quaternions, on every animated file.

use sinew::bake::{BakeDesc, Gauge, xzx};
use sinew::io::{self, Options};
use std::path::{Path, PathBuf};

/// Tolerances as parts of the diagonal; each way takes a half.
const PARTS: [f64; 2] = [1e-2, 1e-3];

pub fn run(data: &Path) -> Result<(), String> {
    let mut clips = 0;
    let mut seen = std::collections::BTreeSet::new();
    for file in files(&data.join("gltf")) {
        // The same asset in other wrappings has the same clips.
        let asset = file.file_stem().map(|s| s.to_os_string());
        if !seen.insert(asset) {
            continue;
        }
        let name = file.display();
        let import = io::import(&file, &Options::default()).map_err(|e| format!("{name}: {e}"))?;
        let character = &import.asset.character;
        let gauge = Gauge::new(character, 2);
        let diagonal = gauge.diagonal();
        for clip in character.clips() {
            clips += 1;
            for part in PARTS {
                let desc = BakeDesc { tolerance: 0.5 * part * diagonal, threads: 2, ..BakeDesc::default() };
                let failed = |e| format!("{name}, `{}`: {e}", clip.name);
                let angles = xzx::to_xzx(character, clip, &desc).map_err(failed)?;
                let back = xzx::to_quat(character, &angles.clip, &desc).map_err(failed)?;
                let range = clip.range();
                let times: Vec<f64> =
                    (0..499).map(|k| range.start + range.duration() * (k as f64 + 0.37) / 499.0).collect();
                for (to, limit) in [(&angles.clip, 1.0), (&back.clip, 2.0)] {
                    let worst = gauge.worst(clip, to, &times);
                    if worst.distance > limit * desc.tolerance {
                        return Err(format!(
                            "{name}, `{}`: {worst:?}, asked for {}",
                            clip.name, desc.tolerance
                        ));
                    }
                }
            }
        }
    }
    if clips < 20 { Err(format!("only {clips} clips found")) } else { Ok(()) }
}

/// Every glTF file below a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut out = vec![];
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            out.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "glb" || e == "gltf") {
            out.push(path);
        }
    }
    out
}
