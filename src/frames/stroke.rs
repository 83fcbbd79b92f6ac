//! Lines and dots in a picture, smoothed by how much of each pixel they cover.

use crate::image::Image;
use crate::image::composite::Operator;
use glam::DVec2;

/// A straight colour and how much of it there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ink {
    pub color: [f32; 3],
    pub alpha: f32,
}

impl Ink {
    fn pixel(self, coverage: f32) -> [f32; 4] {
        let a = self.alpha * coverage;
        let [r, g, b] = self.color;
        [r * a, g * a, b * a, a]
    }
}

/// A part of a picture that is drawn on.
pub(super) struct Pad<'a> {
    pub image: &'a mut Image,
    /// Column and row of the whole picture that it begins at.
    pub corner: [usize; 2],
}

/// Put the line from `a` to `b` (pixels from the whole picture's top left corner) into a layer, round at its ends. Where lines of one layer
/// meet, the one that covers more is seen, so that joints are not darker than what they join.
pub(super) fn line(layer: &mut Pad, [a, b]: [DVec2; 2], width: f64, ink: Ink) {
    let along = b - a;
    let scale = 1.0 / along.length_squared().max(1e-12);
    visit(layer, a.min(b), a.max(b), 0.5 * width, |p, old| {
        let t = ((p - a).dot(along) * scale).clamp(0.0, 1.0);
        let coverage = cover(p.distance(a + along * t), 0.5 * width);
        let new = ink.pixel(coverage);
        if new[3] > old[3] {
            *old = new;
        }
    });
}

/// Put a dot on a picture.
pub(super) fn dot(out: &mut Pad, center: DVec2, radius: f64, ink: Ink) {
    // Coverage that falls off linearly covers π(r² + 1/12) in all; a dot is to cover its own area.
    let radius = (radius * radius - 1.0 / 12.0).max(0.25 * radius * radius).sqrt();
    visit(out, center, center, radius, |p, old| {
        *old = Operator::OVER.pixel(ink.pixel(cover(p.distance(center), radius)), *old);
    });
}

/// The part of a pixel that is covered, its centre being `distance` from the middle of what reaches `radius` far.
fn cover(distance: f64, radius: f64) -> f32 {
    (radius + 0.5 - distance).clamp(0.0, (2.0 * radius).min(1.0)) as f32
}

/// Visit the centres of all pixels within `radius` and a half of the box from `low` to `high`.
fn visit(pad: &mut Pad, low: DVec2, high: DVec2, radius: f64, mut f: impl FnMut(DVec2, &mut [f32; 4])) {
    let (margin, [left, top]) = (radius + 1.0, pad.corner);
    let range = |low: f64, high: f64, start: usize, size: usize| {
        let inside = |v: f64| (v - start as f64).clamp(0.0, size as f64) as usize;
        let first = inside((low - margin).floor());
        first..inside((high + margin).ceil()).max(first)
    };
    let columns = range(low.x, high.x, left, pad.image.width);
    for y in range(low.y, high.y, top, pad.image.height) {
        for x in columns.clone() {
            // Places in the whole picture, so that a part of it comes out the same.
            let p = DVec2::new((left + x) as f64 + 0.5, (top + y) as f64 + 0.5);
            f(p, &mut pad.image.pixels[y * pad.image.width + x]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pad(image: &mut Image) -> Pad<'_> {
        Pad { image, corner: [0, 0] }
    }

    const INK: Ink = Ink { color: [1.0, 0.5, 0.0], alpha: 1.0 };

    #[test]
    fn a_dot_covers_its_area() {
        for (radius, at) in [(0.5, 20.5), (3.0, 20.25), (7.5, 19.9)] {
            let mut out = Image::filled(40, 40, [0.0; 4]);
            dot(&mut pad(&mut out), DVec2::new(at, 20.0), radius, INK);
            let area: f32 = out.pixels.iter().map(|p| p[3]).sum();
            let want = std::f32::consts::PI * (radius * radius) as f32;
            assert!((area / want - 1.0).abs() < 0.08, "{radius}: {area} {want}");
        }
    }

    #[test]
    fn a_line_in_two_parts_is_the_line() {
        let (a, b) = (DVec2::new(4.0, 5.0), DVec2::new(30.0, 21.0));
        let (mut whole, mut parts) = (Image::filled(40, 30, [0.0; 4]), Image::filled(40, 30, [0.0; 4]));
        line(&mut pad(&mut whole), [a, b], 3.0, INK);
        line(&mut pad(&mut parts), [a, a.lerp(b, 0.4)], 3.0, INK);
        line(&mut pad(&mut parts), [a.lerp(b, 0.4), b], 3.0, INK);
        for (w, p) in whole.pixels.iter().zip(&parts.pixels) {
            assert!((w[3] - p[3]).abs() < 1e-5);
        }
        let area: f32 = whole.pixels.iter().map(|p| p[3]).sum();
        let want = 3.0 * a.distance(b) as f32 + std::f32::consts::PI * 2.25;
        assert!((area / want - 1.0).abs() < 0.05, "{area} {want}");
    }

    #[test]
    fn what_lies_outside_is_no_trouble() {
        let mut out = Image::filled(8, 8, [0.0; 4]);
        let far = DVec2::new(-1e9, 1e9);
        line(&mut pad(&mut out), [far, far * 2.0], 2.0, INK);
        dot(&mut pad(&mut out), far, 2.0, INK);
        dot(&mut pad(&mut out), DVec2::NAN, 2.0, INK);
        assert!(out.pixels.iter().all(|p| *p == [0.0; 4]));
    }
}
