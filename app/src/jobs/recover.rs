//! What a crash must not take: unsaved clips, beside the name of their file.

use super::open;
use super::save::put;
use crate::state::{Document, State};
use sinew::clip::Clip;
use sinew::io::rig_json;
use sinew::time::Timeline;
use std::path::{Path, PathBuf};

#[derive(serde::Serialize, serde::Deserialize)]
struct Kept {
    sinew_recovery: u32,
    file: PathBuf,
    poses: String,
}

/// Where such files lie: below `XDG_STATE_HOME` or `~/.local/state`.
pub fn folder() -> Option<PathBuf> {
    let state = std::env::var_os("XDG_STATE_HOME").map(PathBuf::from).filter(|p| p.is_absolute());
    let home = || std::env::var_os("HOME").map(|h| PathBuf::from(h).join(".local/state"));
    state.or_else(home).map(|p| p.join("sinew-app"))
}

/// This process's own file.
pub fn own(folder: &Path) -> PathBuf {
    folder.join(format!("{}.json", std::process::id()))
}

/// What processes that are gone left there.
pub fn left(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    let gone = |p: &PathBuf| {
        let id = p.file_stem().and_then(|s| s.to_str()).and_then(|s| s.parse::<u32>().ok());
        id.is_some_and(|id| !runs(id))
    };
    let mut all: Vec<PathBuf> = entries.filter(gone).collect();
    all.sort();
    all
}

/// Whether a process is an editor, and not dead with nobody to bury it.
fn runs(id: u32) -> bool {
    let name = |id: &str| std::fs::read_to_string(format!("/proc/{id}/comm")).ok();
    let state = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let dead = state.rsplit_once(") ").is_none_or(|(_, s)| s.starts_with(['Z', 'X']));
    id == std::process::id() || (!dead && name("self") == name(&id.to_string()))
}

/// Put clips aside.
///
/// # Errors
/// What the system says.
pub fn keep(folder: &Path, file: &Path, document: &Document) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| open::named(folder, &e))?;
    let poses = rig_json::export_poses(&document.asset.character, &document.to_clips()).document;
    let poses = poses.with_timeline(&document.timeline()).to_text();
    let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let kept = Kept { sinew_recovery: 1, file, poses };
    let text = serde_json::to_vec(&kept).map_err(|e| e.to_string())?;
    put(&own(folder), &text)
}

/// The file that a kept one belongs to, if it can be read.
pub fn file_of(path: &Path) -> Option<PathBuf> {
    let kept: Kept = serde_json::from_slice(&sinew::io::read_file(path).ok()?).ok()?;
    Some(kept.file)
}

/// The document that was being edited; it counts as unsaved.
///
/// # Errors
/// What is wrong with the kept file or with the one that it belongs to.
pub fn restore(path: &Path) -> Result<(open::Opened, Vec<Clip>, Timeline), String> {
    let bad = |e: &dyn std::fmt::Display| open::named(path, e);
    let bytes = sinew::io::read_file(path).map_err(|e| bad(&e))?;
    let kept: Kept = serde_json::from_slice(&bytes).map_err(|e| bad(&e))?;
    let opened = open::read(&kept.file)?;
    let poses = rig_json::Poses::from_bytes(kept.poses.as_bytes()).map_err(|e| bad(&e))?;
    let clips = poses.to_clips(&opened.asset.character).map_err(|e| bad(&e))?;
    let timeline = poses.timeline().map_err(|e| bad(&e))?;
    Ok((opened, clips, timeline))
}

/// A state with recovered clips, to be saved or undone.
pub fn state(opened: &open::Opened, clips: Vec<Clip>, timeline: &Timeline) -> State {
    use crate::state::{Command, Edit};
    let mut state = opened.state();
    let replaced = state.update(Command::Do(Edit::ReplaceClips("Recover", clips)));
    debug_assert!(replaced.is_ok(), "poses that were checked");
    state.set_timeline(timeline);
    state
}
