//! What panes look like, against the README's pictures: those are what is compared, so they show the editor as it is.

use super::person::Person;
use super::{file, pip};
use egui::Vec2;
use sinew::image::Rgba8;
use sinew::io::picture::{Dither, Palette, PixelArt, PixelArtDesc, PngLevel, encode_indexed_png, frames_of};
use sinew_app::state::{Command, Mode, Quality, State, View};
use sinew_app::viewport::Cost;
use std::collections::BTreeSet;

/// Letters are drawn by a library that may round otherwise on another processor: few pixels may be off, and others by little. On one
/// machine all are equal.
const OFF: u8 = 24;
const FEW: usize = 64;

/// The file of a picture in the colours of a palette, or in those that suit it, and what it shows.
fn reduced(picture: &Rgba8, palette: Option<Palette>) -> (Vec<u8>, Rgba8) {
    let desc = PixelArtDesc { colors: 255, dither: Dither::None, ..PixelArtDesc::default() };
    let art = PixelArt::new(desc, std::slice::from_ref(picture), palette);
    let mapped = art.finish(&mut art.mapper(), picture);
    let bytes = encode_indexed_png(&mapped, art.palette(), PngLevel::Best).expect("a picture");
    (bytes, mapped.to_rgba8(art.palette()))
}

fn compare(p: &mut Person, name: &str) {
    // What a machine needs for a frame is its own.
    let size = p.ui.state().viewport.cost.size;
    let cost = Cost { evaluate_ms: 0.05, skin_ms: 0.12, draw_ms: 2.9, vertices: 4012, triangles: 3874, size };
    p.ui.state_mut().viewport.cost = cost;
    p.ui.run_steps(1);
    let (now, path) = (p.picture(), file("app").join(name));
    let bytes = std::fs::read(&path).unwrap_or_default();
    let first = frames_of(&bytes).ok().and_then(|mut f| f.next());
    let then = first.and_then(Result::ok).map_or(Rgba8::default(), |f| f.pixels.into_codes());
    let colors: BTreeSet<[u8; 3]> = then.data.chunks(4).map(|c| [c[0], c[1], c[2]]).collect();
    let found = (1..=255).contains(&colors.len());
    let seen = reduced(&now, found.then(|| Palette::new(colors.into_iter().collect()))).1;
    let pixels = seen.data.chunks(4).zip(then.data.chunks(4)).enumerate();
    let far = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > OFF);
    let off: Vec<usize> = pixels.filter(|(_, p)| far(*p)).map(|p| p.0).collect();
    if seen.data.len() == then.data.len() && off.len() <= FEW {
        return;
    }
    let blessed = std::env::var_os("BLESS").map(|_| path);
    let target = blessed.unwrap_or_else(|| std::env::temp_dir().join(name));
    std::fs::write(&target, reduced(&now, None).0).expect("a folder to write to");
    let [top, bottom] = [off.first(), off.last()].map(|i| i.map_or(0, |i| i / now.width));
    panic!(
        "{name}: {} pixels differ, in rows {top} to {bottom}; what it is now is in {}; BLESS=1 makes that the README's",
        off.len(),
        target.display()
    );
}

fn reader() -> Person {
    let mut state = State::open(pip());
    let hand = state.document.skeleton().find("hand.R").expect("pip has one");
    let shown = View { onion: true, paths: true, quality: Quality::Normal, ..View::default() };
    for command in
        [Command::SetTime(0.4), Command::SelectBones(vec![hand], Mode::Replace), Command::SetView(shown)]
    {
        state.update(command).expect("always");
    }
    Person::sized(state, Vec2::new(1080.0, 675.0))
}

#[test]
fn the_readme_shows_every_pane_as_it_is() {
    compare(&mut reader(), "editor.png");
}

#[test]
fn the_readme_shows_help_as_it_is() {
    let mut p = reader();
    p.click("Help on Graph");
    compare(&mut p, "help.png");
}
