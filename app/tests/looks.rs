//! What panes look like, against the README's pictures: those are what is compared, so they show the editor as it is.

use super::person::Person;
use super::{file, pip};
use egui::Vec2;
use sinew::image::Rgba8;
use sinew::io::picture::{PngLevel, encode_png, frames_of};
use sinew_app::state::{Command, Mode, Quality, State, View};
use sinew_app::viewport::Cost;

/// Letters are drawn by a library that may round otherwise on another processor: a channel of few pixels may be off by little.
const OFF: u8 = 16;
const FEW: usize = 64;

fn compare(p: &mut Person, name: &str) {
    // What a machine needs for a frame is its own.
    let [width, height] = p.ui.state().viewport.cost.size;
    let vertices = 2104;
    let cost = Cost {
        evaluate_ms: 0.05,
        skin_ms: 0.12,
        draw_ms: 2.9,
        vertices,
        triangles: 3874,
        size: [width, height],
    };
    p.ui.state_mut().viewport.cost = cost;
    p.ui.run_steps(1);
    let (now, path) = (p.picture(), file("app").join(name));
    let bytes = std::fs::read(&path).unwrap_or_default();
    let first = frames_of(&bytes).ok().and_then(|mut f| f.next());
    let then = first.and_then(Result::ok).map_or(Rgba8::default(), |f| f.pixels.into_codes());
    let far = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > OFF);
    let off: Vec<usize> = now
        .data
        .chunks(4)
        .zip(then.data.chunks(4))
        .enumerate()
        .filter(|(_, p)| far(*p))
        .map(|p| p.0)
        .collect();
    if now.data.len() == then.data.len() && off.len() <= FEW {
        return;
    }
    let target = match std::env::var_os("BLESS") {
        Some(_) => path,
        None => std::env::temp_dir().join(name),
    };
    let bytes = encode_png(&now, PngLevel::Best).expect("a picture");
    std::fs::write(&target, bytes).expect("a folder to write to");
    let rows = [off.first(), off.last()].map(|i| i.map_or(0, |i| i / now.width));
    panic!(
        "{name}: {} pixels differ, rows {rows:?}; what it is now is in {}; BLESS=1 makes that the README's",
        off.len(),
        target.display()
    );
}

#[test]
fn the_readme_shows_every_pane_as_it_is() {
    let mut state = State::open(pip());
    let hand = state.document.skeleton().find("hand.R").expect("pip has one");
    for command in [
        Command::SetTime(0.4),
        Command::SelectBones(vec![hand], Mode::Replace),
        Command::SetView(View { onion: true, paths: true, quality: Quality::Normal, ..View::default() }),
    ] {
        state.update(command).expect("always");
    }
    let mut p = Person::sized(state, Vec2::new(1080.0, 675.0));
    compare(&mut p, "editor.png");
    p.click("Help on Graph");
    compare(&mut p, "help.png");
}
