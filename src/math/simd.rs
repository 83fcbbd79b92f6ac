//! Eight numbers at a time, written once: plain arrays that the compiler turns into vector instructions.
//!
//! Every operation is exactly rounded IEEE arithmetic lane by lane (no fused multiply-add, no estimates), so a kernel gives
//! the same bits on every machine. [`run`] compiles a kernel a second time with AVX2 and picks that build where it can.

use glam::Vec4;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Eight `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct F8(pub [f32; 8]);

/// Eight `i32`; as a mask, 0 or −1 a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub struct I8(pub [i32; 8]);

/// Eight `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct D8(pub [f64; 8]);

/// Three times eight `f32`: points, directions or colours.
pub type V8 = super::lanes::V3<F8>;

macro_rules! lanes {
    ($i:ident => $e:expr) => {{
        let mut r = [Default::default(); 8];
        let mut $i = 0;
        while $i < 8 {
            r[$i] = $e;
            $i += 1;
        }
        r
    }};
}

macro_rules! lanewise {
    ($t:ident, $trait:ident, $f:ident, $a:ident, $b:ident, $e:expr) => {
        impl $trait for $t {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                Self(lanes!(i => {
                    let ($a, $b) = (self.0[i], other.0[i]);
                    $e
                }))
            }
        }
    };
}

lanewise!(F8, Add, add, a, b, a + b);
lanewise!(F8, Sub, sub, a, b, a - b);
lanewise!(F8, Mul, mul, a, b, a * b);
lanewise!(F8, Div, div, a, b, a / b);
lanewise!(D8, Add, add, a, b, a + b);
lanewise!(D8, Sub, sub, a, b, a - b);
lanewise!(D8, Mul, mul, a, b, a * b);
lanewise!(D8, Div, div, a, b, a / b);
lanewise!(I8, Add, add, a, b, a.wrapping_add(b));
lanewise!(I8, Sub, sub, a, b, a.wrapping_sub(b));
lanewise!(I8, Mul, mul, a, b, a.wrapping_mul(b));
lanewise!(I8, BitAnd, bitand, a, b, a & b);
lanewise!(I8, BitOr, bitor, a, b, a | b);

impl Neg for F8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(lanes!(i => -self.0[i]))
    }
}

impl Neg for D8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl Not for I8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(lanes!(i => !self.0[i]))
    }
}

impl Mul<f32> for F8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: f32) -> Self {
        self * Self::splat(k)
    }
}

impl Add<f32> for F8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, k: f32) -> Self {
        self + Self::splat(k)
    }
}

impl F8 {
    /// Zero in every lane.
    pub const ZERO: Self = Self([0.0; 8]);
    /// One in every lane.
    pub const ONE: Self = Self([1.0; 8]);

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: f32) -> Self {
        Self([x; 8])
    }

    /// The first eight of a slice.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn load(s: &[f32]) -> Self {
        Self(s[..8].try_into().expect("eight lanes"))
    }

    /// Into the first eight of a slice.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn store(self, s: &mut [f32]) {
        s[..8].copy_from_slice(&self.0);
    }

    /// The smaller; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Into 0…1; NaN becomes 0.
    #[inline(always)]
    pub fn clamp01(self) -> Self {
        self.max(Self::ZERO).min(Self::ONE)
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(lanes!(i => self.0[i].sqrt()))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] > other.0[i]) as i32)))
    }

    /// Mask of `self ≥ other`.
    #[inline(always)]
    pub fn ge(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] >= other.0[i]) as i32)))
    }

    /// Mask of `self = other`.
    #[inline(always)]
    pub fn equal(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] == other.0[i]) as i32)))
    }

    /// The bits of each lane.
    #[inline(always)]
    pub fn to_bits(self) -> I8 {
        I8(lanes!(i => self.0[i].to_bits() as i32))
    }

    /// To the nearest integer (ties to even); exact for `|x| ≤ 2²²`, some integer otherwise.
    #[inline(always)]
    pub fn round(self) -> I8 {
        // Adding 1.5·2²³ pushes the fraction out of the mantissa.
        const MAGIC: f32 = 12_582_912.0;
        I8(lanes!(i => ((self.0[i] + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)))
    }

    /// The largest integer that is not above; exact for `|x| ≤ 2²²`.
    #[inline(always)]
    pub fn floor(self) -> I8 {
        let r = self.round();
        r + r.to_f32().gt(self)
    }
}

impl I8 {
    /// Zero in every lane.
    pub const ZERO: Self = Self([0; 8]);
    /// 0, 1, 2 … 7.
    pub const IOTA: Self = Self([0, 1, 2, 3, 4, 5, 6, 7]);

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(x: i32) -> Self {
        Self([x; 8])
    }

    /// To floating point, rounded to nearest.
    #[inline(always)]
    pub fn to_f32(self) -> F8 {
        F8(lanes!(i => self.0[i] as f32))
    }

    /// The bits as floating point.
    #[inline(always)]
    pub fn from_bits(self) -> F8 {
        F8(lanes!(i => f32::from_bits(self.0[i] as u32)))
    }

    /// The smaller.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] > other.0[i]) as i32)))
    }

    /// Mask of `self = other`.
    #[inline(always)]
    pub fn equal(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] == other.0[i]) as i32)))
    }

    /// Arithmetic shift to the right.
    #[inline(always)]
    pub fn shift_right(self, n: u32) -> Self {
        Self(lanes!(i => self.0[i] >> n))
    }

    /// Shift to the left.
    #[inline(always)]
    pub fn shift_left(self, n: u32) -> Self {
        Self(lanes!(i => self.0[i] << n))
    }

    /// `a` where the mask is set, else `b`.
    #[inline(always)]
    pub fn select(self, a: F8, b: F8) -> F8 {
        F8(lanes!(i => if self.0[i] < 0 { a.0[i] } else { b.0[i] }))
    }

    /// `a` where the mask is set, else `b`.
    #[inline(always)]
    pub fn select_int(self, a: I8, b: I8) -> I8 {
        I8(lanes!(i => if self.0[i] < 0 { a.0[i] } else { b.0[i] }))
    }

    /// One bit a lane: the sign.
    #[inline(always)]
    pub fn bitmask(self) -> u32 {
        // glam knows the one instruction for four signs.
        let f = self.from_bits().0;
        let low = Vec4::new(f[0], f[1], f[2], f[3]).is_negative_bitmask();
        let high = Vec4::new(f[4], f[5], f[6], f[7]).is_negative_bitmask();
        low | high << 4
    }

    /// All signs set.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.bitmask() == 0xff
    }

    /// Any sign set.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.bitmask() != 0
    }
}

impl D8 {
    /// The smaller; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// The larger; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(lanes!(i => if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    /// Mask of `self > other`.
    #[inline(always)]
    pub fn gt(self, other: Self) -> I8 {
        I8(lanes!(i => -((self.0[i] > other.0[i]) as i32)))
    }

    /// `xʸ`, as exact as the system's.
    pub fn powf(self, y: Self) -> Self {
        Self(lanes!(i => self.0[i].powf(y.0[i])))
    }
}

/// `log₂ x` of positive, normal `x`; the error is below 2e-7 absolute or 2 ulp, whichever is larger.
///
/// `x = 2ᵉ·m` with `m` in √½…√2; `ln m = 2 artanh((m−1)/(m+1))` by its series to the ninth power.
#[inline(always)]
pub fn log2(x: F8) -> F8 {
    const SQRT_HALF: i32 = 0x3f35_04f3;
    let bits = x.to_bits() - I8::splat(SQRT_HALF);
    let e = bits.shift_right(23);
    let m = ((bits & I8::splat(0x007f_ffff)) + I8::splat(SQRT_HALF)).from_bits();
    let s = (m + -1.0) / (m + 1.0);
    let s2 = s * s;
    let k = 2.0 * std::f32::consts::LOG2_E;
    // Pairs of terms first (Estrin 1960): the chain of dependent operations is half as long as Horner's.
    let s4 = s2 * s2;
    let p = (s2 * (k / 3.0) + k) + (s2 * (k / 7.0) + k / 5.0) * s4 + s4 * s4 * (k / 9.0);
    e.to_f32() + p * s
}

/// `2ˣ`, `x` clamped to −126…127; the relative error is below 3e-7.
///
/// `x = n + f` with `|f| ≤ ½`; `2ᶠ` by the Taylor series of `e^{f ln 2}` to the sixth power.
#[inline(always)]
pub fn exp2(x: F8) -> F8 {
    let x = x.max(F8::splat(-126.0)).min(F8::splat(127.0));
    let n = x.round();
    let f = (x - n.to_f32()) * std::f32::consts::LN_2;
    let f2 = f * f;
    let tail = (f * (1.0 / 120.0) + 1.0 / 24.0) + f2 * (1.0 / 720.0);
    let p = (f + 1.0) + ((f * (1.0 / 6.0) + 0.5) + f2 * tail) * f2;
    p * (n + I8::splat(127)).shift_left(23).from_bits()
}

/// `xʸ` for `x ≥ 0`; 0 for `x` below 1e-37.
///
/// For `x` in 1e-37…1 and `y` in 1…1024 the relative error is below `3e-7 + 2e-7·|y log₂ x|`, hence below 2.6e-5; powers below
/// `2⁻¹²⁶` come out as `2⁻¹²⁶`. Where all of `y` is one whole number up to 64, powers are products, and 0 below `2⁻⁶⁰`.
#[inline(always)]
pub fn pow(x: F8, y: F8) -> F8 {
    let n = y.0[0] as i32;
    if (1..=64).contains(&n) && y.equal(F8::splat(n as f32)).all() {
        return whole_power(x, n as u32);
    }
    let tiny = F8::splat(1e-37);
    x.gt(tiny).select(exp2(y * log2(x.max(tiny))), F8::ZERO)
}

/// `xⁿ` by squares (Knuth 4.6.3); 0 where a product would come near the smallest numbers, with which machines are slow.
#[inline(always)]
fn whole_power(x: F8, mut n: u32) -> F8 {
    let least = F8::splat(f32::from_bits((127 - 120 / n) << 23));
    let (mut square, mut out) = (x.gt(least).select(x, F8::ZERO), F8::ONE);
    loop {
        if n & 1 != 0 {
            out = out * square;
        }
        n >>= 1;
        if n == 0 {
            return out;
        }
        square = square * square;
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

/// Which build of a kernel runs; the results are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Isa {
    /// AVX2 where the machine has it. (AVX-512 gives the same bits and takes the same time: the kernels are eight wide.)
    #[default]
    Best,
    /// What every machine of the target has.
    Portable,
}

/// Run a kernel in the build that `isa` asks for.
#[inline]
pub fn run<K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if isa == Isa::Best && *HAS_AVX2 {
        // What calling it needs has just been checked.
        #[allow(unsafe_code)]
        return unsafe { run_avx2(kernel) };
    }
    let _ = isa;
    kernel.run()
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

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Powers<'a>(&'a [[f32; 2]], &'a mut Vec<f32>);
    impl Kernel for Powers<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            for p in self.0.chunks_exact(8) {
                let (x, y) = (F8(lanes!(i => p[i][0])), F8(lanes!(i => p[i][1])));
                self.1.extend(pow(x, y).0);
            }
        }
    }

    #[test]
    fn powers_are_as_exact_as_stated_and_the_same_in_both_builds() {
        let mut rng = crate::test_rng::Rng::new(3);
        // All of 0…1, its end at 1, where high powers are bright, and its end at 0.
        let bases: [fn(f64) -> f64; 3] =
            [|u| u.max(1e-3), |u| 1.0 - (-24.0 * u).exp2(), |u| 1e-36_f64.powf(u)];
        let mut pair = |i: usize| {
            let (u, y) = (rng.range(0.0, 1.0), rng.range(0.0, 10.0).exp2());
            [bases[i % 3](u) as f32, y as f32]
        };
        let pairs: Vec<[f32; 2]> = (0..240_000).map(&mut pair).collect();
        let (mut best, mut portable) = (vec![], vec![]);
        run(Isa::Best, Powers(&pairs, &mut best));
        run(Isa::Portable, Powers(&pairs, &mut portable));
        assert_eq!(best, portable);
        for (&[x, y], &found) in pairs.iter().zip(&best) {
            let exact = (x as f64).powf(y as f64);
            let least = f32::MIN_POSITIVE as f64;
            let relative = ((found as f64 - exact.max(least)) / exact.max(least)).abs();
            // The error of the logarithm grows with its size, and the exponent multiplies it.
            let bound = 3e-7 + 2e-7 * y as f64 * (x as f64).log2().abs();
            assert!(relative < bound.min(2.6e-5), "{x}^{y}: {found} {exact} {relative:e} {bound:e}");
        }
    }

    #[test]
    fn whole_powers_are_products_and_powers_of_nothing_are_nothing() {
        for x in (0..20_000).map(|i| i as f32 / 20_000.0) {
            for n in [1, 2, 3, 16, 24, 37, 64] {
                let (found, exact) = (pow(F8::splat(x), F8::splat(n as f32)).0[0], f64::from(x).powi(n));
                assert!((f64::from(found) - exact).abs() <= exact * 4e-6 + 1e-18, "{x}^{n}: {found} {exact}");
            }
        }
        assert_eq!((pow(F8::ZERO, F8::splat(32.0)), pow(F8::ZERO, F8::splat(32.5))), (F8::ZERO, F8::ZERO));
        assert_eq!((pow(F8::ONE, F8::splat(32.0)), pow(F8::ONE, F8::splat(32.5))), (F8::ONE, F8::ONE));
        assert_eq!(pow(F8::splat(f32::NAN), F8::ONE), F8::ZERO);
    }

    #[test]
    fn rounding() {
        let x = F8([-1.5, -0.5, -0.25, 0.0, 0.5, 0.75, 1.5, 4_000_000.0]);
        assert_eq!(x.round().0, [-2, 0, 0, 0, 0, 1, 2, 4_000_000]);
        assert_eq!(x.floor().0, [-2, -1, -1, 0, 0, 0, 1, 4_000_000]);
        assert_eq!(I8([-1, 0, -1, 0, 0, 0, 0, -1]).bitmask(), 0b1000_0101);
    }
}
