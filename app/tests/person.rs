//! Somebody at the editor: pointers, keys and names.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, Vec2};
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, Node, TestRenderer};
use sinew::clip::Target;
use sinew::image::Rgba8;
use sinew::io::picture::{PngLevel, encode_png};
use sinew_app::App;
use sinew_app::paint::Paint;
use sinew_app::state::{Quality, State};
use std::sync::{Arc, Mutex};

pub const CTRL: Modifiers = Modifiers::COMMAND;
pub const CTRL_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// The editor and somebody at it.
pub struct Person {
    pub ui: Harness<'static, App>,
    paint: Arc<Mutex<Paint>>,
    size: Vec2,
}

/// Keeps textures for pictures.
struct Textures(Arc<Mutex<Paint>>);

impl TestRenderer for Textures {
    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        self.0.lock().expect("one thread").apply(delta);
    }
}

impl Person {
    pub fn at(mut state: State) -> Self {
        // The picture of the character is not what is looked at here.
        state.view.quality = Quality::Draft;
        Self::sized(state, Vec2::new(1440.0, 900.0))
    }

    pub fn sized(state: State, size: Vec2) -> Self {
        let paint = Arc::new(Mutex::new(Paint::default()));
        let build = Harness::builder()
            .with_size(size)
            .with_max_steps(64)
            .with_context_setup(sinew_app::set_up)
            .renderer(Textures(paint.clone()));
        let mut ui = build.build_ui_state(|ui, app: &mut App| app.ui(ui), App::new(state));
        ui.run();
        Self { ui, paint, size }
    }

    /// What is seen.
    pub fn picture(&self) -> Rgba8 {
        let paint = self.paint.lock().expect("one thread");
        paint.draw(&self.ui.ctx, self.ui.output(), self.size.into(), egui::Color32::from_gray(27))
    }

    /// Left behind for whoever wants to look, where `SHOTS` names a folder.
    pub fn shot(&self, name: &str) {
        if let Some(folder) = std::env::var_os("SHOTS") {
            let bytes = encode_png(&self.picture(), PngLevel::default()).expect("a picture");
            let path = std::path::Path::new(&folder).join(name).with_extension("png");
            std::fs::write(path, bytes).expect("a folder to write to");
        }
    }

    pub fn state(&self) -> &State {
        &self.ui.state().state
    }

    pub fn node<'n>(&'n self, name: &'n str) -> Node<'n> {
        let mut found = self.ui.query_all_by_label(name);
        let first = found.next().unwrap_or_else(|| panic!("nothing is called `{name}`"));
        assert!(found.next().is_none(), "two things are called `{name}`");
        first
    }

    /// Choose a bone in the tree, wherever it is scrolled to.
    pub fn pick(&mut self, bone: &str) {
        self.type_into("Filter of the bones", bone);
        self.click(bone);
    }

    pub fn has(&self, name: &str) -> bool {
        self.ui.query_all_by_label(name).next().is_some()
    }

    pub fn place(&self, name: &str) -> Rect {
        self.node(name).rect()
    }

    pub fn click(&mut self, name: &str) {
        let at = self.place(name).center();
        self.press(at, PointerButton::Primary, Modifiers::NONE);
    }

    pub fn press(&mut self, at: Pos2, button: PointerButton, modifiers: Modifiers) {
        self.ui.event(Event::PointerMoved(at));
        self.ui.step();
        for pressed in [true, false] {
            self.button(at, button, pressed, modifiers);
        }
        self.ui.run();
    }

    pub fn button(&mut self, pos: Pos2, button: PointerButton, pressed: bool, modifiers: Modifiers) {
        self.ui.event_modifiers(Event::PointerButton { pos, button, pressed, modifiers }, modifiers);
        self.ui.step();
    }

    /// Press, move in steps, and let go, or leave held.
    pub fn drag(&mut self, from: Pos2, to: Pos2, release: bool) {
        self.ui.event(Event::PointerMoved(from));
        self.ui.step();
        self.button(from, PointerButton::Primary, true, Modifiers::NONE);
        for i in 1..=5 {
            self.ui.event(Event::PointerMoved(from + (to - from) * (i as f32 / 5.0)));
            self.ui.step();
        }
        if release {
            self.button(to, PointerButton::Primary, false, Modifiers::NONE);
        }
        self.ui.run_steps(3);
    }

    pub fn key(&mut self, modifiers: Modifiers, key: Key) {
        self.ui.key_press_modifiers(modifiers, key);
        self.ui.run_steps(2);
    }

    pub fn hover(&mut self, at: Pos2) {
        self.ui.event(Event::PointerMoved(at));
        self.ui.run_steps(2);
    }

    /// Click a number and type another.
    pub fn type_into(&mut self, name: &str, text: &str) {
        self.click(name);
        self.key(CTRL, Key::A);
        self.ui.event(Event::Text(text.into()));
        self.ui.run_steps(2);
        self.key(Modifiers::NONE, Key::Enter);
        self.ui.run_steps(2);
    }

    pub fn times(&self, bone: &str) -> Vec<f64> {
        let s = self.state();
        let bone = s.document.skeleton().find(bone).expect("a bone of the rig");
        let track = s.track_of(&Target::Xzx(bone)).expect("it is keyed");
        let times = s.active().tracks[track].curve.times();
        times.iter().map(|t| (s.frame_at(*t) * 1e6).round() / 1e6).collect()
    }

    pub fn menu(&mut self, menu: &str, item: &str) {
        self.click(menu);
        self.click(item);
    }
}
