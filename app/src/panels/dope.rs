//! Dope.

use crate::Bus;
use crate::state::State;

/// The pane.
#[derive(Default)]
pub struct Dope {}

impl Dope {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, _state: &State, _bus: &mut Bus) {
        ui.label("dope");
    }
}
