//! Numbers of the bone that was chosen last: its angles within their limits, its place, its keys.

use super::parts::{button, gesture};
use crate::Bus;
use crate::commands::named;
use crate::state::{Change, Command, Edit, Mode, Spans, State, TrackKeys};
use egui::{Color32, DragValue, RichText};
use glam::Vec3;
use sinew::clip::{Interpolation, Target};
use sinew::math::spline::Tangents;
use sinew::skeleton::BoneId;

/// The pane.
#[derive(Default)]
pub struct Inspector {}

const ORANGE: Color32 = Color32::from_rgb(255, 150, 60);
const LOOSE: &str = "posed, not keyed: press I, or it is lost when the time changes";

impl Inspector {
    /// Draw it.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let Some(bone) = state.selection.active() else {
                ui.weak("Select a bone: in the tree, or in the viewport.");
                asset(ui, state);
                shapes(ui, state, bus);
                return;
            };
            head(ui, bone, state, bus);
            angles(ui, bone, state, bus);
            quaternion(ui, bone, state);
            vectors(ui, bone, state, bus);
            tracks(ui, bone, state, bus);
            shapes(ui, state, bus);
        });
    }
}

/// What the file holds, where no bone is chosen.
fn asset(ui: &mut egui::Ui, state: &State) {
    let c = &state.document.asset.character;
    let vertices: usize = c.instances().iter().map(|i| c.mesh(i).positions.len()).sum();
    ui.separator();
    let lines = [
        many(c.skeleton().len(), "bone", "bones"),
        format!("{}, {vertices} vertices", many(c.meshes().len(), "mesh", "meshes")),
        many(state.document.clips.len(), "clip", "clips"),
        format!("{} in this clip", many(state.active().tracks.len(), "track", "tracks")),
    ];
    lines.into_iter().for_each(|l| drop(ui.label(l)));
}

fn many(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// Weights of blend shapes, by the meshes that they change.
fn shapes(ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
    let c = &state.document.asset.character;
    let runs = c.weight_runs();
    if runs.is_empty() {
        return;
    }
    ui.separator();
    ui.strong("Shapes").on_hover_text("Weights of blend shapes; I keys them, as it does bones");
    let weights = state.weights();
    for (first, width) in runs {
        let own = c.instances().iter().find(|i| i.first_weight == first && !c.mesh(i).targets.is_empty());
        ui.weak(own.map_or("", |i| &c.mesh(i).name));
        egui::Grid::new(("shapes", first)).num_columns(2).show(ui, |ui| {
            for i in first..first + width {
                let (label, mut weight) = (state.document.shape(i), weights[i]);
                let r =
                    number(ui, &label, format!("shape {label}"), &mut weight, 0.01, "", (f32::MIN, f32::MAX));
                gesture(&r, "Shape", Edit::Weight(i, weight), state, bus);
            }
        });
    }
    if !state.loose_weights.is_empty() {
        ui.label(RichText::new(LOOSE).color(ORANGE));
    }
}

fn head(ui: &mut egui::Ui, bone: BoneId, state: &State, bus: &mut Bus) {
    let skeleton = state.document.skeleton();
    ui.heading(skeleton.name(bone));
    let parent = skeleton.parent(bone).map_or("none", |p| skeleton.name(p));
    let more = state.selection.bones.len();
    let also = if more > 1 { format!(" · and {} more", more - 1) } else { String::new() };
    ui.weak(format!("parent {parent} · {:.3} m{also}", skeleton.length(bone)));
    ui.horizontal_wrapped(|ui| {
        for (text, name) in [
            ("Key", "Insert keys"),
            ("Reset", "Reset rotations"),
            ("Copy", "Copy pose"),
            ("Paste", "Paste pose"),
            ("Mirror", "Paste mirrored pose"),
        ] {
            button(ui, text, name, state, bus);
        }
    });
    if state.loose.contains_key(&bone) {
        ui.label(RichText::new(LOOSE).color(ORANGE));
    }
}

/// One of three numbers.
fn number(
    ui: &mut egui::Ui,
    label: &str,
    name: String,
    value: &mut f32,
    speed: f64,
    suffix: &str,
    range: (f32, f32),
) -> egui::Response {
    ui.label(label);
    // What a clip does beyond the limits is shown as it is.
    let field = DragValue::new(value)
        .speed(speed)
        .suffix(suffix)
        .max_decimals(3)
        .range(range.0..=range.1)
        .clamp_existing_to_range(false)
        .update_while_editing(false);
    let response = ui.add(field);
    ui.end_row();
    response.accessible_name(name)
}

fn angles(ui: &mut egui::Ui, bone: BoneId, state: &State, bus: &mut Bus) {
    let skeleton = state.document.skeleton();
    let theta = state.theta(bone).map(f32::to_degrees);
    let limits = skeleton.limits(bone);
    ui.separator();
    ui.strong("Rotation: twist, bend, twist")
        .on_hover_text("XZX Euler angles about the bone's own +x, from rest (§7.2)");
    egui::Grid::new("angles").num_columns(2).show(ui, |ui| {
        for c in 0..3 {
            let mut new = theta;
            let range =
                limits.map_or((f32::MIN, f32::MAX), |l| (l.min[c].to_degrees(), l.max[c].to_degrees()));
            let name = format!("{} θ{}", skeleton.name(bone), c + 1);
            let label = ["θ1 twist", "θ2 bend", "θ3 twist"][c];
            let r = number(ui, label, name, &mut new[c], 0.5, "°", range);
            let r = if limits.is_some() {
                r.on_hover_text(format!("{:.0}° to {:.0}°", range.0, range.1))
            } else {
                r
            };
            let edit = Edit::Pose(vec![(bone, Change::Xzx(new.map(f32::to_radians)))]);
            gesture(&r, "Rotate bone", edit, state, bus);
            if limits.is_some() {
                bar(ui, theta[c], range);
            }
        }
    });
    if let Some(hint) = super::graph::singular(state) {
        ui.label(RichText::new(hint).color(Color32::from_rgb(240, 200, 120)).small());
    }
}

/// Where the angle stands between its limits.
fn bar(ui: &mut egui::Ui, value: f32, (low, high): (f32, f32)) {
    ui.label("");
    let (rect, _) = ui.allocate_exact_size(egui::Vec2::new(90.0, 4.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let part = ((value - low) / (high - low).max(1e-6)).clamp(0.0, 1.0);
    let at = egui::pos2(rect.left() + part * rect.width(), rect.center().y);
    let color = if part <= 0.0 || part >= 1.0 { ORANGE } else { ui.visuals().text_color() };
    ui.painter().circle_filled(at, 3.0, color);
    ui.end_row();
}

fn quaternion(ui: &mut egui::Ui, bone: BoneId, state: &State) {
    let q = state.pose_of_bone(bone).locals[bone.index()].rotation;
    let keyed = state.track_of(&Target::Rotation(bone)).is_some();
    let what = if keyed { "quaternion keys" } else { "as a quaternion" };
    ui.weak(format!("{what}: {:.4} {:.4} {:.4} {:.4}", q.x, q.y, q.z, q.w))
        .on_hover_text("x y z w, parent_from_bone");
}

fn vectors(ui: &mut egui::Ui, bone: BoneId, state: &State, bus: &mut Bus) {
    let skeleton = state.document.skeleton();
    let local = state.pose_of_bone(bone).locals[bone.index()];
    let mut one = |ui: &mut egui::Ui,
                   title: &str,
                   now: Vec3,
                   speed: f64,
                   suffix: &str,
                   change: fn(Vec3) -> Change| {
        egui::Grid::new(title).num_columns(2).show(ui, |ui| {
            for c in 0..3 {
                let mut new = now;
                let name = format!("{} {} {}", skeleton.name(bone), title.to_lowercase(), ["x", "y", "z"][c]);
                let r =
                    number(ui, ["x", "y", "z"][c], name, &mut new[c], speed, suffix, (f32::MIN, f32::MAX));
                let step = if suffix.is_empty() { "Scale bone" } else { "Move bone" };
                gesture(&r, step, Edit::Pose(vec![(bone, change(new))]), state, bus);
            }
        });
    };
    let moves = skeleton.parent(bone).is_none() || state.track_of(&Target::Translation(bone)).is_some();
    egui::CollapsingHeader::new("Translation").default_open(moves).show(ui, |ui| {
        one(ui, "Translation", local.translation, 0.002, " m", Change::Translation);
    });
    let scaled = state.track_of(&Target::Scale(bone)).is_some();
    egui::CollapsingHeader::new("Scale").default_open(scaled).show(ui, |ui| {
        one(ui, "Scale", local.scale, 0.005, "", Change::Scale);
    });
}

/// What an interpolation is called.
pub fn interpolation_name(of: Interpolation) -> &'static str {
    match of {
        Interpolation::Hold => "Hold",
        Interpolation::Linear => "Linear",
        Interpolation::CatmullRom(Tangents::Notes) => "Catmull-Rom",
        Interpolation::CatmullRom(Tangents::ThreePoint) => "Catmull-Rom, three points",
        Interpolation::CatmullRom(Tangents::Monotone) => "Catmull-Rom, monotone",
        Interpolation::Hermite => "stored slopes",
    }
}

fn tracks(ui: &mut egui::Ui, bone: BoneId, state: &State, bus: &mut Bus) {
    ui.separator();
    ui.strong("Tracks").on_hover_text("Interpolation belongs to a whole track: T, or the Keys menu, sets it for the tracks of the selected keys");
    let mut any = false;
    for track in state.active().tracks.iter().filter(|t| t.target.bone() == Some(bone)) {
        any = true;
        let channel = match track.target {
            Target::Xzx(_) => "θ",
            Target::Rotation(_) => "quaternion",
            Target::Translation(_) => "translation",
            _ => "scale",
        };
        let here = track.curve.key_at(state.time).is_some();
        let key = if here { "◆" } else { "◇" };
        let text = format!(
            "{key} {channel}: {}, {}",
            many(track.curve.times().len(), "key", "keys"),
            interpolation_name(track.curve.interpolation())
        );
        ui.label(text).on_hover_text("◆ there is a key at the playhead · the interpolation is per track");
    }
    if !any {
        ui.weak("none; I keys the bone");
        return;
    }
    let shown = egui::ComboBox::from_id_salt("interpolation")
        .selected_text("Interpolation of these tracks")
        .show_ui(ui, |ui| {
            for name in
                ["Hold", "Linear", "Catmull-Rom", "Catmull-Rom, three points", "Catmull-Rom, monotone"]
            {
                if ui.selectable_label(false, name).on_hover_text(named(name).help).clicked() {
                    let mask = u8::MAX;
                    let of = |(i, t): (u32, &std::sync::Arc<sinew::clip::Track>)| {
                        let all = TrackKeys { spans: Spans::one(0..t.curve.times().len()), mask };
                        (t.target.bone() == Some(bone)).then_some((i, all))
                    };
                    let keys = (0..).zip(&state.active().tracks).filter_map(of).collect();
                    bus.send(Command::SelectKeys(keys, Mode::Replace));
                    bus.run(named(name), state);
                }
            }
        });
    shown.response.accessible_name("Interpolation");
}
