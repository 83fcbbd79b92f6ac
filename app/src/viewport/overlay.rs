//! Lines over the character: sticks, paths, handles, the ground.

use super::gizmo::{Gizmo, Part, Ring};
use super::orbit::Lens;
use crate::state::{EditClip, State};
use egui::{Color32, Painter, Pos2, Shape, Stroke};
use glam::DVec3;
use sinew::fk::Posed;
use sinew::skeleton::BoneId;
use std::f64::consts::TAU;
use std::sync::Arc;

const CHOSEN: Color32 = Color32::from_rgb(255, 170, 60);
const BONE: Color32 = Color32::from_rgb(150, 180, 215);
const AXES: [Color32; 3] =
    [Color32::from_rgb(235, 90, 80), Color32::from_rgb(120, 205, 90), Color32::from_rgb(90, 150, 255)];

fn at(lens: &Lens, p: DVec3) -> Option<Pos2> {
    lens.project(p).map(|[x, y]| Pos2::new(x, y))
}

fn line(painter: &Painter, lens: &Lens, a: DVec3, b: DVec3, stroke: Stroke) {
    if let (Some(a), Some(b)) = (at(lens, a), at(lens, b)) {
        painter.line_segment([a, b], stroke);
    }
}

/// A grid on y = 0, of the power of ten that suits the distance.
pub fn ground(painter: &Painter, lens: &Lens) {
    let step = 10_f64.powf((lens.orbit.distance * 0.3).log10().floor());
    let snapped = |v: f64| (v / step).round() * step;
    let (x, z) = (snapped(lens.orbit.target.x), snapped(lens.orbit.target.z));
    let faint = Stroke::new(1.0, Color32::from_gray(58));
    let far = 10.0 * step;
    for d in (-10..=10).map(|k| f64::from(k) * step) {
        let along_z = |t: f64| DVec3::new(x + d, 0.0, z + t);
        let along_x = |t: f64| DVec3::new(x + t, 0.0, z + d);
        for point in [&along_z as &dyn Fn(f64) -> DVec3, &along_x] {
            let whole = [-far, far].map(|t| at(lens, point(t)));
            // In parts where an end is behind the eye, so that what is there is left out alone.
            let parts = if whole.iter().all(Option::is_some) { 1 } else { 20 };
            let t = |i: i32| far * (2.0 * f64::from(i) / f64::from(parts) - 1.0);
            (0..parts).for_each(|i| line(painter, lens, point(t(i)), point(t(i + 1)), faint));
        }
    }
}

/// Bones as lines with a dot at their origins.
pub fn sticks(painter: &Painter, lens: &Lens, state: &State, posed: &Posed) {
    let skeleton = state.document.skeleton();
    let mut chosen = vec![false; skeleton.len()];
    state.selection.bones.iter().for_each(|b| chosen[b.index()] = true);
    for bone in skeleton.ids() {
        let color = if chosen[bone.index()] { CHOSEN } else { BONE };
        let [origin, tip] = super::ends(skeleton, posed, bone);
        line(painter, lens, origin, tip, Stroke::new(2.0, color));
        at(lens, origin).map(|p| painter.circle_filled(p, 2.5, color));
    }
}

/// Where tips go over the whole clip, made once for a clip and a choice.
#[derive(Default)]
pub struct Paths {
    of: Option<(Arc<EditClip>, Vec<BoneId>)>,
    lines: Vec<(Vec<DVec3>, Vec<DVec3>)>,
}

/// Moments of a path at most.
const MOMENTS: f64 = 240.0;

impl Paths {
    /// Draw the paths of the selected bones, keys of theirs and of those above them in bold.
    pub fn draw(&mut self, painter: &Painter, lens: &Lens, state: &State) {
        let clip = &state.document.clips[state.clip];
        let fresh = |(c, bones): &(Arc<EditClip>, Vec<BoneId>)| {
            Arc::ptr_eq(c, clip) && *bones == state.selection.bones
        };
        if !self.of.as_ref().is_some_and(fresh) {
            self.of = Some((clip.clone(), state.selection.bones.clone()));
            self.make(state);
        }
        for (k, (dots, keys)) in self.lines.iter().enumerate() {
            let color = [CHOSEN, AXES[1], AXES[2], AXES[0]][k % 4];
            for pair in dots.windows(2) {
                line(painter, lens, pair[0], pair[1], Stroke::new(1.5, color.gamma_multiply(0.8)));
            }
            for p in dots.iter().filter_map(|p| at(lens, *p)) {
                painter.circle_filled(p, 1.8, color);
            }
            for p in keys.iter().filter_map(|p| at(lens, *p)) {
                painter.circle(p, 4.5, color, Stroke::new(1.0, Color32::BLACK));
            }
        }
    }

    fn make(&mut self, state: &State) {
        let (character, range) = (&state.document.asset.character, state.active().range);
        let skeleton = character.skeleton();
        let step = state.frame_seconds().max(range.duration() / MOMENTS);
        let count = (range.duration() / step).round().max(1.0) as usize;
        let times = (0..=count).map(|i| range.start + range.duration() * i as f64 / count as f64);
        let tips = |t: f64| {
            let posed = character.posed(&state.pose_at(t));
            let tip = |b: &BoneId| super::ends(skeleton, &posed, *b)[1];
            state.selection.bones.iter().map(tip).collect::<Vec<_>>()
        };
        self.lines = vec![(vec![], vec![]); state.selection.bones.len()];
        for t in times {
            self.lines.iter_mut().zip(tips(t)).for_each(|(l, p)| l.0.push(p));
        }
        for (i, bone) in state.selection.bones.iter().enumerate() {
            let above: Vec<BoneId> = std::iter::successors(Some(*bone), |b| skeleton.parent(*b)).collect();
            let own = |t: &&Arc<sinew::clip::Track>| t.target.bone().is_some_and(|b| above.contains(&b));
            let mut keys: Vec<f64> =
                state.active().tracks.iter().filter(own).flat_map(|t| t.curve.times().to_vec()).collect();
            keys.sort_by(f64::total_cmp);
            keys.dedup();
            let most = keys.len().div_ceil(MOMENTS as usize).max(1);
            self.lines[i].1 = keys.into_iter().step_by(most).map(|t| tips(t)[i]).collect();
        }
    }
}

/// Rings, arrows and the handle at the tip; `held` is drawn strong.
pub fn gizmo(painter: &Painter, lens: &Lens, gizmo: &Gizmo, held: Option<Part>) {
    for ring in &gizmo.rings {
        let color = match ring.part {
            Part::Angle(k) => AXES[[2, 1, 0][k]],
            _ => Color32::from_gray(220),
        };
        let width = if held == Some(ring.part) { 3.0 } else { 1.5 };
        let [from, to] = ring.range.unwrap_or([0.0, TAU]);
        if to - from < TAU {
            arc(painter, lens, gizmo, ring, [0.0, TAU], Stroke::new(1.0, color.gamma_multiply(0.25)));
        }
        let stroke = Stroke::new(if ring.range.is_some() { width + 1.5 } else { width }, color);
        arc(painter, lens, gizmo, ring, [from, to.min(from + TAU)], stroke);
        if ring.part != Part::Free {
            // At a limit the knob is ringed.
            let stopped = ring.range.is_some_and(|[a, b]| ring.angle <= a + 1e-4 || ring.angle >= b - 1e-4);
            let edge =
                if stopped { Stroke::new(2.5, Color32::WHITE) } else { Stroke::new(1.0, Color32::BLACK) };
            at(lens, gizmo.on(ring, ring.angle)).map(|p| painter.circle(p, 5.0, color, edge));
        }
    }
    if let Some(length) = gizmo.arrows {
        for (k, color) in AXES.into_iter().enumerate() {
            let tip = gizmo.origin + DVec3::AXES[k] * length;
            line(painter, lens, gizmo.origin, tip, Stroke::new(2.0, color));
            at(lens, tip).map(|p| painter.circle_filled(p, 5.0, color));
        }
        let square = |p| egui::Rect::from_center_size(p, egui::vec2(9.0, 9.0));
        at(lens, gizmo.origin).map(|p| painter.rect_filled(square(p), 1.0, Color32::from_gray(230)));
    }
    at(lens, gizmo.tip)
        .map(|p| painter.circle(p, 6.0, Color32::from_black_alpha(120), Stroke::new(2.0, CHOSEN)));
}

fn arc(painter: &Painter, lens: &Lens, gizmo: &Gizmo, ring: &Ring, [from, to]: [f64; 2], stroke: Stroke) {
    let n = ((to - from).abs() / TAU * 64.0).ceil().max(1.0) as usize;
    let point = |i: usize| at(lens, gizmo.on(ring, from + (to - from) * i as f64 / n as f64));
    let points: Option<Vec<Pos2>> = (0..=n).map(point).collect();
    if let Some(points) = points {
        painter.add(Shape::line(points, stroke));
    }
}
