//! Many inputs in one run: names of outputs, none of them twice; what failed, and the exit code that says so.

use super::{Failure, say::Say};
use sinew::io::picture::{Fields, Template};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Names of outputs, and those that are taken.
pub struct Names {
    pub template: Template,
    /// Outputs so far, and where they came from.
    taken: BTreeMap<PathBuf, String>,
}

impl Names {
    pub fn new(pattern: &str) -> Result<Self, Failure> {
        let template = Template::parse(pattern).map_err(|e| Failure::Usage(e.to_string()))?;
        Ok(Self { template, taken: BTreeMap::new() })
    }

    /// A name as others will be, to be checked before anything is read.
    pub fn example(&self) -> String {
        self.template.fill(&Fields { name: "name", folder: "folder", clip: "clip", index: 0 })
    }

    /// Several inputs need names that differ.
    pub fn tell_apart(&self, inputs: usize) -> Result<(), Failure> {
        if inputs > 1 && !self.template.tells_inputs() {
            let message = "-o: several inputs need {name} (or {folder}) in the output's name";
            return Err(Failure::Usage(message.into()));
        }
        Ok(())
    }

    pub fn fill(&self, input: &Path, clip: &str, index: usize) -> String {
        let lossy = |s: Option<&std::ffi::OsStr>| s.unwrap_or_default().to_string_lossy().into_owned();
        let name = lossy(input.file_stem());
        let folder = lossy(input.parent().and_then(|p| p.file_name()));
        self.template.fill(&Fields { name: &name, folder: &folder, clip, index })
    }

    /// Refuse a name that another output of this run has.
    pub fn claim(&mut self, path: PathBuf, source: String) -> Result<(), Failure> {
        match self.taken.get(&path) {
            Some(other) => Err(Failure::Usage(format!(
                "{}: {other} and {source} would be written there; tell them apart by {{folder}}, {{name}}, {{clip}} or {{index}}",
                path.display()
            ))),
            None => {
                self.taken.insert(path, source);
                Ok(())
            }
        }
    }
}

/// What came of a run.
#[derive(Default)]
pub struct Outcome {
    /// Outputs that were written.
    pub done: usize,
    failures: Vec<Failure>,
}

impl Outcome {
    /// Tell a failure and go on.
    pub fn fail(&mut self, failure: Failure, say: &Say) {
        say.error(failure.message());
        self.failures.push(failure);
    }

    /// The worst failure, if there is any; `alone` is said where the only output failed, whose failure was told.
    pub fn sum_up(self, alone: &str) -> Result<(), Failure> {
        let failed = self.failures.len();
        let Some(worst) = self.failures.into_iter().reduce(Failure::worse) else { return Ok(()) };
        let all = self.done + failed;
        Err(worst.with_message(match self.done {
            0 if all == 1 => alone.into(),
            0 => format!("all {all} outputs failed"),
            _ => format!("{failed} of {all} outputs failed; the others were written"),
        }))
    }
}

/// Where names are made from inputs and clips, so are folders.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::Run(format!("{}: cannot create the folder: {e}", folder.display())))
}

/// Refuse to write over what is being read, `--force` or not.
pub fn keep_inputs<'p>(inputs: impl Iterator<Item = &'p PathBuf>, path: &Path) -> Result<(), Failure> {
    let Ok(output) = path.canonicalize() else { return Ok(()) };
    for input in inputs {
        if input.canonicalize().is_ok_and(|i| i == output) {
            let message = format!("-o {}: this is an input; choose another name", input.display());
            return Err(Failure::Usage(message));
        }
    }
    Ok(())
}
