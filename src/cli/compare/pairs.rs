//! Which files belong together.

use crate::cli::{Failure, say::Say};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A picture that should be, and the one that is.
pub struct Pair {
    /// Below the folders, or the name of the file.
    pub name: PathBuf,
    /// `None` where it is missing.
    pub expected: Option<PathBuf>,
    /// `None` where it is missing.
    pub actual: Option<PathBuf>,
}

/// Endings that are taken for pictures in folders.
const ENDINGS: [&str; 7] = ["png", "apng", "gif", "webp", "jpg", "jpeg", "exr"];
/// Folders in folders that are entered.
const DEEPEST: usize = 32;

pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// Two files, or those of two folders by their names.
pub fn find(expected: &Path, actual: &Path, say: &Say) -> Result<Vec<Pair>, Failure> {
    for path in [expected, actual] {
        std::fs::metadata(path).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
    }
    match (is_folder(expected), is_folder(actual)) {
        (false, false) => {
            let name = actual.file_name().map_or_else(|| actual.to_owned(), PathBuf::from);
            let some = |p: &Path| Some(p.to_owned());
            Ok(vec![Pair { name, expected: some(expected), actual: some(actual) }])
        }
        (true, true) => in_folders(expected, actual, say),
        (folder, _) => {
            let what = |is: bool| if is { "a folder" } else { "a file" };
            Err(Failure::Usage(format!(
                "{} is {} and {} is {}: expected two files or two folders",
                expected.display(),
                what(folder),
                actual.display(),
                what(!folder)
            )))
        }
    }
}

fn in_folders(expected: &Path, actual: &Path, say: &Say) -> Result<Vec<Pair>, Failure> {
    let [ours, theirs] = [expected, actual].map(|folder| {
        let mut names = BTreeSet::new();
        list(folder, Path::new(""), 0, &mut names, say).map(|()| names)
    });
    let (ours, theirs) = (ours?, theirs?);
    let of = |names: &BTreeSet<PathBuf>, folder: &Path, name: &Path| {
        names.contains(name).then(|| folder.join(name))
    };
    let pair = |name: &PathBuf| Pair {
        name: name.clone(),
        expected: of(&ours, expected, name),
        actual: of(&theirs, actual, name),
    };
    let pairs: Vec<Pair> = ours.union(&theirs).map(pair).collect();
    if pairs.is_empty() {
        let endings = ENDINGS.join(", .");
        let message = format!(
            "{} and {}: no pictures (.{endings}), nothing to compare",
            expected.display(),
            actual.display()
        );
        return Err(Failure::Input(message));
    }
    Ok(pairs)
}

/// The pictures of a folder and of those in it; links to folders are not followed, so that there is an end.
fn list(
    root: &Path,
    below: &Path,
    depth: usize,
    names: &mut BTreeSet<PathBuf>,
    say: &Say,
) -> Result<(), Failure> {
    let folder = root.join(below);
    let failed = |e: std::io::Error| Failure::Input(format!("{}: {e}", folder.display()));
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = below.join(entry.file_name());
        let kind = entry.file_type().map_err(failed)?;
        let ending = name.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        if kind.is_dir() && depth < DEEPEST {
            list(root, &name, depth + 1, names, say)?;
        } else if ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) && !kind.is_dir() {
            names.insert(name);
        } else {
            say.detail(&format!("{}: not a picture, not compared", root.join(&name).display()));
        }
    }
    Ok(())
}
