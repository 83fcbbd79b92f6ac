//! The dope sheet: a row a track, keys in time. Only what can be seen is looked at: rows by their place, keys by binary search,
//! and keys too close to tell apart as one block, so a frame costs what it shows.

use super::axis::{self, Axis, RULER, SELECTED};
use super::grip::{self, Drag, Grip};
use super::parts::{Names, menu};
use super::summary::Summary;
use crate::Bus;
use crate::commands::Task;
use crate::state::document::track_name;
use crate::state::{Command, EditClip, Keys, Mode, Selection, Spans, State, TrackKeys};
use egui::{Align2, Color32, FontId, PointerButton, Pos2, Rect, Sense, Vec2, pos2};
use std::ops::Range;
use std::sync::Arc;

/// Height of a row, points.
const ROW: f32 = 18.0;
/// Width of the names.
const NAMES: f32 = 150.0;
/// Keys nearer than this are one block.
const APART: f64 = 6.0;

/// The pane.
#[derive(Default)]
pub struct Dope {
    /// Points scrolled down.
    pub scroll: f32,
    filter: String,
    rows: Rows,
    summary: Summary,
    grip: Grip,
    last_time: f64,
    width: f32,
    /// What time was framed for: another file or clip is looked at as a whole.
    shown: Option<(Arc<sinew::asset::Asset>, usize)>,
    /// What a command asked for, to be done when the pane is drawn next.
    pub pending: Option<Task>,
}

/// The tracks shown, kept while what they follow from is the same.
#[derive(Default)]
struct Rows {
    tracks: Vec<u32>,
    of: Option<(Arc<EditClip>, Arc<Selection>, bool, String)>,
}

impl Rows {
    fn update(&mut self, state: &State, filter: &str) {
        let (clip, selection) = (&state.document.clips[state.clip], &state.selection);
        let only = state.view.only_selected;
        let same = |(c, s, o, f): &(Arc<EditClip>, Arc<Selection>, bool, String)| {
            let tracks = Arc::ptr_eq(c, clip) || same_targets(c, clip);
            tracks && (!only || Arc::ptr_eq(s, selection)) && *o == only && f == filter
        };
        if self.of.as_ref().is_some_and(same) {
            return;
        }
        let skeleton = state.document.skeleton();
        let wanted = |t: &u32| {
            let track = &clip.tracks[*t as usize];
            let bone = !only || track.target.bone().is_some_and(|b| selection.bones.contains(&b));
            bone && (filter.is_empty() || track_name(skeleton, track).to_lowercase().contains(filter))
        };
        self.tracks = (0..clip.tracks.len() as u32).filter(wanted).collect();
        // In the order of the skeleton, whatever order the file had.
        self.tracks.sort_by_key(|&t| clip.tracks[t as usize].target.bone().map_or(u32::MAX, |b| b.0));
        self.of = Some((clip.clone(), selection.clone(), only, filter.into()));
    }
}

fn same_targets(a: &EditClip, b: &EditClip) -> bool {
    a.tracks.len() == b.tracks.len() && a.tracks.iter().zip(&b.tracks).all(|(a, b)| a.target == b.target)
}

/// A run of keys that is drawn as one.
struct Block {
    keys: Range<usize>,
    from: f32,
    to: f32,
}

/// What can be seen of `times`, in blocks.
fn blocks(axis: &Axis, times: &[f64]) -> Vec<Block> {
    let seen = axis.visible(times);
    let (mut out, mut k, mut many) = (Vec::new(), seen.start, 1);
    while k < seen.end {
        let end = first_from(times, k + 1..seen.end, times[k] + APART * axis.scale, k + many);
        out.push(Block { keys: k..end, from: axis.x(times[k]), to: axis.x(times[end - 1]) });
        (k, many) = (end, end - k);
    }
    out
}

/// The first key of a run at `limit` or later, looked for around a guess by strides that double: as keys are about as far apart as
/// they were, few are looked at, however many there are.
fn first_from(times: &[f64], run: Range<usize>, limit: f64, guess: usize) -> usize {
    let guess = guess.clamp(run.start, run.end);
    let (mut low, mut high, mut stride) = (guess, guess, 1);
    while high < run.end && times[high] < limit {
        low = high + 1;
        high = (high + stride).min(run.end);
        stride *= 2;
    }
    while low > run.start && times[low - 1] >= limit {
        high = low - 1;
        low = low.saturating_sub(stride).max(run.start);
        stride *= 2;
    }
    low + times[low..high].partition_point(|&t| t < limit)
}

impl Dope {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let pane = ui.max_rect();
        self.rows.update(state, &self.filter);
        self.summary.update(&state.document.clips[state.clip]);
        let keys = Rect::from_min_max(pane.min + Vec2::new(NAMES, RULER), pane.max);
        let axis = Axis::new(&state.view, keys);
        self.width = keys.width();
        let same = |(a, c): &(Arc<_>, usize)| Arc::ptr_eq(a, &state.document.asset) && *c == state.clip;
        if !self.shown.as_ref().is_some_and(same) {
            self.shown = Some((state.document.asset.clone(), state.clip));
            let range = state.active().range;
            self.frame(range.start, range.end, state, bus);
        }
        let body = Rect::from_min_max(keys.min + Vec2::new(0.0, ROW), keys.max);

        let sense = ui.interact(pane, ui.scope_id().with("dope"), Sense::click_and_drag());
        sense.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Grid, true, "Dope sheet keys"));
        self.scroll -= axis::navigate(ui, pane, &axis, state, bus);
        self.keep_scroll(body);
        axis::follow(&axis, &mut self.last_time, state, bus);
        self.corner(ui, Rect::from_min_max(pane.min, pos2(keys.left(), keys.top())));
        axis::ruler(ui, &axis, "Dope sheet ruler", state, bus);
        self.pointer(ui, &sense, &axis, body, state, bus);
        self.paint(ui, &axis, pane, body, state);
        sense.context_menu(|ui| menu(ui, &["Keys", "Time"], state, bus));
    }

    /// Show a range of seconds.
    pub fn frame(&self, from: f64, to: f64, state: &State, bus: &mut Bus) {
        axis::frame(from, to, self.width, state, bus);
    }

    fn keep_scroll(&mut self, body: Rect) {
        let most = (self.rows.tracks.len() as f32 * ROW - body.height() + ROW).max(0.0);
        self.scroll = self.scroll.clamp(0.0, most);
    }

    fn corner(&mut self, ui: &mut egui::Ui, rect: Rect) {
        let field = egui::TextEdit::singleline(&mut self.filter).hint_text("filter");
        let response = ui.put(rect.shrink2(Vec2::new(4.0, 3.0)), field);
        if response.changed() {
            self.filter = self.filter.to_lowercase();
        }
        response.accessible_name("Filter of the dope sheet");
    }

    /// Rows that can be seen.
    fn seen(&self, body: Rect) -> Range<usize> {
        let first = (self.scroll / ROW) as usize;
        let last = ((self.scroll + body.height()) / ROW).ceil() as usize;
        first.min(self.rows.tracks.len())..last.min(self.rows.tracks.len())
    }

    fn row_at(&self, body: Rect, y: f32) -> Option<usize> {
        let row = (y - body.top() + self.scroll) / ROW;
        (row >= 0.0 && (row as usize) < self.rows.tracks.len()).then_some(row as usize)
    }

    fn pointer(
        &mut self,
        ui: &egui::Ui,
        sense: &egui::Response,
        axis: &Axis,
        body: Rect,
        state: &State,
        bus: &mut Bus,
    ) {
        let Some(at) = ui.input(|i| i.pointer.latest_pos()) else { return };
        let here = (axis.t(at.x), 0.0);
        if let Some(task) = self.pending.take() {
            self.grip.start(task, here, 0.0, bus);
            return;
        }
        if self.grip.follow(ui, here, true, state, bus) {
            ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
            return;
        }
        if let Drag::Box { from } = self.grip.drag {
            self.boxed(ui, axis, body, at, from, state, bus);
            return;
        }
        let shift = ui.input(|i| i.modifiers.shift || i.modifiers.command);
        let mode = if shift { Mode::Toggle } else { Mode::Replace };
        let pressed = ui.input(|i| i.pointer.button_pressed(PointerButton::Primary));
        // A tap is pressed and released within one frame.
        let tapped = pressed && sense.clicked();
        let down = pressed && sense.is_pointer_button_down_on();
        if (down || tapped) && at.x >= axis.rect.left() && at.y >= axis.rect.top() {
            let (hit, selected) = self.hit(axis, body, at, state);
            if tapped {
                bus.send(Command::SelectKeys(hit, mode));
                return;
            }
            if hit.is_empty() {
                self.grip.drag = Drag::Box { from: (here.0, f64::from(at.y - body.top() + self.scroll)) };
                return;
            }
            let click = Some(hit.clone()).filter(|_| selected && !shift);
            if click.is_none() {
                bus.send(Command::SelectKeys(hit, mode));
            }
            self.grip.take(here, 0.0, bus);
            self.grip.click = click;
        } else if sense.clicked() && at.x < axis.rect.left() {
            let bone = self.row_at(body, at.y).map(|r| self.rows.tracks[r] as usize);
            let bone = bone.and_then(|t| state.active().tracks[t].target.bone());
            bus.send(Command::SelectBones(bone.into_iter().collect(), mode));
        }
    }

    /// Keys under the pointer, and whether they are selected.
    fn hit(&self, axis: &Axis, body: Rect, at: Pos2, state: &State) -> (Keys, bool) {
        let clip = state.active();
        if at.y < body.top() {
            return self.column(axis, at.x, state);
        }
        let Some(row) = self.row_at(body, at.y) else { return (Keys::new(), false) };
        let track = self.rows.tracks[row];
        let times = clip.tracks[track as usize].curve.times();
        let Some(key) = axis.hit(times, at.x) else { return (Keys::new(), false) };
        let near = blocks(axis, times).into_iter().find(|b| b.keys.contains(&key));
        let run = near.map_or(key..key + 1, |b| b.keys);
        let spans = Spans::one(run);
        let selected = spans.iter().any(|k| state.selection.has_key(track as usize, k));
        (Keys::from([(track, TrackKeys { spans, mask: u8::MAX })]), selected)
    }

    /// The whole pose under the pointer in the summary: a column of the tracks shown.
    fn column(&self, axis: &Axis, x: f32, state: &State) -> (Keys, bool) {
        let Some(time) = self.summary.near(axis.t(x), f64::from(axis::HIT) * axis.scale) else {
            return (Keys::new(), false);
        };
        let mut keys = Keys::new();
        let mut selected = false;
        for &track in &self.rows.tracks {
            if let Some(k) = state.active().tracks[track as usize].curve.key_at(time) {
                selected |= state.selection.has_key(track as usize, k);
                keys.insert(track, TrackKeys { spans: Spans::one(k..k + 1), mask: u8::MAX });
            }
        }
        (keys, selected)
    }

    /// A box from `from` (second, height from the first row's top) to the pointer; it scrolls at the edges.
    fn boxed(
        &mut self,
        ui: &egui::Ui,
        axis: &Axis,
        body: Rect,
        at: Pos2,
        from: (f64, f64),
        state: &State,
        bus: &mut Bus,
    ) {
        if ui.input(|i| i.key_pressed(egui::Key::Escape)) {
            self.grip.drag = Drag::None;
            return;
        }
        let over = at.y - at.y.clamp(body.top() + 4.0, body.bottom() - 4.0);
        if over != 0.0 && at.y > body.top() - 200.0 {
            self.scroll += over * 0.3;
            self.keep_scroll(body);
            ui.ctx().request_repaint();
        }
        let to = (axis.t(at.x), f64::from(at.y - body.top() + self.scroll));
        let corner = pos2(axis.x(from.0), body.top() + from.1 as f32 - self.scroll);
        let shown = Rect::from_two_pos(corner, at);
        grip::draw_box(ui, axis.rect, shown);
        if ui.input(|i| i.pointer.primary_released()) {
            let add = ui.input(|i| i.modifiers.shift);
            let keys =
                if shown.size().max_elem() < 3.0 { Keys::new() } else { self.keys_in(from, to, state) };
            bus.send(Command::SelectKeys(keys, if add { Mode::Add } else { Mode::Replace }));
            self.grip.drag = Drag::None;
        }
    }

    /// Keys of a box, given by its corners in seconds and heights; above the first row is the summary: all rows.
    pub fn keys_in(&self, a: (f64, f64), b: (f64, f64), state: &State) -> Keys {
        let (t0, t1) = (a.0.min(b.0), a.0.max(b.0));
        let (y0, y1) = (a.1.min(b.1), a.1.max(b.1));
        let row = |y: f64| (y / f64::from(ROW)).max(0.0) as usize;
        let count = self.rows.tracks.len();
        let rows = if y1 < 0.0 { 0..count } else { row(y0).min(count)..(row(y1) + 1).min(count) };
        let of = |&track: &u32| {
            let times = state.active().tracks[track as usize].curve.times();
            let run = times.partition_point(|&t| t < t0)..times.partition_point(|&t| t <= t1);
            (!run.is_empty()).then(|| (track, TrackKeys { spans: Spans::one(run), mask: u8::MAX }))
        };
        self.rows.tracks[rows].iter().filter_map(of).collect()
    }

    fn paint(&self, ui: &egui::Ui, axis: &Axis, pane: Rect, body: Rect, state: &State) {
        let (painter, skeleton) = (ui.painter_at(pane), state.document.skeleton());
        let keys = painter.with_clip_rect(axis.rect);
        axis::grid(&keys, axis, state, ui.visuals());
        let mut mesh = egui::Mesh::default();
        let mut names = Names::of(ui, "dope");

        // The summary, then the rows.
        let mid = axis.rect.top() + ROW / 2.0;
        let strip = Rect::from_min_max(pos2(pane.left(), axis.rect.top()), pos2(pane.right(), body.top()));
        painter.rect_filled(strip, 0.0, Color32::from_white_alpha(10));
        let font = FontId::proportional(12.0);
        let text = ui.visuals().text_color();
        painter.text(pos2(pane.left() + 6.0, mid), Align2::LEFT_CENTER, "Summary", font.clone(), text);
        for time in self.summary.seen(axis, APART) {
            let at = pos2(axis.x(time), mid);
            axis::diamond(&mut mesh, at, 6.0, Color32::from_gray(225));
            names.add(at, || format!("Summary key {:.0}", state.frame_at(time)));
        }
        let (rows, left) = (
            painter.with_clip_rect(Rect::from_min_max(pos2(pane.left(), body.top()), pane.max)),
            pane.left() + 6.0,
        );
        let mut drawn = egui::Mesh::default();
        for row in self.seen(body) {
            let track = self.rows.tracks[row] as usize;
            let of = &state.active().tracks[track];
            let y = body.top() + row as f32 * ROW - self.scroll + ROW / 2.0;
            let line = Rect::from_center_size(pos2(pane.center().x, y), Vec2::new(pane.width(), ROW));
            let chosen = of.target.bone().is_some_and(|b| state.selection.bones.contains(&b));
            if chosen || row % 2 == 1 {
                let fill = if chosen {
                    ui.visuals().selection.bg_fill.gamma_multiply(0.35)
                } else {
                    Color32::from_white_alpha(4)
                };
                rows.rect_filled(line, 0.0, fill);
            }
            let name = track_name(skeleton, of);
            let clip =
                rows.with_clip_rect(line.with_max_x(axis.rect.left() - 2.0).intersect(rows.clip_rect()));
            // Of a name that is too long the end is seen: it says which channel it is.
            let galley = clip.layout_no_wrap(name.clone(), font.clone(), text);
            let x = left.min(axis.rect.left() - 6.0 - galley.size().x);
            clip.galley(pos2(x, y - galley.size().y / 2.0), galley, text);
            self.row(&mut drawn, axis, y, track, &name, state, &mut names, body);
        }
        keys.add(mesh);
        keys.with_clip_rect(body).add(drawn);
        axis::playhead(&keys, axis, state);
        painter.vline(axis.rect.left(), pane.y_range(), ui.visuals().widgets.noninteractive.bg_stroke);
        self.footer(&painter, pane, state);
    }

    fn row(
        &self,
        mesh: &mut egui::Mesh,
        axis: &Axis,
        y: f32,
        track: usize,
        name: &str,
        state: &State,
        names: &mut Names<'_>,
        body: Rect,
    ) {
        let selected = state.selection.keys.get(&(track as u32)).map(|k| &k.spans);
        for Block { keys, from, to } in blocks(axis, state.active().tracks[track].curve.times()) {
            let on = selected.is_some_and(|s| s.meets(keys.clone()));
            let color = if on { SELECTED } else { Color32::from_gray(190) };
            if keys.len() > 1 {
                let bar = Rect::from_min_max(pos2(from - 3.0, y - 4.0), pos2(to + 3.0, y + 4.0));
                mesh.add_colored_rect(bar, color.gamma_multiply(0.7));
            } else {
                axis::diamond(mesh, pos2(from, y), 5.5, color);
            }
            if body.y_range().contains(y) {
                let frame = |k: usize| state.frame_at(state.active().tracks[track].curve.times()[k]).round();
                names.add(pos2((from + to) / 2.0, y), || match keys.len() {
                    1 => format!("{name} key {}", frame(keys.start)),
                    _ => format!("{name} keys {} to {}", frame(keys.start), frame(keys.end - 1)),
                });
            }
        }
    }

    fn footer(&self, painter: &egui::Painter, pane: Rect, state: &State) {
        let say = |text: &str| {
            let at = pane.right_bottom() - Vec2::new(6.0, 4.0);
            painter.text(at, Align2::RIGHT_BOTTOM, text, FontId::proportional(11.0), SELECTED);
        };
        if let Some(hint) = self.grip.hint(false) {
            say(hint);
        } else if state.active().tracks.is_empty() {
            say("No keys yet: pose a bone, then press I over the viewport or here");
        } else if self.rows.tracks.is_empty() {
            say("No track matches: clear the filter, or show more than the selected bones");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_found_from_any_guess() {
        let times = [0.0, 1.0, 1.0, 2.0, 5.0, 9.0, 9.5];
        for (from, limit, guess) in
            (0..7).flat_map(|f| (0..22).flat_map(move |l| (0..9).map(move |g| (f, l, g))))
        {
            let limit = f64::from(limit) * 0.5;
            let want = (from..6).find(|&k| times[k] >= limit).unwrap_or(from.max(6));
            assert_eq!(first_from(&times, from..from.max(6), limit, guess), want, "{from} {limit} {guess}");
        }
    }
}
