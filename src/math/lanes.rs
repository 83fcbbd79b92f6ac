//! Vectors and numbers of several kinds, for what is written once: `f32` and `f64`, one or eight at a time.

use super::power;
use super::simd::{D8, F, F8, I};
use std::fmt::Debug;
use std::ops::{Add, BitOr, Div, Mul, Neg, Sub};

/// What has the four operations.
pub trait Number:
    Copy
    + Send
    + Sync
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Nothing.
    const ZERO: Self;
    /// One.
    const ONE: Self;
}

/// `f32` or `f64`.
pub trait Real: Number + PartialOrd + Default + 'static {
    /// Eight of them.
    type Wide: Lanes<Real = Self>;
    /// The largest relative error of an operation: half the distance from 1 to the next number.
    const ROUNDOFF: f64;
    /// The nearest number.
    fn of(x: f64) -> Self;
    /// As `f64`, exactly.
    fn wide(self) -> f64;
    /// The larger; the other one of a NaN.
    fn max(self, other: Self) -> Self;
}

/// Lanes that are chosen.
pub trait Mask: Copy + BitOr<Output = Self> {
    /// Whether there is one.
    fn any(self) -> bool;
}

impl<const N: usize> Mask for I<N> {
    #[inline(always)]
    fn any(self) -> bool {
        self.any()
    }
}

/// Several numbers.
pub trait Lanes: Number {
    /// What they are.
    type Real: Real;
    /// Some of them.
    type Mask: Mask;
    /// The same in every lane.
    fn splat(x: Self::Real) -> Self;
    /// As a list.
    fn lanes(&mut self) -> &mut [Self::Real];
    /// The smaller; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Mask of `self > other`.
    fn gt(self, other: Self) -> Self::Mask;
    /// `a` where the mask is set, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// `xʸ` for `x ≥ 0`.
    fn pow(self, y: Self) -> Self;
    /// The same `f64` in every lane.
    #[inline(always)]
    fn all(x: f64) -> Self {
        Self::splat(Self::Real::of(x))
    }
    /// Into 0…1; NaN becomes 0.
    #[inline(always)]
    fn clamp01(self) -> Self {
        self.max(Self::ZERO).min(Self::ONE)
    }
}

macro_rules! real {
    ($t:ident, $wide:ident) => {
        impl Number for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
        }
        impl Real for $t {
            type Wide = $wide;
            const ROUNDOFF: f64 = 0.5 * $t::EPSILON as f64;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                $t::max(self, other)
            }
        }
    };
}

real!(f32, F8);
real!(f64, D8);

macro_rules! wide {
    ([$($p:tt)*] $wide:ty, $n:expr, $t:ident, $pow:expr) => {
        impl$($p)* Number for $wide {
            const ZERO: Self = Self([0.0; $n]);
            const ONE: Self = Self([1.0; $n]);
        }
        impl$($p)* Lanes for $wide {
            type Real = $t;
            type Mask = I<$n>;
            #[inline(always)]
            fn splat(x: $t) -> Self {
                Self([x; $n])
            }
            #[inline(always)]
            fn lanes(&mut self) -> &mut [$t] {
                &mut self.0
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn gt(self, other: Self) -> I<$n> {
                self.gt(other)
            }
            #[inline(always)]
            fn select(mask: I<$n>, a: Self, b: Self) -> Self {
                let mut out = b;
                for k in 0..$n {
                    out.0[k] = if mask.0[k] < 0 { a.0[k] } else { b.0[k] };
                }
                out
            }
            #[inline(always)]
            fn pow(self, y: Self) -> Self {
                $pow(self, y)
            }
        }
    };
}

wide!([<const N: usize>] F<N>, N, f32, power::pow);
wide!([] D8, 8, f64, D8::powf);

/// A point, direction or colour.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct V3<T> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
    /// Third component.
    pub z: T,
}

impl<T: Number> V3<T> {
    /// Zero.
    pub const ZERO: Self = Self { x: T::ZERO, y: T::ZERO, z: T::ZERO };

    /// From its components.
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }
}

impl<R: Real> V3<R> {
    /// The nearest vector.
    #[inline(always)]
    pub fn of(v: glam::DVec3) -> Self {
        Self { x: R::of(v.x), y: R::of(v.y), z: R::of(v.z) }
    }

    /// From `f32`, exactly.
    #[inline(always)]
    pub fn from_f32(v: glam::Vec3) -> Self {
        Self::of(v.as_dvec3())
    }

    /// As `f64`, exactly.
    #[inline(always)]
    pub fn wide(self) -> glam::DVec3 {
        glam::DVec3::new(self.x.wide(), self.y.wide(), self.z.wide())
    }
}

impl<L: Lanes> V3<L> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn all(v: V3<L::Real>) -> Self {
        Self { x: L::splat(v.x), y: L::splat(v.y), z: L::splat(v.z) }
    }

    /// `v / ‖v‖`; lanes of no length stay zero.
    #[inline(always)]
    pub fn unit(self) -> Self {
        let l2 = self.dot(self);
        self * (L::ONE / l2.max(L::all(1e-30)).sqrt())
    }

    /// `a` where the mask is set, else `b`.
    #[inline(always)]
    pub fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self { x: L::select(mask, a.x, b.x), y: L::select(mask, a.y, b.y), z: L::select(mask, a.z, b.z) }
    }

    /// The vector of a lane.
    #[inline(always)]
    pub fn lane(mut self, k: usize) -> V3<L::Real> {
        V3 { x: self.x.lanes()[k], y: self.y.lanes()[k], z: self.z.lanes()[k] }
    }

    /// Put a vector into a lane.
    #[inline(always)]
    pub fn set(&mut self, k: usize, v: V3<L::Real>) {
        (self.x.lanes()[k], self.y.lanes()[k], self.z.lanes()[k]) = (v.x, v.y, v.z);
    }
}

impl<const N: usize> V3<F<N>> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(v: glam::Vec3) -> Self {
        Self { x: F::splat(v.x), y: F::splat(v.y), z: F::splat(v.z) }
    }

    /// A vector a lane.
    #[inline(always)]
    pub fn gather(v: [glam::Vec3; N]) -> Self {
        Self { x: F(v.map(|v| v.x)), y: F(v.map(|v| v.y)), z: F(v.map(|v| v.z)) }
    }
}

impl<T: Number> Add for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<T: Number> Sub for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<T: Number> Neg for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<T: Number> Mul for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }
}

impl<T: Number> Mul<T> for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: T) -> Self {
        Self { x: self.x * k, y: self.y * k, z: self.z * k }
    }
}
