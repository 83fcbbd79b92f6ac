//! The picture of the character.

use crate::Bus;
use crate::state::State;

/// What the last picture cost.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Cost {
    /// Clip to pose to matrices, ms.
    pub evaluate_ms: f32,
    /// Deforming meshes, ms.
    pub skin_ms: f32,
    /// Drawing, ms.
    pub draw_ms: f32,
    /// Vertices deformed.
    pub vertices: usize,
    /// Triangles drawn.
    pub triangles: usize,
    /// Pixels of the picture.
    pub pixels: usize,
}

/// The viewport pane.
#[derive(Default)]
pub struct Viewport {
    /// Of the last picture that was drawn anew.
    pub cost: Cost,
}

impl Viewport {
    /// Draw, and send what pointers do.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let _ = (state, bus);
        ui.label("viewport");
    }
}
