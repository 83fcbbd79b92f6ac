//! What a run of the program wrote: every frame with a hash, as JSON that can be merged and checked.
//!
//! ```json
//! {"sinew_manifest": 1, "outputs": [{
//!   "input": "fox.glb", "input_sha256": "…", "clip": "Run", "output": "run.####.png", "size": [512, 512], "fps": "24",
//!   "frames": [{"frame": 1, "seconds": 0.0, "file": "run.0001.png", "sha256": "…"}]}], "failed": []}
//! ```
//!
//! Of a sequence each frame has the hash of its file. Of a film or a sheet, which is one file, the output has `file` and `sha256`, and
//! each frame of a film the hash of its pixels as they came to the encoder. A manifest holds neither times nor machine, so that the
//! same work gives the same bytes, and the manifests of [shards](crate::time::Shard) merge into that of the whole.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// What was written, and what could not be.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The format's version, 1.
    sinew_manifest: u32,
    /// In the order of their names.
    pub outputs: Vec<Output>,
    /// Inputs that could not be drawn.
    #[serde(default)]
    pub failed: Vec<Failed>,
}

/// A picture, a sequence or a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// The asset's file.
    pub input: PathBuf,
    /// Hash of the asset's file; of what it refers to, nothing.
    pub input_sha256: String,
    /// The clip's name; none at rest.
    pub clip: Option<String>,
    /// The name that was asked for, with its place for the frame number.
    pub output: PathBuf,
    /// Pixels a row, and rows.
    pub size: [usize; 2],
    /// Frames a second, as a fraction where it is one.
    pub fps: String,
    /// The film's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Hash of the film's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Files beside it: a sheet's description and maps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<FileEntry>,
    /// In the order of their numbers.
    pub frames: Vec<FrameEntry>,
}

/// A file and its hash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// The file.
    pub file: PathBuf,
    /// Hash of its bytes.
    pub sha256: String,
}

/// A frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameEntry {
    /// Its number.
    pub frame: i64,
    /// What it shows.
    pub seconds: f64,
    /// Its own file, in a sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Hash of its file or, in a film, of its pixels; none if the film was there already.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// An input that could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Failed {
    /// Its file.
    pub input: PathBuf,
    /// Why.
    pub error: String,
}

/// Why manifests cannot be read or merged.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// No JSON, or other fields.
    #[error("line {line}, column {column}: {message}")]
    Json {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// What was expected and what was found.
        message: String,
    },
    /// A version of the format that this reader does not know.
    #[error("`sinew_manifest` is {found}; this version reads 1")]
    Version {
        /// The version that the file has.
        found: u32,
    },
    /// Two hashes for one thing.
    #[error("{}: one manifest says {}, the other {}; they are not of one run", path.display(), or_none(first), or_none(second))]
    Conflict {
        /// The file, or the film with the frame's number.
        path: PathBuf,
        /// Hash in the manifests so far.
        first: Option<String>,
        /// Hash in the next one.
        second: Option<String>,
    },
}

fn or_none(hash: &Option<String>) -> &str {
    hash.as_deref().unwrap_or("nothing")
}

/// A file that is not as the manifest says.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Its bytes are others.
    #[error("{}: expected sha256 {expected}, found {found}", path.display())]
    Differs {
        /// The file.
        path: PathBuf,
        /// What the manifest says.
        expected: String,
        /// What the file has.
        found: String,
    },
}

/// SHA-256 as lower-case hex.
///
/// ```
/// let abc = sinew::io::manifest::sha256(b"abc");
/// assert_eq!(abc, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
/// ```
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of a file, read piece by piece.
///
/// # Errors
/// What the system says.
pub fn sha256_of_file(path: &Path) -> std::io::Result<String> {
    let mut hash = Sha256::new();
    let mut file = std::io::BufReader::with_capacity(1 << 16, std::fs::File::open(path)?);
    loop {
        let piece = std::io::BufRead::fill_buf(&mut file)?;
        if piece.is_empty() {
            return Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect());
        }
        hash.update(piece);
        let n = piece.len();
        std::io::BufRead::consume(&mut file, n);
    }
}

impl Manifest {
    /// Nothing written yet.
    pub fn new() -> Self {
        Self { sinew_manifest: 1, ..Self::default() }
    }

    /// Read a manifest.
    ///
    /// # Errors
    /// [`ManifestError::Json`], [`ManifestError::Version`].
    pub fn from_json(bytes: &[u8]) -> Result<Self, ManifestError> {
        let manifest: Self = serde_json::from_slice(bytes).map_err(|e| ManifestError::Json {
            line: e.line(),
            column: e.column(),
            message: e.to_string(),
        })?;
        match manifest.sinew_manifest {
            1 => Ok(manifest),
            found => Err(ManifestError::Version { found }),
        }
    }

    /// As JSON, indented, with a line break at the end.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("names and numbers");
        text.push('\n');
        text
    }

    /// Put the outputs in order: by name, then by input and clip; frames by number.
    pub fn sort(&mut self) {
        self.outputs.sort_by(|a, b| a.key().cmp(&b.key()));
        self.outputs.iter_mut().for_each(|o| o.frames.sort_by_key(|f| f.frame));
        self.failed.sort();
        self.failed.dedup();
    }

    /// Take in what another run wrote: of the same output the frames are united.
    ///
    /// The result does not depend on the order of merging.
    ///
    /// # Errors
    /// [`ManifestError::Conflict`] where the two disagree about a hash.
    pub fn merge(&mut self, other: Self) -> Result<(), ManifestError> {
        for theirs in other.outputs {
            match self.outputs.iter_mut().find(|o| o.key() == theirs.key()) {
                Some(ours) => ours.unite(theirs)?,
                None => self.outputs.push(theirs),
            }
        }
        self.failed.extend(other.failed);
        self.sort();
        Ok(())
    }

    /// Compare every file with its hash; paths are relative to `folder`.
    pub fn check(&self, folder: &Path) -> Vec<Fault> {
        let films = self.outputs.iter().filter_map(|o| Some((o.file.as_ref()?, o.sha256.as_ref()?)));
        let frames = self.outputs.iter().flat_map(|o| &o.frames);
        let frames = frames.filter_map(|f| Some((f.file.as_ref()?, f.sha256.as_ref()?)));
        let beside = self.outputs.iter().flat_map(|o| &o.beside).map(|f| (&f.file, &f.sha256));
        films
            .chain(beside)
            .chain(frames)
            .filter_map(|(path, expected)| fault(folder.join(path), expected))
            .collect()
    }

    /// Files that the manifest names.
    pub fn files(&self) -> usize {
        let frames = self.outputs.iter().flat_map(|o| &o.frames).filter(|f| f.file.is_some()).count();
        let beside: usize = self.outputs.iter().map(|o| o.beside.len()).sum();
        frames + beside + self.outputs.iter().filter(|o| o.file.is_some()).count()
    }
}

fn fault(path: PathBuf, expected: &str) -> Option<Fault> {
    match sha256_of_file(&path) {
        Err(source) => Some(Fault::Read { path, source }),
        Ok(found) if found != expected => Some(Fault::Differs { path, expected: expected.to_owned(), found }),
        Ok(_) => None,
    }
}

impl Output {
    /// What makes two entries the same output.
    fn key(&self) -> impl Ord + '_ {
        (&self.output, &self.input, &self.input_sha256, &self.clip, self.size, &self.fps, &self.file)
    }

    fn unite(&mut self, theirs: Self) -> Result<(), ManifestError> {
        let conflict = |path: &Path, first: &Option<String>, second: &Option<String>| {
            let (path, first, second) = (path.to_owned(), first.clone(), second.clone());
            Err(ManifestError::Conflict { path, first, second })
        };
        if self.sha256 != theirs.sha256 {
            return conflict(&self.output, &self.sha256, &theirs.sha256);
        }
        let mut frames: std::collections::BTreeMap<i64, FrameEntry> =
            std::mem::take(&mut self.frames).into_iter().map(|f| (f.frame, f)).collect();
        for f in theirs.frames {
            match frames.get(&f.frame) {
                Some(ours) if *ours != f => {
                    let path = f.file.clone().unwrap_or_else(|| self.output.join(f.frame.to_string()));
                    return conflict(&path, &ours.sha256, &f.sha256);
                }
                _ => frames.insert(f.frame, f),
            };
        }
        self.frames = frames.into_values().collect();
        let mut beside: std::collections::BTreeMap<PathBuf, String> =
            std::mem::take(&mut self.beside).into_iter().map(|f| (f.file, f.sha256)).collect();
        for FileEntry { file, sha256 } in theirs.beside {
            match beside.get(&file) {
                Some(ours) if *ours != sha256 => return conflict(&file, &Some(ours.clone()), &Some(sha256)),
                _ => beside.insert(file, sha256),
            };
        }
        self.beside = beside.into_iter().map(|(file, sha256)| FileEntry { file, sha256 }).collect();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output(numbers: &[i64]) -> Output {
        let frame = |&n: &i64| FrameEntry {
            frame: n,
            seconds: n as f64 / 24.0,
            file: Some(format!("a.{n}.png").into()),
            sha256: Some(sha256(&n.to_le_bytes())),
        };
        Output {
            input: "a.glb".into(),
            input_sha256: sha256(b""),
            clip: None,
            output: "a.#.png".into(),
            size: [8, 4],
            fps: "24".into(),
            file: None,
            sha256: None,
            beside: vec![],
            frames: numbers.iter().map(frame).collect(),
        }
    }

    fn manifest(numbers: &[i64]) -> Manifest {
        Manifest { outputs: vec![output(numbers)], ..Manifest::new() }
    }

    #[test]
    fn shares_merge_into_the_whole_in_any_order() {
        let whole = manifest(&[1, 2, 3, 4, 5]);
        for order in [[&[1, 4][..], &[2, 5], &[3]], [&[3], &[2, 5], &[1, 4]]] {
            let mut sum = Manifest::new();
            order.iter().for_each(|n| sum.merge(manifest(n)).unwrap());
            assert_eq!(sum.to_json(), whole.to_json());
        }
        assert_eq!(Manifest::from_json(whole.to_json().as_bytes()).unwrap(), whole);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let mut other = manifest(&[2]);
        other.outputs[0].frames[0].sha256 = Some("00".into());
        let message = manifest(&[1, 2]).merge(other).unwrap_err().to_string();
        assert!(message.contains("a.2.png") && message.contains("the other 00"), "{message}");
        let says = |text: &str| Manifest::from_json(text.as_bytes()).unwrap_err().to_string();
        assert!(says("{\"sinew_manifest\": 2, \"outputs\": []}").contains("reads 1"));
        assert!(says("{\"sinew_manifest\": 1}").contains("outputs"));
    }

    #[test]
    fn files_are_compared_with_their_hashes() {
        let folder = tempfile::tempdir().unwrap();
        let whole = manifest(&[1, 2, 3]);
        std::fs::write(folder.path().join("a.1.png"), 1i64.to_le_bytes()).unwrap();
        std::fs::write(folder.path().join("a.2.png"), "other").unwrap();
        let faults: Vec<String> = whole.check(folder.path()).iter().map(|f| f.to_string()).collect();
        assert_eq!((faults.len(), whole.files()), (2, 3));
        assert!(
            faults[0].contains("a.2.png: expected sha256") && faults[1].contains("a.3.png"),
            "{faults:?}"
        );
    }
}
