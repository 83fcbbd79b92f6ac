//! Promises of the editor, one binary.

mod files;
mod keys;
mod looks;
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
        Arc::new(sinew::io::import(&file("rigs/pip.json"), &options).expect("the shipped biped").asset)
    };
    PIP.get_or_init(read).clone()
}
