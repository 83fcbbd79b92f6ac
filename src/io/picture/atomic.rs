//! Files that appear when they are complete, or not at all.

use super::Error;
use super::unnamed;
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What to do where the folder of a file is missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Folder {
    /// An error with a hint: for one file, where a missing folder is likely a typing error.
    #[default]
    MustExist,
    /// Create it and those above it: for a sequence, which wants a folder of its own.
    Create,
}

/// A file that is written beside its target and takes its name in [`commit`](AtomicFile::commit).
///
/// Dropped before that, it leaves nothing behind, and what stood there before stays. The permissions are those of any
/// new file (0666 less the umask), or those of the file that it replaces. A symbolic link is followed. Where the file system
/// can (Linux), the file has no name at all until it is complete, so that not even a killed process leaves a trace;
/// elsewhere it is called `.sinew-….tmp` meanwhile.
///
/// ```
/// # use std::io::Write;
/// use sinew::io::picture::{AtomicFile, Folder};
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("a.png");
/// let mut file = AtomicFile::create(&path, false, Folder::MustExist).unwrap();
/// file.write_all(b"picture").unwrap();
/// assert!(!path.exists());
/// file.commit().unwrap();
/// assert_eq!(std::fs::read(&path).unwrap(), b"picture");
/// assert!(AtomicFile::create(&path, false, Folder::MustExist).is_err());
/// ```
#[derive(Debug)]
pub struct AtomicFile {
    /// The name as it was given, for messages.
    path: PathBuf,
    /// Where links lead.
    target: PathBuf,
    overwrite: bool,
    /// `None` once committed.
    file: Option<io::BufWriter<Temporary>>,
}

/// A file on its way.
#[derive(Debug)]
enum Temporary {
    Named(tempfile::NamedTempFile),
    Unnamed(fs::File),
}

impl Temporary {
    fn file(&self) -> &fs::File {
        match self {
            Self::Named(f) => f.as_file(),
            Self::Unnamed(f) => f,
        }
    }

    fn path(&self) -> Option<PathBuf> {
        match self {
            Self::Named(f) => Some(f.path().to_owned()),
            Self::Unnamed(_) => None,
        }
    }

    /// Give it its name.
    fn persist(self, target: &Path, overwrite: bool) -> io::Result<()> {
        match self {
            Self::Unnamed(f) => unnamed::name(&f, target, overwrite),
            Self::Named(f) if overwrite => f.persist(target).map(drop).map_err(|e| e.error),
            Self::Named(f) => f.persist_noclobber(target).map(drop).map_err(|e| e.error),
        }
    }
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Seek for Temporary {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file().seek(to)
    }
}

/// The temporaries that exist now; `None` once the program is about to end.
static TEMPORARIES: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(Some(BTreeSet::new()));

/// Remove every unfinished file of this process, and let none be created or completed any more.
///
/// For the program's handler of Ctrl-C, just before it exits. It takes a lock and calls the file system, so it belongs
/// on an ordinary thread (where the crate `ctrlc` calls its handler), not inside a bare signal handler.
pub fn cleanup_temporaries() {
    for path in lock().take().into_iter().flatten() {
        // Best effort: there is nobody left to tell.
        let _ = fs::remove_file(path);
    }
}

fn lock() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    TEMPORARIES.lock().unwrap_or_else(PoisonError::into_inner)
}

impl AtomicFile {
    /// Open a temporary file beside `path`.
    ///
    /// # Errors
    /// [`Error::Exists`] without `overwrite`, [`Error::NotAFile`], [`Error::NoFolder`], [`Error::Io`], and
    /// [`Error::Interrupted`] after [`cleanup_temporaries`].
    pub fn create(path: impl AsRef<Path>, overwrite: bool, folder: Folder) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let target = fs::canonicalize(&path).unwrap_or_else(|_| path.clone());
        let permissions = permissions_for(&path, overwrite)?;
        let parent = match target.parent() {
            Some(p) if !p.as_os_str().is_empty() => p,
            _ => Path::new("."),
        };
        prepare_folder(&path, parent, folder)?;
        let file = open_beside(&path, parent, permissions)?;
        Ok(Self { path, target, overwrite, file: Some(io::BufWriter::with_capacity(1 << 16, file)) })
    }

    /// Create, write all bytes and commit.
    ///
    /// # Errors
    /// Those of [`create`](Self::create) and [`commit`](Self::commit).
    pub fn write(path: impl AsRef<Path>, bytes: &[u8], overwrite: bool, folder: Folder) -> Result<(), Error> {
        let mut file = Self::create(path, overwrite, folder)?;
        file.write_all(bytes).map_err(|source| file.error("write", source))?;
        file.commit()
    }

    /// The same for files that belong together: all bytes are written before the first gets its name.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_together(files: &[(PathBuf, &[u8])], overwrite: bool, folder: Folder) -> Result<(), Error> {
        let written = files.iter().map(|(path, bytes)| {
            let mut file = Self::create(path, overwrite, folder)?;
            let done = file.write_all(bytes).and_then(|()| file.flush());
            done.map_err(|source| file.error("write", source))?;
            Ok(file)
        });
        let written: Vec<Self> = written.collect::<Result<_, Error>>()?;
        written.into_iter().try_for_each(Self::commit)
    }

    /// Give the file its name.
    ///
    /// # Errors
    /// [`Error::Exists`] where the name was taken meanwhile and `overwrite` is not set; [`Error::Io`];
    /// [`Error::Interrupted`]. The temporary is removed in every case.
    pub fn commit(mut self) -> Result<(), Error> {
        let Some(file) = self.file.take() else { return Ok(()) };
        let temporary = file.get_ref().path();
        let flushed = file.into_inner().map_err(|e| self.error("write", e.into_error()));
        // The name changes under the lock, so that a clean-up sees the file either before or after.
        let mut list = lock();
        let Some(list) = list.as_mut() else { return Err(Error::Interrupted { path: self.path.clone() }) };
        temporary.map(|path| list.remove(&path));
        flushed?.persist(&self.target, self.overwrite).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => Error::Exists { path: self.path.clone() },
            _ => self.error("give the file its name", e),
        })
    }

    fn error(&self, action: &'static str, source: io::Error) -> Error {
        Error::Io { path: self.path.clone(), action, source }
    }
}

/// Name the file in an error that leaves through `Write`.
fn name_file(path: &Path) -> impl Fn(io::Error) -> io::Error {
    move |e| io::Error::new(e.kind(), format!("{}: {e}", path.display()))
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        file.write(bytes).map_err(name_file(&self.path))
    }

    fn flush(&mut self) -> io::Result<()> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        file.flush().map_err(name_file(&self.path))
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        file.seek(to).map_err(name_file(&self.path))
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        let Some(file) = self.file.take() else { return };
        let (temporary, _) = file.into_parts();
        let path = temporary.path();
        drop(temporary);
        if let (Some(path), Some(list)) = (path, lock().as_mut()) {
            list.remove(&path);
        }
    }
}

/// Permissions of the file that is to be replaced, if there is one and it may be.
fn permissions_for(path: &Path, overwrite: bool) -> Result<Option<fs::Permissions>, Error> {
    let Ok(meta) = fs::metadata(path) else { return Ok(None) };
    let found = if meta.is_dir() { "a folder" } else { "a device or a pipe" };
    match (meta.is_file(), overwrite) {
        (false, _) => Err(Error::NotAFile { path: path.to_owned(), found }),
        (true, false) => Err(Error::Exists { path: path.to_owned() }),
        (true, true) => Ok(Some(meta.permissions())),
    }
}

fn prepare_folder(path: &Path, parent: &Path, folder: Folder) -> Result<(), Error> {
    if parent.is_dir() {
        return Ok(());
    }
    if folder == Folder::MustExist && !parent.exists() {
        return Err(Error::NoFolder { path: path.to_owned(), folder: parent.to_owned() });
    }
    let failed = |source| Error::Io { path: parent.to_owned(), action: "create the folder", source };
    fs::create_dir_all(parent).map_err(failed)
}

/// A new temporary in `folder`, on the list before anybody can interrupt.
fn open_beside(path: &Path, folder: &Path, permissions: Option<fs::Permissions>) -> Result<Temporary, Error> {
    let failed = |source| Error::Io { path: path.to_owned(), action: "create the file", source };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sinew-").suffix(".tmp");
    // The umask is taken off when the file is created, as for any file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut list = lock();
    let Some(list) = list.as_mut() else { return Err(Error::Interrupted { path: path.to_owned() }) };
    let file = match unnamed::create(folder) {
        Some(file) => Temporary::Unnamed(file),
        None => Temporary::Named(builder.tempfile_in(folder).map_err(failed)?),
    };
    if let Some(permissions) = permissions {
        file.file().set_permissions(permissions).map_err(failed)?;
    }
    list.extend(file.path());
    Ok(file)
}
