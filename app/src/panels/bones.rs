//! Bones.

use crate::Bus;
use crate::state::State;

/// The pane.
#[derive(Default)]
pub struct Bones {}

impl Bones {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, _state: &State, _bus: &mut Bus) {
        ui.label("bones");
    }
}
