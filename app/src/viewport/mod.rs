//! The picture of the character, and what is done to it by hand.

pub mod gizmo;
pub mod orbit;
mod overlay;
mod picture;

use crate::Bus;
use crate::commands::Task;
use crate::state::{BoneStyle, Command, Edit, Mode, State};
use egui::{Color32, PointerButton, Pos2, Rect, Sense, WidgetInfo, pos2};
use gizmo::{Gizmo, Hold, Part};
use glam::DVec3;
use orbit::{Lens, Orbit};
use picture::What;
use sinew::fk::Posed;
use sinew::skeleton::{BoneId, Skeleton};

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
    /// Pixels of the picture, across and down.
    pub size: [usize; 2],
}

/// The viewport pane.
pub struct Viewport {
    /// Of the last picture that was drawn anew.
    pub cost: Cost,
    /// Where it is seen from.
    pub orbit: Orbit,
    /// Bones that follow a pulled tip.
    pub chain: usize,
    picture: picture::Picture,
    paths: overlay::Paths,
    drag: Option<Drag>,
    framed: bool,
}

impl Default for Viewport {
    fn default() -> Self {
        Self {
            cost: Cost::default(),
            orbit: Orbit::default(),
            chain: 3,
            picture: picture::Picture::default(),
            paths: overlay::Paths::default(),
            drag: None,
            framed: false,
        }
    }
}

/// What a pressed pointer does.
#[derive(Debug)]
enum Drag {
    Hold(Box<Hold>, Part),
    Turn,
    /// It was cancelled, and the button is still held.
    Over,
}

/// Points around a handle that count as on it.
const REACH: f32 = 8.0;
/// Points around a bone that count as on it.
const NEAR: f32 = 9.0;

/// Origin and tip of a bone in the world.
fn ends(skeleton: &Skeleton, posed: &Posed, bone: BoneId) -> [DVec3; 2] {
    [posed.origin(bone), posed.world_from_bone(bone).transform_point3(skeleton.tip(bone).as_dvec3())]
}

/// Distance of a point of the pane from a segment.
fn off_segment(p: [f32; 2], a: [f32; 2], b: [f32; 2]) -> f32 {
    let [p, a, b] = [p, a, b].map(glam::Vec2::from);
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
    p.distance(a + along * t)
}

impl Viewport {
    /// Draw, and send what pointers do.
    pub fn ui(&mut self, ui: &mut egui::Ui, state: &State, bus: &mut Bus) {
        let rect = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::GenericContainer, true, "Character"));
        if self.picture.is_stale(state) {
            self.picture.open(state);
            self.framed = false;
        }
        if !std::mem::replace(&mut self.framed, true) {
            self.fit();
        }
        self.look_around(ui, &response, rect);
        self.handle(ui, &response, rect, state, bus);

        let moving = state.playback.playing.is_some() || self.drag.is_some();
        let scale = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()].map(|s| (s * scale).round().max(0.0) as usize);
        let cost = self.picture.update(ui.ctx(), state, &self.orbit, size, moving);
        self.cost = cost.unwrap_or(self.cost);
        self.paint(ui, rect, state);
        self.tools(ui, rect);
    }

    /// Look at all of the character.
    pub fn fit(&mut self) {
        self.picture.bounds().into_iter().for_each(|b| self.orbit.frame(b));
    }

    /// Pictures drawn since the start.
    pub fn pictures(&self) -> u64 {
        self.picture.drawn
    }

    /// What a command asks of the pane.
    pub fn task(&mut self, task: Task, state: &State) {
        match task {
            Task::FrameSelection if !state.selection.bones.is_empty() => {
                let Some(posed) = self.picture.posed() else { return };
                let of = |b: &BoneId| ends(state.document.skeleton(), posed, *b);
                let points = state.selection.bones.iter().flat_map(of);
                let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
                let [low, high] = points.fold(none, |[l, h], p| [l.min(p), h.max(p)]);
                let room = DVec3::splat(0.3 * (high - low).length().max(1e-3));
                self.orbit.frame([low - room, high + room]);
            }
            _ => self.fit(),
        }
    }

    fn lens(&self, rect: Rect) -> Lens {
        Lens { orbit: self.orbit, pane: [rect.left(), rect.top(), rect.width(), rect.height()] }
    }

    /// Wheel and camera drags.
    fn look_around(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect) {
        let (scroll, pinch, pointer) =
            ui.input(|i| (i.smooth_scroll_delta.y, i.zoom_delta(), i.pointer.latest_pos()));
        let factor = f64::from(pinch) * f64::from(scroll * 0.005).exp();
        if let (true, Some(p)) = (response.hovered() && factor != 1.0, pointer) {
            let (c, half) = (rect.center(), 0.5 * rect.height().max(1.0));
            self.orbit.zoom(factor, [(p.x - c.x) / half, (c.y - p.y) / half]);
        }
        let shift = ui.input(|i| i.modifiers.shift);
        let by = |b| response.dragged_by(b);
        let delta = [response.drag_delta().x, response.drag_delta().y];
        let pan = (by(PointerButton::Middle) && shift) || by(PointerButton::Secondary);
        if pan {
            self.orbit.pan(delta, rect.height());
        } else if by(PointerButton::Middle) || matches!(self.drag, Some(Drag::Turn)) {
            self.orbit.turn(delta);
        }
    }

    /// Handles and picking.
    fn handle(&mut self, ui: &egui::Ui, response: &egui::Response, rect: Rect, state: &State, bus: &mut Bus) {
        let lens = self.lens(rect);
        let pointer = ui.input(|i| i.pointer.latest_pos());
        let modifiers = ui.input(|i| i.modifiers);
        if response.drag_started_by(PointerButton::Primary) {
            let from = ui.input(|i| i.pointer.press_origin()).or(pointer);
            self.drag = from.map(|p| self.take(state, &lens, p, modifiers, bus));
        } else if matches!(self.drag, Some(Drag::Hold(..))) && !state.in_gesture() {
            // Somebody cancelled it.
            self.drag = Some(Drag::Over);
        }
        if let (Some(Drag::Hold(hold, _)), Some(p)) = (&mut self.drag, pointer)
            && response.dragged_by(PointerButton::Primary)
        {
            let changes = hold.change(state, &lens, [p.x, p.y], modifiers.command);
            bus.send(Command::Preview(Edit::Pose(changes)));
        }
        if response.drag_stopped_by(PointerButton::Primary)
            && let Some(Drag::Hold(..)) = self.drag.take()
        {
            bus.send(Command::Commit);
        }
        if let (true, Some(p)) = (response.clicked(), response.interact_pointer_pos()) {
            let on_handle = self.gizmo(state, &lens).and_then(|g| g.hit(&lens, [p.x, p.y], REACH));
            if on_handle.is_none() {
                let bone = self.pick(ui, state, rect, p);
                let mode = if modifiers.shift { Mode::Toggle } else { Mode::Replace };
                if bone.is_some() || mode == Mode::Replace {
                    bus.send(Command::SelectBones(bone.into_iter().collect(), mode));
                }
            }
        }
    }

    fn gizmo(&self, state: &State, lens: &Lens) -> Option<Gizmo> {
        Gizmo::of(state, state.selection.active()?, self.picture.posed()?, lens)
    }

    /// Take what is below a pressed pointer: a handle, the end of a chain, or the camera.
    fn take(
        &mut self,
        state: &State,
        lens: &Lens,
        p: Pos2,
        modifiers: egui::Modifiers,
        bus: &mut Bus,
    ) -> Drag {
        let at = [p.x, p.y];
        if modifiers.alt {
            return Drag::Turn;
        }
        let Some(posed) = self.picture.posed() else { return Drag::Turn };
        let handle = self.gizmo(state, lens).and_then(|g| Some((g.hit(lens, at, REACH)?, g, None)));
        let end = || {
            let bone = self.end_at(state, posed, lens, at)?;
            Some((Part::Tip, Gizmo::of(state, bone, posed, lens)?, Some(bone)))
        };
        let Some((part, gizmo, chosen)) = handle.or_else(end) else { return Drag::Turn };
        let Some(hold) = Hold::new(state, posed, lens, gizmo, part, at, self.chain) else {
            return Drag::Turn;
        };
        chosen.into_iter().for_each(|b| bus.send(Command::SelectBones(vec![b], Mode::Replace)));
        bus.send(Command::Begin(hold.name()));
        Drag::Hold(Box::new(hold), part)
    }

    /// A bone without children whose tip is there.
    fn end_at(&self, state: &State, posed: &Posed, lens: &Lens, at: [f32; 2]) -> Option<BoneId> {
        let skeleton = state.document.skeleton();
        if state.view.bones == BoneStyle::Hidden {
            return None;
        }
        let ends = skeleton.ids().filter(|b| skeleton.subtree(*b).len() == 1 && skeleton.length(*b) > 0.0);
        let far = |b: BoneId| {
            let tip = lens.project(ends_tip(skeleton, posed, b))?;
            Some(((tip[0] - at[0]).hypot(tip[1] - at[1]), b))
        };
        ends.filter_map(far).filter(|f| f.0 <= NEAR).min_by(|a, b| a.0.total_cmp(&b.0)).map(|f| f.1)
    }

    /// The bone below the pointer: where bones are drawn the nearest segment, else what moves the skin there.
    fn pick(&mut self, ui: &egui::Ui, state: &State, rect: Rect, p: Pos2) -> Option<BoneId> {
        let (lens, skeleton) = (self.lens(rect), state.document.skeleton());
        if let Some(posed) = self.picture.posed().filter(|_| state.view.bones != BoneStyle::Hidden) {
            let off = |b: BoneId| {
                let [a, z] = ends(skeleton, posed, b).map(|e| lens.project(e));
                Some((off_segment([p.x, p.y], a?, z?), b))
            };
            let nearest = skeleton.ids().filter_map(off).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, bone)) = nearest.filter(|n| n.0 <= NEAR) {
                return Some(bone);
            }
        }
        let scale = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()].map(|s| (s * scale).round() as usize);
        let at = [p.x - rect.left(), p.y - rect.top()].map(|v| (v * scale) as usize);
        self.picture.bone_at(&self.orbit, size, at)
    }

    fn paint(&mut self, ui: &mut egui::Ui, rect: Rect, state: &State) {
        let (painter, lens) = (ui.painter_at(rect), self.lens(rect));
        painter.rect_filled(rect, 0.0, Color32::from_gray(42));
        overlay::ground(&painter, &lens);
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let xray = state.view.bones == BoneStyle::XRay;
        for layer in &self.picture.layers {
            let share = match layer.what() {
                What::Ghost(_, share) => *share,
                What::Body => {
                    if xray {
                        90
                    } else {
                        255
                    }
                }
                What::Bones(_) => {
                    if xray {
                        255
                    } else {
                        200
                    }
                }
            };
            painter.image(layer.texture.id(), rect, whole, Color32::from_white_alpha(share));
        }
        if state.view.paths {
            self.paths.draw(&painter, &lens, state);
        }
        let Some(posed) = self.picture.posed() else { return };
        if state.view.bones == BoneStyle::Sticks {
            overlay::sticks(&painter, &lens, state, posed);
        }
        let held = match &self.drag {
            Some(Drag::Hold(_, part)) => Some(*part),
            _ => None,
        };
        if let Some(g) = self.gizmo(state, &lens).filter(|_| state.playback.playing.is_none()) {
            overlay::gizmo(&painter, &lens, &g, held);
            self.name_handles(ui, state, &lens, &g);
        }
    }

    /// Nodes of the handles, for tests and readers.
    fn name_handles(&self, ui: &egui::Ui, state: &State, lens: &Lens, g: &Gizmo) {
        let bone = state.document.skeleton().name(g.bone);
        let name = |part: &str, at: DVec3| {
            if let Some([x, y]) = lens.project(at) {
                let place = Rect::from_center_size(pos2(x, y), egui::vec2(14.0, 14.0));
                let label = format!("{bone} {part}");
                let node = ui.interact(place, ui.scope_id().with(&label), Sense::hover());
                node.widget_info(|| WidgetInfo::labeled(egui::Role::GenericContainer, true, &label));
            }
        };
        for ring in &g.rings {
            match ring.part {
                Part::Angle(k) => name(["ring θ1", "ring θ2", "ring θ3"][k], g.on(ring, ring.angle)),
                _ => name("free ring", g.on(ring, 0.0)),
            }
        }
        name("tip", g.tip);
        if let Some(length) = g.arrows {
            for (k, part) in ["move x", "move y", "move z"].into_iter().enumerate() {
                name(part, g.origin + DVec3::AXES[k] * length);
            }
        }
    }

    /// Views, and how far a pull reaches.
    fn tools(&mut self, ui: &mut egui::Ui, rect: Rect) {
        let place =
            Rect::from_min_size(rect.min + egui::vec2(6.0, 6.0), egui::vec2(rect.width() - 12.0, 22.0));
        ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
            ui.horizontal(|ui| {
                let half = std::f64::consts::FRAC_PI_2;
                for (name, yaw, pitch) in [("Front", 0.0, 0.0), ("Left", half, 0.0), ("Top", 0.0, 1.57)] {
                    if ui.small_button(name).clicked() {
                        (self.orbit.yaw, self.orbit.pitch) = (yaw, pitch);
                    }
                }
                if ui.small_button("All").on_hover_text("Look at all of the character").clicked() {
                    self.fit();
                }
                let pull =
                    egui::DragValue::new(&mut self.chain).range(1..=20).prefix("pull ").suffix(" bones");
                ui.add(pull).on_hover_text("How many bones follow a dragged tip");
            });
        });
    }
}

fn ends_tip(skeleton: &Skeleton, posed: &Posed, bone: BoneId) -> DVec3 {
    ends(skeleton, posed, bone)[1]
}
