//! Panes but for the viewport, and what is drawn over them.

pub mod bones;
pub mod dope;
pub mod graph;
pub mod header;
pub mod inspector;
pub mod palette;
pub mod status;
pub mod toasts;

use crate::Bus;
use crate::commands::Task;
use crate::layout::Pane;
use crate::state::State;

/// All of them, with what each remembers.
#[derive(Default)]
pub struct Panels {
    /// The tree of bones.
    pub bones: bones::Bones,
    /// Numbers.
    pub inspector: inspector::Inspector,
    /// Keys.
    pub dope: dope::Dope,
    /// Curves.
    pub graph: graph::Graph,
    /// Menus and time.
    pub header: header::Header,
    /// The line below.
    pub status: status::Status,
    /// The search for commands.
    pub palette: palette::Palette,
    /// Notices.
    pub toasts: toasts::Toasts,
    /// The pane that the pointer was in last.
    pub hovered: Option<Pane>,
}

impl Panels {
    /// Something that takes all keys is open.
    pub fn modal(&self) -> bool {
        self.palette.open()
    }

    /// Over the panes.
    pub fn over(&mut self, ctx: &egui::Context, state: &State, bus: &mut Bus) {
        self.palette.ui(ctx, state, bus);
        self.toasts.ui(ctx);
    }

    /// What a command asks of a pane.
    pub fn task(&mut self, task: Task, _state: &State, _bus: &mut Bus) {
        if task == Task::Palette {
            self.palette.show();
        }
    }
}
