//! Logarithms and powers of several numbers at a time, of operations that give the same bits everywhere.

use super::simd::{F, I};

/// `log₂ x` of positive, normal `x`; the error is below 2e-7 absolute or 2 ulp, whichever is larger.
///
/// `x = 2ᵉ·m` with `m` in √½…√2; `ln m = 2 artanh((m−1)/(m+1))` by its series to the ninth power.
#[inline(always)]
pub fn log2<const N: usize>(x: F<N>) -> F<N> {
    const SQRT_HALF: i32 = 0x3f35_04f3;
    let bits = x.to_bits() - I::splat(SQRT_HALF);
    let e = bits.shift_right(23);
    let m = ((bits & I::splat(0x007f_ffff)) + I::splat(SQRT_HALF)).from_bits();
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
pub fn exp2<const N: usize>(x: F<N>) -> F<N> {
    let x = x.max(F::splat(-126.0)).min(F::splat(127.0));
    let n = x.round();
    let f = (x - n.to_f32()) * std::f32::consts::LN_2;
    let f2 = f * f;
    let tail = (f * (1.0 / 120.0) + 1.0 / 24.0) + f2 * (1.0 / 720.0);
    let p = (f + 1.0) + ((f * (1.0 / 6.0) + 0.5) + f2 * tail) * f2;
    p * (n + I::splat(127)).shift_left(23).from_bits()
}

/// `xʸ` for `x ≥ 0`; 0 for `x` below 1e-37.
///
/// For `x` in 1e-37…1 and `y` in 1…1024 the relative error is below `3e-7 + 2e-7·|y log₂ x|`, hence below 2.6e-5; powers below
/// `2⁻¹²⁶` come out as `2⁻¹²⁶`. Where all of `y` is one whole number up to 64, powers are products, and 0 below `2⁻⁶⁰`.
#[inline(always)]
pub fn pow<const N: usize>(x: F<N>, y: F<N>) -> F<N> {
    let n = y.0[0] as i32;
    if (1..=64).contains(&n) && y.equal(F::splat(n as f32)).all() {
        return whole_power(x, n as u32);
    }
    let tiny = F::splat(1e-37);
    x.gt(tiny).select(exp2(y * log2(x.max(tiny))), F::ZERO)
}

/// From where on the `n`-th power is `2⁻¹²⁰` at least.
static LEAST: [f32; 65] = {
    let mut least = [0.0; 65];
    let mut n = 1;
    while n < least.len() {
        least[n] = f32::from_bits((127 - 120 / n as u32) << 23);
        n += 1;
    }
    least
};

/// `xⁿ` by squares (Knuth 4.6.3); 0 where a product would come near the smallest numbers, with which machines are slow.
#[inline(always)]
fn whole_power<const N: usize>(x: F<N>, mut n: u32) -> F<N> {
    let least = F::splat(LEAST[n as usize % LEAST.len()]);
    let (mut square, mut out) = (x.gt(least).select(x, F::ZERO), F::ONE);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::{F8, Isa, WideKernel, run_wide};

    struct Powers<'a>(&'a [[f32; 2]], &'a mut Vec<f32>);
    impl WideKernel for Powers<'_> {
        type Output = ();
        #[inline(always)]
        fn run<const N: usize>(self) {
            for p in self.0.as_chunks::<N>().0 {
                self.1.extend(pow(F(p.map(|p| p[0])), F(p.map(|p| p[1]))).0);
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
        let [best, avx2, portable] = [Isa::Best, Isa::Avx2, Isa::Portable].map(|isa| {
            let mut out = vec![];
            run_wide(isa, Powers(&pairs, &mut out));
            out
        });
        assert_eq!(best, portable);
        assert_eq!(avx2, portable);
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
}
