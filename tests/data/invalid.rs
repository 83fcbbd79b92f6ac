//! Broken and odd files: an asset or an error with a message, within a second, within a gigabyte, never a panic.

use crate::gltf_oracle::files;
use sinew::io::{Options, gltf};
use std::path::Path;
use std::time::{Duration, Instant};

pub fn run(data: &Path) -> Result<(), String> {
    let mut bad = Vec::new();
    let (mut count, mut refused) = (0, 0);
    for file in files(&data.join("invalid")) {
        if file.extension().is_some_and(|e| e == "json") {
            continue;
        }
        count += 1;
        let start = Instant::now();
        let outcome = std::panic::catch_unwind(|| gltf::import(&file, &Options { textures: true }));
        let took = start.elapsed();
        let name = file.strip_prefix(data).unwrap_or(&file).display();
        match outcome {
            Err(_) => bad.push(format!("{name}: panicked")),
            Ok(Err(e)) if e.to_string().trim().is_empty() => bad.push(format!("{name}: no message")),
            Ok(Err(e)) => {
                refused += 1;
                if std::env::var_os("SHOW").is_some() {
                    println!("{name}: {e}");
                }
            }
            Ok(Ok(import)) => {
                if std::env::var_os("SHOW").is_some() {
                    println!(
                        "{name}: ok, {:?}",
                        import.warnings.iter().map(|w| w.to_string()).collect::<Vec<_>>()
                    );
                }
                // What is let in must also move.
                let c = &import.asset.character;
                let clips = (0..c.clips().len()).map(Some).chain([None]);
                for clip in clips.take(4) {
                    drop(c.posed(&c.pose(clip, 0.5)));
                }
            }
        }
        if took > Duration::from_secs(1) {
            bad.push(format!("{name}: took {took:?}"));
        }
    }
    println!("{count} files, {refused} refused, {} falls", bad.len());
    peak(&mut bad);
    if count == 0 {
        return Err("there are no files".into());
    }
    if bad.is_empty() { Ok(()) } else { Err(bad.join("\n")) }
}

/// The program on each of them: a picture, or exit code 3 and a message that names the file.
pub fn program(data: &Path) -> Result<(), String> {
    let out = tempfile::tempdir().map_err(|e| e.to_string())?;
    let picture = out.path().join("a.png");
    let mut bad = Vec::new();
    let mut refused = 0;
    for file in files(&data.join("invalid")) {
        if file.extension().is_some_and(|e| e == "json") {
            continue;
        }
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_sinew"));
        command.arg("render").arg(&file).arg("-o").arg(&picture).args(["--size", "32", "--at", "0.3", "-f"]);
        let done = command.output().map_err(|e| e.to_string())?;
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        match done.status.code() {
            Some(0) => {}
            Some(3) if said.contains(name.as_ref()) => refused += 1,
            code => bad.push(format!("{}: exit {code:?}, {}", file.display(), said.trim())),
        }
    }
    if refused == 0 {
        return Err("none was refused".into());
    }
    if bad.is_empty() { Ok(()) } else { Err(bad.join("\n")) }
}

/// The largest amount of memory that the process ever held, where the system tells.
fn peak(bad: &mut Vec<String>) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib: Option<u64> = line.and_then(|l| l.split_whitespace().next()?.parse().ok());
    if let Some(kib) = kib.filter(|&k| k > 1 << 20) {
        bad.push(format!("held {kib} KiB"));
    }
}
