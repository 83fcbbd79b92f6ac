//! Interpolating keyed numbers: hold, linear, Catmull-Rom, Hermite.

/// How the slope at a Catmull-Rom key follows from its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tangents {
    /// The notes' rule (§7.11): `m_k = (θ_{k+1} − θ_{k−1}) / (t_{k+1} − t_{k−1})`. Second order on unequal intervals.
    #[default]
    Notes,
    /// The slope at `k` of the parabola through three keys. Third order, but overshoots a step (62 % at interval ratio 5).
    ThreePoint,
    /// Fritsch–Carlson's limit on the three-point slope (SIAM J. Numer. Anal. 17, 1980): never overshoots.
    Monotone,
}

/// The cubic Hermite basis (notes §7.11) on `u` in 0…1 with slopes per unit time scaled by the interval `h`.
///
/// `c(u) = (2u³−3u²+1)θ₀ + (u³−2u²+u)·h·m₀ + (−2u³+3u²)θ₁ + (u³−u²)·h·m₁`
#[inline]
pub fn hermite(p0: f64, m0: f64, p1: f64, m1: f64, h: f64, u: f64) -> f64 {
    let (u2, u3) = (u * u, u * u * u);
    (2.0 * u3 - 3.0 * u2 + 1.0) * p0
        + (u3 - 2.0 * u2 + u) * h * m0
        + (3.0 * u2 - 2.0 * u3) * p1
        + (u3 - u2) * h * m1
}

/// The derivative of [`hermite`] by time.
pub fn hermite_slope(p0: f64, m0: f64, p1: f64, m1: f64, h: f64, u: f64) -> f64 {
    6.0 * (u * u - u) * (p0 - p1) / h + (3.0 * u * u - 4.0 * u + 1.0) * m0 + (3.0 * u * u - 2.0 * u) * m1
}

/// The slope at a key from its neighbours, one-sided where one is missing (`None`).
///
/// Arguments are `(time, value)` of the previous, this and the next key; times strictly increase.
pub fn tangent(rule: Tangents, prev: Option<(f64, f64)>, here: (f64, f64), next: Option<(f64, f64)>) -> f64 {
    let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
    let (a, b) = match (prev, next) {
        (None, None) => return 0.0,
        (Some(p), None) => return slope(p, here),
        (None, Some(n)) => return slope(here, n),
        (Some(p), Some(n)) => (p, n),
    };
    if rule == Tangents::Notes {
        return slope(a, b);
    }

    // The parabola's slope weighs each secant by the other interval.
    let (h0, h1) = (here.0 - a.0, b.0 - here.0);
    let (d0, d1) = (slope(a, here), slope(here, b));
    let m = (h1 * d0 + h0 * d1) / (h0 + h1);
    if rule == Tangents::ThreePoint {
        return m;
    }

    // Monotone: flat at an extremum, else at most three times the smaller secant.
    if d0 * d1 <= 0.0 { 0.0 } else { m.signum() * m.abs().min(3.0 * d0.abs().min(d1.abs())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_hits_its_ends_and_slopes() {
        let c = |u| hermite(1.0, 2.0, 5.0, -3.0, 0.5, u);
        assert_eq!((c(0.0), c(1.0)), (1.0, 5.0));
        let e = 1e-6;
        assert!(((c(e) - c(0.0)) / (e * 0.5) - 2.0).abs() < 1e-4);
        assert!(((c(1.0) - c(1.0 - e)) / (e * 0.5) + 3.0).abs() < 1e-4);
    }

    #[test]
    fn three_points_of_a_parabola_give_its_slope() {
        let f = |t: f64| (t, 3.0 * t * t - t + 2.0);
        let m = tangent(Tangents::ThreePoint, Some(f(0.0)), f(1.0), Some(f(3.0)));
        assert!((m - 5.0).abs() < 1e-12);
        assert!((tangent(Tangents::Notes, Some(f(0.0)), f(1.0), Some(f(3.0))) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn monotone_never_overshoots_a_step() {
        // Interval ratio 5, a step up: the worst case of the parabola.
        let keys = [(0.0, 0.0), (5.0, 0.0), (6.0, 1.0), (11.0, 1.0)];
        let m: Vec<f64> = (0..4)
            .map(|k: usize| {
                let at = |i: usize| keys.get(i).copied();
                tangent(Tangents::Monotone, k.checked_sub(1).and_then(at), keys[k], at(k + 1))
            })
            .collect();
        for k in 0..3 {
            for i in 0..=100 {
                let h = keys[k + 1].0 - keys[k].0;
                let v = hermite(keys[k].1, m[k], keys[k + 1].1, m[k + 1], h, i as f64 / 100.0);
                assert!((-1e-12..=1.0 + 1e-12).contains(&v), "{v}");
            }
        }
    }
}
