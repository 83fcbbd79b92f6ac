//! Menus; and time: transport, frame, rate, range, speed, automatic keys.

use super::parts::{button, gesture};
use crate::Bus;
use crate::commands::{ACTIONS, MENUS, is_on, named};
use crate::state::{Command, Edit, LoopMode, Playback, State};
use egui::{Color32, DragValue, RichText};
use sinew::time::{Range, Rate};

/// The line on top.
#[derive(Default)]
pub struct Header {
    shown_at: Option<f64>,
    rate: f64,
}

impl Header {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        egui::MenuBar::new().ui(ui, |ui| {
            for menu in MENUS {
                ui.menu_button(*menu, |ui| menu_items(ui, menu, state, bus));
            }
            ui.separator();
            clips(ui, state, bus);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| auto_key(ui, state, bus));
        });
        ui.horizontal(|ui| self.time(ui, state, bus));
    }

    fn time(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let playing = state.playback.playing.is_some();
        for (text, action) in [
            ("⇤", "To the start"),
            ("◂◆", "Previous key"),
            (if playing { "║" } else { "▶" }, "Play"),
            ("◆▸", "Next key"),
            ("⇥", "To the end"),
        ] {
            button(ui, text, action, state, bus);
        }
        let mut frame = state.frame_at(state.time);
        let decimals = usize::from((frame - frame.round()).abs() > 1e-6);
        let field =
            DragValue::new(&mut frame).max_decimals(decimals).prefix("frame ").update_while_editing(false);
        if ui.add(field).on_hover_text("Frame: drag, or click and type").accessible_name("Frame").changed() {
            bus.send(Command::SetTime(state.time_of(frame)));
        }
        self.range(ui, state, bus);
        rate(ui, state, bus);
        speed(ui, state, bus);
        if playing {
            let text = format!("{:.1} frames/s", self.rate);
            ui.label(text).on_hover_text("Frames shown each second");
        }
    }

    fn range(&self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let range = state.active().range;
        let (mut first, mut last) = (state.frame_at(range.start), state.frame_at(range.end));
        let a = ui.add(
            DragValue::new(&mut first)
                .max_decimals(2)
                .range(f64::MIN..=last)
                .prefix("from ")
                .update_while_editing(false),
        );
        let b = ui.add(
            DragValue::new(&mut last)
                .max_decimals(2)
                .range(first..=f64::MAX)
                .prefix("to ")
                .update_while_editing(false),
        );
        let (a, b) = (a.accessible_name("First frame"), b.accessible_name("Last frame"));
        let range = Range { start: state.time_of(first), end: state.time_of(last) };
        gesture(&(a | b), "Range", Edit::SetRange(range), state, bus);
        if state.playback.range != state.active().range {
            let r = state.playback.range;
            let text = format!("preview {:.0}–{:.0}", state.frame_at(r.start), state.frame_at(r.end));
            let shown = ui.button(RichText::new(text).color(Color32::from_rgb(120, 190, 255)));
            if shown.on_hover_text("Only this part is played; click to play all").clicked() {
                bus.run(named("Preview all"), state);
            }
        }
    }

    /// Seconds until the next frame is due, where each is shown.
    pub(crate) fn wait(&self, now: f64, frame: f64) -> f64 {
        self.shown_at.map_or(0.0, |at| (at + frame - now).max(0.0))
    }

    /// A frame of the clip was shown.
    pub(crate) fn shown(&mut self, now: f64) {
        if let Some(dt) = self.shown_at.map(|at| now - at).filter(|dt| *dt > 0.0) {
            let rate = 1.0 / dt;
            self.rate = if self.rate > 0.0 { self.rate * 0.9 + rate * 0.1 } else { rate };
        }
        self.shown_at = Some(now);
    }

    /// Nothing plays.
    pub(crate) fn stopped(&mut self) {
        (self.shown_at, self.rate) = (None, 0.0);
    }
}

fn menu_items(ui: &mut egui::Ui, menu: &str, state: &State, bus: &mut Bus) {
    for action in ACTIONS.iter().filter(|a| a.menu == menu) {
        let text = match action.name {
            "Undo" => state.undo_name().map_or("Undo".into(), |n| format!("Undo {}", n.to_lowercase())),
            "Redo" => state.redo_name().map_or("Redo".into(), |n| format!("Redo {}", n.to_lowercase())),
            name => name.to_string(),
        };
        let mut button = egui::Button::new(&text).selected(is_on(action, state));
        if let Some(s) = action.shortcut {
            button = button.shortcut_text(ui.ctx().format_shortcut(&s));
        }
        let response = ui.add_enabled((action.enabled)(state), button).on_hover_text(action.help);
        if response.accessible_name(text).clicked() {
            bus.run(action, state);
            ui.close();
        }
    }
}

fn clips(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let combo = egui::ComboBox::from_id_salt("clip")
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
        .selected_text(&state.active().name);
    let shown = combo.show_ui(ui, |ui| {
        for (i, clip) in state.document.clips.iter().enumerate() {
            if ui.selectable_label(i == state.clip, &clip.name).clicked() {
                bus.send(Command::SelectClip(i));
                ui.close();
            }
        }
        ui.separator();
        if let Some(name) = super::parts::name(ui, "Name of this clip", &state.active().name) {
            bus.send(Command::Do(Edit::RenameClip(name)));
            ui.close();
        }
    });
    shown.response.on_hover_text("The clip that is edited").accessible_name("Clip to edit");
}

fn auto_key(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let on = state.auto_key;
    let (text, fill) = if on {
        (RichText::new("● AUTO-KEY").color(Color32::WHITE).strong(), Color32::from_rgb(200, 30, 30))
    } else {
        (RichText::new("● auto-key"), Color32::TRANSPARENT)
    };
    let response = ui.add(egui::Button::new(text).fill(fill).selected(on));
    if response.on_hover_text(named("Automatic keys").help).accessible_name("Automatic keys").clicked() {
        bus.send(Command::SetAutoKey(!on));
    }
    let mut snap = state.snap;
    if ui.checkbox(&mut snap, "snap").on_hover_text(named("Snap to frames").help).changed() {
        bus.send(Command::SetSnap(snap));
    }
}

fn rate(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let mut fps = state.document.rate.fps();
    let field = DragValue::new(&mut fps)
        .range(1.0..=1000.0)
        .max_decimals(3)
        .suffix(" fps")
        .update_while_editing(false);
    let response = ui.add(field).on_hover_text("Frames a second; keys keep their seconds");
    if let Ok(rate) = Rate::from_fps(fps) {
        gesture(&response.accessible_name("Frames a second"), "Frame rate", Edit::SetRate(rate), state, bus);
    }
}

fn speed(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let mut p = state.playback;
    let combo = egui::ComboBox::from_id_salt("speed").width(48.0).selected_text(format!("{}×", p.speed));
    let shown = combo.show_ui(ui, |ui| {
        for speed in [0.25, 0.5, 0.75, 1.0, 1.5, 2.0] {
            ui.selectable_value(&mut p.speed, speed, format!("{speed}×"));
        }
    });
    shown.response.on_hover_text("Speed").accessible_name("Speed");
    let name = |m| match m {
        LoopMode::Loop => "loop",
        LoopMode::Once => "once",
        LoopMode::PingPong => "ping-pong",
    };
    let combo = egui::ComboBox::from_id_salt("mode").width(80.0).selected_text(name(p.mode));
    let shown = combo.show_ui(ui, |ui| {
        for mode in [LoopMode::Loop, LoopMode::Once, LoopMode::PingPong] {
            ui.selectable_value(&mut p.mode, mode, name(mode));
        }
    });
    shown.response.on_hover_text("What happens at the end").accessible_name("At the end");
    ui.checkbox(&mut p.every_frame, "every frame").on_hover_text(named("Every frame").help);
    if p != state.playback {
        bus.send(Command::SetPlayback(Playback { ..p }));
    }
}
