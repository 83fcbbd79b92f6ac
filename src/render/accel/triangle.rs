//! Ray against triangle without gaps: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013.
//!
//! The ray becomes the z axis: its longest axis by permutation, the others by shearing. A corner is sheared the same way in every
//! triangle that it belongs to, and the sign of an edge function is the exact one, so two triangles at an edge cannot both deny
//! a ray. Edge functions in the ray's own precision only sort out what is surely missed: `fl(ab) > fl(cd)` implies `ab > cd`.
//! What remains is computed once more with exact products, so that `t` and the weights are as good for slivers.

use super::build::Span;
use super::ray::{Hit, REACH, Ray, Real};
use glam::{Mat4, Vec3, Vec3A};

/// A ray as triangles see it.
#[derive(Clone, Copy, Debug)]
pub struct Shear<R> {
    pub origin: [R; 3],
    /// Which axes are x, y and z of the sheared frame; z is the longest of the direction.
    pub axes: [usize; 3],
    /// Shear of x and of y.
    pub slope: [R; 2],
    /// Length along z of one unit of `t`.
    pub depth: f64,
    pub t_min: R,
    pub t_max: R,
}

/// The axis after an axis, round and round.
const NEXT: [usize; 4] = [1, 2, 0, 1];

impl<R: Real> Shear<R> {
    #[inline(always)]
    pub fn new(ray: &Ray<R>) -> Self {
        let d = &ray.direction;
        // Without branches: the longest axis of a stray ray cannot be predicted.
        let (x, y, z) = (d[0].abs(), d[1].abs(), d[2].abs());
        let (last, middle) = ((z >= x && z >= y) as usize, (y > x) as usize);
        let z = 2 * last + (1 - last) * middle;
        // A reflected frame would turn the winding round.
        let swap = (d[z] < R::from(0.0)) as usize;
        let axes = [NEXT[z + swap], NEXT[z + 1 - swap], z];
        Self {
            origin: ray.origin,
            axes,
            slope: [d[axes[0]] / d[z], d[axes[1]] / d[z]],
            depth: d[z].into(),
            t_min: ray.t_min,
            t_max: ray.t_max,
        }
    }

    /// A corner in the sheared frame.
    #[inline(always)]
    fn apply(&self, p: [f32; 3]) -> [R; 3] {
        let [x, y, z] = self.axes;
        let depth = R::from(p[z]) - self.origin[z];
        let x = (R::from(p[x]) - self.origin[x]) - self.slope[0] * depth;
        let y = (R::from(p[y]) - self.origin[y]) - self.slope[1] * depth;
        [x, y, depth]
    }

    /// What one triangle has to say, edges and corners included; nothing in its own plane.
    #[inline(always)]
    pub fn meet(&self, corners: [[f32; 3]; 3]) -> Option<Meeting<R>> {
        let (a, b, c) = (self.apply(corners[0]), self.apply(corners[1]), self.apply(corners[2]));
        // Surely missed?
        let signs = |p: R, q: R| ((p > q) as u32) | ((p < q) as u32) << 1;
        let sign = signs(c[0] * b[1], c[1] * b[0])
            | signs(a[0] * c[1], a[1] * c[0])
            | signs(b[0] * a[1], b[1] * a[0]);
        if sign == 3 {
            return None;
        }
        let u = R::minor(c[0], b[1], c[1], b[0]);
        let v = R::minor(a[0], c[1], a[1], c[0]);
        let w = R::minor(b[0], a[1], b[1], a[0]);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        let (za, zb, zc): (f64, f64, f64) = (a[2].into(), b[2].into(), c[2].into());
        let t = R::from_f64((u * za + v * zb + w * zc) / (det * self.depth));
        (det != 0.0 && t >= self.t_min && t <= self.t_max).then_some(Meeting { t, v, w, det })
    }
}

/// `t`, two edge functions and the sum of all three.
pub struct Meeting<R> {
    t: R,
    v: f64,
    w: f64,
    det: f64,
}

/// Four of them.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Meetings<R> {
    pub v: [f64; 4],
    pub w: [f64; 4],
    pub det: [f64; 4],
    pub t: [R; 4],
}

impl<R: Real> Meetings<R> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { v: [0.0; 4], w: [0.0; 4], det: [0.0; 4], t: [R::from(0.0); 4] }
    }

    /// The hit in one lane.
    #[inline(always)]
    pub fn hit(&self, lane: usize, object: u32, triangle: u32) -> Hit<R> {
        let det = self.det[lane];
        let (u, v) = (R::from_f64(self.v[lane] / det), R::from_f64(self.w[lane] / det));
        Hit { t: self.t[lane], u, v, object, triangle, back: det < 0.0 }
    }
}

/// Four triangles side by side, what a leaf holds.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Pack {
    /// Corner, axis, triangle.
    pub corners: [[[f32; 4]; 3]; 3],
    /// Which triangles; `EMPTY` where there is none, with corners of its neighbour.
    pub ids: [u32; 4],
}

/// Which vertices the corners of a pack are: corner, triangle. In the order of the packs, so that fitting them again reads on.
pub(super) type Vertices = [[u32; 4]; 3];

/// No triangle.
pub(super) const EMPTY: u32 = u32::MAX;

impl Pack {
    /// Of up to four triangles.
    pub fn new(ids: [u32; 4]) -> Self {
        Self { corners: [[[0.0; 4]; 3]; 3], ids }
    }

    /// Take the corners from where they stand now; gives the box around them.
    #[inline(always)]
    pub fn fill(&mut self, positions: &[Vec3], vertices: &Vertices) -> Span {
        let mut span = Span::EMPTY;
        for c in 0..3 {
            let p: [Vec3A; 4] = std::array::from_fn(|lane| standing(positions[vertices[c][lane] as usize]));
            span.lo = span.lo.min(p[0].min(p[1])).min(p[2].min(p[3]));
            span.hi = span.hi.max(p[0].max(p[1])).max(p[2].max(p[3]));
            let rows =
                Mat4::from_cols(p[0].extend(0.0), p[1].extend(0.0), p[2].extend(0.0), p[3].extend(0.0));
            let rows = rows.transpose();
            self.corners[c] = [rows.x_axis.to_array(), rows.y_axis.to_array(), rows.z_axis.to_array()];
        }
        span
    }

    /// The corners of one triangle.
    #[inline(always)]
    pub fn corners_of(&self, lane: usize) -> [[f32; 3]; 3] {
        let at = |c: usize| [self.corners[c][0][lane], self.corners[c][1][lane], self.corners[c][2][lane]];
        [at(0), at(1), at(2)]
    }

    /// Which of the four are hit in `t_min…t_max`, a bit each.
    #[inline(always)]
    pub fn meet<R: Real>(&self, ray: &Shear<R>, out: &mut Meetings<R>) -> u32 {
        let mut bits = 0;
        for lane in 0..4 {
            if self.ids[lane] != EMPTY
                && let Some(m) = ray.meet(self.corners_of(lane))
            {
                (out.t[lane], out.v[lane], out.w[lane], out.det[lane]) = (m.t, m.v, m.w, m.det);
                bits |= 1 << lane;
            }
        }
        bits
    }
}

/// Where a vertex is taken to stand: coordinates that are nowhere, or too far for products to be finite, are taken for 0.
#[inline(always)]
pub(super) fn standing(p: Vec3) -> Vec3A {
    let p = Vec3A::from(p);
    // Comparisons with NaN are false.
    Vec3A::select(p.abs().cmple(Vec3A::splat(REACH)), p, Vec3A::ZERO)
}
