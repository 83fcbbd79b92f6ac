//! The graph editor: values over time. What is seen is sampled every other point; the value axis fits itself.

use super::axis::{self, Axis, RULER, SELECTED};
use super::dope::{Names, menu};
use super::grip::{Drag, Grip};
use crate::Bus;
use crate::commands::Task;
use crate::state::document::{components, track_name};
use crate::state::{Command, Keys, Mode, Spans, State, TrackKeys};
use egui::{Align2, Color32, FontId, PointerButton, Pos2, Rect, Sense, Stroke, Vec2, pos2};
use sinew::clip::{Interpolation, Target, Track};

/// Width of the values.
const LABELS: f32 = 58.0;
/// Curves shown at once; more could not be told apart.
const MOST: usize = 96;

/// The pane.
#[derive(Default)]
pub struct Graph {
    /// Bottom and top value, where somebody panned; else it fits itself.
    held: Option<(f64, f64)>,
    last_fit: Option<(f64, f64)>,
    grip: Grip,
    last_time: f64,
    /// What a command asked for, to be done when the pane is drawn next.
    pub pending: Option<Task>,
}

/// One component of a track.
struct Channel<'a> {
    track: usize,
    component: usize,
    of: &'a Track,
    name: String,
    color: Color32,
    /// Shown value is `(stored · unit − middle) / half`: degrees, or −1…1 where curves are normalised.
    unit: f64,
    middle: f64,
    half: f64,
}

impl Channel<'_> {
    fn shown(&self, stored: f32) -> f64 {
        (f64::from(stored) * self.unit - self.middle) / self.half
    }

    /// Stored value a unit of the axis.
    fn stored_unit(&self) -> f64 {
        self.half / self.unit
    }

    fn key(&self, k: usize) -> (f64, f64) {
        (self.of.curve.times()[k], self.shown(self.of.curve.value(k)[self.component]))
    }

    fn at(&self, t: f64) -> f64 {
        if let Target::Rotation(_) = self.of.target {
            return self.shown(self.of.curve.sample_rotation(t).to_array()[self.component]);
        }
        let mut v = vec![0.0; self.of.curve.width()];
        self.of.curve.sample(t, &mut v);
        self.shown(v[self.component])
    }

    fn bit(&self) -> u8 {
        1 << self.component.min(7)
    }
}

/// Values to points.
#[derive(Clone, Copy)]
struct Values {
    rect: Rect,
    low: f64,
    high: f64,
}

impl Values {
    fn y(&self, v: f64) -> f32 {
        let part = (v - self.low) / (self.high - self.low);
        self.rect.bottom() - (part.clamp(-1e3, 1e3) as f32) * self.rect.height()
    }

    fn v(&self, y: f32) -> f64 {
        self.low + f64::from((self.rect.bottom() - y) / self.rect.height()) * (self.high - self.low)
    }
}

impl Graph {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let pane = ui.max_rect();
        let rect = Rect::from_min_max(pane.min + Vec2::new(LABELS, RULER), pane.max);
        let axis = Axis::new(&state.view, rect);
        let channels = channels(state, &axis);
        let (low, high) = self.range(&channels, &axis);
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
    fn range(&mut self, channels: &[Channel<'_>], axis: &Axis) -> (f64, f64) {
        if let Some(held) = self.held {
            return held;
        }
        if let (Some(last), true) = (self.last_fit, self.grip.drag != Drag::None) {
            return last;
        }
        let mut ends: Option<(f64, f64)> = None;
        for c in channels {
            let (a, b) = extent(c, axis);
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
        let toggled = ui.put(left, egui::Button::new("fit").small().selected(fit));
        let help = "Values fit the pane by themselves; Shift and the wheel, or a middle drag, hold them";
        if toggled.on_hover_text(help).accessible_name("Fit values").clicked() {
            fit = !fit;
            self.held = if fit { None } else { self.last_fit };
        }
        let normal = ui.put(right, egui::Button::new("0–1").small().selected(state.view.normalise));
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
        if !(pressed && sense.is_pointer_button_down_on() && axis.rect.contains(at)) {
            return;
        }
        let Some((channel, k)) = nearest(channels, axis, values, at) else {
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
        if click.is_none() {
            bus.send(Command::SelectKeys(keys, if shift { Mode::Add } else { Mode::Replace }));
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
        let painter = ui
            .painter_at(axis.rect)
            .with_layer_id(egui::LayerId::new(egui::Order::Foreground, ui.scope_id()));
        painter.rect(
            shown,
            0.0,
            SELECTED.gamma_multiply(0.1),
            Stroke::new(1.0, SELECTED),
            egui::StrokeKind::Inside,
        );
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
        let mut names = Names(ui);
        for c in channels {
            curve(&inner, axis, values, c);
            let chosen = state.selection.keys.get(&(c.track as u32)).filter(|k| k.mask & c.bit() != 0);
            let seen = axis.visible(c.of.curve.times());

            // Keys too close to be taken one by one are left to the curve.
            let crowded = seen.len() as f32 > axis.rect.width() / 4.0;
            for k in seen.filter(|_| !crowded) {
                let (t, v) = c.key(k);
                let at = pos2(axis.x(t), values.y(v));
                let on = chosen.is_some_and(|s| s.spans.contains(k));
                if on {
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
            let text = "Select bones, or keys in the dope sheet, to see their curves";
            inner.text(axis.rect.center(), Align2::CENTER_CENTER, text, font, ui.visuals().weak_text_color());
        }
    }
}

/// Curves of the selected bones, or of the tracks whose keys are selected.
fn channels<'a>(state: &'a State, axis: &Axis) -> Vec<Channel<'a>> {
    let skeleton = state.document.skeleton();
    let bones = &state.selection.bones;
    let of = |(i, t): &(usize, &std::sync::Arc<Track>)| match t.target.bone() {
        Some(b) if !bones.is_empty() => bones.contains(&b),
        _ => state.selection.keys.contains_key(&(*i as u32)),
    };
    let mut out = Vec::new();
    for (track, t) in state.active().tracks.iter().enumerate().filter(of) {
        let full = track_name(skeleton, t);
        let bone = full.rsplit_once('.').map_or(full.as_str(), |(b, _)| b);
        let unit = if matches!(t.target, Target::Xzx(_)) { 180.0 / std::f64::consts::PI } else { 1.0 };
        for (component, name) in components(t).into_iter().enumerate() {
            let color = hue(component, track);
            let mut c = Channel {
                track,
                component,
                of: t,
                name: format!("{bone}.{name}"),
                color,
                unit,
                middle: 0.0,
                half: 1.0,
            };
            if state.view.normalise {
                let (lo, hi) = extent(&c, axis);
                (c.middle, c.half) = ((lo + hi) / 2.0, ((hi - lo) / 2.0).max(1e-6));
            }
            out.push(c);
            if out.len() == MOST {
                return out;
            }
        }
    }
    out
}

/// Red, green, blue by component; paler from bone to bone.
fn hue(component: usize, track: usize) -> Color32 {
    let base = [[240, 90, 90], [110, 210, 90], [90, 150, 255], [220, 180, 80]][component % 4];
    let pale = (track % 3) as f32 * 0.25;
    let [r, g, b] = base.map(|c| (c as f32 + (235.0 - c as f32) * pale) as u8);
    Color32::from_rgb(r, g, b)
}

/// Smallest and largest value of what can be seen of a curve.
fn extent(c: &Channel<'_>, axis: &Axis) -> (f64, f64) {
    let samples =
        (0..=64).map(|i| axis.t(axis.rect.left() + axis.rect.width() * i as f32 / 64.0)).map(|t| c.at(t));
    let seen = axis.visible(c.of.curve.times());
    let step = (seen.len() / 256).max(1);
    let keys = seen.step_by(step).map(|k| c.key(k).1);
    samples.chain(keys).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
}

/// The key within half a hit area of a point.
fn nearest<'c, 'a>(
    channels: &'c [Channel<'a>],
    axis: &Axis,
    values: &Values,
    at: Pos2,
) -> Option<(&'c Channel<'a>, usize)> {
    let (t0, t1) = (axis.t(at.x - axis::HIT), axis.t(at.x + axis::HIT));
    let near = channels.iter().flat_map(|c| {
        let times = c.of.curve.times();
        let run = times.partition_point(|&t| t < t0)..times.partition_point(|&t| t <= t1);
        run.map(move |k| (c, k))
    });
    let far = |(c, k): &(&Channel<'_>, usize)| {
        let (t, v) = c.key(*k);
        pos2(axis.x(t), values.y(v)).distance(at)
    };
    near.filter(|n| far(n) <= axis::HIT * 1.4).min_by(|a, b| far(a).total_cmp(&far(b)))
}

fn curve(painter: &egui::Painter, axis: &Axis, values: &Values, c: &Channel<'_>) {
    let stroke = Stroke::new(1.3, c.color);
    let rect = axis.rect;
    let mut points = Vec::new();
    if c.of.curve.interpolation() == Interpolation::Hold {
        // Steps, drawn as steps, by the keys that are there, as far as they can be told apart.
        let mut last = c.at(axis.t(rect.left()));
        points.push(pos2(rect.left(), values.y(last)));
        let mut x = rect.left();
        for k in axis.visible(c.of.curve.times()) {
            let (t, v) = c.key(k);
            if axis.x(t) - x >= 1.0 {
                x = axis.x(t);
                points.push(pos2(x, values.y(last)));
                points.push(pos2(x, values.y(v)));
            }
            last = v;
        }
        points.push(pos2(rect.right(), values.y(last)));
    } else {
        let mut x = rect.left();
        while x <= rect.right() + 2.0 {
            points.push(pos2(x, values.y(c.at(axis.t(x)))));
            x += 2.0;
        }
    }
    painter.add(egui::Shape::line(points, stroke));
}

/// The slope at a selected key, on either side.
fn tangent(painter: &egui::Painter, axis: &Axis, values: &Values, c: &Channel<'_>, k: usize, at: Pos2) {
    let (t, v) = c.key(k);
    let small = (axis.scale * 0.5).max(1e-5);
    for side in [-1.0, 1.0] {
        let slope = (c.at(t + side * small) - v) / small;
        let to = pos2(axis.x(t + side * 30.0 * axis.scale), values.y(v + slope * 30.0 * axis.scale));
        let arm = (to - at).normalized() * 30.0;
        if arm.is_finite() && c.of.curve.interpolation() != Interpolation::Hold {
            painter.line_segment([at, at + arm], Stroke::new(1.0, SELECTED));
            painter.circle_filled(at + arm, 2.0, SELECTED);
        }
    }
}

/// Lines of round values with their numbers.
fn levels(painter: &egui::Painter, values: &Values, visuals: &egui::Visuals) {
    let span = values.high - values.low;
    let rough = span / f64::from((values.rect.height() / 32.0).max(1.0));
    let ten = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * ten).find(|s| *s >= rough).unwrap_or(ten);
    let count = (span / step).clamp(0.0, 60.0) as usize + 2;
    let first = (values.low / step).floor() * step;
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    for v in (0..count).map(|i| first + i as f64 * step) {
        let y = values.y(v);
        if values.rect.y_range().contains(y) {
            let faint =
                visuals.weak_text_color().gamma_multiply(if v.abs() < step * 1e-6 { 0.5 } else { 0.15 });
            painter.hline(values.rect.x_range(), y, Stroke::new(1.0, faint));
            let at = pos2(values.rect.left() - 4.0, y);
            let text = format!("{:.decimals$}", v + 0.0);
            painter.text(
                at,
                Align2::RIGHT_CENTER,
                text,
                FontId::proportional(10.0),
                visuals.weak_text_color(),
            );
        }
    }
}

fn legend(painter: &egui::Painter, axis: &Axis, channels: &[Channel<'_>]) {
    let lines = ((axis.rect.height() - 20.0) / 13.0).max(1.0) as usize;
    for (i, c) in channels.iter().take(lines).enumerate() {
        let at = axis.rect.left_top() + Vec2::new(8.0, 4.0 + 13.0 * i as f32);
        let unit = if c.unit == 1.0 { "" } else { " °" };
        painter.text(at, Align2::LEFT_TOP, format!("{}{unit}", c.name), FontId::proportional(11.0), c.color);
    }
    if channels.len() > lines {
        let at = axis.rect.left_top() + Vec2::new(8.0, 4.0 + 13.0 * lines as f32);
        let text = format!("and {} more", channels.len() - lines);
        painter.text(at, Align2::LEFT_TOP, text, FontId::proportional(11.0), Color32::GRAY);
    }
}

/// Said where it bites: at θ₂ = 0 the two twists are one.
pub fn singular(state: &State) -> Option<String> {
    let bone = state.selection.active()?;
    state.track_of(&Target::Xzx(bone)).or(state.loose.get(&bone).and_then(|l| l.theta).map(|_| 0))?;
    let theta = state.theta(bone);
    let name = state.document.skeleton().name(bone);
    (theta.y.sin().abs() < 0.05).then(|| {
        let sum = if theta.y.cos() > 0.0 { theta.x + theta.z } else { theta.z - theta.x };
        let sign = if theta.y.cos() > 0.0 { "θ1 + θ3" } else { "θ3 − θ1" };
        format!(
            "{name}: θ2 is near {:.0}°, so θ1 and θ3 turn about one axis: only {sign} = {:.1}° shows",
            theta.y.to_degrees(),
            sum.to_degrees()
        )
    })
}
