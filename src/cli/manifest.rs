//! `sinew manifest`: merge what shares wrote, and check files against their hashes.

use super::{Failure, say::Say};
use sinew::io::manifest::Manifest;
use sinew::io::picture::{AtomicFile, Folder};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sinew manifest merge part-*.json -o all.json
  sinew manifest check all.json                  every file is there and has its hash, else exit code 4";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Unite the manifests of shares into that of the whole.
    Merge {
        /// Manifests that `sinew render --manifest` wrote.
        #[arg(required = true, value_name = "FILE")]
        inputs: Vec<PathBuf>,
        /// Where the union goes.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Overwrite an existing file.
        #[arg(short, long)]
        force: bool,
    },
    /// Compare every file with its hash.
    Check {
        /// A manifest.
        #[arg(value_name = "FILE")]
        input: PathBuf,
        /// The folder that names are relative to: where `sinew render` ran.
        #[arg(long, default_value = ".", value_name = "FOLDER")]
        folder: PathBuf,
    },
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    match &args.command {
        Command::Merge { inputs, output, force } => merge(inputs, output, *force, say),
        Command::Check { input, folder } => check(input, folder, say),
    }
}

fn read(path: &Path) -> Result<Manifest, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let bytes = sinew::io::read_file(path).map_err(|e| bad(&e))?;
    Manifest::from_json(&bytes).map_err(|e| bad(&e))
}

fn merge(inputs: &[PathBuf], output: &Path, force: bool, say: &Say) -> Result<(), Failure> {
    let mut sum = Manifest::new();
    for path in inputs {
        let bad = |e| Failure::Input(format!("{}: {e}", path.display()));
        sum.merge(read(path)?).map_err(bad)?;
    }
    let json = sum.to_json();
    let written = AtomicFile::write(output, json.as_bytes(), force, Folder::MustExist);
    written.map_err(|e| Failure::Run(e.to_string()))?;
    say.note(&format!("wrote {}: {} files of {} outputs", output.display(), sum.files(), sum.outputs.len()));
    Ok(())
}

fn check(input: &Path, folder: &Path, say: &Say) -> Result<(), Failure> {
    let manifest = read(input)?;
    let faults = manifest.check(folder);
    faults.iter().for_each(|f| say.error(&f.to_string()));
    for f in &manifest.failed {
        say.error(&format!("{}: was not drawn: {}", f.input.display(), f.error));
    }
    match faults.len() + manifest.failed.len() {
        0 if manifest.files() == 0 => {
            Err(Failure::Differs(format!("{} names no files: there is nothing to check", input.display())))
        }
        0 => {
            say.note(&format!("{} files are as {} says", manifest.files(), input.display()));
            Ok(())
        }
        n => Err(Failure::Differs(format!(
            "{n} faults among {} files of {}",
            manifest.files(),
            input.display()
        ))),
    }
}
