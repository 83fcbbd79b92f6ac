//! The README's line for GNU parallel: four shards, each a process of its own, are the whole film.

use std::path::Path;
use std::process::Command;

/// Whether GNU parallel is here; a continuous integration that lacks it must fail, not pass by silence.
pub fn possible() -> bool {
    let version = Command::new("parallel").arg("--version").output();
    std::env::var_os("CI").is_some() || version.is_ok_and(|o| o.stdout.starts_with(b"GNU parallel"))
}

pub fn run() -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).map_err(|e| e.to_string())?;
    let line = readme.lines().find(|l| l.starts_with("parallel sinew render"));
    let line = line.ok_or("the README shows no line for GNU parallel")?;
    let dir = tempfile::tempdir().map_err(|e| e.to_string())?;
    for folder in ["poses", "rigs"] {
        std::os::unix::fs::symlink(root.join(folder), dir.path().join(folder)).map_err(|e| e.to_string())?;
    }
    // The line as a reader types it, with the program on the path.
    let bin = Path::new(env!("CARGO_BIN_EXE_sinew")).parent().expect("a folder");
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let shell = |command: &str| {
        let out =
            Command::new("sh").args(["-ec", command]).current_dir(dir.path()).env("PATH", &path).output();
        let out = out.map_err(|e| e.to_string())?;
        match out.status.success() {
            true => Ok(()),
            false => Err(format!("{command}\n{}", String::from_utf8_lossy(&out.stderr))),
        }
    };
    shell(line)?;
    shell("sinew manifest merge part-*.json -o sum.json")?;
    shell("mv frames parts")?;
    shell("sinew render rigs/pip.json -o frames/####.png --manifest whole.json -q")?;
    shell("cmp sum.json whole.json && diff -r frames parts")?;
    let frames = std::fs::read_dir(dir.path().join("frames")).map_err(|e| e.to_string())?.count();
    if frames < 20 { Err(format!("only {frames} frames")) } else { Ok(()) }
}
