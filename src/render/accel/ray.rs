//! Rays, hits, and the two numbers they are made of.

use super::build::Span;
use super::lanes::Lanes;
use super::triangle::{Meetings, Pack, Shear};
use glam::Vec3A;
use std::ops::{Add, Div, Mul, Sub};

/// A ray `origin + t·direction` with `t` in `t_min…t_max`, both included; the direction has any length.
///
/// A ray hits nothing unless every number of it but `t_max` is finite, `|origin| ≤ 2⁴⁰` and the largest component of the
/// direction lies in `2⁻⁴⁰…2⁴⁰`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<R> {
    /// Where `t = 0`.
    pub origin: [R; 3],
    /// One unit of `t`.
    pub direction: [R; 3],
    /// The first `t` that counts.
    pub t_min: R,
    /// The last `t` that counts.
    pub t_max: R,
}

/// Where a ray meets a triangle: at `(1−u−v)·p₀ + u·p₁ + v·p₂`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<R> {
    /// Along the ray.
    pub t: R,
    /// Weight of the second corner.
    pub u: R,
    /// Weight of the third corner.
    pub v: R,
    /// Which object of the [`World`](super::World).
    pub object: u32,
    /// Which triangle of it.
    pub triangle: u32,
    /// The ray meets its back: where it stands in its surface, corners go round clockwise as seen from the origin.
    pub back: bool,
}

impl<R: Real> Hit<R> {
    /// Whether this is what a ray answers rather than `other`: the smaller `t`, then object, then triangle. What is found
    /// thus never depends on where it was looked for first.
    #[inline(always)]
    pub fn before(&self, other: &Self) -> bool {
        self.t < other.t || self.t == other.t && (self.object, self.triangle) < (other.object, other.triangle)
    }
}

mod sealed {
    use super::super::{
        lanes::Lanes,
        triangle::{Meetings, Pack, Shear},
    };

    /// What differs between the two.
    pub trait Sealed: Sized {
        /// Without its sign.
        fn abs(self) -> Self;
        /// Rounded to nearest.
        fn from_f64(x: f64) -> Self;
        /// `a·b − c·d`, with the sign of the exact value and a relative error of at most 2⁻⁵².
        fn minor(a: Self, b: Self, c: Self, d: Self) -> f64;
        /// Which triangles of a pack are hit, a bit each.
        fn meet<S: Lanes>(pack: &Pack, ray: &Shear<Self>, out: &mut Meetings<Self>) -> u32;
    }
}
use sealed::Sealed;

/// `f32`, or `f64` for reference.
pub trait Real:
    Copy
    + PartialOrd
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + From<f32>
    + Into<f64>
    + Send
    + Sync
    + Sealed
    + 'static
{
    /// Beyond every `t`.
    const INFINITY: Self;
}

impl Real for f32 {
    const INFINITY: Self = f32::INFINITY;
}

impl Sealed for f32 {
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn minor(a: f32, b: f32, c: f32, d: f32) -> f64 {
        // Products of two f32 are exact in f64.
        a as f64 * b as f64 - c as f64 * d as f64
    }
    #[inline(always)]
    fn meet<S: Lanes>(pack: &Pack, ray: &Shear<f32>, out: &mut Meetings<f32>) -> u32 {
        S::meet(pack, ray, out)
    }
}

impl Real for f64 {
    const INFINITY: Self = f64::INFINITY;
}

impl Sealed for f64 {
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn minor(a: f64, b: f64, c: f64, d: f64) -> f64 {
        // Kahan's difference of products; right to 1.5 ulp (Jeannerod, Louvet, Muller 2013).
        let cd = c * d;
        a.mul_add(b, -cd) + (-c).mul_add(d, cd)
    }
    #[inline(always)]
    fn meet<S: Lanes>(pack: &Pack, ray: &Shear<f64>, out: &mut Meetings<f64>) -> u32 {
        pack.meet(ray, out)
    }
}

/// Twice the room for the rounding of origins, slopes and distances: see [`Slab::new`].
pub(super) const SLACK: f32 = 24.0 * 0.5 * f32::EPSILON;

/// Largest coordinate that is looked at: its products stay finite.
pub(super) const REACH: f32 = (1u64 << 40) as f32;

/// A ray as boxes see it: box planes `b` are crossed at `t = b·slope − near` or `b·slope − far`, rounded outwards.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    pub slope: Vec3A,
    pub near: Vec3A,
    pub far: Vec3A,
    /// Signs of the direction, one bit an axis; −0 counts as negative, which is as right.
    pub octant: usize,
    pub t_min: f32,
    pub t_max: f32,
}

impl Slab {
    /// Widened so that no box is missed whose triangle is hit, by all that rounding can do before a box around everything has
    /// been crossed (Ize 2013; Woop, Benthin, Wald 2013 §3.3, with one bound for all axes).
    ///
    /// With `u = 2⁻²⁴` and `m` the farthest that a corner lies from the origin: the sheared corners are off by `6um`, `t` by
    /// `4um`, the crossings by `3um + 3u|origin|`; twice that is taken. A slope is at most 2³⁰ times the smallest: over `m` the
    /// ray then moves by less than the slack, and neither 1/0 nor 0·∞ occurs.
    ///
    /// `None` for rays that hit nothing.
    #[inline(always)]
    pub fn new<R: Real>(ray: &Ray<R>, span: &Span, slack: f32) -> Option<Self> {
        let round = |x: R| Into::<f64>::into(x) as f32;
        let three = |v: &[R; 3]| Vec3A::new(round(v[0]), round(v[1]), round(v[2]));
        let (o, d) = (three(&ray.origin), three(&ray.direction));
        let (size, away) = (d.abs(), o.abs());
        let longest = size.max_element();
        let near = (size.cmple(Vec3A::splat(REACH)) & away.cmple(Vec3A::splat(REACH))).all();
        let (t_min, t_max) = (round(ray.t_min), round(ray.t_max));
        if !(near & (longest >= 1.0 / REACH) & (t_min.abs() < f32::INFINITY) & (t_max >= t_min)) {
            return None;
        }
        let reach = (o - span.lo).abs().max((span.hi - o).abs()).max_element();
        let slope = Vec3A::ONE / size.max(Vec3A::splat(longest * (0.5f32).powi(30)));
        let off = (Vec3A::splat(SLACK * reach) + away * (0.5 * SLACK)) * slope * slack;
        let slope = slope.copysign(d);
        Some(Self {
            slope,
            near: o * slope + off,
            far: o * slope - off,
            octant: d.is_negative_bitmask() as usize,
            t_min: t_min - t_min.abs() * f32::EPSILON,
            t_max: above(t_max),
        })
    }
}

/// A little more, so that rounding of a `t` in f64 to f32 does not matter.
#[inline(always)]
pub(super) fn above<R: Real>(t: R) -> f32 {
    let t = Into::<f64>::into(t) as f32;
    t + t.abs() * f32::EPSILON
}
