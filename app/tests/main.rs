//! Promises of the editor, one binary.

mod files;
mod keys;
mod person;
mod random;
mod session;
mod view;

use sinew::asset::Asset;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A file of the repository.
fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

/// Pip, a biped, with clips; read once.
fn pip() -> Arc<Asset> {
    static PIP: OnceLock<Arc<Asset>> = OnceLock::new();
    let read = || {
        let options = sinew::io::Options::default();
        let asset = sinew::io::import(&file("rigs/pip.json"), &options).expect("the shipped biped").asset;
        let poses = std::fs::read(file("poses/pip.json")).expect("its poses");
        let poses = sinew::io::rig_json::Poses::from_bytes(&poses).expect("they parse");
        let clips = poses.to_clips(&asset.character).expect("they fit");
        let character = asset.character.with_clips(clips).expect("they fit");
        Arc::new(Asset { character, ..asset })
    };
    PIP.get_or_init(read).clone()
}
