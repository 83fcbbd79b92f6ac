//! The command line: parse, call the library, print, choose an exit code. No algorithm lives here.

mod bake;
mod batch;
mod compare;
mod eval;
mod info;
mod manifest;
#[cfg(target_os = "linux")]
mod memory;
mod render;
mod say;

use clap::{CommandFactory, Parser, Subcommand};
use say::Say;
use sinew::clip::Clip;
use sinew::io::scene::{Setting, ours};
use sinew::io::{self, Import, Options};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  sinew render rigs/pip.json -o walk.gif        a film of one of the shipped characters
  sinew render fox.glb -o run.####.png --clip Run a numbered sequence of one clip
  sinew info fox.glb                              what is in a file
  sinew eval fox.glb --clip 0 --times 0,0.5       the numbers behind a picture

Exit codes: 0 done, 1 failed while running, 2 wrong usage, 3 bad input file, 4 files differ, 130 interrupted.
The variable NO_COLOR switches colours off.";

/// Character animation: rigged glTF in, right frames out.
#[derive(Parser)]
#[command(name = "sinew", version, after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose", display_order = 900)]
    quiet: bool,
    /// Say more: every warning, what was chosen, what it cost.
    #[arg(short, long, global = true, display_order = 901)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Draw a character: one picture, a numbered sequence or a film.
    Render(Box<render::Args>),
    /// Make a file's clips small within an error that you choose.
    Bake(Box<bake::Args>),
    /// Tell what is in a file: bones, meshes, clips, extensions, warnings.
    Info(info::Args),
    /// Print node matrices and vertex positions as JSON.
    Eval(eval::Args),
    /// Tell how far pictures or films are from what they should be.
    Compare(compare::Args),
    /// Merge and check lists of what was written.
    Manifest(manifest::Args),
    /// Print a completion script for a shell.
    #[command(
        after_help = "Example:\n  sinew completions bash > ~/.local/share/bash-completion/completions/sinew"
    )]
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Print a manual page (roff).
    #[command(after_help = "Examples:\n  sinew man | man -l -\n  sinew man render | man -l -")]
    Man {
        /// Of which subcommand; of the program itself by default.
        subcommand: Option<String>,
    },
}

/// What went wrong, and so the exit code.
enum Failure {
    /// 1: failed while running.
    Run(String),
    /// 2: the command cannot mean anything.
    Usage(String),
    /// 3: the input file.
    Input(String),
    /// 4: files are not what they should be.
    Differs(String),
}

impl Failure {
    fn message(&self) -> &str {
        match self {
            Failure::Run(m) | Failure::Usage(m) | Failure::Input(m) | Failure::Differs(m) => m,
        }
    }

    /// Of two failures the one that says more: while running, then the input's, then the usage, then what is not as it should be.
    fn worse(self, other: Self) -> Self {
        let rank = |f: &Self| match f {
            Failure::Run(_) => 3,
            Failure::Input(_) => 2,
            Failure::Usage(_) => 1,
            Failure::Differs(_) => 0,
        };
        if rank(&self) >= rank(&other) { self } else { other }
    }

    /// The exit code.
    fn code(&self) -> u8 {
        match self {
            Failure::Run(_) => 1,
            Failure::Usage(_) => 2,
            Failure::Input(_) => 3,
            Failure::Differs(_) => 4,
        }
    }

    fn with_message(self, message: String) -> Self {
        match self {
            Failure::Run(_) => Failure::Run(message),
            Failure::Usage(_) => Failure::Usage(message),
            Failure::Input(_) => Failure::Input(message),
            Failure::Differs(_) => Failure::Differs(message),
        }
    }
}

/// Parse the arguments and do what they say.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let say = Say::new(cli.quiet, cli.verbose);
    let done = match cli.command {
        Command::Render(args) => render::run(&args, &say),
        Command::Bake(args) => bake::run(&args, &say),
        Command::Info(args) => info::run(&args, &say),
        Command::Eval(args) => eval::run(&args, &say),
        Command::Compare(args) => compare::run(&args, &say),
        Command::Manifest(args) => manifest::run(&args, &say),
        Command::Completions { shell } => completions(shell),
        Command::Man { subcommand } => manual(subcommand.as_deref()),
    };
    let Err(failure) = done else { return ExitCode::SUCCESS };
    say.error(failure.message());
    ExitCode::from(failure.code())
}

fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "sinew", &mut script);
    print(&script)
}

fn manual(subcommand: Option<&str>) -> Result<(), Failure> {
    let mut program = Cli::command();
    // Building hands the global options down to the subcommands.
    program.build();
    let command = match subcommand {
        None => program,
        Some(name) => {
            let of = program.find_subcommand(name).cloned();
            of.ok_or_else(|| Failure::Usage(format!("man {name}: no such subcommand")))?
        }
    };
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page).map_err(|e| Failure::Run(e.to_string()))?;
    print(&page)
}

/// Bytes to standard output; a reader that went away (`| head`) is no failure.
fn print(bytes: &[u8]) -> Result<(), Failure> {
    use std::io::{ErrorKind, Write};
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::Run(format!("standard output: {e}"))),
        _ => Ok(()),
    }
}

/// Read the input, show its warnings.
fn load(path: &Path, options: Options, say: &Say) -> Result<Import, Failure> {
    load_while(path, options, say, &mut |_| ())
}

/// The same, with something to do while pictures are decoded.
fn load_while(
    path: &Path,
    options: Options,
    say: &Say,
    meanwhile: &mut dyn FnMut(&Import),
) -> Result<Import, Failure> {
    let import = io::import_while(path, &options, meanwhile)
        .map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
    say.warnings(path, &import.warnings);
    Ok(import)
}

/// Read the input and, if poses are named, put them in the place of its clips.
fn load_posed(path: &Path, poses: Option<&PathBuf>, options: Options, say: &Say) -> Result<Import, Failure> {
    let mut import = load(path, options, say)?;
    if let Some(file) = poses {
        let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", file.display()));
        let bytes = io::read_file(file).map_err(|e| bad(&e))?;
        if bytes.trim_ascii_start().get(..9).is_some_and(|w| w.eq_ignore_ascii_case(b"HIERARCHY")) {
            return Err(bad(
                &"a motion capture stands on a skeleton of its own; expected poses (`sinew_poses`)",
            ));
        }
        let clips = match packed_clips(file, &bytes, &import, say)? {
            Some(clips) => clips,
            None => io::rig_json::poses_from_bytes(&bytes, &import.asset.character).map_err(|e| bad(&e))?,
        };
        let character = std::mem::take(&mut import.asset.character);
        import.asset.character = character.with_clips(clips).map_err(|e| bad(&e))?;
    }
    Ok(import)
}

/// The clips of packed bytes on the import's bones; none if the bytes are something else.
fn packed_clips(file: &Path, bytes: &[u8], import: &Import, say: &Say) -> Result<Option<Vec<Clip>>, Failure> {
    if !bytes.starts_with(io::sinew_clip::MAGIC) {
        return Ok(None);
    }
    let packed =
        io::sinew_clip::read(bytes).map_err(|e| Failure::Input(format!("{}: {e}", file.display())))?;
    let mut warnings = vec![];
    let clips = packed.clips(&import.asset.character, &mut warnings);
    say.warnings(file, &warnings);
    Ok(Some(clips))
}

/// The clip that `--clip` names: by name, else by index; by default a scene's own, else the first, `None` without clips.
fn find_clip(import: &Import, asked: Option<&str>) -> Result<Option<usize>, Failure> {
    let clips = import.asset.character.clips();
    let of_scene = match &import.setting {
        Some(Setting::Ours(scene)) => scene.clip.as_ref().map(|c| match c {
            ours::Clip::Name(name) => name.clone(),
            ours::Clip::Index(i) => i.to_string(),
        }),
        _ => None,
    };
    let asked = asked.or(of_scene.as_deref());
    let Some(asked) = asked else { return Ok((!clips.is_empty()).then_some(0)) };
    let named = clips.iter().position(|c| c.name == asked);
    let index = asked.parse::<usize>().ok().filter(|&i| i < clips.len());
    named.or(index).map(Some).ok_or_else(|| {
        let names: Vec<String> =
            clips.iter().enumerate().map(|(i, c)| format!("{i} {}", say::name(&c.name))).collect();
        let has = if names.is_empty() { "none".into() } else { names.join(", ") };
        Failure::Usage(format!("--clip {asked}: no such clip; the file has: {has}"))
    })
}
