//! The tree of bones; rows that can be seen, whatever is there.

use super::parts::menu;
use crate::Bus;
use crate::state::{Command, Mode, State};
use egui::{Align2, Color32, FontId, Rect, Sense, Stroke, Vec2, pos2};
use sinew::skeleton::BoneId;
use std::collections::BTreeSet;

/// Height of a row, points.
const ROW: f32 = 18.0;

/// The pane.
#[derive(Default)]
pub struct Bones {
    folded: BTreeSet<BoneId>,
    filter: String,
    shown: Option<BoneId>,
    range_from: Option<usize>,
}

impl Bones {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let field =
            egui::TextEdit::singleline(&mut self.filter).hint_text("filter").desired_width(f32::INFINITY);
        ui.add(field).accessible_name("Filter of the bones");
        let mut scroll = egui::ScrollArea::vertical().auto_shrink(false);

        // A bone that was chosen elsewhere is brought into view, once, whatever is folded above it.
        let active = state.selection.active();
        let elsewhere = std::mem::replace(&mut self.shown, active) != active;
        if elsewhere {
            let parent = |b: &BoneId| state.document.skeleton().parent(*b);
            std::iter::successors(active.as_ref().and_then(parent), parent).for_each(|b| {
                self.folded.remove(&b);
            });
        }
        let rows = self.rows(state);
        let row = rows.iter().position(|(b, _)| Some(*b) == active);
        if let Some(row) = row.filter(|_| elsewhere) {
            let middle = row as f32 * ROW - ui.available_height() / 2.0;
            scroll = scroll.vertical_scroll_offset(middle.max(0.0));
        }
        ui.spacing_mut().item_spacing.y = 0.0;
        let mut keyed = vec![false; state.document.skeleton().len()];
        state.active().tracks.iter().filter_map(|t| t.target.bone()).for_each(|b| keyed[b.index()] = true);
        scroll.show_rows(ui, ROW, rows.len(), |ui, seen| {
            for row in seen {
                let (bone, depth) = rows[row];
                self.row(ui, &rows, row, bone, depth, keyed[bone.index()], state, bus);
            }
        });
    }

    /// Bones whose ancestors are all unfolded, or that the filter names, with their depth.
    fn rows(&self, state: &State) -> Vec<(BoneId, usize)> {
        let skeleton = state.document.skeleton();
        let filter = self.filter.to_lowercase();
        let mut depth = vec![0usize; skeleton.len()];
        let mut out = Vec::new();
        let mut skip = 0;
        for bone in skeleton.ids() {
            let i = bone.index();
            depth[i] = skeleton.parent(bone).map_or(0, |p| depth[p.index()] + 1);
            if !filter.is_empty() {
                if skeleton.name(bone).to_lowercase().contains(&filter) {
                    out.push((bone, 0));
                }
            } else if i >= skip {
                out.push((bone, depth[i]));
                if self.folded.contains(&bone) {
                    skip = skeleton.subtree(bone).end;
                }
            }
        }
        out
    }

    fn row(
        &mut self,
        ui: &mut egui::Ui,
        rows: &[(BoneId, usize)],
        row: usize,
        bone: BoneId,
        depth: usize,
        keyed: bool,
        state: &State,
        bus: &mut Bus,
    ) {
        let skeleton = state.document.skeleton();
        let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW), Sense::click());
        let selected = state.selection.bones.contains(&bone);
        let name = skeleton.name(bone);
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::accesskit::Role::TreeItem, true, selected, name)
        });
        let visuals = ui.style().interact_selectable(&response, selected);
        if selected || response.hovered() {
            ui.painter().rect_filled(rect, 2.0, visuals.weak_bg_fill);
        }

        // Deep chains stay within the pane.
        let indent = (depth as f32 * 10.0).min(rect.width() * 0.5);
        let left = rect.left() + 4.0 + indent;
        let has_children = skeleton.subtree(bone).len() > 1 && self.filter.is_empty();
        let fold = Rect::from_min_size(pos2(left - 2.0, rect.top()), Vec2::new(14.0, ROW));
        if has_children {
            let folded = self.folded.contains(&bone);
            let text = if folded { "▸" } else { "▾" };
            ui.painter().text(
                fold.center(),
                Align2::CENTER_CENTER,
                text,
                FontId::proportional(10.0),
                visuals.text_color(),
            );
        }
        let loose = state.loose.contains_key(&bone);
        let color = if loose { Color32::from_rgb(255, 150, 60) } else { visuals.text_color() };
        let at = pos2(left + 14.0, rect.center().y);
        let names = ui.painter_at(rect.with_max_x(rect.right() - 18.0));
        names.text(at, Align2::LEFT_CENTER, name, FontId::proportional(12.5), color);
        if keyed {
            let mut mesh = egui::Mesh::default();
            super::axis::diamond(
                &mut mesh,
                pos2(rect.right() - 10.0, rect.center().y),
                4.0,
                Color32::from_gray(170),
            );
            ui.painter().add(mesh);
        }
        if Some(bone) == state.selection.active() {
            ui.painter().rect_stroke(
                rect,
                2.0,
                Stroke::new(1.0, ui.visuals().selection.stroke.color),
                egui::StrokeKind::Inside,
            );
        }
        if response.clicked() {
            let on_fold = response.interact_pointer_pos().is_some_and(|p| fold.contains(p));
            if has_children && on_fold {
                if !self.folded.remove(&bone) {
                    self.folded.insert(bone);
                }
            } else {
                self.choose(ui, rows, row, bone, bus);
            }
        }
        response.context_menu(|ui| {
            if ui.button("Select with children").clicked() {
                let all = skeleton.subtree(bone).map(|i| BoneId(i as u32)).collect();
                bus.send(Command::SelectBones(all, Mode::Replace));
                ui.close();
            }
            menu(ui, &["Pose"], state, bus);
        });
    }

    /// A click; with Ctrl one more or less, with Shift all from the last one.
    fn choose(&mut self, ui: &egui::Ui, rows: &[(BoneId, usize)], row: usize, bone: BoneId, bus: &mut Bus) {
        let (ctrl, shift) = ui.input(|i| (i.modifiers.command, i.modifiers.shift));
        self.shown = Some(bone);
        if let (true, Some(from)) = (shift, self.range_from.filter(|&f| f < rows.len())) {
            let run = rows[from.min(row)..=from.max(row)].iter().map(|r| r.0).collect();
            bus.send(Command::SelectBones(run, Mode::Add));
        } else {
            let mode = if ctrl || shift { Mode::Toggle } else { Mode::Replace };
            bus.send(Command::SelectBones(vec![bone], mode));
        }
        self.range_from = Some(row);
    }
}
