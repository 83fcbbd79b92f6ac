//! What each pane can do: its gestures, and the actions that have keys.

use crate::commands::{ACTIONS, Scope};
use crate::layout::Pane;

/// Gestures of a pane, one a line.
pub fn gestures(of: Pane) -> &'static [(&'static str, &'static str)] {
    match of {
        Pane::Viewport => &[
            ("Click", "select a bone"),
            ("Shift + click", "one more or less"),
            ("Drag a ring", "twist, bend, twist, or turn freely; Ctrl goes by 5°"),
            ("Drag an arrow", "move a root, or a bone with keys of its place"),
            ("Drag the end of a chain", "pull the chain"),
            ("Middle drag, or on empty ground", "look around"),
            ("Shift + middle drag, right drag", "move sideways"),
            ("Wheel", "nearer and further, at the pointer"),
            ("Home, .", "look at all, or at the selected bones"),
            ("Esc", "cancel the drag"),
        ],
        Pane::Bones => &[
            ("Click", "select; on the triangle fold"),
            ("Ctrl + click", "one more or less"),
            ("Shift + click", "all from the last one"),
            ("Right click", "what can be done to the pose"),
        ],
        Pane::Inspector => &[
            ("Drag a number", "change it, one step of undo"),
            ("Click a number", "type it"),
            ("Esc", "cancel the drag"),
        ],
        Pane::Dope => &[
            ("Drag in the ruler", "move the playhead"),
            ("Click a key", "select it; Shift adds"),
            ("Drag a key", "move all selected keys; in the summary a whole pose"),
            ("Drag on empty ground", "select by a box; Shift adds"),
            ("Wheel", "zoom at the pointer"),
            ("Shift + wheel, or over the names", "scroll rows"),
            ("Middle drag", "pan"),
            ("T", "how tracks run: hold, linear, smooth; whole tracks, not keys"),
            ("Right click", "all that can be done to keys"),
            ("Esc", "cancel the drag"),
        ],
        Pane::Graph => &[
            ("Drag in the ruler", "move the playhead"),
            ("Drag a key", "time and value; X or Y while dragging: time or value only"),
            ("Drag on empty ground", "select by a box; Shift adds"),
            ("Wheel", "zoom time at the pointer"),
            ("Shift + wheel, or over the numbers", "zoom values"),
            ("Middle drag", "pan; “fit” lets values fit again"),
            ("T", "how tracks run: hold, linear, smooth; whole tracks, not keys"),
            ("Esc", "cancel the drag"),
        ],
    }
}

/// The window; whether it stays.
pub fn ui(ctx: &egui::Context, pane: Pane) -> bool {
    let mut open = true;
    let title = format!("{}: gestures and keys", pane.title());
    let window = egui::Window::new(title)
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]);
    window.show(ctx, |ui| {
        egui::Grid::new("gestures").num_columns(2).striped(true).show(ui, |ui| {
            for (gesture, what) in gestures(pane) {
                ui.strong(*gesture);
                ui.label(*what);
                ui.end_row();
            }
        });
        ui.separator();
        let own = if pane.has_time() { Scope::Time } else { Scope::Body };
        egui::ScrollArea::vertical().max_height(260.0).show(ui, |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                let of = |scope| ACTIONS.iter().filter(move |a| a.scope == scope);
                for (action, keys) in of(own).chain(of(Scope::Any)).filter_map(|a| Some((a, a.shortcut?))) {
                    ui.strong(ui.ctx().format_shortcut(&keys));
                    ui.label(action.name).on_hover_text(action.help);
                    ui.end_row();
                }
            });
        });
    });
    open && !ctx.input(|i| i.key_pressed(egui::Key::Escape))
}
