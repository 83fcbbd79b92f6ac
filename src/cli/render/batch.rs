//! Many inputs and clips in one run: names, shares, what is there already, what went wrong, what was written.

use super::film::Written;
use super::stats::{Form, Totals};
use super::time::Frame;
use super::{Args, Plan, Ready, Task, draw, list, plan, scene, usual_size};
use crate::cli::batch::{self, Names, Outcome};
use crate::cli::{Failure, load_posed, load_while, print, say, say::Say};
use sinew::frames::Foresight;
use sinew::image::Rgba8;
use sinew::io::manifest::{self, Failed, FileEntry, FrameEntry, Manifest, Output};
use sinew::io::picture::{AtomicFile, Folder, Target};
use sinew::io::{Import, Options};
use sinew::render::Settings;
use sinew::time::Shard;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

#[derive(clap::Args)]
#[command(next_help_heading = "Batch")]
pub struct BatchArgs {
    /// Every clip of every input; the output's name needs {clip}.
    #[arg(long, conflicts_with_all = ["clip", "rest"])]
    all_clips: bool,
    /// Keep the files that are there already and draw the rest.
    #[arg(long, conflicts_with = "force")]
    pub skip_existing: bool,
    /// Say what would be written, and write nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// Write a list of all frames with a hash each, as JSON.
    #[arg(long, value_name = "FILE")]
    pub manifest: Option<PathBuf>,
    /// Draw one share of the work, as in 2/4: every 4th frame from the 2nd, or every 4th film.
    #[arg(long, value_name = "K/N", default_value = "1/1")]
    shard: Shard,
    /// Print what was counted and where the time went.
    #[arg(long, value_name = "FORM", num_args = 0..=1, require_equals = true, default_missing_value = "text")]
    pub stats: Option<Form>,
}

/// A run over all inputs.
struct Batch<'a> {
    args: &'a Args,
    say: &'a Say,
    names: Names,
    /// Pieces of work so far, whichever share they belong to.
    pieces: usize,
    manifest: Manifest,
    outcome: Outcome,
    totals: Totals,
    start: Instant,
}

/// Draw everything that the arguments ask for.
pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    if args.list {
        return args.inputs.iter().try_for_each(|input| {
            let import = load_posed(input, args.time.poses.as_ref(), Options { textures: false }, say)?;
            list(&import.asset)
        });
    }
    let batch = Batch::new(args, say)?;
    batch.run()
}

/// What the one shot of an import will need, as far as that can be told so early.
fn foresee(args: &Args, import: &Import) -> Option<Ready> {
    if args.batch.all_clips {
        return None;
    }
    let asset = &import.asset;
    let clip = args.time.clip(import).ok()?;
    let view = args.sheet.view(args.camera.view(asset, scene(import)).ok()?, args.camera.is_default());
    let Settings { width, height, .. } =
        args.output.settings(usual_size(import), args.renderer.coverage()).ok()?;
    let foresight =
        Foresight::new(asset, clip, &view, &args.camera.framing(asset).ok()?, width as f32 / height as f32);
    let picture = Rgba8 { width, height, data: vec![0; 4 * width * height] };
    Some(Ready { foresight, picture: Mutex::new(picture) })
}

impl<'a> Batch<'a> {
    /// Find what is wrong with the arguments before anything is read.
    fn new(args: &'a Args, say: &'a Say) -> Result<Self, Failure> {
        let names = Names::new(args.output.name())?;
        args.output.target(&names.example())?;
        args.sheet.settings(args.output.settings(None, args.renderer.coverage())?)?;
        names.tell_apart(args.inputs.len())?;
        if args.batch.all_clips && !names.template.tells_clips() {
            return Err(Failure::Usage("-o: --all-clips needs {clip} in the output's name".into()));
        }
        if let Some(path) = &args.batch.manifest {
            check_manifest(args, path)?;
        }
        let (manifest, outcome) = (Manifest::new(), Outcome::default());
        let (totals, start) = (Totals::default(), Instant::now());
        Ok(Self { args, say, names, pieces: 0, manifest, outcome, totals, start })
    }

    fn run(mut self) -> Result<(), Failure> {
        for input in &self.args.inputs {
            if let Err(failure) = self.input(input) {
                self.fail(input, failure)?;
            }
        }
        self.write_manifest()?;
        if let Some(form) = self.args.batch.stats {
            self.totals.print(form, self.start, self.say);
        }
        self.outcome.sum_up("the manifest lists what was written before")
    }

    /// One failure among many is told and kept; alone it ends the run.
    fn fail(&mut self, input: &Path, failure: Failure) -> Result<(), Failure> {
        let many = self.args.inputs.len() > 1 || self.args.batch.all_clips;
        let mistaken = matches!(failure, Failure::Usage(_));
        if !many && (mistaken || self.args.batch.manifest.is_none()) {
            return Err(failure);
        }
        self.manifest.failed.push(Failed { input: input.to_owned(), error: failure.message().to_owned() });
        self.outcome.fail(failure, self.say);
        Ok(())
    }

    fn input(&mut self, input: &Path) -> Result<(), Failure> {
        if self.skip_unread(input)? {
            return Ok(());
        }
        let textures = !self.args.batch.dry_run;
        let start = Instant::now();
        let mut ready = Ready::default();
        let import = match &self.args.time.poses {
            None => {
                let mut meanwhile = |i: &Import| ready = foresee(self.args, i).unwrap_or_default();
                load_while(input, Options { textures }, self.say, &mut meanwhile)?
            }
            poses => load_posed(input, poses.as_ref(), Options { textures }, self.say)?,
        };
        self.totals.import += start.elapsed();
        let clips = import.asset.character.clips();
        let wanted: Vec<Option<usize>> = match self.args.batch.all_clips {
            true if clips.is_empty() => vec![None],
            true => (0..clips.len()).map(Some).collect(),
            false => vec![self.args.time.clip(&import)?],
        };
        for clip in wanted {
            if let Err(failure) = self.clip(input, &import, &ready, clip) {
                self.fail(input, failure)?;
            }
        }
        Ok(())
    }

    /// Whether a film or a picture is another share's, or there already: then its input need not be read.
    fn skip_unread(&mut self, input: &Path) -> Result<bool, Failure> {
        if self.args.batch.all_clips || self.names.template.tells_clips() {
            return Ok(false);
        }
        let target = self.target(input, "", 0)?;
        if matches!(target, Target::Sequence(..)) {
            return Ok(false);
        }
        if !self.args.batch.shard.has(self.pieces) {
            self.pieces += 1;
            return Ok(true);
        }
        let path = target.path_of(1).filter(|p| self.args.batch.skip_existing && p.exists());
        if let Some(path) = path
            && self.args.sheet.companions(&target).iter().all(|p| p.exists())
            && self.args.channels.files(&target, 1).iter().all(|p| p.exists())
            && self.args.batch.manifest.is_none()
            && !self.args.batch.dry_run
        {
            self.pieces += 1;
            self.say.note(&format!("kept {}", path.display()));
            return Ok(true);
        }
        Ok(false)
    }

    fn target(&self, input: &Path, clip: &str, index: usize) -> Result<Target, Failure> {
        self.args.output.target(&self.names.fill(input, clip, index))
    }

    fn clip(
        &mut self,
        input: &Path,
        import: &Import,
        ready: &Ready,
        clip: Option<usize>,
    ) -> Result<(), Failure> {
        let clip_name = clip.map(|c| import.asset.character.clips()[c].name.clone());
        let target = self.target(input, clip_name.as_deref().unwrap_or("rest"), clip.unwrap_or(0))?;
        self.claim(input, &clip_name, &target)?;
        target.path_of(1).map_or(Ok(()), |path| keep_inputs(self.args, &path))?;
        let companions = self.args.sheet.companions(&target);
        companions.iter().try_for_each(|p| keep_inputs(self.args, p))?;
        let task = Task { input, import, ready, clip, target: &target };
        let mut plan = plan(self.args, &task)?;
        self.take_share(&target, &mut plan.frames);
        self.keep_manifest(
            plan.frames.iter().filter_map(|f| target.path_of(f.number)).chain(companions.clone()),
        )?;
        if plan.frames.is_empty() {
            self.say.note(&format!("{}: no part of it is in this shard", target.name().display()));
            return Ok(());
        }
        let all = plan.frames.clone();
        let skip = self.args.batch.skip_existing;
        let skip = skip && companions.iter().all(|p| p.exists());
        let complete = |f: &Frame| self.args.channels.files(&target, f.number).iter().all(|p| p.exists());
        let there = |f: &Frame| skip && target.path_of(f.number).is_some_and(|p| p.exists()) && complete(f);
        plan.frames.retain(|f| !there(f));
        if self.args.batch.dry_run {
            let mut files = companions;
            files.extend(plan.frames.iter().flat_map(|f| self.args.channels.files(&target, f.number)));
            let pictures = plan.frames.iter().filter_map(|f| target.path_of(f.number));
            self.refuse_what_cannot_be(pictures.chain(files.iter().cloned()), &target)?;
            return announce(self.args, &task, &plan, all.len(), &files);
        }
        if self.names.template.tells_inputs() || self.names.template.tells_clips() {
            target.path_of(1).map_or(Ok(()), |p| batch::make_folder(&p))?;
        }
        let done = match plan.frames.is_empty() {
            true => Ok(Written::default()),
            false => draw(self.args, &task, &plan, &mut self.totals, self.say),
        };
        let done = match done {
            Ok(done) => done,
            Err(failure) => {
                self.record_part(&task, clip_name, &all, plan)?;
                return Err(failure);
            }
        };
        if plan.frames.len() < all.len() {
            let kept = all.len() - plan.frames.len();
            self.say.note(&format!("kept {kept} frames of {} that were there", target.name().display()));
        }
        self.outcome.done += 1;
        match self.args.batch.manifest {
            Some(_) => self.record(&task, clip_name, &all, &plan, done),
            None => Ok(()),
        }
    }

    /// What a dry run would find out only when it is none: files that are in the way, and a folder that is not there.
    fn refuse_what_cannot_be(
        &self,
        mut files: impl Iterator<Item = PathBuf>,
        target: &Target,
    ) -> Result<(), Failure> {
        let made = matches!(target, Target::Sequence(..))
            || self.names.template.tells_inputs()
            || self.names.template.tells_clips();
        let folder = target.path_of(1).and_then(|p| p.parent().map(Path::to_owned));
        if let Some(folder) = folder.filter(|f| !made && !f.as_os_str().is_empty() && !f.is_dir()) {
            let (name, folder) = (target.name(), folder.display());
            let message =
                format!("{}: the folder {folder} does not exist; create it first (mkdir -p)", name.display());
            return Err(Failure::Run(message));
        }
        let keep = !self.args.output.force && !self.args.batch.skip_existing;
        match files.find(|p| keep && p.exists()) {
            Some(p) => Err(Failure::Run(format!("{}: the file exists; --force overwrites it", p.display()))),
            None => Ok(()),
        }
    }

    /// Leave the frames of this share; a file of many frames is one piece of work.
    fn take_share(&mut self, target: &Target, frames: &mut Vec<Frame>) {
        let (shard, first) = (self.args.batch.shard, self.pieces);
        if matches!(target, Target::Sequence(..)) {
            self.pieces += frames.len();
            let mut piece = first..;
            frames.retain(|_| piece.next().is_some_and(|i| shard.has(i)));
        } else {
            self.pieces += 1;
            if !shard.has(first) {
                frames.clear();
            }
        }
    }

    /// Refuse a name that another output of this run has.
    fn claim(&mut self, input: &Path, clip: &Option<String>, target: &Target) -> Result<(), Failure> {
        let source = match clip {
            Some(clip) => format!("clip {clip} of {}", input.display()),
            None => input.display().to_string(),
        };
        self.names.claim(target.path_of(1).unwrap_or("-".into()), source)
    }

    /// After a failure: list the frames of a sequence that were written before it.
    fn record_part(
        &mut self,
        task: &Task,
        clip: Option<String>,
        all: &[Frame],
        mut plan: Plan,
    ) -> Result<(), Failure> {
        // With --force a file that is there may be an older one.
        if self.args.batch.manifest.is_none() || self.args.output.force {
            return Ok(());
        }
        let there = |f: &&Frame| task.target.path_of(f.number).is_some_and(|p| p.exists());
        let written: Vec<Frame> = all.iter().filter(there).copied().collect();
        if !matches!(task.target, Target::Sequence(..)) || written.is_empty() {
            return Ok(());
        }
        plan.frames.clear();
        self.record(task, clip, &written, &plan, Written::default())
    }

    /// Refuse to write the manifest over what it is about.
    fn keep_manifest(&self, outputs: impl Iterator<Item = PathBuf>) -> Result<(), Failure> {
        let Some(manifest) = &self.args.batch.manifest else { return Ok(()) };
        let place = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned());
        let own = place(manifest);
        for path in outputs {
            if place(&path) == own {
                let message =
                    format!("--manifest {}: an output has this name; choose another", path.display());
                return Err(Failure::Usage(message));
            }
        }
        Ok(())
    }

    /// List what was drawn and what was there already.
    fn record(
        &mut self,
        task: &Task,
        clip: Option<String>,
        all: &[Frame],
        plan: &Plan,
        done: Written,
    ) -> Result<(), Failure> {
        let hash = |path: &Path| {
            manifest::sha256_of_file(path).map_err(|e| Failure::Run(format!("{}: {e}", path.display())))
        };
        let single = !task.target.is_film(all.len()) && !self.args.sheet.is_one_picture();
        let mut drawn: BTreeMap<i64, String> =
            plan.frames.iter().map(|f| f.number).zip(done.hashes).collect();
        let mut frames = vec![];
        for f in all {
            let file = task.target.path_of(f.number).filter(|_| single);
            let sha256 = match (drawn.remove(&f.number), &file) {
                (None, Some(file)) => Some(hash(file)?),
                (drawn, _) => drawn,
            };
            frames.push(FrameEntry { frame: f.number, seconds: f.moment.time, file, sha256 });
        }
        let film = task.target.path_of(1).filter(|_| !single);
        let mut companions = self.args.sheet.companions(task.target);
        companions.extend(all.iter().flat_map(|f| self.args.channels.files(task.target, f.number)));
        let beside: Vec<_> =
            companions.into_iter().map(|file| Ok(FileEntry { sha256: hash(&file)?, file })).collect();
        self.manifest.outputs.push(Output {
            input: task.input.to_owned(),
            input_sha256: hash(task.input)?,
            clip,
            output: task.target.name(),
            size: plan.size,
            fps: self.args.time.fps.to_string(),
            sha256: film.as_deref().map(hash).transpose()?,
            file: film,
            beside: beside.into_iter().collect::<Result<_, Failure>>()?,
            frames,
        });
        Ok(())
    }

    fn write_manifest(&mut self) -> Result<(), Failure> {
        let Some(path) = self.args.batch.manifest.as_ref().filter(|_| !self.args.batch.dry_run) else {
            return Ok(());
        };
        self.manifest.sort();
        let json = self.manifest.to_json();
        AtomicFile::write(path, json.as_bytes(), true, Folder::MustExist)
            .map_err(|e| Failure::Run(e.to_string()))
    }
}

/// Refuse names that a manifest cannot have, before anything is drawn.
fn check_manifest(args: &Args, path: &Path) -> Result<(), Failure> {
    let bad = |why: &str| Err(Failure::Usage(format!("--manifest {}: {why}", path.display())));
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.as_os_str() == "-" || path.is_dir() {
        return bad("expected a file's name");
    }
    if !folder.is_dir() && !args.batch.dry_run {
        return bad("its folder does not exist; create it first (mkdir -p)");
    }
    if path.exists() && !args.output.force && !args.batch.skip_existing {
        return Err(Failure::Run(format!("{}: the file exists; --force overwrites it", path.display())));
    }
    keep_inputs(args, path)
}

/// Say what would be written.
fn announce(args: &Args, task: &Task, plan: &Plan, all: usize, beside: &[PathBuf]) -> Result<(), Failure> {
    let [w, h] = plan.size;
    let clip = task.clip.map_or("rest", |c| task.import.asset.character.clips()[c].name.as_str());
    let [n, all] = [plan.frames.len(), all].map(|n| args.sheet.pictures(n));
    let mut line = format!(
        "{}: {n} of {all} frames of {w}x{h}, {} of {}",
        task.target.name().display(),
        say::name(clip),
        task.input.display()
    );
    match beside {
        [first, .., last] if beside.len() > 8 => {
            line += &format!(", with {} files, {} … {}", beside.len(), first.display(), last.display());
        }
        _ => beside.iter().for_each(|p| line += &format!(", with {}", p.display())),
    }
    line.push('\n');
    print(line.as_bytes())
}

/// Refuse to write over what is being read.
fn keep_inputs(args: &Args, path: &Path) -> Result<(), Failure> {
    batch::keep_inputs(args.inputs.iter().chain(&args.time.poses), path)
}
