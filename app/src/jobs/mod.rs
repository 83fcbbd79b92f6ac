//! Files, read and written beside the window: one job at a time on a thread of its own, with progress and a way to stop it.

mod dialog;
pub mod film;
pub mod open;
pub mod recover;
pub mod save;

use crate::Bus;
use crate::commands::Task;
use crate::state::{Command, Document, Edit, State};
use crate::viewport::orbit::Orbit;
use dialog::{Ask, Then};
use open::{Opened, Source};
use sinew::bake::{BakeDesc, Goal, xzx};
use sinew::clip::Clip;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Seconds between two backups of unsaved work.
const BACKUP: f64 = 20.0;
/// Files that are remembered.
const RECENT: usize = 12;

/// What came of a job.
enum Outcome {
    Opened(Box<Opened>, Option<f64>),
    Recovered(Box<State>, Source, PathBuf),
    Saved(PathBuf, Document, Vec<String>),
    Clips(&'static str, Vec<Clip>, String),
    Done(String),
    Chosen(Option<PathBuf>),
    Failed(String),
    Cancelled,
}

/// What a job sees of its window.
pub struct Control {
    progress: Arc<AtomicU32>,
    cancel: Arc<AtomicBool>,
    ctx: egui::Context,
}

impl Control {
    /// Tell how far it is, 0…1; whether to go on.
    pub fn goes_on(&self, share: f32) -> bool {
        self.progress.store(share.to_bits(), Ordering::Relaxed);
        self.ctx.request_repaint();
        !self.cancel.load(Ordering::Relaxed)
    }
}

struct Running {
    name: String,
    result: Receiver<Outcome>,
    progress: Arc<AtomicU32>,
    cancel: Arc<AtomicBool>,
}

/// What is being read and written.
#[derive(Default)]
pub struct Jobs {
    /// Opened lately, the last first.
    pub recent: Vec<PathBuf>,
    /// Where the document came from.
    pub source: Option<Source>,
    /// Where the viewport stands, for pictures as it shows them.
    pub camera: Orbit,
    running: Option<Running>,
    /// A file dialog of the system; it may never answer.
    browsing: Option<Receiver<Outcome>>,
    ask: Option<Ask>,
    /// Where unsaved work is kept; nowhere in tests.
    backups: Option<PathBuf>,
    backed: (u64, f64),
    leaving: bool,
    after_save: Option<Then>,
}

impl Jobs {
    /// The program starts: open a file at a time, offer what a crash left.
    pub fn begin(&mut self, ctx: &egui::Context, file: Option<PathBuf>, at: Option<f64>) {
        self.backups = recover::folder();
        let left = self.backups.as_deref().map(recover::left).unwrap_or_default();
        self.ask = left.into_iter().next().map(Ask::Recover);
        if let Some(path) = file {
            self.open(ctx, &path, at);
        }
    }

    /// Whether a job is under way.
    pub fn busy(&self) -> bool {
        self.running.is_some()
    }

    /// A dialog is open that keys belong to.
    pub fn modal(&self) -> bool {
        self.ask.is_some()
    }

    /// Start what a menu asked for.
    pub fn task(&mut self, ctx: &egui::Context, task: Task, state: &mut State, bus: &mut Bus) {
        match task {
            Task::Open => self.ask = Some(Ask::open(&self.recent)),
            Task::Save => match &self.source {
                Some(s) if s.kind == open::Kind::Rig => self.save(ctx, s.path.clone(), state),
                _ => self.ask = Some(Ask::save(self.source.as_ref())),
            },
            Task::SaveAs => self.ask = Some(Ask::save(self.source.as_ref())),
            Task::Export => self.ask = Some(Ask::export(self.source.as_ref(), state, false)),
            Task::Still => self.ask = Some(Ask::export(self.source.as_ref(), state, true)),
            Task::BakeXzx | Task::BakeQuaternions => self.bake(ctx, task, state),
            Task::Quit => self.leave(ctx, Then::Quit, state),
            _ => bus.tell(format!("{task:?} is nothing that files do")),
        }
    }

    /// Open a file now; unsaved changes have been asked about.
    pub fn open(&mut self, ctx: &egui::Context, path: &Path, at: Option<f64>) {
        let (name, path) = (format!("Reading {}", path.display()), path.to_owned());
        self.start(ctx, name, move |_| match open::read(&path) {
            Ok(opened) => Outcome::Opened(Box::new(opened), at),
            Err(why) => Outcome::Failed(why),
        });
    }

    /// Save to a file: a rig's poses into their place, anything else as a rig.
    pub fn save(&mut self, ctx: &egui::Context, to: PathBuf, state: &State) {
        let (document, source, timeline) = (state.document.clone(), self.source.clone(), state.timeline());
        self.start(ctx, format!("Writing {}", to.display()), move |_| {
            match save::save(&to, source.as_ref(), &document.asset, &document.to_clips(), &timeline) {
                Ok(notes) => Outcome::Saved(to, document, notes),
                Err(why) => Outcome::Failed(why),
            }
        });
    }

    /// Write a glTF file with the document's clips.
    pub fn export_gltf(&mut self, ctx: &egui::Context, to: PathBuf, state: &State) {
        let (document, source) = (state.document.clone(), self.source.clone());
        self.start(ctx, format!("Writing {}", to.display()), move |_| {
            match save::gltf(&to, source.as_ref(), &document.asset, &document.to_clips()) {
                Ok(notes) => Outcome::Done(with_notes(format!("wrote {}", to.display()), &notes)),
                Err(why) => Outcome::Failed(why),
            }
        });
    }

    /// Draw the clip into files.
    pub fn export_film(&mut self, ctx: &egui::Context, wish: film::Wish, state: &State) {
        let document = state.document.clone();
        self.start(ctx, format!("Drawing {}", wish.to.display()), move |control| {
            match film::write(&wish, &document.asset, document.to_clips(), control) {
                Ok(done) => Outcome::Done(done),
                Err(Some(why)) => Outcome::Failed(why),
                Err(None) => Outcome::Cancelled,
            }
        });
    }

    /// All rotations of one kind, with the error that was measured.
    fn bake(&mut self, ctx: &egui::Context, task: Task, state: &State) {
        let document = state.document.clone();
        let (name, into) = match task {
            Task::BakeXzx => ("Bake to angles", true),
            _ => ("Bake to quaternions", false),
        };
        self.start(ctx, name.into(), move |control| {
            let character = &document.asset.character;
            let desc = BakeDesc { goal: Goal::Keys, ..save::desc(character) };
            let (mut clips, mut worst, mut keys) = (vec![], 0.0_f64, [0, 0]);
            let all = document.to_clips();
            for (i, clip) in all.iter().enumerate() {
                if !control.goes_on(i as f32 / all.len() as f32) {
                    return Outcome::Cancelled;
                }
                let baked = if into {
                    xzx::to_xzx(character, clip, &desc)
                } else {
                    xzx::to_quat(character, clip, &desc)
                };
                match baked {
                    Ok(baked) => {
                        worst = worst.max(baked.report.worst.distance);
                        keys = [0, 1].map(|k| keys[k] + baked.report.keys[k]);
                        clips.push(baked.clip);
                    }
                    Err(e) => return Outcome::Failed(format!("clip `{}`: {e}", clip.name)),
                }
            }
            let [before, after] = keys;
            let text = format!(
                "{name}: nothing moved by more than {:.3} mm; {before} keys became {after}",
                1e3 * worst
            );
            Outcome::Clips(name, clips, text)
        });
    }

    fn start(
        &mut self,
        ctx: &egui::Context,
        name: String,
        work: impl FnOnce(&Control) -> Outcome + Send + 'static,
    ) {
        let (progress, cancel) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicBool::new(false)));
        let control = Control { progress: progress.clone(), cancel: cancel.clone(), ctx: ctx.clone() };
        let (send, result) = channel();
        std::thread::spawn(move || {
            let outcome = work(&control);
            // Nobody waits for what was given up.
            let _ = send.send(outcome);
            control.ctx.request_repaint();
        });
        self.running = Some(Running { name, result, progress, cancel });
    }

    /// A file dialog of the system, on a thread since it may hang or find no portal.
    fn browse(&mut self, ctx: &egui::Context, save: bool) {
        let (send, result) = channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            let dialog = rfd::FileDialog::new();
            let _ = send.send(Outcome::Chosen(if save { dialog.save_file() } else { dialog.pick_file() }));
            ctx.request_repaint();
        });
        self.browsing = Some(result);
    }

    /// Go on to what loses the document, once unsaved changes have been asked about.
    fn leave(&mut self, ctx: &egui::Context, then: Then, state: &State) {
        if state.unsaved() {
            self.ask = Some(Ask::Unsaved(then));
        } else {
            self.go(ctx, then);
        }
    }

    fn go(&mut self, ctx: &egui::Context, then: Then) {
        match then {
            Then::Quit => {
                self.leaving = true;
                self.forget_backup();
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
            Then::Open(path) => self.open(ctx, &path, None),
        }
    }

    fn forget_backup(&self) {
        if let Some(folder) = &self.backups {
            let _ = std::fs::remove_file(recover::own(folder));
        }
    }

    /// Take what finished; called at the start of each frame.
    pub fn poll(&mut self, ctx: &egui::Context, state: &mut State, bus: &mut Bus) {
        let finished = |r: &Receiver<Outcome>| match r.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Outcome::Failed("it stopped in the middle: a fault of this program".into()))
            }
        };
        if let Some(outcome) = self.running.as_ref().and_then(|r| finished(&r.result)) {
            let name = self.running.take().map(|r| r.name).unwrap_or_default();
            self.take(ctx, outcome, &name, state, bus);
        }
        if let Some(outcome) = self.browsing.as_ref().and_then(finished) {
            self.browsing = None;
            self.take(ctx, outcome, "The file dialog", state, bus);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_owned()));
        if let Some(path) = dropped {
            self.leave(ctx, Then::Open(path), state);
        }
        if ctx.input(|i| i.viewport().close_requested()) && !self.leaving && state.unsaved() {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.ask = Some(Ask::Unsaved(Then::Quit));
        }
        self.back_up(ctx, state);
    }

    fn take(&mut self, ctx: &egui::Context, outcome: Outcome, name: &str, state: &mut State, bus: &mut Bus) {
        match outcome {
            Outcome::Opened(opened, at) => {
                bus.tell(with_notes(format!("opened {}", opened.source.path.display()), &opened.notes));
                self.show(state, opened.state(), opened.source);
                at.into_iter().for_each(|t| bus.send(Command::SetTime(t)));
            }
            Outcome::Recovered(new, source, kept) => {
                self.show(state, *new, source);
                let _ = std::fs::remove_file(kept);
                bus.tell("recovered; save it to keep it");
            }
            Outcome::Saved(path, document, notes) => {
                if state.document.same_bits(&document) {
                    bus.send(Command::MarkSaved);
                    self.forget_backup();
                }
                self.remember(&path);
                self.source = Some(Source { path: path.clone(), kind: open::Kind::Rig });
                bus.tell(with_notes(format!("saved {}", path.display()), &notes));
                if let Some(then) = self.after_save.take() {
                    self.go(ctx, then);
                }
            }
            Outcome::Clips(name, clips, text) => {
                bus.send(Command::Do(Edit::ReplaceClips(name, clips)));
                bus.tell(text);
            }
            Outcome::Done(text) => bus.tell(text),
            Outcome::Chosen(path) => {
                if let (Some(path), Some(ask)) = (path, &mut self.ask) {
                    ask.choose(&path);
                }
            }
            Outcome::Failed(why) => {
                self.after_save = None;
                let file = name.split_once(' ').map_or("", |n| n.1);
                bus.tell(if why.contains(file) { why } else { format!("{name}: {why}") });
            }
            Outcome::Cancelled => bus.tell(format!("{name}: cancelled")),
        }
    }

    /// Another document in the same window.
    fn show(&mut self, state: &mut State, mut new: State, source: Source) {
        self.remember(&source.path);
        self.source = Some(source);
        (new.view, new.revision) = (state.view.clone(), state.revision + 1);
        (new.auto_key, new.snap) = (state.auto_key, state.snap);
        *state = new;
        self.backed.0 = state.revision;
    }

    fn remember(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT);
    }

    /// Keep unsaved work beside, now and then, if it changed.
    fn back_up(&mut self, ctx: &egui::Context, state: &State) {
        let (Some(folder), Some(source)) = (&self.backups, &self.source) else { return };
        let now = ctx.input(|i| i.time);
        if state.revision == self.backed.0 || state.in_gesture() {
            return;
        }
        if now - self.backed.1 < BACKUP {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(BACKUP));
            return;
        }
        self.backed = (state.revision, now);
        if state.unsaved() {
            let (folder, file, document) = (folder.clone(), source.path.clone(), state.document.clone());
            std::thread::spawn(move || recover::keep(&folder, &file, &document));
        }
    }
}

fn with_notes(text: String, notes: &[String]) -> String {
    match notes {
        [] => text,
        [one] => format!("{text}\n{one}"),
        [first, rest @ ..] => format!("{text}\n{first}\n… and {} more", rest.len()),
    }
}
