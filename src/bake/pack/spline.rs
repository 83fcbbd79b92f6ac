//! Uniform splines through samples, by least squares.

/// Straight pieces or cubic ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Degree {
    Linear,
    Cubic,
}

impl Degree {
    /// Coefficients that a moment depends on.
    pub fn taps(self) -> usize {
        if self == Degree::Linear { 2 } else { 4 }
    }

    /// Coefficients of so many pieces.
    pub fn count(self, pieces: usize) -> usize {
        pieces + self.taps() - 1
    }

    /// The first coefficient that `x` in 0…1 depends on, and the weights from there on.
    pub fn at(self, x: f64, pieces: usize) -> (usize, [f64; 4]) {
        let x = x * pieces as f64;
        let k = (x as usize).min(pieces - 1);
        let u = x - k as f64;
        let (v, u2, u3) = (1.0 - u, u * u, u * u * u);
        let weights = match self {
            Degree::Linear => [v, u, 0.0, 0.0],
            Degree::Cubic => [
                v * v * v / 6.0,
                (4.0 - 6.0 * u2 + 3.0 * u3) / 6.0,
                (1.0 + 3.0 * u + 3.0 * u2 - 3.0 * u3) / 6.0,
                u3 / 6.0,
            ],
        };
        (k, weights)
    }
}

/// How much ends count more than what is between: loops are to close.
const END: f64 = 30.0;

/// How much a bend costs, beside a sample: decides only where there are no samples.
const BEND: f64 = 1e-7;

/// Coefficients of `width` numbers each, nearest to samples at `x` in 0…1, ascending.
pub(super) fn fit(x: &[f64], values: &[f64], width: usize, degree: Degree, pieces: usize) -> Vec<f64> {
    let n = degree.count(pieces);
    // The normal equations: each row from its diagonal on.
    let mut rows = vec![[0.0_f64; 4]; n];
    let mut right = vec![0.0; n * width];
    let last = x.len() - 1;
    for i in 0..=last {
        let around = x[(i + 1).min(last)] - x[i.saturating_sub(1)];
        let w = if i == 0 || i == last { END } else { 1.0 } * (0.5 * around * last as f64).max(1e-3);
        let (k, weights) = degree.at(x[i], pieces);
        for a in 0..degree.taps() {
            (a..degree.taps()).for_each(|b| rows[k + a][b - a] += w * weights[a] * weights[b]);
            (0..width).for_each(|c| right[(k + a) * width + c] += w * weights[a] * values[i * width + c]);
        }
    }
    let bend = BEND * x.len() as f64 / n as f64;
    for k in 0..n.saturating_sub(2) {
        let d = [1.0, -2.0, 1.0];
        (0..3).for_each(|a| (a..3).for_each(|b| rows[k + a][b - a] += bend * d[a] * d[b]));
    }
    solve(&mut rows, &mut right, width);
    right
}

/// Cholesky's L·D·Lᵀ of a band of four.
fn solve(rows: &mut [[f64; 4]], right: &mut [f64], width: usize) {
    let n = rows.len();
    for k in 0..n {
        let pivot = rows[k][0].max(1e-300);
        rows[k][0] = pivot;
        for a in 1..4.min(n - k) {
            let l = rows[k][a] / pivot;
            (a..4).for_each(|b| rows[k + a][b - a] -= l * rows[k][b]);
            (0..width).for_each(|c| right[(k + a) * width + c] -= l * right[k * width + c]);
        }
    }
    for k in (0..n).rev() {
        for c in 0..width {
            let known: f64 = (1..4.min(n - k)).map(|a| rows[k][a] * right[(k + a) * width + c]).sum();
            right[k * width + c] = (right[k * width + c] - known) / rows[k][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_met_and_a_sine_follows_its_law() {
        let x: Vec<f64> = (0..=200).map(|i| i as f64 / 200.0).collect();
        let worst = |f: &dyn Fn(f64) -> f64, degree: Degree, n: usize| {
            let values: Vec<f64> = x.iter().map(|x| f(*x)).collect();
            let c = fit(&x, &values, 1, degree, n);
            let at = |x: f64| {
                let (k, w) = degree.at(x, n);
                (0..degree.taps()).map(|a| w[a] * c[k + a]).sum::<f64>()
            };
            x.iter().zip(&values).map(|(x, v)| (at(*x) - v).abs()).fold(0.0, f64::max)
        };
        assert!(worst(&|x| 1.0 + x - 2.0 * x * x * x, Degree::Cubic, 5) < 1e-4);
        assert!(worst(&|x| 3.0 * x - 1.0, Degree::Linear, 3) < 1e-9);
        // A spline of interval h errs by about (ωh)⁴/384, and more at its ends.
        let sine = |x: f64| (20.0 * x).sin();
        assert!(worst(&sine, Degree::Cubic, 40) < 4.0 * 0.5_f64.powi(4) / 384.0);
        assert!(worst(&sine, Degree::Cubic, 20) > 1.0 / 1000.0);
    }
}
