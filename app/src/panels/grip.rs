//! What a pointer does to keys, the same in the dope sheet and the graph.

use super::axis::SELECTED;
use crate::Bus;
use crate::commands::Task;
use crate::state::{Command, Edit, Keys, Mode, State};
use egui::{Key, PointerButton};

/// A drag under way.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Drag {
    /// None.
    #[default]
    None,
    /// Keys, from a second and a value.
    Keys {
        /// Where it began.
        from: (f64, f64),
        /// Value a unit of the pane's value axis.
        unit: f64,
    },
    /// A box, from a second and a height of the pane's own.
    Box {
        /// Where it began.
        from: (f64, f64),
    },
    /// A command's: keys follow the pointer, no button held.
    Modal {
        /// Move, scale or duplicate.
        task: Task,
        /// Where it began.
        from: (f64, f64),
        /// Value a unit of the value axis.
        unit: f64,
    },
}

/// One axis only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Lock {
    /// Both.
    #[default]
    Free,
    /// Time alone.
    Time,
    /// Value alone.
    Value,
}

/// The drag and its lock.
#[derive(Clone, Debug, Default)]
pub struct Grip {
    /// What is dragged.
    pub drag: Drag,
    /// Along which axis.
    pub lock: Lock,
    /// Selected alone where a press on one of several ends without a drag.
    pub click: Option<Keys>,
    last: (f64, f64),
}

impl Grip {
    /// Take keys under the pointer.
    pub fn take(&mut self, from: (f64, f64), unit: f64, bus: &mut Bus) {
        *self = Self { drag: Drag::Keys { from, unit }, lock: Lock::Free, click: None, last: from };
        bus.send(Command::Begin("Move keys"));
    }

    /// Keys follow the pointer from here on.
    pub fn start(&mut self, task: Task, from: (f64, f64), unit: f64, bus: &mut Bus) {
        *self = Self { drag: Drag::Modal { task, from, unit }, lock: Lock::Free, click: None, last: from };
        bus.send(Command::Begin(match task {
            Task::Stretch => "Scale keys",
            Task::Duplicate => "Duplicate keys",
            _ => "Move keys",
        }));
    }

    /// Go on with keys that are dragged: `at` is the pointer's second and value. Returns whether anything is.
    pub fn follow(
        &mut self,
        ui: &egui::Ui,
        at: (f64, f64),
        time_only: bool,
        state: &State,
        bus: &mut Bus,
    ) -> bool {
        let (task, from, unit, modal) = match self.drag {
            Drag::Keys { from, unit } => (Task::Grab, from, unit, false),
            Drag::Modal { task, from, unit } => (task, from, unit, true),
            _ => return false,
        };
        // Cancelled while the pointer was elsewhere.
        if !state.in_gesture() {
            self.drag = Drag::None;
            return true;
        }
        let (cancel, x, y, enter) = ui.input(|i| {
            let pressed = |k| i.key_pressed(k);
            let other = i.pointer.button_pressed(PointerButton::Secondary);
            (pressed(Key::Escape) || other, pressed(Key::X), pressed(Key::Y), pressed(Key::Enter))
        });
        if cancel {
            bus.send(Command::Cancel);
            self.drag = Drag::None;
            return true;
        }
        let lock = |l: Lock, now: Lock| if now == l { Lock::Free } else { l };
        self.lock = if x { lock(Lock::Time, self.lock) } else { self.lock };
        self.lock = if y { lock(Lock::Value, self.lock) } else { self.lock };

        let (mut seconds, mut value) = (at.0 - from.0, at.1 - from.1);
        if time_only || self.lock == Lock::Time {
            value = 0.0;
        }
        if self.lock == Lock::Value && !time_only {
            seconds = 0.0;
        }
        if seconds.abs() < 0.5 * state.frame_seconds() && state.snap {
            seconds = 0.0;
        }
        // A pointer that stands still asks for nothing.
        let edit = match task {
            Task::Stretch => {
                let (was, is) = (from.0 - state.time, at.0 - state.time);
                let factor = if was.abs() < 1e-9 { 1.0 } else { is / was };
                Edit::ScaleKeys { factor, about: state.time }
            }
            Task::Duplicate => Edit::DuplicateKeys { seconds },
            _ => Edit::MoveKeys { seconds, value: (value * unit) as f32 },
        };
        if std::mem::replace(&mut self.last, at) != at || x || y {
            self.click = None;
            bus.send(Command::Preview(edit));
        }
        let (pressed, released) =
            ui.input(|i| (i.pointer.button_pressed(PointerButton::Primary), i.pointer.primary_released()));
        if enter || if modal { pressed } else { released } {
            bus.send(Command::Commit);
            self.drag = Drag::None;
            if let Some(keys) = self.click.take() {
                bus.send(Command::SelectKeys(keys, Mode::Replace));
            }
        }
        true
    }

    /// What is under way, for whoever looks.
    pub fn hint(&self, values: bool) -> Option<&'static str> {
        match (self.drag, values) {
            (Drag::None | Drag::Box { .. }, _) => None,
            (_, false) => Some("Esc cancels"),
            (_, true) => Some(match self.lock {
                Lock::Free => "X: time only · Y: value only · Esc cancels",
                Lock::Time => "time only (X frees) · Esc cancels",
                Lock::Value => "value only (Y frees) · Esc cancels",
            }),
        }
    }
}

/// The box of a drag on empty ground, over the pane.
pub fn draw_box(ui: &egui::Ui, pane: egui::Rect, shown: egui::Rect) {
    let painter =
        ui.painter_at(pane).with_layer_id(egui::LayerId::new(egui::Order::Foreground, ui.scope_id()));
    let edge = egui::Stroke::new(1.0, SELECTED);
    painter.rect(shown, 0.0, SELECTED.gamma_multiply(0.1), edge, egui::StrokeKind::Inside);
}
