//! Time along a pane: where a second is, the ruler, zoom and pan, the playhead.

use crate::Bus;
use crate::state::{Command, Edit, State, View};
use egui::{Align2, Color32, FontId, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, pos2};
use sinew::time::Marker;

/// Height of the ruler, points.
pub const RULER: f32 = 26.0;
/// The playhead.
pub const PLAYHEAD: Color32 = Color32::from_rgb(90, 160, 255);
/// Selected keys.
pub const SELECTED: Color32 = Color32::from_rgb(255, 190, 60);
/// Seconds a point: a tenth of a microsecond to an hour.
const SCALES: (f64, f64) = (1e-6, 3600.0);

/// Seconds to points in one pane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Where keys are drawn, below the ruler.
    pub rect: Rect,
    /// Seconds at its left edge.
    pub start: f64,
    /// Seconds a point.
    pub scale: f64,
}

impl Axis {
    /// Of a pane whose keys are drawn in `rect`.
    pub fn new(view: &View, rect: Rect) -> Self {
        let scale =
            if view.time_scale.is_finite() { view.time_scale.clamp(SCALES.0, SCALES.1) } else { 0.004 };
        let start = if view.time_start.is_finite() { view.time_start } else { 0.0 };
        Self { rect, start, scale }
    }

    /// Point of a second.
    pub fn x(&self, t: f64) -> f32 {
        self.rect.left() + ((t - self.start) / self.scale).clamp(-1e6, 1e6) as f32
    }

    /// Second of a point.
    pub fn t(&self, x: f32) -> f64 {
        self.start + f64::from(x - self.rect.left()) * self.scale
    }

    /// Keys of `times` that can be seen, half a diamond over the edges included.
    pub fn visible(&self, times: &[f64]) -> std::ops::Range<usize> {
        let (a, b) = (self.t(self.rect.left() - 8.0), self.t(self.rect.right() + 8.0));
        times.partition_point(|&t| t < a)..times.partition_point(|&t| t <= b)
    }

    /// Keys of `times` within half a hit area of `x`, the nearest first chosen.
    pub fn hit(&self, times: &[f64], x: f32) -> Option<usize> {
        let t = self.t(x);
        let after = times.partition_point(|&k| k < t);
        let near = |k: usize| (self.x(times[k]) - x).abs();
        let candidates = [after.checked_sub(1), Some(after).filter(|&k| k < times.len())];
        let best = candidates.into_iter().flatten().min_by(|&a, &b| near(a).total_cmp(&near(b)))?;
        (near(best) <= HIT).then_some(best)
    }
}

/// Half a hit area: keys can be taken by 14 points.
pub const HIT: f32 = 7.0;

/// Wheel and middle button over the pane; `rows` takes what is scrolled up and down.
pub fn navigate(ui: &egui::Ui, pane: Rect, axis: &Axis, state: &State, bus: &mut Bus) -> f32 {
    let over = ui.rect_contains_pointer(pane);
    let pointer = ui.input(|i| i.pointer.hover_pos());
    let mut rows = 0.0;
    let (mut start, mut scale) = (axis.start, axis.scale);
    if let (true, Some(at)) = (over, pointer) {
        let (wheel, pinch, shift) =
            ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta(), i.modifiers.shift));
        if shift || at.x < axis.rect.left() {
            // With Shift the system may have turned the wheel sideways.
            rows = if wheel.y == 0.0 { wheel.x } else { wheel.y };
        } else {
            let factor = f64::from((-wheel.y * 0.004).exp() / pinch);
            let still = axis.t(at.x);
            scale = (scale * factor).clamp(SCALES.0, SCALES.1);
            start = still - f64::from(at.x - axis.rect.left()) * scale - f64::from(wheel.x) * scale;
        }
    }
    let (middle, delta, origin) = ui.input(|i| {
        (i.pointer.button_down(PointerButton::Middle), i.pointer.delta(), i.pointer.press_origin())
    });
    if middle && origin.is_some_and(|o| pane.contains(o)) {
        start -= f64::from(delta.x) * scale;
        rows += delta.y;
    }
    show(start, scale, axis, state, bus);
    rows
}

fn show(start: f64, scale: f64, axis: &Axis, state: &State, bus: &mut Bus) {
    if (start, scale) != (axis.start, axis.scale) && start.is_finite() {
        bus.send(Command::SetView(View { time_start: start, time_scale: scale, ..state.view.clone() }));
    }
}

/// Show a range with some room at the ends.
pub fn frame(from: f64, to: f64, width: f32, state: &State, bus: &mut Bus) {
    let room = ((to - from) * 0.05).max(4.0 * state.frame_seconds());
    let (time_start, span) = (from - room, to - from + 2.0 * room);
    let time_scale = span / f64::from(width.max(50.0));
    bus.send(Command::SetView(View { time_start, time_scale, ..state.view.clone() }));
}

/// The ruler over the keys: ticks, range, markers; a drag in it scrubs.
pub fn ruler(ui: &mut egui::Ui, axis: &Axis, name: &str, state: &State, bus: &mut Bus) {
    let rect = Rect::from_min_max(pos2(axis.rect.left(), axis.rect.top() - RULER), axis.rect.right_top());
    let response = ui.interact(rect, ui.scope_id().with("ruler"), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Slider, true, name));
    let held = response.is_pointer_button_down_on() && ui.input(|i| i.pointer.primary_down());
    let taken = held || response.dragged_by(PointerButton::Primary) || response.clicked();
    if let (true, Some(at)) = (taken, response.interact_pointer_pos()) {
        // Beyond an edge the pane runs along, so the playhead stays in view.
        let x = at.x.clamp(rect.left(), rect.right());
        let over = at.x - x;
        if over != 0.0 {
            show(axis.start + f64::from(over) * 0.2 * axis.scale, axis.scale, axis, state, bus);
        }
        let t = state.key_time(axis.t(x));
        if t != state.time {
            bus.send(Command::SetTime(t));
        }
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
    band(
        &painter,
        rect,
        axis,
        state.playback.range.start,
        state.playback.range.end,
        PLAYHEAD.gamma_multiply(0.18),
    );
    for (t, label) in ticks(axis, state) {
        let x = axis.x(t);
        let height = if label.is_some() { 8.0 } else { 4.0 };
        painter.vline(
            x,
            rect.bottom() - height..=rect.bottom(),
            Stroke::new(1.0, ui.visuals().weak_text_color()),
        );
        if let Some(label) = label {
            let font = FontId::proportional(10.0);
            painter.text(
                pos2(x + 2.0, rect.top() + 1.0),
                Align2::LEFT_TOP,
                label,
                font,
                ui.visuals().text_color(),
            );
        }
    }
    markers(ui, &painter, rect, axis, name, state, bus);
    head(&painter, rect, axis, state);
}

fn band(painter: &egui::Painter, rect: Rect, axis: &Axis, from: f64, to: f64, color: Color32) {
    let (a, b) = (axis.x(from).max(rect.left()), axis.x(to).min(rect.right()));
    if a < b {
        painter.rect_filled(Rect::from_min_max(pos2(a, rect.top()), pos2(b, rect.bottom())), 0.0, color);
    }
}

fn markers(
    ui: &egui::Ui,
    painter: &egui::Painter,
    rect: Rect,
    axis: &Axis,
    ruler: &str,
    state: &State,
    bus: &mut Bus,
) {
    let green = Color32::from_rgb(120, 210, 120);
    for (i, marker) in state.active().markers.iter().enumerate() {
        let x = axis.x(marker.time);
        if !(rect.left()..=rect.right()).contains(&x) {
            continue;
        }
        let hit = Rect::from_center_size(pos2(x, rect.bottom() - 7.0), Vec2::splat(14.0));
        let response = ui.interact(hit, ui.scope_id().with(("marker", i)), Sense::click());
        let name = format!("{ruler}: {}", marker.name);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Button, true, &name));
        if response.clicked() {
            bus.send(Command::SetTime(marker.time));
        }
        response.context_menu(|ui| marker_menu(ui, marker, bus));
        let tip = pos2(x, rect.bottom());
        let up = [tip, tip + Vec2::new(-4.0, -7.0), tip + Vec2::new(4.0, -7.0)];
        painter.add(egui::Shape::convex_polygon(up.to_vec(), green, Stroke::NONE));
        painter.text(
            tip + Vec2::new(5.0, 0.0),
            Align2::LEFT_BOTTOM,
            &marker.name,
            FontId::proportional(10.0),
            green,
        );
    }
}

/// Another name, or none.
fn marker_menu(ui: &mut egui::Ui, marker: &Marker, bus: &mut Bus) {
    let name = super::parts::name(ui, "Name of the marker", &marker.name);
    let gone = ui.button("Remove marker").clicked();
    if gone {
        bus.send(Command::Do(Edit::RemoveMarker(marker.time)));
    }
    let done = name.is_some();
    name.into_iter().for_each(|name| {
        bus.send(Command::Do(Edit::SetMarker(Marker { name, ..marker.clone() })));
    });
    if done || gone {
        ui.close();
    }
}

fn head(painter: &egui::Painter, rect: Rect, axis: &Axis, state: &State) {
    let x = axis.x(state.time);
    let frame = state.frame_at(state.time);
    let text =
        if (frame - frame.round()).abs() < 1e-6 { format!("{frame:.0}") } else { format!("{frame:.2}") };
    let galley = painter.layout_no_wrap(text, FontId::proportional(11.0), Color32::WHITE);
    let size = galley.size() + Vec2::new(8.0, 2.0);
    let tag = Rect::from_center_size(pos2(x, rect.top() + size.y / 2.0), size);
    painter.rect_filled(tag, 3.0, Color32::from_rgb(40, 100, 200));
    painter.galley(tag.min + Vec2::new(4.0, 1.0), galley, Color32::WHITE);
    painter.vline(x, tag.bottom()..=rect.bottom(), Stroke::new(1.5, PLAYHEAD));
}

/// Under the keys: what is not played is darker, every labelled tick has a line, and so has the playhead.
pub fn grid(painter: &egui::Painter, axis: &Axis, state: &State, visuals: &egui::Visuals) {
    let rect = axis.rect;
    let dark = Color32::from_black_alpha(70);
    band(painter, rect, axis, f64::NEG_INFINITY, state.playback.range.start, dark);
    band(painter, rect, axis, state.playback.range.end, f64::INFINITY, dark);
    let faint = Stroke::new(1.0, visuals.weak_text_color().gamma_multiply(0.18));
    for (t, _) in ticks(axis, state).into_iter().filter(|t| t.1.is_some()) {
        painter.vline(axis.x(t), rect.y_range(), faint);
    }
    for marker in &state.active().markers {
        let green = Stroke::new(1.0, Color32::from_rgb(120, 210, 120).gamma_multiply(0.35));
        painter.vline(axis.x(marker.time), rect.y_range(), green);
    }
}

/// Over the keys.
pub fn playhead(painter: &egui::Painter, axis: &Axis, state: &State) {
    painter.vline(axis.x(state.time), axis.rect.y_range(), Stroke::new(1.5, PLAYHEAD));
}

/// Where ticks are: whole frames 1, 2, 5, 10, … apart, so that labels have 50 points each.
fn ticks(axis: &Axis, state: &State) -> Vec<(f64, Option<String>)> {
    let frame = state.frame_seconds() / axis.scale;
    let apart = |points: f64| {
        let at_least = (points / frame).max(1.0);
        let ten = 10f64.powf(at_least.log10().floor());
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * ten).find(|s| *s >= at_least * 0.999).unwrap_or(ten)
    };
    let (big, small) = (apart(50.0), apart(8.0));
    let first = (state.frame_at(axis.t(axis.rect.left())) / small).floor() * small;
    let count = (f64::from(axis.rect.width()) / (frame * small)).ceil().min(4000.0) as usize + 2;
    let label = |f: f64| ((f / big).round() * big - f).abs().lt(&1e-6).then(|| format!("{f:.0}"));
    (0..count).map(|i| first + i as f64 * small).map(|f| (state.time_of(f), label(f))).collect()
}

/// Turn the page when the playhead leaves the pane by itself.
pub fn follow(axis: &Axis, last: &mut f64, state: &State, bus: &mut Bus) {
    let moved = last.to_bits() != state.time.to_bits();
    *last = state.time;
    let (left, right) = (axis.t(axis.rect.left()), axis.t(axis.rect.right()));
    if moved && !(left..=right).contains(&state.time) {
        show(state.time - 0.1 * (right - left), axis.scale, axis, state, bus);
    }
}

/// A key: a diamond with soft edges, four corners of it opaque.
pub fn diamond(mesh: &mut egui::Mesh, at: Pos2, radius: f32, color: Color32) {
    let base = mesh.vertices.len() as u32;
    for (r, c) in [(radius - 0.5, color), (radius + 0.7, Color32::TRANSPARENT)] {
        for d in [Vec2::new(0.0, -r), Vec2::new(r, 0.0), Vec2::new(0.0, r), Vec2::new(-r, 0.0)] {
            mesh.colored_vertex(at + d, c);
        }
    }
    mesh.add_triangle(base, base + 1, base + 2);
    mesh.add_triangle(base, base + 2, base + 3);
    for k in 0..4 {
        let (a, b) = (base + k, base + (k + 1) % 4);
        mesh.add_triangle(a, b, b + 4);
        mesh.add_triangle(a, b + 4, a + 4);
    }
}
