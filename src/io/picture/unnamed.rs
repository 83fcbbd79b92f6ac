//! Files without a name until they are complete: `O_TMPFILE` and `linkat` on Linux.

use std::fs::File;
use std::io;
use std::path::Path;

/// A file in `folder` that vanishes with the process unless it is [`name`]d; `None` where there is no such thing.
#[cfg(target_os = "linux")]
pub(super) fn create(folder: &Path) -> Option<File> {
    use rustix::fs::{Mode, OFlags};
    // Without /proc it could never get its name.
    if !Path::new("/proc/self/fd").is_dir() {
        return None;
    }
    let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
    let mode = Mode::RUSR | Mode::WUSR | Mode::RGRP | Mode::WGRP | Mode::ROTH | Mode::WOTH;
    rustix::fs::open(folder, flags, mode).ok().map(File::from)
}

/// Give a file from [`create`] its name.
#[cfg(target_os = "linux")]
pub(super) fn name(file: &File, target: &Path, overwrite: bool) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    use std::os::fd::AsRawFd;
    let source = format!("/proc/self/fd/{}", file.as_raw_fd());
    let link = |to: &Path| linkat(CWD, &source, CWD, to, AtFlags::SYMLINK_FOLLOW).map_err(io::Error::from);
    match link(target) {
        Err(e) if overwrite && e.kind() == io::ErrorKind::AlreadyExists => {
            // A link cannot replace a file, a renamed one can: the whole file has a second name for that moment.
            let parent = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let beside = tempfile::Builder::new().prefix(".sinew-").suffix(".tmp").make_in(parent, link)?;
            beside.into_temp_path().persist(target).map_err(|e| e.error)
        }
        done => done,
    }
}

/// Elsewhere every file has a name.
#[cfg(not(target_os = "linux"))]
pub(super) fn create(_: &Path) -> Option<File> {
    None
}

/// Never called: there are no such files.
#[cfg(not(target_os = "linux"))]
pub(super) fn name(_: &File, _: &Path, _: bool) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
