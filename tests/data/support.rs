//! Finding the files.

use std::path::PathBuf;

/// The folder of third-party files; `None` where nobody put any.
///
/// Ends the process if `SINEW_DATA` names a folder that does not exist: a check that was asked for must not be skipped.
pub fn data_dir() -> Option<PathBuf> {
    if let Some(dir) = std::env::var_os("SINEW_DATA") {
        let dir = PathBuf::from(dir);
        if !dir.is_dir() {
            eprintln!("SINEW_DATA is set to {}, which is no folder", dir.display());
            std::process::exit(1);
        }
        return Some(dir);
    }
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    beside.is_dir().then_some(beside)
}
