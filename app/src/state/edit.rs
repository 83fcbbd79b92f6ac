//! Edits: what changes the document. Each says what it is called, for the menu.

use super::{EditClip, State};
use glam::{Quat, Vec3};
use sinew::clip::{Clip, CurveError, Interpolation};
use sinew::skeleton::BoneId;
use sinew::time::{Marker, Range, Rate};
use std::sync::Arc;

/// One channel of a bone, absolute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// XZX angles about the bone's aim, radians.
    Xzx(Vec3),
    /// `parent_from_bone` rotation.
    Rotation(Quat),
    /// `parent_from_bone` translation, metres.
    Translation(Vec3),
    /// `parent_from_bone` scale.
    Scale(Vec3),
}

/// Whether a pose is pasted as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// As it was copied.
    No,
    /// Left and right exchanged, by names.
    ByName,
}

/// A change of the document.
#[derive(Clone, Debug)]
pub enum Edit {
    /// Keys of the chosen bones at the playhead, as they stand.
    InsertKeys,
    /// Remove the selected keys.
    DeleteKeys,
    /// Move the selected keys by seconds and, of the components selected, by value (radians, metres).
    MoveKeys {
        /// Seconds.
        seconds: f64,
        /// Value.
        value: f32,
    },
    /// Stretch the selected keys about a second.
    ScaleKeys {
        /// Factor; negative turns around.
        factor: f64,
        /// What stays, seconds.
        about: f64,
    },
    /// Copies of the selected keys, moved by seconds, which are selected next.
    DuplicateKeys {
        /// Seconds.
        seconds: f64,
    },
    /// The keys put aside, the first at the playhead.
    PasteKeys,
    /// How the tracks of the selected keys (or of the chosen bones) run between keys.
    SetInterpolation(Interpolation),
    /// Pose bones: keys at the playhead where keying is automatic, else loose.
    Pose(Vec<(BoneId, Change)>),
    /// The weight of a shape, by its place in a pose: a key where keying is automatic, else loose.
    Weight(usize, f32),
    /// The chosen bones' rotations at rest.
    ResetRotations,
    /// The pose put aside.
    PastePose(Mirror),
    /// Name the moment.
    SetMarker(Marker),
    /// Forget the marker at a second.
    RemoveMarker(f64),
    /// Frames a second; keys keep their seconds.
    SetRate(Rate),
    /// What the clip plays.
    SetRange(Range),
    /// An empty clip, to be edited next.
    NewClip(String),
    /// A clip's name.
    RenameClip(String),
    /// The clip, without the last.
    DeleteClip,
    /// Left does what right did, all through the clip.
    MirrorClip,
    /// All clips anew, for example baked; the edit is called by the name given.
    ReplaceClips(&'static str, Vec<Clip>),
}

/// Why nothing happened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// A command on keys.
    #[error("no keys are selected; click or box-select some in the dope sheet")]
    NoKeys,
    /// A paste.
    #[error("nothing was copied")]
    NothingCopied,
    /// Undo at the start.
    #[error("nothing to undo")]
    NothingToUndo,
    /// Redo at the end.
    #[error("nothing to redo")]
    NothingToRedo,
    /// A preview outside of a drag.
    #[error("no drag is under way")]
    NoGesture,
    /// A clip that does not exist.
    #[error("there is no clip {0}")]
    NoClip(usize),
    /// The last clip cannot go.
    #[error("a document has at least one clip")]
    LastClip,
    /// No marker there.
    #[error("there is no marker at {0:.3} s")]
    NoMarker(f64),
    /// A number that is not finite, a bone that is missing.
    #[error("{0}")]
    Bad(String),
    /// The library's word on keys.
    #[error(transparent)]
    Curve(#[from] CurveError),
}

impl Edit {
    /// What undo calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::InsertKeys => "Insert keys",
            Self::DeleteKeys => "Delete keys",
            Self::MoveKeys { .. } => "Move keys",
            Self::ScaleKeys { .. } => "Scale keys",
            Self::DuplicateKeys { .. } => "Duplicate keys",
            Self::PasteKeys => "Paste keys",
            Self::SetInterpolation(_) => "Interpolation",
            Self::Pose(_) => "Pose",
            Self::Weight(..) => "Shape",
            Self::ResetRotations => "Reset rotations",
            Self::PastePose(Mirror::No) => "Paste pose",
            Self::PastePose(Mirror::ByName) => "Paste mirrored pose",
            Self::SetMarker(_) => "Marker",
            Self::RemoveMarker(_) => "Remove marker",
            Self::SetRate(_) => "Frame rate",
            Self::SetRange(_) => "Range",
            Self::NewClip(_) => "New clip",
            Self::RenameClip(_) => "Rename clip",
            Self::DeleteClip => "Delete clip",
            Self::MirrorClip => "Mirror clip",
            Self::ReplaceClips(name, _) => name,
        }
    }

    /// Change the state; where it fails, the caller puts back what was there.
    pub(super) fn apply(self, state: &mut State) -> Result<(), Refused> {
        match self {
            Self::InsertKeys => state.insert_keys(),
            Self::DeleteKeys => state.delete_keys(),
            Self::MoveKeys { seconds, value } => state.move_keys(seconds, value),
            Self::ScaleKeys { factor, about } => state.scale_keys(factor, about),
            Self::DuplicateKeys { seconds } => state.duplicate_keys(seconds),
            Self::PasteKeys => state.paste_keys(),
            Self::SetInterpolation(to) => state.set_interpolation(to),
            Self::Pose(changes) => state.apply_pose(&changes),
            Self::Weight(i, weight) => state.set_weight(i, weight),
            Self::ResetRotations => state.reset_rotations(),
            Self::PastePose(mirror) => state.paste_pose(mirror),
            Self::SetMarker(marker) => state.set_marker(marker),
            Self::RemoveMarker(time) => state.remove_marker(time),
            Self::SetRate(rate) => {
                state.document.rate = rate;
                Ok(())
            }
            Self::SetRange(range) => state.set_range(range),
            Self::NewClip(name) => {
                state.document.clips.push(Arc::new(EditClip::empty(&name)));
                state.show_clip(state.document.clips.len() - 1);
                Ok(())
            }
            Self::RenameClip(name) => {
                state.active_mut().name = name;
                Ok(())
            }
            Self::DeleteClip if state.document.clips.len() == 1 => Err(Refused::LastClip),
            Self::DeleteClip => {
                state.document.clips.remove(state.clip);
                state.show_clip(state.clip.min(state.document.clips.len() - 1));
                Ok(())
            }
            Self::MirrorClip => {
                let character = &state.document.asset.character;
                let image = state.active().to_clip().mirrored(character.skeleton(), &character.mirror());
                state.active_mut().tracks = image.tracks.into_iter().map(Arc::new).collect();
                state.selected().keys.clear();
                Ok(())
            }
            Self::ReplaceClips(_, clips) => state.replace_clips(&clips),
        }
    }
}

impl State {
    fn show_clip(&mut self, clip: usize) {
        self.clip = clip;
        self.selected().keys.clear();
        self.loosen_none();
        self.playback.range = self.active().range;
    }

    fn set_marker(&mut self, marker: Marker) -> Result<(), Refused> {
        if !marker.time.is_finite() {
            return Err(Refused::Bad("a marker needs a finite time".into()));
        }
        let marker = Marker { time: marker.time.clamp(-86_400.0, 86_400.0), ..marker };
        let markers = &mut self.active_mut().markers;
        markers.retain(|m| (m.time - marker.time).abs() > 1e-6);
        let at = markers.partition_point(|m| m.time < marker.time);
        markers.insert(at, marker);
        Ok(())
    }

    fn remove_marker(&mut self, time: f64) -> Result<(), Refused> {
        let near = |m: &Marker| (m.time - time).abs() <= 1e-6;
        let at = self.active().markers.iter().position(near).ok_or(Refused::NoMarker(time))?;
        self.active_mut().markers.remove(at);
        Ok(())
    }

    fn set_range(&mut self, range: Range) -> Result<(), Refused> {
        if !(range.start.is_finite() && range.end.is_finite() && range.start <= range.end) {
            return Err(Refused::Bad("a range ends where it starts or later".into()));
        }
        self.active_mut().range = range;
        self.playback.range = range;
        Ok(())
    }

    fn replace_clips(&mut self, clips: &[Clip]) -> Result<(), Refused> {
        if clips.is_empty() {
            return Err(Refused::LastClip);
        }
        // A clip that the asset cannot play would break every pose after it.
        let character = sinew::character::Character::new(
            self.document.skeleton().clone(),
            Vec::new(),
            Vec::new(),
            self.document.asset.character.rest_pose().weights,
            clips.to_vec(),
        );
        character.map_err(|e| Refused::Bad(e.to_string()))?;
        let old = std::mem::take(&mut self.document.clips);
        self.document.clips = clips
            .iter()
            .enumerate()
            .map(|(i, c)| {
                let mut new = EditClip::from_clip(c);
                if let Some(o) = old.get(i) {
                    (new.range, new.markers) = (o.range, o.markers.clone());
                }
                Arc::new(new)
            })
            .collect();
        self.show_clip(self.clip.min(clips.len() - 1));
        Ok(())
    }
}
