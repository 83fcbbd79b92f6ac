//! The line below: what the last frame cost, and what is selected.

use crate::Bus;
use crate::state::{Command, Quality, State, View};
use crate::viewport::{Cost, Viewport};

/// The line.
#[derive(Default)]
pub struct Status {
    cost: Cost,
    since: f64,
}

/// Seconds that numbers stand while a clip plays: long enough to be read.
const STAND: f64 = 0.25;

impl Status {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, viewport: &Viewport, bus: &mut Bus) {
        ui.horizontal(|ui| {
            quality(ui, state, bus);
            ui.separator();
            let now = ui.input(|i| i.time);
            if state.playback.playing.is_none() || now - self.since >= STAND {
                (self.cost, self.since) = (viewport.cost, now);
            }
            let c = self.cost;
            let skin = match c.vertices {
                0 => "skin kept".into(),
                n => format!("skin {:.2} ms, {n} vertices", c.skin_ms),
            };
            let text = format!(
                "evaluate {:.2} ms · {skin} · draw {:.2} ms, {} triangles, {} × {} pixels",
                c.evaluate_ms, c.draw_ms, c.triangles, c.size[0], c.size[1]
            );
            ui.label(text).on_hover_text("What the last picture that was drawn anew cost");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let clip = state.active();
                let total: usize = clip.tracks.iter().map(|t| t.curve.times().len()).sum();
                let (bones, keys) = (state.selection.bones.len(), state.selection.key_count());
                let unsaved = if state.unsaved() { "unsaved · " } else { "" };
                ui.label(format!(
                    "{unsaved}{bones} of {} bones · {keys} of {total} keys",
                    state.document.skeleton().len()
                ));
            });
        });
    }
}

fn quality(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let mut quality = state.view.quality;
    for (value, name, help) in [
        (Quality::Draft, "draft", "Half the pixels each way, one sample each: fastest"),
        (Quality::Normal, "normal", "Every pixel; four samples each at rest, one while anything moves"),
        (
            Quality::Exact,
            "exact",
            "Every pixel, four samples each, moving or not, as many as an export takes: slowest",
        ),
    ] {
        ui.selectable_value(&mut quality, value, name).on_hover_text(help);
    }
    if quality != state.view.quality {
        bus.send(Command::SetView(View { quality, ..state.view.clone() }));
    }
}
