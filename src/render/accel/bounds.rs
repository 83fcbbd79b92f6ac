//! Simple bodies around points: a sphere, a box along the axes, a box along the principal axes.

use glam::{DMat3, DVec3, Vec3};

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Mean of the points.
    pub center: DVec3,
    /// Largest distance of a point from it, metres.
    pub radius: f64,
}

/// A box with axes of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// In the middle.
    pub center: DVec3,
    /// Columns: unit axes, by falling variance of the points, right-handed.
    pub axes: DMat3,
    /// Half its size along each, metres.
    pub half: DVec3,
}

impl Sphere {
    /// Around points: mean centre, largest distance. Not the smallest ball there is, but never more than twice that.
    ///
    /// `None` without points.
    pub fn around(points: &[Vec3]) -> Option<Self> {
        let center = mean(points)?;
        let radius = points.iter().map(|p| p.as_dvec3().distance(center)).fold(0.0, f64::max);
        Some(Self { center, radius })
    }
}

impl OrientedBox {
    /// Around points, along their principal axes (eigenvectors of the covariance, by Jacobi's rotations).
    ///
    /// Where two variances are equal, as for a cube, any axes across them are principal; those found are then an accident of the
    /// points' order and rounding, and the box may be larger than need be. It always contains the points.
    ///
    /// `None` without points.
    pub fn around(points: &[Vec3]) -> Option<Self> {
        let mean = mean(points)?;
        let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        let covariance: DMat3 =
            points.iter().map(|p| outer(p.as_dvec3() - mean)).fold(DMat3::ZERO, |a, b| a + b);
        let axes = principal(covariance);
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in points {
            let q = axes.transpose() * p.as_dvec3();
            (lo, hi) = (lo.min(q), hi.max(q));
        }
        Some(Self { center: axes * ((lo + hi) / 2.0), axes, half: (hi - lo) / 2.0 })
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        8.0 * self.half.element_product()
    }
}

fn mean(points: &[Vec3]) -> Option<DVec3> {
    let sum: DVec3 = points.iter().map(|p| p.as_dvec3()).sum();
    (!points.is_empty()).then(|| sum / points.len() as f64)
}

/// Eigenvectors of a symmetric matrix by falling eigenvalue.
fn principal(mut m: DMat3) -> DMat3 {
    let mut axes = DMat3::IDENTITY;
    // Jacobi's method at least doubles the digits a sweep.
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * 12) {
        let off = m.col(q)[p];
        if off == 0.0 {
            continue;
        }
        let theta = (m.col(q)[q] - m.col(p)[p]) / (2.0 * off);
        let t = 1f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
        let c = 1.0 / (t * t + 1.0).sqrt();
        let mut turn = DMat3::IDENTITY;
        (turn.col_mut(p)[p], turn.col_mut(q)[q]) = (c, c);
        (turn.col_mut(p)[q], turn.col_mut(q)[p]) = (-t * c, t * c);
        (m, axes) = (turn.transpose() * m * turn, axes * turn);
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| m.col(b)[b].total_cmp(&m.col(a)[a]));
    let (x, y) = (axes.col(order[0]).normalize(), axes.col(order[1]).normalize());
    DMat3::from_cols(x, y, x.cross(y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn corners(half: Vec3) -> Vec<Vec3> {
        let sign = |i: u32, k: u32| if i >> k & 1 == 1 { 1.0 } else { -1.0 };
        (0..8).map(|i| half * Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
    }

    #[test]
    fn around_a_unit_cube_and_a_turned_box() {
        let ball = Sphere::around(&corners(Vec3::splat(0.5))).unwrap();
        assert_eq!(ball.center, DVec3::ZERO);
        assert!((ball.radius - 0.75f64.sqrt()).abs() < 1e-12);
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.5, 1.0, -0.7);
        let points: Vec<Vec3> =
            corners(Vec3::new(1.0, 2.0, 0.5)).iter().map(|&p| turn * p + Vec3::new(3.0, -1.0, 2.0)).collect();
        let found = OrientedBox::around(&points).unwrap();
        assert!((found.volume() - 8.0).abs() < 1e-5, "{found:?}");
        assert!((found.half - DVec3::new(2.0, 1.0, 0.5)).length() < 1e-6, "{found:?}");
        assert!((found.axes.determinant() - 1.0).abs() < 1e-12);
        assert!(Sphere::around(&[]).is_none() && OrientedBox::around(&[]).is_none());
    }
}
