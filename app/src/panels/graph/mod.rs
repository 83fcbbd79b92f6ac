//! The graph editor: values over time. What is seen is sampled every other point; the value axis fits itself.

mod channel;
mod draw;

pub use draw::singular;

use super::axis::{self, Axis, RULER, SELECTED};
use super::grip::{self, Drag, Grip};
use super::parts::{Names, menu};
use crate::Bus;
use crate::commands::Task;
use crate::state::{Command, Keys, Mode, Spans, State, TrackKeys};
use channel::{Channel, Looks, Values, channels, nearest};
use draw::{curve, legend, levels, tangent};
use egui::{Align2, Color32, FontId, PointerButton, Pos2, Rect, Sense, Vec2, pos2};

/// Width of the values.
const LABELS: f32 = 66.0;
/// The pane.
#[derive(Default)]
pub struct Graph {
    /// Bottom and top value, where somebody panned; else it fits itself.
    held: Option<(f64, f64)>,
    last_fit: Option<(f64, f64)>,
    grip: Grip,
    last_time: f64,
    looks: Looks,
    /// What a command asked for, to be done when the pane is drawn next.
    pub pending: Option<Task>,
}

impl Graph {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let pane = ui.max_rect();
        let rect = Rect::from_min_max(pane.min + Vec2::new(LABELS, RULER), pane.max);
        let axis = Axis::new(&state.view, rect);
        let channels = channels(state, &axis, &mut self.looks);
        let (low, high) = self.range(&channels);
        let values = Values { rect, low, high };

        let sense = ui.interact(pane, ui.scope_id().with("graph"), Sense::click_and_drag());
        sense.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Canvas, true, "Graph curves"));
        let up = axis::navigate(ui, pane, &axis, state, bus);
        self.scroll(ui, pane, up, &values);
        axis::follow(&axis, &mut self.last_time, state, bus);
        axis::ruler(ui, &axis, "Graph ruler", state, bus);
        self.corner(ui, Rect::from_min_max(pane.min, rect.left_top()), state, bus);
        self.pointer(ui, &sense, &axis, &values, &channels, state, bus);
        self.paint(ui, &axis, &values, &channels, state);
        sense.context_menu(|ui| menu(ui, &["Keys", "Time"], state, bus));
    }

    /// Values fit the pane again.
    pub fn fit(&mut self) {
        self.held = None;
    }

    /// Bottom and top: what somebody chose, or what is there; while keys are dragged it stays.
    fn range(&mut self, channels: &[Channel<'_>]) -> (f64, f64) {
        if let Some(held) = self.held {
            return held;
        }
        if let (Some(last), true) = (self.last_fit, self.grip.drag != Drag::None) {
            return last;
        }
        let mut ends: Option<(f64, f64)> = None;
        for c in channels {
            let (a, b) = c.extent();
            ends = Some(ends.map_or((a, b), |(lo, hi)| (lo.min(a), hi.max(b))));
        }
        let (lo, hi) = ends.unwrap_or((-1.0, 1.0));
        let room = ((hi - lo) * 0.12).max(0.02 * hi.abs().max(lo.abs()).max(0.5));
        self.last_fit = Some((lo - room, hi + room));
        (lo - room, hi + room)
    }

    /// Shift and the wheel zoom values at the pointer; a middle drag pans them; both hold the axis.
    fn scroll(&mut self, ui: &egui::Ui, pane: Rect, up: f32, values: &Values) {
        if up == 0.0 {
            return;
        }
        let at = ui.input(|i| i.pointer.hover_pos()).map_or(values.rect.center().y, |p| p.y);
        let (low, high) = (values.low, values.high);
        let middle = ui.input(|i| i.pointer.button_down(PointerButton::Middle));
        self.held = Some(if middle {
            let by = f64::from(up / values.rect.height()) * (high - low);
            (low + by, high + by)
        } else {
            let (still, factor) = (values.v(at), f64::from((-up * 0.004).exp()));
            (still + (low - still) * factor, still + (high - still) * factor)
        });
        if middle && !ui.input(|i| i.pointer.press_origin()).is_some_and(|o| pane.contains(o)) {
            self.held = None;
        }
    }

    fn corner(&mut self, ui: &mut egui::Ui, rect: Rect, state: &State, bus: &mut Bus) {
        let mut fit = self.held.is_none();
        let left = Rect::from_min_size(rect.min, Vec2::new(rect.width() / 2.0, rect.height())).shrink(2.0);
        let right = left.translate(Vec2::new(rect.width() / 2.0, 0.0));
        let toggled = ui.put(left, small("fit", fit));
        let help = "Values fit the pane by themselves; Shift and the wheel, or a middle drag, hold them";
        if toggled.on_hover_text(help).accessible_name("Fit values").clicked() {
            fit = !fit;
            self.held = if fit { None } else { self.last_fit };
        }
        let normal = ui.put(right, small("0–1", state.view.normalise));
        if normal
            .on_hover_text("Each curve fills the height (N)")
            .accessible_name("Normalise curves")
            .clicked()
        {
            bus.run(crate::commands::named("Normalise curves"), state);
        }
    }

    fn pointer(
        &mut self,
        ui: &egui::Ui,
        sense: &egui::Response,
        axis: &Axis,
        values: &Values,
        channels: &[Channel<'_>],
        state: &State,
        bus: &mut Bus,
    ) {
        let Some(at) = ui.input(|i| i.pointer.latest_pos()) else { return };
        let here = (axis.t(at.x), values.v(at.y));
        if let Some(task) = self.pending.take() {
            let unit = channels.iter().find(|c| state.selection.keys.contains_key(&(c.track as u32)));
            self.grip.start(task, here, unit.map_or(0.0, Channel::stored_unit), bus);
            return;
        }
        if self.grip.follow(ui, here, false, state, bus) {
            return;
        }
        if let Drag::Box { from } = self.grip.drag {
            self.boxed(ui, axis, values, channels, (at, here), from, bus);
            return;
        }
        let shift = ui.input(|i| i.modifiers.shift || i.modifiers.command);
        let pressed = ui.input(|i| i.pointer.button_pressed(PointerButton::Primary));
        // A tap is pressed and released within one frame.
        let tapped = pressed && sense.clicked();
        let down = pressed && sense.is_pointer_button_down_on();
        if !((down || tapped) && axis.rect.contains(at)) {
            return;
        }
        let mode = if shift { Mode::Add } else { Mode::Replace };
        let Some((channel, k)) = nearest(channels, axis, values, at) else {
            if tapped {
                return bus.send(Command::SelectKeys(Keys::new(), mode));
            }
            self.grip.drag = Drag::Box { from: here };
            return;
        };
        let keys = Keys::from([(
            channel.track as u32,
            TrackKeys { spans: Spans::one(k..k + 1), mask: channel.bit() },
        )]);
        let chosen = state.selection.keys.get(&(channel.track as u32));
        let selected = chosen.is_some_and(|s| s.spans.contains(k) && s.mask & channel.bit() != 0);
        let click = Some(keys.clone()).filter(|_| selected && !shift);
        if tapped || click.is_none() {
            bus.send(Command::SelectKeys(keys, mode));
        }
        if tapped {
            return;
        }
        self.grip.take(here, channel.stored_unit(), bus);
        self.grip.click = click;
    }

    fn boxed(
        &mut self,
        ui: &egui::Ui,
        axis: &Axis,
        values: &Values,
        channels: &[Channel<'_>],
        (at, to): (Pos2, (f64, f64)),
        from: (f64, f64),
        bus: &mut Bus,
    ) {
        if ui.input(|i| i.key_pressed(egui::Key::Escape)) {
            self.grip.drag = Drag::None;
            return;
        }
        let shown = Rect::from_two_pos(pos2(axis.x(from.0), values.y(from.1)), at);
        grip::draw_box(ui, axis.rect, shown);
        if !ui.input(|i| i.pointer.primary_released()) {
            return;
        }
        self.grip.drag = Drag::None;
        let mut keys = Keys::new();
        for c in channels.iter().filter(|_| shown.size().max_elem() >= 3.0) {
            let (v0, v1) = (from.1.min(to.1), from.1.max(to.1));
            let (t0, t1) = (from.0.min(to.0), from.0.max(to.0));
            let times = c.of.curve.times();
            let run = times.partition_point(|&t| t < t0)..times.partition_point(|&t| t <= t1);
            let spans = Spans::from_indices(run.filter(|&k| (v0..=v1).contains(&c.key(k).1)));
            if !spans.is_empty() {
                let slot =
                    keys.entry(c.track as u32).or_insert(TrackKeys { spans: Spans::default(), mask: 0 });
                *slot = TrackKeys { spans: slot.spans.union(&spans), mask: slot.mask | c.bit() };
            }
        }
        let add = ui.input(|i| i.modifiers.shift);
        bus.send(Command::SelectKeys(keys, if add { Mode::Add } else { Mode::Replace }));
    }

    fn paint(&self, ui: &egui::Ui, axis: &Axis, values: &Values, channels: &[Channel<'_>], state: &State) {
        let painter = ui.painter_at(ui.max_rect());
        let inner = painter.with_clip_rect(axis.rect);
        axis::grid(&inner, axis, state, ui.visuals());
        levels(&painter, values, ui.visuals());
        let mut mesh = egui::Mesh::default();
        let mut names = Names::of(ui, "graph");
        // Slopes of many keys would hide the curves.
        let few = state.selection.key_count() <= 24;
        for c in channels {
            curve(&inner, axis, values, c);
            let chosen = state.selection.keys.get(&(c.track as u32)).filter(|k| k.mask & c.bit() != 0);
            let seen = axis.visible(c.of.curve.times());

            // Keys too close to be taken one by one are left to the curve.
            let crowded = seen.len() as f32 > axis.rect.width() / 4.0;
            for k in if crowded { 0..0 } else { seen } {
                let (t, v) = c.key(k);
                let at = pos2(axis.x(t), values.y(v));
                let on = chosen.is_some_and(|s| s.spans.contains(k));
                if on && few {
                    tangent(&inner, axis, values, c, k, at);
                }
                axis::diamond(&mut mesh, at, if on { 5.5 } else { 4.5 }, if on { SELECTED } else { c.color });
                if axis.rect.contains(at) {
                    names.add(at, || format!("{} key {:.0}", c.name, state.frame_at(t)));
                }
            }
        }
        inner.add(mesh);
        axis::playhead(&inner, axis, state);
        legend(&inner, axis, channels);
        let below = axis.rect.right_bottom() - Vec2::new(6.0, 4.0);
        let font = FontId::proportional(11.0);
        if let Some(hint) = self.grip.hint(true) {
            inner.text(below, Align2::RIGHT_BOTTOM, hint, font, SELECTED);
        } else if let Some(hint) = singular(state) {
            inner.text(below, Align2::RIGHT_BOTTOM, hint, font, Color32::from_rgb(240, 200, 120));
        } else if channels.is_empty() {
            let text = match state.selection.bones.is_empty() {
                true => "Select bones, or keys in the dope sheet, to see their curves",
                false => "The selected bones have no keys yet: I sets some",
            };
            inner.text(axis.rect.center(), Align2::CENTER_CENTER, text, font, ui.visuals().weak_text_color());
        }
    }
}

fn small(text: &str, on: bool) -> egui::Button<'_> {
    egui::Button::new(egui::RichText::new(text).size(10.0))
        .small()
        .wrap_mode(egui::TextWrapMode::Extend)
        .selected(on)
}
