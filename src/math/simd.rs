//! Many numbers at a time, written once: plain arrays that the compiler turns into vector instructions.
//!
//! Every operation is exactly rounded IEEE arithmetic lane by lane (no fused multiply-add, no estimates), so a kernel gives
//! the same bits on every machine. [`run`] compiles a kernel of eight lanes a second time with AVX2 and picks that build where it
//! can; [`run_wide`] compiles one of any number of lanes a third time, sixteen wide, with AVX-512.

use glam::Vec4;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// `N` times `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct F<const N: usize>(pub [f32; N]);

/// `N` times `i32`; as a mask, 0 or −1 a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub struct I<const N: usize>(pub [i32; N]);

/// Eight `f32`.
pub type F8 = F<8>;

/// Eight `i32`.
pub type I8 = I<8>;

/// Eight `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct D8(pub [f64; 8]);

/// Three times eight `f32`: points, directions or colours.
pub type V8 = super::lanes::V3<F8>;

macro_rules! lanes {
    ($i:ident in $n:expr => $e:expr) => {{
        let mut r = [Default::default(); $n];
        let mut $i = 0;
        while $i < $n {
            r[$i] = $e;
            $i += 1;
        }
        r
    }};
}

macro_rules! lanewise {
    ([$($p:tt)*] $t:ty, $n:expr, $trait:ident, $f:ident, $a:ident, $b:ident, $e:expr) => {
        impl$($p)* $trait for $t {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                Self(lanes!(i in $n => {
                    let ($a, $b) = (self.0[i], other.0[i]);
                    $e
                }))
            }
        }
    };
}

lanewise!([<const N: usize>] F<N>, N, Add, add, a, b, a + b);
lanewise!([<const N: usize>] F<N>, N, Sub, sub, a, b, a - b);
lanewise!([<const N: usize>] F<N>, N, Mul, mul, a, b, a * b);
lanewise!([<const N: usize>] F<N>, N, Div, div, a, b, a / b);
lanewise!([] D8, 8, Add, add, a, b, a + b);
lanewise!([] D8, 8, Sub, sub, a, b, a - b);
lanewise!([] D8, 8, Mul, mul, a, b, a * b);
lanewise!([] D8, 8, Div, div, a, b, a / b);
lanewise!([<const N: usize>] I<N>, N, Add, add, a, b, a.wrapping_add(b));
lanewise!([<const N: usize>] I<N>, N, Sub, sub, a, b, a.wrapping_sub(b));
lanewise!([<const N: usize>] I<N>, N, Mul, mul, a, b, a.wrapping_mul(b));
lanewise!([<const N: usize>] I<N>, N, BitAnd, bitand, a, b, a & b);
lanewise!([<const N: usize>] I<N>, N, BitOr, bitor, a, b, a | b);

impl<const N: usize> Neg for F<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(lanes!(i in N => -self.0[i]))
    }
}

impl Neg for D8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl<const N: usize> Not for I<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(lanes!(i in N => !self.0[i]))
    }
}

impl<const N: usize> Mul<f32> for F<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: f32) -> Self {
        self * Self::splat(k)
    }
}

impl<const N: usize> Add<f32> for F<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, k: f32) -> Self {
        self + Self::splat(k)
    }
}

impl<const N: usize> F<N> {
    /// Zero in every lane.
    pub const ZERO: Self = Self([0.0; N]);
    /// One in every lane.
    pub const ONE: Self = Self([1.0; N]);

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: f32) -> Self {
        Self([x; N])
    }

    /// The first of a slice.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn load(s: &[f32]) -> Self {
        Self(s[..N].try_into().expect("as many as lanes"))
    }

    /// Into the first of a slice.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn store(self, s: &mut [f32]) {
        s[..N].copy_from_slice(&self.0);
    }

    /// The smaller; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i in N => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i in N => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Into 0…1; NaN becomes 0.
    #[inline(always)]
    pub fn clamp01(self) -> Self {
        self.max(Self::ZERO).min(Self::ONE)
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(lanes!(i in N => self.0[i].sqrt()))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I<N> {
        I(lanes!(i in N => -((self.0[i] > other.0[i]) as i32)))
    }

    /// Mask of `self ≥ other`.
    #[inline(always)]
    pub fn ge(self, other: Self) -> I<N> {
        I(lanes!(i in N => -((self.0[i] >= other.0[i]) as i32)))
    }

    /// Mask of `self = other`.
    #[inline(always)]
    pub fn equal(self, other: Self) -> I<N> {
        I(lanes!(i in N => -((self.0[i] == other.0[i]) as i32)))
    }

    /// The bits of each lane.
    #[inline(always)]
    pub fn to_bits(self) -> I<N> {
        I(lanes!(i in N => self.0[i].to_bits() as i32))
    }

    /// To the nearest integer (ties to even); exact for `|x| ≤ 2²²`, some integer otherwise.
    #[inline(always)]
    pub fn round(self) -> I<N> {
        // Adding 1.5·2²³ pushes the fraction out of the mantissa.
        const MAGIC: f32 = 12_582_912.0;
        I(lanes!(i in N => ((self.0[i] + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)))
    }

    /// The largest integer that is not above; exact for `|x| ≤ 2²²`.
    #[inline(always)]
    pub fn floor(self) -> I<N> {
        let r = self.round();
        r + r.to_f32().gt(self)
    }
}

impl<const N: usize> I<N> {
    /// Zero in every lane.
    pub const ZERO: Self = Self([0; N]);
    /// 0, 1, 2 …
    pub const IOTA: Self = {
        let mut of = [0; N];
        let mut i = 0;
        while i < N {
            of[i] = i as i32;
            i += 1;
        }
        Self(of)
    };

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: i32) -> Self {
        Self([x; N])
    }

    /// To floating point, rounded to nearest.
    #[inline(always)]
    pub fn to_f32(self) -> F<N> {
        F(lanes!(i in N => self.0[i] as f32))
    }

    /// The bits as floating point.
    #[inline(always)]
    pub fn from_bits(self) -> F<N> {
        F(lanes!(i in N => f32::from_bits(self.0[i] as u32)))
    }

    /// The smaller.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i in N => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i in N => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I<N> {
        I(lanes!(i in N => -((self.0[i] > other.0[i]) as i32)))
    }

    /// Mask of `self = other`.
    #[inline(always)]
    pub fn equal(self, other: Self) -> I<N> {
        I(lanes!(i in N => -((self.0[i] == other.0[i]) as i32)))
    }

    /// Arithmetic shift to the right.
    #[inline(always)]
    pub fn shift_right(self, n: u32) -> Self {
        Self(lanes!(i in N => self.0[i] >> n))
    }

    /// Shift to the left.
    #[inline(always)]
    pub fn shift_left(self, n: u32) -> Self {
        Self(lanes!(i in N => self.0[i] << n))
    }

    /// `a` where the mask is set, else `b`.
    #[inline(always)]
    pub fn select(self, a: F<N>, b: F<N>) -> F<N> {
        F(lanes!(i in N => if self.0[i] < 0 { a.0[i] } else { b.0[i] }))
    }

    /// `a` where the mask is set, else `b`.
    #[inline(always)]
    pub fn select_int(self, a: I<N>, b: I<N>) -> I<N> {
        I(lanes!(i in N => if self.0[i] < 0 { a.0[i] } else { b.0[i] }))
    }

    /// Any sign set.
    #[inline(always)]
    pub fn any(self) -> bool {
        if N > 8 {
            // One instruction where the lanes are of comparisons.
            return self.0.iter().fold(0, |a, b| a | b) < 0;
        }
        self.fours(|a, b| a | b) != 0
    }

    /// All signs set.
    #[inline(always)]
    pub fn all(self) -> bool {
        if N > 8 {
            return self.0.iter().fold(-1, |a, b| a & b) < 0;
        }
        self.fours(|a, b| a & b) == 0xf
    }

    /// Signs of the fours folded into one.
    #[inline(always)]
    fn fours(self, fold: impl Fn(i32, i32) -> i32) -> u32 {
        let mut r = [self.0[0], self.0[1], self.0[2], self.0[3]];
        let mut i = 4;
        while i < N {
            for k in 0..4 {
                r[k] = fold(r[k], self.0[i + k]);
            }
            i += 4;
        }
        Vec4::from_array(r.map(|x| f32::from_bits(x as u32))).is_negative_bitmask()
    }

    /// One bit a lane, for at most 16 of them: the sign.
    #[inline(always)]
    pub fn bitmask(self) -> u32 {
        // glam knows the one instruction for four signs.
        let (f, mut mask, mut i) = (self.from_bits().0, 0, 0);
        while i < N {
            mask |= Vec4::new(f[i], f[i + 1], f[i + 2], f[i + 3]).is_negative_bitmask() << i;
            i += 4;
        }
        mask
    }
}

impl D8 {
    /// The smaller; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i in 8 => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i in 8 => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I8 {
        I(lanes!(i in 8 => -((self.0[i] > other.0[i]) as i32)))
    }

    /// `xʸ`, as exact as the system's.
    pub fn powf(self, y: Self) -> Self {
        Self(lanes!(i in 8 => self.0[i].powf(y.0[i])))
    }
}

/// A piece of work that is compiled for more than one instruction set. `run` must be `#[inline(always)]`, and so must
/// everything in it that is to profit.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Do it.
    fn run(self) -> Self::Output;
}

/// The same for any number of lanes.
pub trait WideKernel {
    /// What it gives, whatever the number of lanes.
    type Output;
    /// Do it, `N` at a time.
    fn run<const N: usize>(self) -> Self::Output;
}

/// Which build of a kernel runs; the results are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Isa {
    /// The widest that the machine has: AVX2, and AVX-512 for what can be sixteen wide.
    #[default]
    Best,
    /// AVX2 where the machine has it, and nothing beyond.
    Avx2,
    /// What every machine of the target has.
    Portable,
}

/// Run a kernel in the build that `isa` asks for.
#[inline]
pub fn run<K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if isa != Isa::Portable && *HAS_AVX2 {
        // What calling it needs has just been checked.
        #[allow(unsafe_code)]
        return unsafe { run_avx2(kernel) };
    }
    let _ = isa;
    kernel.run()
}

/// Run a kernel with sixteen lanes where the machine has registers for them and `isa` does not forbid it, else with eight as [`run`] does.
#[inline]
pub fn run_wide<K: WideKernel>(isa: Isa, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if isa == Isa::Best && *HAS_AVX512 {
        return run_as::<16, _>(isa, Wide::<K, 16>(kernel));
    }
    run(isa, Wide::<K, 8>(kernel))
}

/// Run a kernel of `N` lanes as the kernel of [`run_wide`] that calls it.
#[inline]
pub fn run_as<const N: usize, K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if N == 16 && isa == Isa::Best && *HAS_AVX512 {
        // What calling it needs has just been checked.
        #[allow(unsafe_code)]
        return unsafe { run_avx512(kernel) };
    }
    run(isa, kernel)
}

/// A kernel of any number of lanes, with `N`.
struct Wide<K, const N: usize>(K);

impl<K: WideKernel, const N: usize> Kernel for Wide<K, N> {
    type Output = K::Output;

    #[inline(always)]
    fn run(self) -> K::Output {
        self.0.run::<N>()
    }
}

/// Whether there is what [`run_avx2`] uses: AVX2, and what counts bits, which came to processors before it.
#[cfg(target_arch = "x86_64")]
static HAS_AVX2: std::sync::LazyLock<bool> = std::sync::LazyLock::new(|| {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
});

/// Whether there is what [`run_avx512`] uses: what every processor with AVX-512 has had from the second generation on.
#[cfg(target_arch = "x86_64")]
static HAS_AVX512: std::sync::LazyLock<bool> = std::sync::LazyLock::new(|| {
    *HAS_AVX2
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
});

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding() {
        let x = F([-1.5, -0.5, -0.25, 0.0, 0.5, 0.75, 1.5, 4_000_000.0]);
        assert_eq!(x.round().0, [-2, 0, 0, 0, 0, 1, 2, 4_000_000]);
        assert_eq!(x.floor().0, [-2, -1, -1, 0, 0, 0, 1, 4_000_000]);
        assert_eq!(I([-1, 0, -1, 0, 0, 0, 0, -1]).bitmask(), 0b1000_0101);
    }
}
