//! Where bytes go: a file that appears when it is complete, or standard output.

use super::{AtomicFile, Error, Folder};
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::path::Path;

/// A file or standard output, to be written once and then committed.
#[derive(Debug)]
pub struct Output(Kind);

#[derive(Debug)]
enum Kind {
    File(AtomicFile),
    /// Standard output as it comes, and how much of it has been written.
    Stream(io::BufWriter<io::Stdout>, u64),
    /// Standard output for a format that goes back to its head: all at once in the end.
    Held(Cursor<Vec<u8>>),
}

impl Output {
    /// A file, as in [`AtomicFile::create`].
    ///
    /// # Errors
    /// Those of [`AtomicFile::create`].
    pub fn file(path: impl AsRef<Path>, overwrite: bool, folder: Folder) -> Result<Self, Error> {
        AtomicFile::create(path, overwrite, folder).map(|f| Self(Kind::File(f)))
    }

    /// Standard output; `held` keeps everything in memory until [`commit`](Self::commit), so that seeking works.
    pub fn stdout(held: bool) -> Self {
        Self(match held {
            true => Kind::Held(Cursor::new(Vec::new())),
            false => Kind::Stream(io::BufWriter::with_capacity(1 << 16, io::stdout()), 0),
        })
    }

    /// Give the file its name, or hand everything to the reader of the pipe.
    ///
    /// # Errors
    /// Those of [`AtomicFile::commit`]; [`Error::Stdout`].
    pub fn commit(self) -> Result<(), Error> {
        let done = match self.0 {
            Kind::File(file) => return file.commit(),
            Kind::Stream(mut out, _) => out.flush(),
            Kind::Held(bytes) => {
                let mut out = io::stdout().lock();
                out.write_all(bytes.get_ref()).and_then(|()| out.flush())
            }
        };
        done.map_err(|source| Error::Stdout { source })
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.0 {
            Kind::File(file) => file.write(bytes),
            Kind::Stream(out, written) => {
                let n = out.write(bytes)?;
                *written += n as u64;
                Ok(n)
            }
            Kind::Held(held) => held.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Kind::File(file) => file.flush(),
            Kind::Stream(out, _) => out.flush(),
            Kind::Held(_) => Ok(()),
        }
    }
}

impl Seek for Output {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.0 {
            Kind::File(file) => file.seek(to),
            // Where it stands is known; a pipe does not go elsewhere.
            Kind::Stream(_, written) if to == SeekFrom::Current(0) => Ok(*written),
            Kind::Stream(..) => Err(io::ErrorKind::NotSeekable.into()),
            Kind::Held(held) => held.seek(to),
        }
    }
}
