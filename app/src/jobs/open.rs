//! Files to documents.

use crate::state::{Document, State};
use sinew::asset::Asset;
use sinew::bake::xzx;
use sinew::io::{self, Import, Options};
use sinew::time::Timeline;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What kind of file a document came from: it decides what saving writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Ours.
    Rig,
    /// glTF, which goes back into the same file with other clips.
    Gltf,
    /// Captures, rigs of the notes, scenes: read only.
    Other,
}

/// Where a document came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// What it is.
    pub kind: Kind,
}

/// A file that was read.
pub struct Opened {
    /// Where from.
    pub source: Source,
    /// What was in it.
    pub asset: Arc<Asset>,
    /// What was dropped or repaired.
    pub notes: Vec<String>,
    /// What it keeps beside the keys.
    pub timeline: Timeline,
}

impl Opened {
    /// The document in the editor.
    pub fn state(&self) -> State {
        let mut document = Document::new(self.asset.clone());
        document.set_timeline(&self.timeline);
        let mut state = State::with_document(document);
        state.set_timeline(&self.timeline);
        state
    }
}

/// Read any file that the library knows.
///
/// # Errors
/// A message that says which file, where in it, and what is wrong.
pub fn read(path: &Path) -> Result<Opened, String> {
    let import = io::import(path, &Options { textures: true }).map_err(|e| named(path, &e))?;
    let Import { mut asset, format, timeline, warnings, .. } = import;
    let kind = match format.as_str() {
        "glTF" => Kind::Gltf,
        "sinew rig" => Kind::Rig,
        _ => Kind::Other,
    };
    if asset.character.skeleton().is_empty() && asset.character.instances().is_empty() {
        return Err(format!(
            "{}: this {format} has neither bones nor meshes; there is nothing to pose",
            path.display()
        ));
    }
    if kind != Kind::Rig {
        // Angles turn about the bone's length, which such files do not say.
        asset.character = xzx::with_aims(&asset.character);
    }
    let source = Source { path: path.to_owned(), kind };
    let notes = warnings.iter().map(ToString::to_string).collect();
    Ok(Opened { source, asset: Arc::new(asset), notes, timeline })
}

/// A message with the file's name, once.
pub(super) fn named(path: &Path, e: &dyn std::fmt::Display) -> String {
    let (name, text) = (path.display().to_string(), e.to_string());
    if text.contains(&name) { text } else { format!("{name}: {text}") }
}
