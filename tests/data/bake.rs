//! Baked clips of third-party files: bounds and sizes.

use sinew::bake::{BakeDesc, Gauge, bake};
use sinew::io::{self, Options};
use std::path::Path;

/// File, tolerance as a part of the diagonal, and the bytes that all its clips may take: half of what glTF-Transform's resampling
/// leaves of the first two.
const FILES: [(&str, f64, usize); 3] = [
    ("Fox/glTF-Binary/Fox.glb", 3e-4, 14_100),
    ("CesiumMan/glTF-Binary/CesiumMan.glb", 3e-4, 8_300),
    ("RobotExpressive/RobotExpressive.glb", 1e-3, 40_000),
];

pub fn run(data: &Path) -> Result<(), String> {
    for (file, part, most) in FILES {
        let import =
            io::import(&data.join("gltf").join(file), &Options::default()).map_err(|e| e.to_string())?;
        let character = &import.asset.character;
        let diagonal = Gauge::new(character, 1).diagonal();
        let (desc, mut bytes) =
            (BakeDesc { tolerance: part * diagonal, threads: 2, ..BakeDesc::default() }, 0);
        for clip in character.clips() {
            let baked = bake(character, clip, &desc).map_err(|e| format!("{file}: {e}"))?;
            bytes += baked.report.bytes[1];
            // Where nobody looked: at moments that have nothing to do with keys or frames.
            let range = clip.range();
            let times: Vec<f64> =
                (0..997).map(|k| range.start + range.duration() * (k as f64 + 0.37) / 997.0).collect();
            let worst = Gauge::new(character, 2).worst(clip, &baked.clip, &times);
            if worst.distance > desc.tolerance {
                return Err(format!("{file}, `{}`: {worst:?}, asked for {}", clip.name, desc.tolerance));
            }
        }
        if bytes > most {
            return Err(format!("{file}: {bytes} bytes, expected at most {most}"));
        }
    }
    Ok(())
}
