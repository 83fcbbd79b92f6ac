//! The viewport by pointer: picking, rings, chains, and what is drawn.

use super::person::Person;
use super::pip;
use egui::{Key, Modifiers, Pos2, vec2};
use sinew::skeleton::BoneId;
use sinew_app::state::{BoneStyle, Command, Mode, Quality, State, View};

fn draft() -> State {
    let mut state = State::open(pip());
    state.view.quality = Quality::Draft;
    state
}

fn bone(person: &Person, name: &str) -> BoneId {
    person.state().document.skeleton().find(name).expect("a bone of the rig")
}

/// Where a bone's middle is on the screen.
fn middle(person: &Person, name: &str) -> Pos2 {
    let app = person.ui.state();
    let (state, pane) = (&app.state, person.place("Character"));
    let posed = state.document.asset.character.posed(&state.pose());
    let b = bone(person, name);
    let tip = state.document.skeleton().tip(b).as_dvec3() * 0.5;
    let at = posed.world_from_bone(b).transform_point3(tip);
    let lens = sinew_app::viewport::orbit::Lens {
        orbit: app.viewport.orbit,
        pane: [pane.left(), pane.top(), pane.width(), pane.height()],
    };
    lens.project(at).expect("in front of the eye").into()
}

fn choose(person: &mut Person, name: &str) {
    let b = bone(person, name);
    let app = person.ui.state_mut();
    app.state.update(Command::SelectBones(vec![b], Mode::Replace)).expect("a bone");
    person.ui.run();
}

fn view(person: &mut Person, change: impl FnOnce(&mut View)) {
    let app = person.ui.state_mut();
    let mut view = app.state.view.clone();
    change(&mut view);
    app.state.update(Command::SetView(view)).expect("always");
    person.ui.run();
}

#[test]
fn bones_are_picked_and_turned_by_rings_one_step_each() {
    let mut p = Person::at(draft());
    let at = middle(&p, "upper arm.L");
    p.press(at, egui::PointerButton::Primary, Modifiers::NONE);
    assert_eq!(p.state().selection.bones, [bone(&p, "upper arm.L")]);
    p.shot("picked");

    // The third ring is seen from its edge and followed along its line.
    let rings = [
        ("ring θ1", 0, vec2(25.0, 18.0)),
        ("ring θ2", 1, vec2(25.0, 18.0)),
        ("ring θ3", 2, vec2(-25.0, 28.0)),
    ];
    for (ring, k, by) in rings {
        let (before, document) = (p.state().theta(bone(&p, "upper arm.L")), p.state().document.clone());
        let from = p.place(&format!("upper arm.L {ring}")).center();
        p.drag(from, from + by, false);
        p.shot(&format!("ring{k}"));
        assert!(p.state().in_gesture());
        p.key(Modifiers::NONE, Key::Escape);
        assert_eq!(p.state().theta(bone(&p, "upper arm.L")), before, "Esc leaves no trace");
        p.button(from, egui::PointerButton::Primary, false, Modifiers::NONE);
        assert!(p.state().undo_name().is_none() && p.state().loose.is_empty());

        p.drag(from, from + by, true);
        let after = p.state().theta(bone(&p, "upper arm.L"));
        for c in 0..3 {
            assert_eq!((after[c] - before[c]).abs() > 0.02, c == k, "{ring}: {before} {after}");
        }
        p.key(Modifiers::COMMAND, Key::Z);
        assert!(p.state().document.same_bits(&document) && p.state().loose.is_empty());
        assert!(p.state().undo_name().is_none(), "one drag, one step");
    }
    let from = p.place("upper arm.L free ring").center();
    p.drag(from, from + vec2(-10.0, 40.0), true);
    assert_eq!(p.state().undo_name(), Some("Turn bone"));
}

#[test]
fn a_pulled_tip_takes_its_chain_along_and_roots_move() {
    let mut p = Person::at(draft());
    choose(&mut p, "hand.L");
    let from = p.place("hand.L tip").center();
    p.drag(from, from + vec2(40.0, -30.0), true);
    p.shot("pulled");
    let to = p.place("hand.L tip").center();
    assert!(to.distance(from + vec2(40.0, -30.0)) < 3.0, "the hand is below the pointer: {from} {to}");
    let moved: Vec<&str> = p.state().loose.keys().map(|b| p.state().document.skeleton().name(*b)).collect();
    assert_eq!(moved, ["upper arm.L", "forearm.L", "hand.L"]);
    assert_eq!(p.state().undo_name(), Some("Pull chain"));

    choose(&mut p, "root");
    let from = p.place("root move x").center();
    let before = p.state().pose().locals[0].translation;
    p.drag(from, from + vec2(40.0, 0.0), true);
    let moved = p.state().pose().locals[0].translation - before;
    assert!(moved.x > 0.01 && moved.y.abs() < 1e-5 && moved.z.abs() < 1e-5, "{moved}");
    p.shot("moved");
}

#[test]
fn overlays_are_drawn_and_nothing_is_drawn_twice() {
    let mut p = Person::at(State::open(pip()));
    choose(&mut p, "hand.R");
    let drawn = p.ui.state().viewport.pictures();
    p.ui.run_steps(5);
    view(&mut p, |v| v.time_scale *= 2.0);
    p.ui.state_mut().action("Select all keys");
    p.ui.run_steps(3);
    assert_eq!(p.ui.state().viewport.pictures(), drawn, "what it shows did not change");
    p.shot("pyramids");
    let mut last = p.picture();
    type Change = (&'static str, fn(&mut View));
    let changes: [Change; 6] = [
        ("sticks", |v| v.bones = BoneStyle::Sticks),
        ("xray", |v| v.bones = BoneStyle::XRay),
        ("hidden", |v| v.bones = BoneStyle::Hidden),
        ("paths", |v| v.paths = true),
        ("onion", |v| v.onion = true),
        ("draft", |v| v.quality = Quality::Draft),
    ];
    for (name, change) in changes {
        p.ui.state_mut().state.update(Command::SetTime(0.4)).expect("always");
        view(&mut p, change);
        p.shot(name);
        let now = p.picture();
        assert!(now != last, "{name} is seen");
        last = now;
    }
    // Ghosts and body stay as they are while bones change.
    let triangles = |p: &Person| p.ui.state().viewport.cost.triangles;
    let all = triangles(&p);
    view(&mut p, |v| v.bones = BoneStyle::Pyramids);
    assert!((1..all / 4).contains(&triangles(&p)), "{all} {}", triangles(&p));
    view(&mut p, |v| v.bones = BoneStyle::Hidden);

    // Where no bones are shown, the skin is picked.
    view(&mut p, |v| (v.onion, v.paths) = (false, false));
    choose(&mut p, "root");
    let at = middle(&p, "head");
    p.press(at, egui::PointerButton::Primary, Modifiers::NONE);
    let name = p.state().selection.active().map(|b| p.state().document.skeleton().name(b).to_owned());
    assert!(name.as_deref().is_some_and(|n| ["head", "neck"].contains(&n)), "{name:?}");
}
