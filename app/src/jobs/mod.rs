//! Files, read and written beside the window.

use crate::Bus;
use crate::commands::Task;
use crate::state::State;

/// What is being read and written.
#[derive(Default)]
pub struct Jobs {}

impl Jobs {
    /// Start what a menu asked for: open, save, export, quit.
    pub fn task(&mut self, _ctx: &egui::Context, task: Task, _state: &mut State, bus: &mut Bus) {
        bus.tell(format!("{task:?} is not there yet"));
    }

    /// Take what finished; called at the start of each frame.
    pub fn poll(&mut self, _ctx: &egui::Context, _state: &mut State, _bus: &mut Bus) {}

    /// Progress, questions and dialogs over the panes.
    pub fn ui(&mut self, _ctx: &egui::Context, _state: &State, _bus: &mut Bus) {}
}
