//! Panes but for the viewport, and what is drawn over them.

pub mod axis;
pub mod bones;
pub mod dope;
pub mod graph;
pub mod grip;
pub mod header;
mod help;
pub mod inspector;
pub mod palette;
pub mod parts;
pub mod status;
pub mod summary;
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
    help: Option<Pane>,
}

impl Panels {
    /// Something that takes all keys is open.
    pub fn modal(&self) -> bool {
        self.palette.open()
    }

    /// Over the panes.
    pub fn over(&mut self, ctx: &egui::Context, state: &State, bus: &mut Bus) {
        self.palette.ui(ctx, state, bus);
        if let Some(pane) = self.help {
            self.help = help::ui(ctx, pane).then_some(pane);
        }
        self.toasts.ui(ctx);
    }

    /// Show what a pane does.
    pub fn help_on(&mut self, pane: Pane) {
        self.help = Some(pane);
    }

    /// What a command asks of a pane.
    pub fn task(&mut self, task: Task, state: &State, bus: &mut Bus) {
        match task {
            Task::Palette => self.palette.show(""),
            // The actions that say so.
            Task::Interpolation => self.palette.show("per track"),
            Task::Help => self.help = self.hovered.or(Some(Pane::Viewport)),
            Task::FrameAll => {
                let r = state.active().range;
                let keys = state.active().tracks.iter().map(|t| t.curve.times());
                let ends = keys.map(|k| (k[0], k[k.len() - 1]));
                let (a, b) = ends.fold((r.start, r.end), |(a, b), (c, d)| (a.min(c), b.max(d)));
                self.dope.frame(a, b, state, bus);
                self.graph.fit();
            }
            Task::FrameSelection => {
                let of = |(&t, k): (&u32, &crate::state::TrackKeys)| {
                    let times = state.active().tracks[t as usize].curve.times();
                    let runs = k.spans.runs();
                    Some((times[runs.first()?.start as usize], times[runs.last()?.end as usize - 1]))
                };
                let ends = state.selection.keys.iter().filter_map(of);
                let (a, b) =
                    ends.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))).unwrap_or((state.time, state.time));
                self.dope.frame(a, b, state, bus);
                self.graph.fit();
            }
            _ if self.hovered == Some(Pane::Graph) => self.graph.pending = Some(task),
            _ => self.dope.pending = Some(task),
        }
    }
}
