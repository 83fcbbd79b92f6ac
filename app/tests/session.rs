//! A real session without a window: pointers, keys and names, as a person would.

use super::files::{Folder, small, wait};
use super::person::{CTRL, CTRL_SHIFT, Person};
use super::pip;
use egui::{Event, Key, Modifiers, PointerButton, pos2};
use sinew::clip::Interpolation;
use sinew::io::picture::frames_of;
use sinew_app::jobs::open;
use sinew_app::state::State;

#[test]
fn from_the_first_bone_to_the_last_frame() {
    let mut p = Person::at(State::open(pip()));
    let start = p.state().document.clone();
    p.menu("Clip", "New clip");
    assert!(p.state().active().tracks.is_empty());
    p.click("Clip to edit");
    p.type_into("Name of this clip", "kneel");
    assert_eq!(p.state().active().name, "kneel");

    // Three poses of a knee and a hip, by typed numbers.
    for (frame, bend) in [("0", "10"), ("12", "70"), ("24", "10")] {
        p.type_into("Frame", frame);
        for bone in ["shin.L", "thigh.L"] {
            p.pick(bone);
            p.type_into(&format!("{bone} θ2"), bend);
            p.hover(p.place("Dope sheet keys").center());
            p.key(Modifiers::NONE, Key::I);
        }
    }
    assert_eq!(p.times("shin.L"), [0.0, 12.0, 24.0]);
    assert!(p.state().loose.is_empty());

    // Retime: the middle key by the pointer, three frames on.
    p.menu("View", "Frame all");
    let key = p.place("shin.L.θ key 12").center();
    let frame = p.place("shin.L.θ key 24").center().x - key.x;
    p.drag(key, key + egui::vec2(frame / 4.0, 0.0), true);
    assert_eq!(p.times("shin.L"), [0.0, 15.0, 24.0]);
    assert_eq!(p.times("thigh.L"), [0.0, 12.0, 24.0], "only what was taken moves");
    assert_eq!(p.state().undo_name(), Some("Move keys"));

    // A drag given up leaves no trace.
    let before = p.state().document.clone();
    let key = p.place("thigh.L.θ key 12").center();
    p.drag(key, key + egui::vec2(60.0, 0.0), false);
    assert!(!p.state().document.same_bits(&before));
    p.key(Modifiers::NONE, Key::Escape);
    p.button(key, PointerButton::Primary, false, Modifiers::NONE);
    assert!(p.state().document.same_bits(&before) && !p.state().in_gesture());

    // All keys by a box on empty ground, stretched to twice the time about frame 0.
    p.type_into("Frame", "0");
    let dope = p.place("Dope sheet keys");
    p.drag(
        pos2(dope.right() - 12.0, dope.bottom() - 12.0),
        pos2(dope.left() + 152.0, dope.top() + 50.0),
        true,
    );
    assert_eq!(p.state().selection.key_count(), 6);
    let at = p.place("thigh.L.θ key 12").center();
    p.hover(at);
    p.key(Modifiers::NONE, Key::S);
    let zero = p.place("thigh.L.θ key 0").center().x;
    p.hover(pos2(zero + 2.0 * (at.x - zero), at.y));
    p.press(pos2(zero + 2.0 * (at.x - zero), at.y), PointerButton::Primary, Modifiers::NONE);
    assert_eq!(p.times("thigh.L"), [0.0, 24.0, 48.0]);

    p.menu("Keys", "Catmull-Rom, monotone");
    let kinds = p.state().active().tracks.iter().map(|t| t.curve.interpolation());
    assert!(kinds.into_iter().all(|k| matches!(k, Interpolation::CatmullRom(_))));

    p.shot("session");
    p.menu("Clip", "Mirror clip");
    assert_eq!(p.times("shin.R"), [0.0, 30.0, 48.0]);

    // It plays, and stops.
    p.hover(dope.center());
    p.key(Modifiers::NONE, Key::Space);
    let t = p.state().time;
    p.ui.run_steps(20);
    assert!(p.state().playback.playing.is_some() && p.state().time > t);
    p.key(Modifiers::NONE, Key::Space);
    assert!(p.state().playback.playing.is_none());

    // All the way back, and forth.
    let end = p.state().document.clone();
    let mut steps = 0;
    while p.state().undo_name().is_some() {
        p.key(CTRL, Key::Z);
        steps += 1;
    }
    assert!(p.state().document.same_bits(&start));
    for _ in 0..steps {
        p.key(CTRL_SHIFT, Key::Z);
    }
    assert!(p.state().document.same_bits(&end));

    // Onto the disk and back, equal.
    let folder = Folder::new("session");
    let [rig, glb, gif] = ["pip.json", "pip.glb", "pip.gif"].map(|n| folder.0.join(n));
    let ctx = p.ui.ctx.clone();
    let app = p.ui.state_mut();
    app.jobs.save(&ctx, rig.clone(), &app.state);
    wait(&mut p);
    assert!(!p.state().unsaved());
    let again = open::read(&rig).expect("what was written").state();
    assert_eq!(again.document.to_clips(), p.state().document.to_clips());

    // And out, to whoever plays it.
    let clip = p.state().clip;
    let app = p.ui.state_mut();
    app.jobs.export_gltf(&ctx, glb.clone(), &app.state);
    wait(&mut p);
    let wish = small(gif.clone(), p.state());
    let app = p.ui.state_mut();
    app.jobs.export_film(&ctx, wish, &app.state);
    wait(&mut p);
    let import = sinew::io::import(&glb, &sinew::io::Options::default()).expect("a GLB");
    let played = import.asset.character.clips()[clip].range();
    assert!((played.end - 2.0).abs() < 1e-6, "{played:?}");
    let frames = frames_of(&std::fs::read(&gif).expect("a film")).expect("a GIF").count();
    assert_eq!(frames, 12);
}

#[test]
fn pictures_of_every_pane() {
    let mut p = Person::at(State::open(pip()));
    p.shot("opened");
    p.pick("shin.L");
    p.type_into("Frame", "9");
    p.menu("View", "Frame all");
    p.shot("bone");
    p.click("Help on Graph");
    p.shot("help");
    p.key(Modifiers::NONE, Key::Escape);
    p.click("Keys");
    p.shot("menu");
    p.key(Modifiers::NONE, Key::Escape);
    p.key(Modifiers::NONE, Key::T);
    p.shot("palette");
}

#[test]
fn nobody_who_types_sets_off_a_command() {
    let mut p = Person::at(State::open(pip()));
    p.click("Filter of the bones");
    for (key, text) in [(Key::I, "i"), (Key::X, "x"), (Key::Space, " "), (Key::M, "m")] {
        p.ui.event(Event::Text(text.into()));
        p.key(Modifiers::NONE, key);
    }
    let s = p.state();
    assert!(s.undo_name().is_none() && s.playback.playing.is_none() && s.active().markers.is_empty());
}

#[test]
fn the_ruler_scrubs_the_wheel_zooms_and_the_playhead_stays_in_view() {
    let mut p = Person::at(State::open(pip()));
    let ruler = p.place("Dope sheet ruler");
    p.drag(ruler.left_center(), ruler.center(), true);
    let (s, middle) = (p.state(), ruler.center());
    let t = s.view.time_start + f64::from(ruler.width() / 2.0) * s.view.time_scale;
    assert!((s.time - t).abs() <= 0.51 * s.frame_seconds(), "{} {t}", s.time);

    // What is under the pointer stays there.
    let scale = s.view.time_scale;
    p.hover(middle + egui::vec2(0.0, 60.0));
    let unit = egui::MouseWheelUnit::Point;
    let wheel = Event::MouseWheel {
        unit,
        delta: egui::vec2(0.0, 120.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    };
    p.ui.event(wheel);
    p.ui.run_steps(30);
    let s = p.state();
    assert!(s.view.time_scale < 0.9 * scale);
    let now = s.view.time_start + f64::from(ruler.width() / 2.0) * s.view.time_scale;
    assert!((now - t).abs() < 1e-3, "{now} {t}");

    // Stepping past the edge turns the page.
    for _ in 0..200 {
        p.key(Modifiers::NONE, Key::ArrowRight);
    }
    let s = p.state();
    let end = s.view.time_start + f64::from(ruler.width()) * s.view.time_scale;
    assert!((s.view.time_start..=end).contains(&s.time));
}

#[test]
fn every_action_can_be_found_and_nothing_panics() {
    let mut p = Person::at(State::open(pip()));
    p.pick("shin.L");
    for action in sinew_app::commands::ACTIONS.iter().filter(|a| a.menu != "File") {
        p.key(CTRL, Key::P);
        assert!(p.has("Search for a command"), "{}", action.name);
        p.ui.event(Event::Text(action.name.into()));
        p.ui.run_steps(3);
        p.key(Modifiers::NONE, Key::Enter);
        p.ui.run_steps(3);
        p.key(Modifiers::NONE, Key::Escape);
    }
    assert!(!p.has("Search for a command"));
}

#[test]
fn an_idle_editor_asks_for_no_frame() {
    let mut p = Person::at(State::open(pip()));
    p.ui.run_steps(10);
    let out = p.ui.output();
    let wait = out.viewport_output.values().map(|v| v.repaint_delay).min().expect("a window");
    assert!(wait > std::time::Duration::from_secs(3600), "{wait:?}");
}
