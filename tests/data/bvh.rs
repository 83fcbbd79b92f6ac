//! Motion captures against an independent reader's joint positions.

use serde_json::Value;
use sinew::io::{self, Options};
use std::path::Path;

/// Positions of every joint at a few frames, within 1e-5 of the capture's extent.
pub fn run(data: &Path) -> Result<(), String> {
    let mut files = 0;
    for entry in std::fs::read_dir(data.join("bvh-oracle")).map_err(|e| e.to_string())? {
        let path = entry.map_err(|e| e.to_string())?.path();
        let text = std::fs::read(&path).map_err(|e| e.to_string())?;
        let oracle: Value = serde_json::from_slice(&text).map_err(|e| e.to_string())?;
        one(data, &oracle).map_err(|e| format!("{}: {e}", path.display()))?;
        files += 1;
    }
    if files < 7 { Err(format!("{files} captures; expected 7")) } else { Ok(()) }
}

fn one(data: &Path, oracle: &Value) -> Result<(), String> {
    let file = data.join("bvh").join(oracle["asset"].as_str().ok_or("no asset")?);
    let import = io::import(&file, &Options::default()).map_err(|e| e.to_string())?;
    let character = &import.asset.character;
    let names: Vec<&str> =
        oracle["joints"].as_array().ok_or("no joints")?.iter().filter_map(Value::as_str).collect();
    if names.len() != character.skeleton().len() {
        return Err(format!("{} bones, expected {}", character.skeleton().len(), names.len()));
    }
    let step = oracle["frameTime"].as_f64().ok_or("no frame time")?;
    let (mut worst, mut bounds) = (0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
    for sample in oracle["samples"].as_array().ok_or("no samples")? {
        let time = step * sample["frame"].as_f64().ok_or("no frame")?;
        let posed = character.posed(&character.pose(Some(0), time));
        for (name, want) in names.iter().zip(sample["pos"].as_array().ok_or("no positions")?) {
            let bone = character.skeleton().find(name).ok_or_else(|| format!("no bone `{name}`"))?;
            let found = posed.origin(bone).to_array();
            for (c, found) in found.iter().enumerate() {
                let want = want[c].as_f64().ok_or("no number")?;
                worst = worst.max((want - found).abs());
                bounds = [bounds[0].min(want), bounds[1].max(want)];
            }
        }
    }
    let extent = bounds[1] - bounds[0];
    if worst <= 1e-5 * extent { Ok(()) } else { Err(format!("{worst} off, extent {extent}")) }
}
