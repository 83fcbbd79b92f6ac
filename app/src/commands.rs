//! Every action, named once: menus, shortcuts, the palette, context menus and tests take it from here.

use crate::state::{
    BoneStyle, Command, Edit, LoopMode, Mirror, Mode, Playback, Quality, Spans, State, TrackKeys, View,
};
use egui::{Key, KeyboardShortcut, Modifiers};
use sinew::clip::Interpolation;
use sinew::math::spline::Tangents;
use sinew::time::Marker;

/// What the window does, not the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Choose a file and open it.
    Open,
    /// Write the document where it came from.
    Save,
    /// Choose where to write it.
    SaveAs,
    /// Choose what to export.
    Export,
    /// A picture by rays, as the viewport stands.
    Still,
    /// Rotations as XZX angles.
    BakeXzx,
    /// Rotations as quaternions.
    BakeQuaternions,
    /// A search over every action.
    Palette,
    /// The ways that a track can run between its keys.
    Interpolation,
    /// Panes where they were at first.
    ResetLayout,
    /// All of the range in the time panes.
    FrameAll,
    /// The selection in the time panes.
    FrameSelection,
    /// Keys follow the pointer until a click.
    Grab,
    /// Keys are stretched by the pointer until a click.
    Stretch,
    /// Copies of keys follow the pointer until a click.
    Duplicate,
    /// What the pane under the pointer can do.
    Help,
    /// Close the window; unsaved changes are asked about.
    Quit,
}

/// What choosing an action does.
#[derive(Clone, Copy)]
pub enum Run {
    /// Commands, one after the other.
    State(fn(&State) -> Vec<Command>),
    /// For the window.
    Window(Task),
}

/// Where a shortcut counts: two actions may share one in different panes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Everywhere.
    Any,
    /// Over the dope sheet and the graph.
    Time,
    /// Over everything else.
    Body,
}

/// One thing that can be done.
pub struct Action {
    /// Menu it is in, and its name there.
    pub menu: &'static str,
    /// The name; unique.
    pub name: &'static str,
    /// One sentence for whoever hovers.
    pub help: &'static str,
    /// Key and modifiers.
    pub shortcut: Option<KeyboardShortcut>,
    /// Where the shortcut counts.
    pub scope: Scope,
    /// Whether it can be done now.
    pub enabled: fn(&State) -> bool,
    /// What it does.
    pub run: Run,
}

const fn key(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::NONE, key))
}

const fn with(modifiers: Modifiers, key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(modifiers, key))
}

const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

fn always(_: &State) -> bool {
    true
}

fn has_keys(s: &State) -> bool {
    !s.selection.keys.is_empty()
}

fn has_bones(s: &State) -> bool {
    !s.selection.bones.is_empty()
}

const fn act(
    menu: &'static str,
    name: &'static str,
    help: &'static str,
    shortcut: Option<KeyboardShortcut>,
    scope: Scope,
    enabled: fn(&State) -> bool,
    run: Run,
) -> Action {
    Action { menu, name, help, shortcut, scope, enabled, run }
}

fn playback(s: &State, change: impl FnOnce(&mut Playback)) -> Vec<Command> {
    let mut p = s.playback;
    change(&mut p);
    vec![Command::SetPlayback(p)]
}

fn view(s: &State, change: impl FnOnce(&mut View)) -> Vec<Command> {
    let mut v = s.view.clone();
    change(&mut v);
    vec![Command::SetView(v)]
}

fn edit(edit: Edit) -> Vec<Command> {
    vec![Command::Do(edit)]
}

fn all_keys(s: &State) -> Vec<Command> {
    let of = |t: &std::sync::Arc<sinew::clip::Track>| TrackKeys {
        spans: Spans::one(0..t.curve.times().len()),
        mask: u8::MAX,
    };
    let keys = (0..).zip(s.active().tracks.iter().map(of)).collect();
    vec![Command::SelectKeys(keys, Mode::Replace)]
}

fn interpolate(to: Interpolation) -> Vec<Command> {
    edit(Edit::SetInterpolation(to))
}

/// Next to the playhead: a key in a direction, or nothing. A look at every track, so it is not asked whether there is one until somebody does.
fn to_key(s: &State, forward: bool) -> Vec<Command> {
    s.neighbour_key(forward).map(Command::SetTime).into_iter().collect()
}

use Run::{State as Do, Window};
use Scope::{Any, Body, Time};

/// All of them, in the order of the menus.
#[rustfmt::skip]
pub static ACTIONS: &[Action] = &[
    act("File", "Open…", "Open a rig, a glTF, a capture or a scene", with(CTRL, Key::O), Any, always, Window(Task::Open)),
    act("File", "Save", "Write the rig and its poses", with(CTRL, Key::S), Any, always, Window(Task::Save)),
    act("File", "Save as…", "Write the rig and its poses elsewhere", with(CTRL_SHIFT, Key::S), Any, always, Window(Task::SaveAs)),
    act("File", "Export…", "GLB, frames, GIF or a sheet", with(CTRL, Key::E), Any, always, Window(Task::Export)),
    act("File", "Ray-traced still…", "What the viewport shows, by rays", None, Any, always, Window(Task::Still)),
    act("File", "Quit", "Close the window", with(CTRL, Key::Q), Any, always, Window(Task::Quit)),
    act("Edit", "Undo", "Take the last step back", with(CTRL, Key::Z), Any, |s| s.undo_name().is_some(), Do(|_| vec![Command::Undo])),
    act("Edit", "Redo", "Do the step again", with(CTRL_SHIFT, Key::Z), Any, |s| s.redo_name().is_some(), Do(|_| vec![Command::Redo])),
    act("Edit", "All commands…", "Search for a command by name", with(CTRL, Key::P), Any, always, Window(Task::Palette)),
    act("Keys", "Insert keys", "Key the selected bones at the playhead; all that is keyed where none is selected", key(Key::I), Any, always, Do(|_| edit(Edit::InsertKeys))),
    act("Keys", "Delete keys", "Remove the selected keys", key(Key::X), Time, has_keys, Do(|_| edit(Edit::DeleteKeys))),
    act("Keys", "Move keys", "The selected keys follow the pointer: click to place, Esc to leave", key(Key::G), Time, has_keys, Window(Task::Grab)),
    act("Keys", "Scale keys", "Stretch the selected keys about the playhead", key(Key::S), Time, has_keys, Window(Task::Stretch)),
    act("Keys", "Duplicate keys", "Copies of the selected keys follow the pointer", with(SHIFT, Key::D), Time, has_keys, Window(Task::Duplicate)),
    act("Keys", "Copy keys", "Put the selected keys aside", with(CTRL, Key::C), Time, has_keys, Do(|_| vec![Command::CopyKeys])),
    act("Keys", "Paste keys", "The keys put aside, the first at the playhead", with(CTRL, Key::V), Time, |s| !s.clipboard.keys.is_empty(), Do(|_| edit(Edit::PasteKeys))),
    act("Keys", "Select all keys", "Every key of the clip", key(Key::A), Time, always, Do(all_keys)),
    act("Keys", "Select no keys", "Forget the selected keys", with(ALT, Key::A), Time, has_keys, Do(|_| vec![Command::SelectKeys(Default::default(), Mode::Replace)])),
    act("Keys", "Hold", "Tracks of the selected keys hold each key (per track)", None, Time, always, Do(|_| interpolate(Interpolation::Hold))),
    act("Keys", "Linear", "Tracks of the selected keys run straight (per track)", None, Time, always, Do(|_| interpolate(Interpolation::Linear))),
    act("Keys", "Catmull-Rom", "Smooth through the keys, by the notes' slopes (per track)", None, Time, always, Do(|_| interpolate(Interpolation::CatmullRom(Tangents::Notes)))),
    act("Keys", "Catmull-Rom, three points", "Smooth, by the parabola through three keys (per track)", None, Time, always, Do(|_| interpolate(Interpolation::CatmullRom(Tangents::ThreePoint)))),
    act("Keys", "Catmull-Rom, monotone", "Smooth and never beyond the keys (per track)", None, Time, always, Do(|_| interpolate(Interpolation::CatmullRom(Tangents::Monotone)))),
    act("Keys", "Interpolation…", "Hold, linear or Catmull-Rom by one of three rules, for whole tracks with a selected key", key(Key::T), Any, always, Window(Task::Interpolation)),
    act("Keys", "Automatic keys", "A changed pose becomes keys at once", key(Key::K), Any, always, Do(|s| vec![Command::SetAutoKey(!s.auto_key)])),
    act("Keys", "Snap to frames", "Moved and inserted keys stand on whole frames", None, Any, always, Do(|s| vec![Command::SetSnap(!s.snap)])),
    act("Pose", "Reset rotations", "The selected bones as they are at rest", with(ALT, Key::R), Any, always, Do(|_| edit(Edit::ResetRotations))),
    act("Pose", "Copy pose", "Put the pose of the selected bones aside", with(CTRL, Key::C), Body, always, Do(|_| vec![Command::CopyPose])),
    act("Pose", "Paste pose", "The pose put aside, on the same bones", with(CTRL, Key::V), Body, |s| !s.clipboard.pose.is_empty(), Do(|_| edit(Edit::PastePose(Mirror::No)))),
    act("Pose", "Paste mirrored pose", "The pose put aside, left and right exchanged by bone names", with(CTRL_SHIFT, Key::V), Any, |s| !s.clipboard.pose.is_empty(), Do(|_| edit(Edit::PastePose(Mirror::ByName)))),
    act("Pose", "Select all bones", "Every bone", key(Key::A), Body, always, Do(|s| vec![Command::SelectBones(s.document.skeleton().ids().collect(), Mode::Replace)])),
    act("Pose", "Select no bones", "Forget the selected bones", with(ALT, Key::A), Body, has_bones, Do(|_| vec![Command::SelectBones(vec![], Mode::Replace)])),
    act("Time", "Play", "Start or stop", key(Key::Space), Any, always, Do(|s| vec![Command::Play(s.playback.playing.is_none())])),
    act("Time", "Next frame", "The playhead a frame on", key(Key::ArrowRight), Any, always, Do(|s| vec![Command::SetTime(s.time_of(s.frame_at(s.time + 1e-9).floor() + 1.0))])),
    act("Time", "Previous frame", "The playhead a frame back", key(Key::ArrowLeft), Any, always, Do(|s| vec![Command::SetTime(s.time_of(s.frame_at(s.time - 1e-9).ceil() - 1.0))])),
    act("Time", "To the end", "The last frame of the range", with(SHIFT, Key::ArrowRight), Any, always, Do(|s| vec![Command::SetTime(s.playback.range.end)])),
    act("Time", "To the start", "The first frame of the range", with(SHIFT, Key::ArrowLeft), Any, always, Do(|s| vec![Command::SetTime(s.playback.range.start)])),
    act("Time", "Next key", "The next key of the selected bones, or of all", key(Key::ArrowUp), Any, always, Do(|s| to_key(s, true))),
    act("Time", "Previous key", "The key before", key(Key::ArrowDown), Any, always, Do(|s| to_key(s, false))),
    act("Time", "Marker", "Name the moment at the playhead", key(Key::M), Any, always, Do(|s| edit(Edit::SetMarker(Marker { time: s.time, name: format!("M{}", s.active().markers.len() + 1) })))),
    act("Time", "Remove marker", "Forget the marker at the playhead", with(SHIFT, Key::M), Any, |s| s.active().markers.iter().any(|m| (m.time - s.time).abs() < 1e-6), Do(|s| edit(Edit::RemoveMarker(s.time)))),
    act("Time", "Preview from here", "What is played starts at the playhead", key(Key::OpenBracket), Any, always, Do(|s| playback(s, |p| p.range.start = s.time))),
    act("Time", "Preview to here", "What is played ends at the playhead", key(Key::CloseBracket), Any, always, Do(|s| playback(s, |p| p.range.end = s.time))),
    act("Time", "Preview all", "The whole clip is played", key(Key::Backslash), Any, always, Do(|s| playback(s, |p| p.range = s.active().range))),
    act("Time", "Loop", "At its end the clip starts again", None, Any, always, Do(|s| playback(s, |p| p.mode = LoopMode::Loop))),
    act("Time", "Once", "At its end the clip stops", None, Any, always, Do(|s| playback(s, |p| p.mode = LoopMode::Once))),
    act("Time", "Ping-pong", "At its end the clip turns around", None, Any, always, Do(|s| playback(s, |p| p.mode = LoopMode::PingPong))),
    act("Time", "Every frame", "Show every frame, however long each takes; else frames are dropped to keep time", None, Any, always, Do(|s| playback(s, |p| p.every_frame = !p.every_frame))),
    act("View", "Frame all", "The whole range in the time panes", key(Key::Home), Any, always, Window(Task::FrameAll)),
    act("View", "Frame selection", "The selected keys in the time panes", key(Key::Period), Any, always, Window(Task::FrameSelection)),
    act("View", "Only selected bones", "The time panes show tracks of selected bones", None, Any, always, Do(|s| view(s, |v| v.only_selected = !v.only_selected))),
    act("View", "Normalise curves", "Each curve of the graph fills its height", key(Key::N), Time, always, Do(|s| view(s, |v| v.normalise = !v.normalise))),
    act("View", "Onion skin", "Ghosts of the moments around", key(Key::O), Any, always, Do(|s| view(s, |v| v.onion = !v.onion))),
    act("View", "Motion paths", "Where the selected bones go, keys in bold", key(Key::P), Any, always, Do(|s| view(s, |v| v.paths = !v.paths))),
    act("View", "Next bone style", "Hidden, sticks, pyramids, x-ray", key(Key::B), Any, always, Do(|s| view(s, |v| v.bones = next_style(v.bones)))),
    act("View", "Draft quality", "Half the pixels each way", None, Any, always, Do(|s| view(s, |v| v.quality = Quality::Draft))),
    act("View", "Normal quality", "Every pixel; smooth edges at rest", None, Any, always, Do(|s| view(s, |v| v.quality = Quality::Normal))),
    act("View", "Exact quality", "Four samples a pixel, moving or not", None, Any, always, Do(|s| view(s, |v| v.quality = Quality::Exact))),
    act("View", "Reset layout", "Panes where they were at first", None, Any, always, Window(Task::ResetLayout)),
    act("Clip", "New clip", "An empty clip", None, Any, always, Do(|s| edit(Edit::NewClip(format!("clip {}", s.document.clips.len() + 1))))),
    act("Clip", "Mirror clip", "Left does what right did, by bone names", None, Any, |s| !s.active().tracks.is_empty(), Do(|_| edit(Edit::MirrorClip))),
    act("Clip", "Delete clip", "This clip", None, Any, |s| s.document.clips.len() > 1, Do(|_| edit(Edit::DeleteClip))),
    act("Clip", "Bake to angles", "All rotations as twist, bend, twist; the error is measured", None, Any, always, Window(Task::BakeXzx)),
    act("Clip", "Bake to quaternions", "All rotations as quaternions, as glTF has them", None, Any, always, Window(Task::BakeQuaternions)),
    act("Help", "What this pane does", "Gestures and keys of the pane under the pointer", with(SHIFT, Key::Questionmark), Any, always, Window(Task::Help)),
];

/// Other keys for the same.
pub static ALIASES: &[(KeyboardShortcut, &str)] = &[
    (KeyboardShortcut::new(Modifiers::NONE, Key::Delete), "Delete keys"),
    (KeyboardShortcut::new(Modifiers::NONE, Key::Questionmark), "What this pane does"),
    (KeyboardShortcut::new(CTRL, Key::Y), "Redo"),
];

/// The menus, in order.
pub static MENUS: &[&str] = &["File", "Edit", "Keys", "Pose", "Time", "View", "Clip", "Help"];

/// The action of that name.
///
/// # Panics
/// If there is none: names are written once, here.
pub fn named(name: &str) -> &'static Action {
    ACTIONS.iter().find(|a| a.name == name).unwrap_or_else(|| panic!("no action is called `{name}`"))
}

/// Whether what an action switches is on now.
pub fn is_on(action: &Action, s: &State) -> bool {
    match action.name {
        "Automatic keys" => s.auto_key,
        "Snap to frames" => s.snap,
        "Loop" => s.playback.mode == LoopMode::Loop,
        "Once" => s.playback.mode == LoopMode::Once,
        "Ping-pong" => s.playback.mode == LoopMode::PingPong,
        "Every frame" => s.playback.every_frame,
        "Only selected bones" => s.view.only_selected,
        "Normalise curves" => s.view.normalise,
        "Onion skin" => s.view.onion,
        "Motion paths" => s.view.paths,
        "Draft quality" => s.view.quality == Quality::Draft,
        "Normal quality" => s.view.quality == Quality::Normal,
        "Exact quality" => s.view.quality == Quality::Exact,
        _ => false,
    }
}

fn next_style(of: BoneStyle) -> BoneStyle {
    match of {
        BoneStyle::Hidden => BoneStyle::Sticks,
        BoneStyle::Sticks => BoneStyle::Pyramids,
        BoneStyle::Pyramids => BoneStyle::XRay,
        BoneStyle::XRay => BoneStyle::Hidden,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_shortcuts_mean_one_thing() {
        for (i, a) in ACTIONS.iter().enumerate() {
            assert!(MENUS.contains(&a.menu) && !a.help.is_empty(), "{}", a.name);
            for b in &ACTIONS[..i] {
                assert_ne!(a.name, b.name);
                let overlap = a.scope == b.scope || a.scope == Any || b.scope == Any;
                assert!(
                    a.shortcut.is_none() || a.shortcut != b.shortcut || !overlap,
                    "{} and {}",
                    a.name,
                    b.name
                );
            }
        }
        assert!(ALIASES.iter().all(|(_, name)| ACTIONS.iter().any(|a| a.name == *name)));
    }
}
