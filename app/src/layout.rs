//! Panes and where they stand.

use crate::Bus;
use crate::panels::Panels;
use crate::state::State;
use crate::viewport::Viewport;
use egui_tiles::{Behavior, Linear, LinearDir, Tile, TileId, Tiles, Tree, UiResponse};

/// What a pane shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Pane {
    /// The character.
    Viewport,
    /// The tree of bones.
    Bones,
    /// Numbers of the selected bone.
    Inspector,
    /// Keys in time.
    Dope,
    /// Values over time.
    Graph,
}

impl Pane {
    /// On its tab.
    pub fn title(self) -> &'static str {
        match self {
            Self::Viewport => "Viewport",
            Self::Bones => "Bones",
            Self::Inspector => "Inspector",
            Self::Dope => "Dope sheet",
            Self::Graph => "Graph",
        }
    }

    /// Whether time runs along it.
    pub fn has_time(self) -> bool {
        matches!(self, Self::Dope | Self::Graph)
    }
}

/// Bones, viewport and inspector above, keys and curves below.
pub fn default_tree() -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let [bones, viewport, inspector, dope, graph] =
        [Pane::Bones, Pane::Viewport, Pane::Inspector, Pane::Dope, Pane::Graph].map(|p| {
            let pane = tiles.insert_pane(p);
            tiles.insert_tab_tile(vec![pane])
        });
    let mut row = |children: &[(TileId, f32)], dir| {
        let mut line = Linear::new(dir, children.iter().map(|c| c.0).collect());
        children.iter().for_each(|c| line.shares.set_share(c.0, c.1));
        tiles.insert_new(Tile::Container(line.into()))
    };
    let above = row(&[(bones, 0.8), (viewport, 3.2), (inspector, 1.0)], LinearDir::Horizontal);
    let below = row(&[(dope, 1.2), (graph, 1.0)], LinearDir::Horizontal);
    let root = row(&[(above, 1.5), (below, 1.0)], LinearDir::Vertical);
    Tree::new(egui::Id::unique("panes"), root, tiles)
}

/// Some room around what is read.
fn inset(ui: &mut egui::Ui, draw: impl FnOnce(&mut egui::Ui)) {
    egui::Frame::new().inner_margin(6.0).show(ui, draw);
}

/// Draws panes.
pub(crate) struct Panes<'a> {
    pub state: &'a State,
    pub viewport: &'a mut Viewport,
    pub panels: &'a mut Panels,
    pub bus: &'a mut Bus,
}

impl Behavior<Pane> for Panes<'_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        ui.painter().rect_filled(ui.max_rect(), 0.0, ui.visuals().panel_fill);
        if ui.rect_contains_pointer(ui.max_rect()) {
            self.panels.hovered = Some(*pane);
        }
        match pane {
            Pane::Viewport => self.viewport.ui(ui, self.state, self.bus),
            Pane::Bones => inset(ui, |ui| self.panels.bones.ui(ui, self.state, self.bus)),
            Pane::Inspector => inset(ui, |ui| self.panels.inspector.ui(ui, self.state, self.bus)),
            Pane::Dope => self.panels.dope.ui(ui, self.state, self.bus),
            Pane::Graph => self.panels.graph.ui(ui, self.state, self.bus),
        }
        UiResponse::None
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<Pane>,
        ui: &mut egui::Ui,
        _: TileId,
        tabs: &egui_tiles::Tabs,
        _: &mut f32,
    ) {
        let Some(Tile::Pane(pane)) = tabs.active.and_then(|t| tiles.get(t)) else { return };
        let name = format!("Help on {}", pane.title());
        if ui.small_button("?").on_hover_text("What this pane does").accessible_name(name).clicked() {
            self.panels.help_on(*pane);
        }
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        pane.title().into()
    }

    fn simplification_options(&self) -> egui_tiles::SimplificationOptions {
        egui_tiles::SimplificationOptions { all_panes_must_have_tabs: true, ..Default::default() }
    }
}
