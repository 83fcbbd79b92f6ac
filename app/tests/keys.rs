//! Each gesture on keys, one at a time.

use super::person::{CTRL, Person};
use super::pip;
use egui::{Event, Key, Modifiers, PointerButton, Vec2, vec2};
use glam::Vec3;
use sinew::asset::Asset;
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::Target;
use sinew::mesh::{Mesh, MeshData, MorphTarget};
use sinew::skeleton::{BoneDesc, Skeleton};
use sinew_app::state::{Change, Command, Edit, State};

const NONE: Modifiers = Modifiers::NONE;

/// Pip with three keys on a shin and a thigh, at frames 0, 10 and 20, θ2 = 0.2, 0.4, 0.2 rad.
fn posed() -> Person {
    let mut s = State::open(pip());
    s.update(Command::Do(Edit::NewClip("test".into()))).unwrap();
    s.update(Command::SetAutoKey(true)).unwrap();
    for (frame, bend) in [(0.0, 0.2), (10.0, 0.4), (20.0, 0.2)] {
        s.update(Command::SetTime(s.time_of(frame))).unwrap();
        let bone = |name| s.document.skeleton().find(name).unwrap();
        let change = Change::Xzx(Vec3::new(0.0, bend, 0.0));
        let pose = vec![(bone("shin.L"), change), (bone("thigh.L"), change)];
        s.update(Command::Do(Edit::Pose(pose))).unwrap();
    }
    s.update(Command::SetAutoKey(false)).unwrap();
    s.update(Command::SelectKeys(Default::default(), sinew_app::state::Mode::Replace)).unwrap();
    s.update(Command::SetTime(0.0)).unwrap();
    let mut p = Person::at(s);
    p.menu("View", "Frame all");
    p
}

/// Points between two frames.
fn frame(p: &Person) -> f32 {
    (p.place("shin.L.θ key 10").center().x - p.place("shin.L.θ key 0").center().x) / 10.0
}

fn selected(p: &Person) -> usize {
    p.state().selection.key_count()
}

#[test]
fn clicks_choose_keys() {
    let mut p = posed();
    p.click("shin.L.θ key 10");
    assert_eq!(selected(&p), 1);
    let other = p.place("thigh.L.θ key 20").center();
    p.press(other, PointerButton::Primary, Modifiers::SHIFT);
    assert_eq!(selected(&p), 2);
    p.press(other, PointerButton::Primary, Modifiers::SHIFT);
    assert_eq!(selected(&p), 1);
    p.key(NONE, Key::A);
    assert_eq!(selected(&p), 6);
    p.click("shin.L.θ key 10");
    assert_eq!(selected(&p), 1, "a click on one of many chooses it alone");
    p.key(NONE, Key::A);
    p.key(Modifiers::ALT, Key::A);
    assert_eq!(selected(&p), 0);
    p.click("Summary key 10");
    assert_eq!(selected(&p), 2, "a column of the summary is a pose");
    assert!(p.state().undo_name() == Some("Pose"), "choosing is no step of undo");
}

/// What a touchpad sends: the button is down and up before the next frame.
#[test]
fn taps_choose_keys_and_move_the_playhead() {
    let mut p = posed();
    let tap = |p: &mut Person, pos: egui::Pos2| {
        p.hover(pos);
        for pressed in [true, false] {
            let (button, modifiers) = (PointerButton::Primary, NONE);
            p.ui.event(Event::PointerButton { pos, button, pressed, modifiers });
        }
        p.ui.run_steps(3);
    };
    let at = p.place("shin.L.θ key 10").center();
    tap(&mut p, at);
    assert!(selected(&p) == 1 && !p.state().in_gesture());
    p.hover(at + vec2(30.0, 0.0));
    assert_eq!(p.times("shin.L"), [0.0, 10.0, 20.0], "nothing is held");
    let ruler = p.place("Dope sheet ruler");
    tap(&mut p, egui::pos2(at.x, ruler.bottom() - 3.0));
    assert_eq!(p.state().frame_at(p.state().time), 10.0);
    tap(&mut p, at + vec2(0.0, 80.0));
    assert_eq!(selected(&p), 0);
    p.pick("shin.L");
    let curve = p.place("shin.L.θ2 key 10").center();
    tap(&mut p, curve);
    assert!(selected(&p) == 1 && !p.state().in_gesture());
}

#[test]
fn keys_go_come_twice_and_come_back() {
    let mut p = posed();
    let before = p.state().document.clone();
    p.click("shin.L.θ key 10");
    p.key(NONE, Key::X);
    assert_eq!(p.times("shin.L"), [0.0, 20.0]);
    assert_eq!(p.state().undo_name(), Some("Delete keys"));
    p.key(CTRL, Key::Z);
    assert!(p.state().document.same_bits(&before));

    // Copies follow the pointer until a click; Esc leaves nothing.
    let (at, step) = (p.place("shin.L.θ key 10").center(), frame(&p));
    p.click("shin.L.θ key 10");
    for end in [Key::Escape, Key::Enter] {
        p.hover(at);
        p.key(Modifiers::SHIFT, Key::D);
        p.hover(at + vec2(4.0 * step, 0.0));
        assert_eq!(p.times("shin.L"), [0.0, 10.0, 14.0, 20.0]);
        p.key(NONE, end);
        assert!(!p.state().in_gesture());
    }
    assert_eq!(p.times("shin.L"), [0.0, 10.0, 14.0, 20.0]);
    p.key(CTRL, Key::Z);
    assert!(p.state().document.same_bits(&before), "the cancelled copy left a step");

    // Copy and paste at the playhead, by the system's events.
    p.click("Summary key 10");
    p.ui.event(Event::Copy);
    p.ui.run_steps(2);
    p.type_into("Frame", "15");
    p.hover(at);
    p.ui.event(Event::Paste("sinew".into()));
    p.ui.run_steps(2);
    assert_eq!(
        (p.times("shin.L"), p.times("thigh.L")),
        (vec![0.0, 10.0, 15.0, 20.0], vec![0.0, 10.0, 15.0, 20.0])
    );
}

#[test]
fn a_column_moves_a_pose_and_g_moves_keys() {
    let mut p = posed();
    let (at, step) = (p.place("Summary key 10").center(), frame(&p));
    p.drag(at, at + vec2(3.2 * step, 0.0), true);
    assert_eq!((p.times("shin.L"), p.times("thigh.L")), (vec![0.0, 13.0, 20.0], vec![0.0, 13.0, 20.0]));
    p.key(NONE, Key::G);
    p.hover(at + vec2(5.2 * step, 0.0));
    p.key(NONE, Key::Enter);
    assert_eq!(p.times("shin.L"), [0.0, 15.0, 20.0]);
    assert_eq!(p.state().undo_name(), Some("Move keys"));
}

#[test]
fn the_graph_moves_values_alone_with_y() {
    let mut p = posed();
    p.pick("shin.L");
    let value = |p: &Person, k: usize| {
        let s = p.state();
        let track = s.track_of(&Target::Xzx(s.document.skeleton().find("shin.L").unwrap())).unwrap();
        s.active().tracks[track].curve.value(k).to_vec()
    };
    let at = p.place("shin.L.θ2 key 10").center();
    p.drag(at, at + vec2(40.0, -30.0), false);
    assert!(p.times("shin.L")[1] > 10.0);
    p.key(NONE, Key::Y);
    assert_eq!(p.times("shin.L"), [0.0, 10.0, 20.0], "value only");
    p.button(at + vec2(40.0, -30.0), PointerButton::Primary, false, NONE);
    let moved = value(&p, 1);
    assert!(moved[1] > 0.41 && moved[0] == 0.0 && moved[2] == 0.0, "{moved:?}: θ2 alone moves");
    assert_eq!(value(&p, 0), [0.0, 0.2, 0.0]);

    // A box takes what is in it, component by component.
    let all = p.place("Graph curves");
    p.drag(
        all.right_bottom() - Vec2::splat(3.0),
        p.place("shin.L.θ2 key 20").center() + vec2(-30.0, 12.0),
        true,
    );
    assert_eq!(selected(&p), 1);
}

#[test]
fn a_number_dragged_is_one_step_and_esc_gives_it_up() {
    let mut p = posed();
    p.pick("shin.L");
    p.key(NONE, Key::K);
    assert!(p.state().auto_key);
    p.type_into("Frame", "5");
    let before = p.state().document.clone();
    let at = p.place("shin.L θ2").center();
    p.drag(at, at + vec2(30.0, 0.0), false);
    assert_eq!(p.times("shin.L"), [0.0, 5.0, 10.0, 20.0], "keyed by itself");
    p.key(NONE, Key::Escape);
    p.button(at, PointerButton::Primary, false, NONE);
    assert!(p.state().document.same_bits(&before));
    p.drag(at, at + vec2(30.0, 0.0), true);
    assert_eq!(p.state().undo_name(), Some("Rotate bone"));
    p.key(CTRL, Key::Z);
    assert!(p.state().document.same_bits(&before), "one step takes it back");
}

#[test]
fn markers_keys_and_frames_are_stepped_through() {
    let mut p = posed();
    p.key(NONE, Key::ArrowUp);
    assert_eq!(p.state().frame_at(p.state().time), 10.0);
    p.key(NONE, Key::M);
    p.key(NONE, Key::ArrowRight);
    p.key(NONE, Key::ArrowRight);
    p.key(NONE, Key::ArrowLeft);
    assert!((p.state().frame_at(p.state().time) - 11.0).abs() < 1e-9);
    p.key(Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(p.state().time, p.state().playback.range.end);
    p.key(NONE, Key::Home);
    p.click("Dope sheet ruler: M1");
    assert_eq!(p.state().frame_at(p.state().time), 10.0);
    p.key(NONE, Key::ArrowDown);
    assert_eq!(p.state().time, 0.0);
}

/// A face with two shapes, `smile` and one that has no name.
pub fn face() -> State {
    let (skeleton, of) = Skeleton::new(vec![BoneDesc { length: 1.0, ..BoneDesc::new("head") }]).unwrap();
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let shape = |name: &str, by: Vec3| MorphTarget {
        name: name.into(),
        positions: vec![by; 3],
        ..MorphTarget::default()
    };
    let data = MeshData {
        name: "face".into(),
        positions: corners.into(),
        triangles: vec![[0, 1, 2]],
        targets: vec![shape("smile", Vec3::X), shape("", Vec3::Y)],
        ..MeshData::default()
    };
    let instance = Instance { mesh: MeshId(0), binding: Binding::Bone(of[0]), first_weight: 0 };
    let mesh = Mesh::new(data).unwrap();
    let character = Character::new(skeleton, vec![mesh], vec![instance], vec![0.0; 2], vec![]).unwrap();
    State::open(Asset { character, ..Asset::default() }.into())
}

#[test]
fn shapes_are_typed_dragged_keyed_and_taken_back() {
    let mut p = Person::at(face());
    let before = p.state().document.clone();
    let keys = |p: &Person| {
        let s = p.state();
        let track = s.track_of(&Target::Weights { first: 0 })?;
        Some((
            s.active().tracks[track].curve.times().to_vec(),
            s.active().tracks[track].curve.values().to_vec(),
        ))
    };
    p.type_into("shape w1", "0.5");
    assert_eq!((p.state().pose().weights.clone(), keys(&p)), (vec![0.0, 0.5], None));
    assert!(p.state().undo_name() == Some("Shape"));

    // Lost like a pose when the time changes; kept by a key.
    p.type_into("Frame", "24");
    assert_eq!(p.state().pose().weights, [0.0, 0.0]);
    p.type_into("shape w1", "0.5");
    p.hover(p.place("Dope sheet keys").center());
    p.key(NONE, Key::I);
    assert_eq!(keys(&p), Some((vec![1.0], vec![0.0, 0.5])));
    p.key(NONE, Key::K);
    p.type_into("Frame", "0");
    let at = p.place("shape smile").center();
    p.drag(at, at + vec2(25.0, 0.0), true);
    let (times, values) = keys(&p).unwrap();
    assert!(times == [0.0, 1.0] && values[0] > 0.1 && values[1] == 0.5, "{times:?} {values:?}");
    assert_eq!(p.state().undo_name(), Some("Shape"));
    while p.state().undo_name().is_some() {
        p.key(CTRL, Key::Z);
    }
    assert!(p.state().document.same_bits(&before) && p.state().loose_weights.is_empty());
}
