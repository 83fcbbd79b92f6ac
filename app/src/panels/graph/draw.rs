//! Curves, slopes, levels and names, painted.

use super::channel::{Channel, Values};
use crate::panels::axis::{Axis, SELECTED};
use crate::state::State;
use egui::{Align2, Color32, FontId, Pos2, Stroke, Vec2, pos2};
use sinew::clip::{Interpolation, Target};

pub(super) fn curve(painter: &egui::Painter, axis: &Axis, values: &Values, c: &Channel<'_>) {
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
        points = c.points(axis, values);
    }
    painter.add(egui::Shape::line(points, stroke));
}

/// The slope at a selected key, on either side.
pub(super) fn tangent(
    painter: &egui::Painter,
    axis: &Axis,
    values: &Values,
    c: &Channel<'_>,
    k: usize,
    at: Pos2,
) {
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
pub(super) fn levels(painter: &egui::Painter, values: &Values, visuals: &egui::Visuals) {
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

pub(super) fn legend(painter: &egui::Painter, axis: &Axis, channels: &[Channel<'_>]) {
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
