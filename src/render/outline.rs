//! Lines where one thing ends and another begins, found in the picture.

use super::raster::IdImage;
use crate::image::Image;

/// A line along contours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Pixels across.
    pub width: f32,
    /// Linear RGB and straight alpha.
    pub color: [f32; 4],
}

/// A contour runs between two neighbours of which one lies so many steps of the surface further away.
const JUMP: f32 = 4.0;
/// From so many steps on it is drawn in full: lines fade in and do not break up into dots.
const FULL: f32 = 10.0;
/// The least of such a step: so many pixels' worth of distance.
const STEP: f32 = 1.5;

impl Outline {
    /// Draw the line over a picture; `ids` are of the same size, `pixel` is metres along a pixel's side at a distance of a metre
    /// (perspective) or anywhere (parallel).
    ///
    /// Contours run between pixels: where something meets nothing, and where depth jumps. A jump is more than the surfaces on both
    /// sides change within a pixel, so that slopes, however steep, are none. A pixel's coverage falls from 1 to 0 within a pixel
    /// around half the width from the nearest contour.
    pub fn draw(&self, ids: &IdImage, pixel: f32, perspective: bool, picture: &mut Image) {
        let (w, h) = (ids.width, ids.height);
        let mut cover = vec![0.0f32; w * h];
        let footprint = |z: f32| if perspective { pixel * z } else { pixel };
        for y in 0..h {
            for x in 0..w {
                let right = if x + 1 < w { parted(ids, [x, y], [1, 0], footprint) } else { 0.0 };
                let down = if y + 1 < h { parted(ids, [x, y], [0, 1], footprint) } else { 0.0 };
                self.splat(&mut cover, [w, h], [x as f32 + 0.5, y as f32], right);
                self.splat(&mut cover, [w, h], [x as f32, y as f32 + 0.5], down);
            }
        }
        for (p, cover) in picture.pixels.iter_mut().zip(&cover) {
            let a = cover * self.color[3];
            if a > 0.0 {
                *p = std::array::from_fn(|c| (1.0 - a) * p[c] + a * if c < 3 { self.color[c] } else { 1.0 });
            }
        }
    }

    /// Cover the pixels around a point of a contour, in pixels from the first pixel's centre.
    fn splat(&self, cover: &mut [f32], [w, h]: [usize; 2], at: [f32; 2], strength: f32) {
        if strength <= 0.0 {
            return;
        }
        let reach = 0.5 * self.width + 0.5;
        let span = |c: f32, n: usize| {
            let (a, b) = ((c - reach).ceil().max(0.0), (c + reach).floor().min(n as f32 - 1.0));
            a as usize..=b as usize
        };
        for y in span(at[1], h) {
            for x in span(at[0], w) {
                let distance = (x as f32 - at[0]).hypot(y as f32 - at[1]);
                let c = &mut cover[y * w + x];
                *c = c.max(strength * (reach - distance).clamp(0.0, 1.0));
            }
        }
    }
}

/// Whether a contour runs between a pixel and its neighbour: 0 to 1.
fn parted(ids: &IdImage, [x, y]: [usize; 2], [dx, dy]: [usize; 2], footprint: impl Fn(f32) -> f32) -> f32 {
    let at = |k: isize| {
        let (x, y) = (x as isize + k * dx as isize, y as isize + k * dy as isize);
        let inside = x >= 0 && y >= 0 && x < ids.width as isize && y < ids.height as isize;
        inside.then(|| ids.depth[y as usize * ids.width + x as usize]).filter(|z| z.is_finite())
    };
    let (a, b) = match (at(0), at(1)) {
        (Some(a), Some(b)) => (a, b),
        (a, b) => return f32::from(u8::from(a.is_some() != b.is_some())),
    };
    // The surface's own slope on either side, as far as it goes on there.
    let (left, right) = (at(-1).map(|q| (a - q).abs()), at(2).map(|q| (b - q).abs()));
    let slope = match (left, right) {
        (Some(left), Some(right)) => left.min(right),
        (one, other) => one.or(other).unwrap_or(0.0),
    };
    let step = STEP * footprint(a.min(b)) + slope;
    (((b - a).abs() / step - JUMP) / (FULL - JUMP)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of depths, and where the line is.
    fn lines(width: usize, depth: &[f32]) -> Vec<f32> {
        let n = depth.len();
        let ids = IdImage {
            width,
            height: n / width,
            objects: vec![0; n],
            triangles: vec![0; n],
            depth: depth.to_vec(),
        };
        let mut picture = Image::filled(width, n / width, [0.0; 4]);
        Outline { width: 1.0, color: [1.0; 4] }.draw(&ids, 1.0, false, &mut picture);
        picture.pixels.iter().map(|p| p[3]).collect()
    }

    #[test]
    fn lines_run_between_something_and_nothing_and_where_depth_jumps() {
        let far = f32::INFINITY;
        assert_eq!(lines(6, &[far, far, 5.0, 5.0, 5.0, 5.0]), [0.0, 0.5, 0.5, 0.0, 0.0, 0.0]);
        assert_eq!(lines(6, &[5.0, 5.0, 5.0, 50.0, 50.0, 50.0]), [0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
        // A steep slope is no jump.
        assert_eq!(lines(6, &[0.0, 50.0, 100.0, 150.0, 200.0, 250.0]), [0.0; 6]);
    }

    #[test]
    fn a_wide_line_covers_its_width() {
        let mut depth = vec![f32::INFINITY; 40];
        depth[20..].fill(5.0);
        let n = depth.len();
        let ids = IdImage { width: n, height: 1, objects: vec![0; n], triangles: vec![0; n], depth };
        for width in [1.0, 2.5, 4.0, 7.0] {
            let mut picture = Image::filled(n, 1, [0.0; 4]);
            Outline { width, color: [0.0, 0.0, 0.0, 1.0] }.draw(&ids, 1.0, false, &mut picture);
            let sum: f32 = picture.pixels.iter().map(|p| p[3]).sum();
            assert!((sum - width).abs() < 1e-5, "{width}: {sum}");
        }
    }
}
