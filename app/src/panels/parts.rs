//! Parts that several panes share: names of keys, menus, buttons of actions, numbers that are dragged.

use super::axis;
use crate::Bus;
use crate::commands::{ACTIONS, named};
use crate::state::{Command, Edit, State};
use egui::{Pos2, Rect, Sense, Vec2};

/// Key nodes for assistive technology and for tests: there where somebody listens, of keys that can be seen.
pub struct Names<'a> {
    ui: &'a egui::Ui,
    heard: bool,
}

impl<'a> Names<'a> {
    /// Of a pane whose own node has that name.
    pub fn of(ui: &'a egui::Ui, pane: &str) -> Self {
        Self { ui, heard: ui.ctx().has_accesskit_node(ui.scope_id().with(pane)) }
    }

    /// A node over a key, if somebody listens.
    pub fn add(&mut self, at: Pos2, name: impl Fn() -> String) {
        let Self { ui, heard: true } = self else { return };
        let name = name();
        let rect = Rect::from_center_size(at, Vec2::splat(2.0 * axis::HIT));
        let response = ui.interact(rect, ui.scope_id().with(("key", &name)), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Button, true, &name));
    }
}

/// Actions of some menus, at the pointer.
pub fn menu(ui: &mut egui::Ui, of: &[&str], state: &State, bus: &mut Bus) {
    for action in ACTIONS.iter().filter(|a| of.contains(&a.menu)) {
        let mut button = egui::Button::new(action.name);
        if let Some(keys) = action.shortcut {
            button = button.shortcut_text(ui.ctx().format_shortcut(&keys));
        }
        let response = ui.add_enabled((action.enabled)(state), button).on_hover_text(action.help);
        if response.accessible_name(action.name).clicked() {
            bus.run(action, state);
            ui.close();
        }
    }
}

/// A name to be typed; given back when Enter ends it.
pub fn name(ui: &mut egui::Ui, what: &str, now: &str) -> Option<String> {
    let id = ui.scope_id().with((what, now));
    let mut name = ui.data(|d| d.get_temp(id)).unwrap_or_else(|| now.to_owned());
    let field = ui.text_edit_singleline(&mut name).accessible_name(what);
    if field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
        ui.data_mut(|d| d.remove_temp::<String>(id));
        return Some(name);
    }
    ui.data_mut(|d| d.insert_temp(id, name));
    None
}

/// A button that does an action; its name and help are the action's.
pub fn button(ui: &mut egui::Ui, text: &str, name: &str, state: &State, bus: &mut Bus) {
    let action = named(name);
    let keys = action.shortcut.map_or(String::new(), |s| format!(" ({})", ui.ctx().format_shortcut(&s)));
    let response = ui.add_enabled((action.enabled)(state), egui::Button::new(text));
    if response.on_hover_text(format!("{}{keys}", action.help)).accessible_name(name).clicked() {
        bus.run(action, state);
    }
}

/// A number that is dragged or typed: a drag is one gesture, a typed number one edit.
pub fn gesture(r: &egui::Response, name: &'static str, edit: Edit, state: &State, bus: &mut Bus) {
    if r.drag_started() {
        bus.send(Command::Begin(name));
    }
    // After Esc the pointer may go on; the drag is over all the same.
    if r.changed() && r.dragged() && (state.in_gesture() || r.drag_started()) {
        bus.send(Command::Preview(edit));
    } else if r.changed() && !r.dragged() {
        bus.send(Command::Do(edit));
    }
    if r.drag_stopped() {
        bus.send(Command::Commit);
    }
}
