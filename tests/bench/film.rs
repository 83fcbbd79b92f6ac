//! Whole processes side by side: ours and any peer's, taking turns in one run.
//!
//! ```text
//! cargo bench --bench film -- man.glb 48 'filly=python filly_frames.py man.glb 48 {out}' 'f3d=python f3d_frames.py …'
//! ```
//!
//! Each round runs every command once, so a machine that slows down slows all of them; `{out}` is an empty folder each time. Printed are
//! medians of wall and processor time over all rounds, the largest resident set of one more run, and the ratios to ours.

mod process;

use process::run;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROUNDS: usize = 9;

struct Entry {
    name: String,
    words: Vec<String>,
    /// Where its pictures go.
    out: PathBuf,
    wall: Vec<f64>,
    cpu: Vec<f64>,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [asset, frames, peers @ ..] = args.as_slice() else {
        println!("usage: cargo bench --bench film -- ASSET FRAMES ['NAME=COMMAND' …]");
        return;
    };
    let out = std::env::temp_dir().join(format!("sinew-bench-{}", std::process::id()));
    let ours = format!(
        "sinew={} render {asset} -o {{out}}/f.####.png --frames 1-{frames} -q",
        env!("CARGO_BIN_EXE_sinew")
    );
    let mut entries: Vec<Entry> = std::iter::once(&ours).chain(peers).map(|e| entry(e, &out)).collect();
    for round in 0..=ROUNDS {
        for e in &mut entries {
            empty(&e.out);
            let (wall, cpu) = run(&e.words);
            // The first round warms caches.
            if round > 0 {
                e.wall.push(wall);
                e.cpu.push(cpu);
            }
        }
    }
    report(&mut entries);
    std::fs::remove_dir_all(&out).ok();
}

fn entry(text: &str, out: &Path) -> Entry {
    let (name, command) = text.split_once('=').expect("a peer is NAME=COMMAND");
    let out = out.join(name);
    let folder = out.display().to_string();
    let words = command.split_whitespace().map(|w| w.replace("{out}", &folder)).collect();
    Entry { name: name.into(), words, out, wall: vec![], cpu: vec![] }
}

/// A folder with nothing in it: to replace files takes longer than to make them.
fn empty(folder: &Path) {
    std::fs::remove_dir_all(folder).ok();
    std::fs::create_dir_all(folder).expect("a folder for pictures");
}

/// Megabytes of the largest resident set, by GNU time where it is installed.
fn peak(words: &[String]) -> Option<f64> {
    let out = Command::new("/usr/bin/time").args(["-f", "%M"]).args(words).output().ok()?;
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    text.lines().last()?.trim().parse::<f64>().ok().map(|kb| kb / 1024.0)
}

fn report(entries: &mut [Entry]) {
    let median = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let mut first = (0.0, 0.0);
    println!("{:10} {:>9} {:>9} {:>9} {:>8} {:>8}", "", "wall s", "cpu s", "peak MB", "× wall", "× cpu");
    for (i, e) in entries.iter_mut().enumerate() {
        let (wall, cpu) = (median(&mut e.wall), median(&mut e.cpu));
        if i == 0 {
            first = (wall, cpu);
        }
        empty(&e.out);
        let peak = peak(&e.words).map_or("?".into(), |m| format!("{m:.0}"));
        let (rw, rc) = (wall / first.0, cpu / first.1);
        println!("{:10} {wall:9.3} {cpu:9.3} {peak:>9} {rw:8.1} {rc:8.1}", e.name);
    }
}
