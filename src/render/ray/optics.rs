//! Mirrors and glass (notes §3.8–3.9).

use glam::DVec3;

/// `d − 2(d·n)n`.
pub(super) fn mirrored(d: DVec3, n: DVec3) -> DVec3 {
    d - n * (2.0 * d.dot(n))
}

/// What glass makes of light that arrives along `d` (unit) at a surface whose normal `n` (unit) is on the side that it comes from;
/// `ratio` is the refractive index there over that behind: the refracted direction, and the share that is mirrored instead.
///
/// Snell: `ratio·sin θ₁ = sin θ₂`, `t = ratio·d + (ratio·cos θ₁ − cos θ₂)n`. Fresnel: the mean of both polarisations. `None`
/// where `sin θ₂` would exceed 1: all of it is mirrored.
pub(super) fn refracted(d: DVec3, n: DVec3, ratio: f64) -> Option<(DVec3, f64)> {
    let c1 = (-d.dot(n)).clamp(0.0, 1.0);
    let s2 = ratio * ratio * (1.0 - c1 * c1);
    if s2 > 1.0 {
        return None;
    }
    let c2 = (1.0 - s2).sqrt();
    let across = (ratio * c1 - c2) / (ratio * c1 + c2);
    let along = (c1 - ratio * c2) / (c1 + ratio * c2);
    let share = 0.5 * (across * across + along * along);
    // Grazing light between equal media has 0/0, and passes.
    Some(((d * ratio + n * (ratio * c1 - c2)).normalize_or(d), if share.is_nan() { 0.0 } else { share }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64) -> DVec3 {
        DVec3::new(degrees.to_radians().sin(), -degrees.to_radians().cos(), 0.0)
    }

    #[test]
    fn light_bends_as_snell_says_and_not_beyond_the_critical_angle() {
        let (t, _) = refracted(at(45.0), DVec3::Y, 1.0 / 1.5).unwrap();
        assert!((t.x.atan2(-t.y).to_degrees() - 28.1255).abs() < 5e-5);
        assert!(refracted(at(41.8103), DVec3::Y, 1.5).is_some());
        assert!(refracted(at(41.8104), DVec3::Y, 1.5).is_none());
        // Out of it again, the way it came.
        let (back, _) = refracted(t, DVec3::Y, 1.5).unwrap();
        assert!((back - at(45.0)).length() < 1e-12);
    }

    #[test]
    fn glass_mirrors_four_percent_straight_on_and_nothing_of_one_polarisation_at_brewsters_angle() {
        assert!((refracted(at(0.0), DVec3::Y, 1.0 / 1.5).unwrap().1 - 0.04).abs() < 1e-12);
        let brewster = 1.5f64.atan().to_degrees();
        let (t, share) = refracted(at(brewster), DVec3::Y, 1.0 / 1.5).unwrap();
        // The other one: ((n² − 1)/(n² + 1))².
        assert!((share - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-12);
        assert!((mirrored(at(brewster), DVec3::Y).dot(t)).abs() < 1e-12);
        assert!((refracted(at(89.9999), DVec3::Y, 1.0 / 1.5).unwrap().1 - 1.0).abs() < 1e-4);
    }
}
