//! The editor's state as plain data: what is edited, what is selected, where the playhead stands; and `update`, the one way
//! to change it.

pub mod document;
mod edit;
mod keys;
pub mod playback;
mod posing;
pub mod selection;

pub use document::{Document, EditClip};
pub use edit::{Change, Edit, Mirror, Refused};
pub use playback::{LoopMode, Playback};
pub use posing::Loose;
pub use selection::{Keys, Mode, Selection, Spans, TrackKeys};

use sinew::asset::Asset;
use sinew::clip::Track;
use sinew::pose::Pose;
use sinew::skeleton::BoneId;
use sinew::time::Timeline;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What the viewport spends on a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Quality {
    /// Half the pixels each way, no smoothing of edges.
    Draft,
    /// Every pixel, smoothed edges when nothing moves.
    #[default]
    Normal,
    /// Every pixel, smoothed edges at every moment.
    Exact,
}

/// How bones are drawn over the character.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum BoneStyle {
    /// Not at all.
    Hidden,
    /// Lines.
    Sticks,
    /// Notes §7.1.
    #[default]
    Pyramids,
    /// Pyramids, through a faint character.
    XRay,
}

/// What is shown and how; not part of the document, kept between runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct View {
    /// Cost of the viewport.
    pub quality: Quality,
    /// Bones over the character.
    pub bones: BoneStyle,
    /// Ghosts of other moments.
    pub onion: bool,
    /// Paths of the selected bones, keys in bold.
    pub paths: bool,
    /// Seconds at the left edge of the time panes.
    pub time_start: f64,
    /// Seconds a point of the time panes.
    pub time_scale: f64,
    /// The dope sheet and the graph show tracks of selected bones only.
    pub only_selected: bool,
    /// Each curve of the graph fills its height.
    pub normalise: bool,
}

impl Default for View {
    fn default() -> Self {
        Self {
            quality: Quality::default(),
            bones: BoneStyle::default(),
            onion: false,
            paths: false,
            time_start: -0.1,
            time_scale: 0.004,
            only_selected: false,
            normalise: false,
        }
    }
}

/// What copying put aside.
#[derive(Clone, Debug, Default)]
pub struct Clipboard {
    /// Tracks of the copied keys alone, and the time of the first.
    pub keys: Vec<Track>,
    /// Bones' poses.
    pub pose: Vec<(BoneId, Change)>,
}

/// Everything that a command can change.
#[derive(Clone, Debug)]
pub struct State {
    /// What is edited.
    pub document: Document,
    /// The clip being edited.
    pub clip: usize,
    /// What commands act upon.
    pub selection: Arc<Selection>,
    /// The playhead, seconds.
    pub time: f64,
    /// Whether and how it runs.
    pub playback: Playback,
    /// What is shown.
    pub view: View,
    /// A changed pose becomes keys at once.
    pub auto_key: bool,
    /// Times of moved and inserted keys are whole frames.
    pub snap: bool,
    /// What was copied.
    pub clipboard: Clipboard,
    /// Posed and not keyed; lost when the time changes.
    pub loose: BTreeMap<BoneId, Loose>,
    /// Weights of shapes that are set and not keyed, by their place in a pose.
    pub loose_weights: BTreeMap<usize, f32>,
    /// Grows with every change of the document, the pose or the selection.
    pub revision: u64,
    undo: Vec<Step>,
    redo: Vec<Step>,
    gesture: Option<Step>,
    saved: Document,
}

/// What undo returns to.
#[derive(Clone, Debug)]
struct Step {
    name: String,
    document: Document,
    clip: usize,
    selection: Arc<Selection>,
    loose: BTreeMap<BoneId, Loose>,
    loose_weights: BTreeMap<usize, f32>,
}

/// Everything that can be asked of the state.
#[derive(Clone, Debug)]
pub enum Command {
    /// An edit, one step of undo.
    Do(Edit),
    /// A drag begins; its name is that of the step.
    Begin(&'static str),
    /// The drag so far: an edit of what was there when it began, in place of the last one.
    Preview(Edit),
    /// The drag ends: one step, or none where nothing changed.
    Commit,
    /// The drag never was.
    Cancel,
    /// A step back.
    Undo,
    /// A step forward.
    Redo,
    /// Move the playhead, seconds.
    SetTime(f64),
    /// Play on by so many real seconds.
    Tick(f64),
    /// Start or stop.
    Play(bool),
    /// How it is played.
    SetPlayback(Playback),
    /// Choose bones.
    SelectBones(Vec<BoneId>, Mode),
    /// Choose keys.
    SelectKeys(Keys, Mode),
    /// Edit another clip.
    SelectClip(usize),
    /// What is shown.
    SetView(View),
    /// A changed pose becomes keys at once, or not.
    SetAutoKey(bool),
    /// Times snap to frames, or not.
    SetSnap(bool),
    /// Put the selected keys aside.
    CopyKeys,
    /// Put the pose of the selected bones (all where none is) aside.
    CopyPose,
    /// What is there now is on disk.
    MarkSaved,
}

impl State {
    /// An asset, opened.
    pub fn open(asset: Arc<Asset>) -> Self {
        Self::with_document(Document::new(asset))
    }

    /// A document, opened; a recovered one as well.
    pub fn with_document(document: Document) -> Self {
        let playback = Playback { range: document.clips[0].range, ..Playback::default() };
        let mut state = Self {
            saved: document.clone(),
            document,
            clip: 0,
            selection: Arc::default(),
            time: 0.0,
            playback,
            view: View::default(),
            auto_key: false,
            snap: true,
            clipboard: Clipboard::default(),
            loose: BTreeMap::new(),
            loose_weights: BTreeMap::new(),
            revision: 0,
            undo: Vec::new(),
            redo: Vec::new(),
            gesture: None,
        };
        state.time = state.playback.range.start;
        state
    }

    /// What a file keeps beside the keys, with what is previewed now.
    pub fn timeline(&self) -> Timeline {
        let mut timeline = self.document.timeline();
        timeline.clips[self.clip].preview = Some(self.playback.range).filter(|r| *r != self.active().range);
        timeline
    }

    /// Take what a file kept beside the keys; the clip that was previewed is shown.
    pub fn set_timeline(&mut self, timeline: &Timeline) {
        self.document.set_timeline(timeline);
        let count = self.document.clips.len();
        self.clip = timeline.clips.iter().take(count).position(|c| c.preview.is_some()).unwrap_or(self.clip);
        let preview = timeline.clips.get(self.clip).and_then(|c| c.preview);
        self.playback.range = preview.unwrap_or(self.active().range);
        self.time = self.playback.range.start;
    }

    /// Do what is asked.
    ///
    /// # Errors
    /// [`Refused`] says why nothing happened; the state is then as it was.
    pub fn update(&mut self, command: Command) -> Result<(), Refused> {
        let time = self.time;
        let result = self.dispatch(command);
        if time.to_bits() != self.time.to_bits() && self.gesture.is_none() {
            self.loosen_none();
        }
        self.revision += 1;
        result
    }

    fn dispatch(&mut self, command: Command) -> Result<(), Refused> {
        match command {
            Command::Do(edit) => {
                self.commit();
                let before = self.step(edit.name());
                edit.apply(self).inspect_err(|_| self.restore(before.clone()))?;
                self.push_step(before);
            }
            Command::Begin(name) => {
                self.commit();
                self.gesture = Some(self.step(name));
            }
            Command::Preview(edit) => {
                let before = self.gesture.clone().ok_or(Refused::NoGesture)?;
                self.restore(before.clone());
                edit.apply(self).inspect_err(|_| self.restore(before))?;
            }
            Command::Commit => self.commit(),
            Command::Cancel => {
                if let Some(before) = self.gesture.take() {
                    self.restore(before);
                }
            }
            Command::Undo => self.undo()?,
            Command::Redo => self.redo()?,
            Command::SetTime(t) => self.set_time(t),
            Command::Tick(dt) => self.tick(dt),
            Command::Play(on) => self.play(on),
            Command::SetPlayback(p) => {
                self.playback = Playback { playing: self.playback.playing, ..p.checked() }
            }
            Command::SelectBones(bones, mode) => {
                let count = self.document.skeleton().len();
                let bones: Vec<_> = bones.into_iter().filter(|b| b.index() < count).collect();
                self.selected().choose_bones(&bones, mode);
            }
            Command::SelectKeys(keys, mode) => {
                self.selected().choose_keys(keys, mode);
                self.trim_selection();
            }
            Command::SelectClip(clip) => self.select_clip(clip)?,
            Command::SetView(view) => self.view = view,
            Command::SetAutoKey(on) => self.auto_key = on,
            Command::SetSnap(on) => self.snap = on,
            Command::CopyKeys => self.copy_keys()?,
            Command::CopyPose => self.clipboard.pose = self.pose_of(&self.chosen_bones()),
            Command::MarkSaved => self.saved = self.document.clone(),
        }
        Ok(())
    }

    /// The clip being edited.
    pub fn active(&self) -> &EditClip {
        &self.document.clips[self.clip]
    }

    /// To be changed: shared tracks stay shared.
    fn active_mut(&mut self) -> &mut EditClip {
        Arc::make_mut(&mut self.document.clips[self.clip])
    }

    /// To be changed: the steps of undo share it.
    fn selected(&mut self) -> &mut Selection {
        Arc::make_mut(&mut self.selection)
    }

    /// What the next undo takes back.
    pub fn undo_name(&self) -> Option<&str> {
        self.undo.last().map(|s| s.name.as_str())
    }

    /// What the next redo does again.
    pub fn redo_name(&self) -> Option<&str> {
        self.redo.last().map(|s| s.name.as_str())
    }

    /// A drag is under way.
    pub fn in_gesture(&self) -> bool {
        self.gesture.is_some()
    }

    /// The document is not as it was opened or saved.
    pub fn unsaved(&self) -> bool {
        !self.document.same_bits(&self.saved)
    }

    /// The pose at the playhead, with what is posed and not keyed.
    pub fn pose(&self) -> Pose {
        let mut pose = self.pose_at(self.time);
        for (bone, loose) in &self.loose {
            pose.locals[bone.index()] = loose.local;
        }
        for (&i, &weight) in &self.loose_weights {
            pose.weights[i] = weight;
        }
        pose
    }

    /// The pose of the active clip at `t`.
    pub fn pose_at(&self, t: f64) -> Pose {
        let mut pose = self.document.asset.character.rest_pose();
        self.active().sample(self.document.skeleton(), t, &mut pose);
        pose
    }

    /// Selected bones; all where none is.
    pub fn chosen_bones(&self) -> Vec<BoneId> {
        if self.selection.bones.is_empty() {
            return self.document.skeleton().ids().collect();
        }
        self.selection.bones.clone()
    }

    fn select_clip(&mut self, clip: usize) -> Result<(), Refused> {
        if clip >= self.document.clips.len() {
            return Err(Refused::NoClip(clip));
        }
        self.commit();
        self.clip = clip;
        self.selected().keys.clear();
        self.loosen_none();
        self.playback.range = self.active().range;
        self.time = self.time.clamp(self.playback.range.start, self.playback.range.end);
        Ok(())
    }

    fn step(&self, name: &str) -> Step {
        Step {
            name: name.into(),
            document: self.document.clone(),
            clip: self.clip,
            selection: self.selection.clone(),
            loose: self.loose.clone(),
            loose_weights: self.loose_weights.clone(),
        }
    }

    fn restore(&mut self, step: Step) {
        let range = self.active().range;
        self.document = step.document;
        self.clip = step.clip;
        self.selection = step.selection;
        (self.loose, self.loose_weights) = (step.loose, step.loose_weights);
        if self.active().range != range {
            self.playback.range = self.active().range;
        }
    }

    /// One step back to `before`, if anything is different now.
    fn push_step(&mut self, before: Step) {
        let posed = self.loose != before.loose || self.loose_weights != before.loose_weights;
        if posed || !self.document.same_bits(&before.document) {
            self.undo.push(before);
            self.redo.clear();
        }
    }

    fn commit(&mut self) {
        if let Some(before) = self.gesture.take() {
            self.push_step(before);
        }
    }

    fn undo(&mut self) -> Result<(), Refused> {
        self.commit();
        let step = self.undo.pop().ok_or(Refused::NothingToUndo)?;
        let now = self.step(&step.name);
        self.redo.push(now);
        self.restore(step);
        Ok(())
    }

    fn redo(&mut self) -> Result<(), Refused> {
        self.commit();
        let step = self.redo.pop().ok_or(Refused::NothingToRedo)?;
        let now = self.step(&step.name);
        self.undo.push(now);
        self.restore(step);
        Ok(())
    }

    /// Drop what the selection names and the clip no longer has.
    fn trim_selection(&mut self) {
        let clip = &self.document.clips[self.clip];
        Arc::make_mut(&mut self.selection).keys.retain(|&track, keys| {
            let count = clip.tracks.get(track as usize).map_or(0, |t| t.curve.times().len());
            keys.spans = keys.spans.below(count);
            !keys.spans.is_empty()
        });
    }
}
