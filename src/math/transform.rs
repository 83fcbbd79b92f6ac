//! Local transforms, and the three ways to carry a quantity through a matrix.

use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};

/// A local transform `T · R · S`: scale first, then rotation, then translation (glTF 2.0 §3.5.3).
///
/// ```
/// use sinew::math::Trs;
/// use glam::Vec3;
/// let t = Trs { translation: Vec3::X, scale: Vec3::splat(2.0), ..Trs::IDENTITY };
/// assert_eq!(t.to_affine().transform_point3(Vec3::Y), Vec3::new(1.0, 2.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trs {
    /// Metres, in the parent's frame.
    pub translation: Vec3,
    /// A unit quaternion.
    pub rotation: Quat,
    /// Factors along the local axes; may be negative or zero.
    pub scale: Vec3,
}

impl Trs {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// The linear part `R · S`.
    #[inline]
    pub fn linear(&self) -> Mat3A {
        let r = Mat3A::from_quat(self.rotation);
        if self.scale == Vec3::ONE {
            return r;
        }
        Mat3A::from_cols(r.x_axis * self.scale.x, r.y_axis * self.scale.y, r.z_axis * self.scale.z)
    }

    /// The whole transform as a 3×4 matrix.
    pub fn to_affine(&self) -> Affine3A {
        Affine3A { matrix3: self.linear(), translation: self.translation.into() }
    }

    /// Blend towards `other`: translation and scale linearly, rotation on the short arc.
    pub fn lerp(&self, other: &Self, t: f32) -> Self {
        Self {
            translation: self.translation.lerp(other.translation, t),
            rotation: super::rotation::slerp(self.rotation, other.rotation, t),
            scale: self.scale.lerp(other.scale, t),
        }
    }

    /// All nine numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite() && self.scale.is_finite()
    }
}

impl Default for Trs {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// A position: linear part and translation.
#[inline]
pub fn transform_point(m: &Affine3A, p: Vec3) -> Vec3 {
    m.transform_point3(p)
}

/// A displacement or tangent: linear part only.
#[inline]
pub fn transform_vector(m: &Affine3A, v: Vec3) -> Vec3 {
    m.transform_vector3(v)
}

/// The matrix that carries normals: `sign(det M) · cof(M)`.
///
/// The cofactor matrix is `det(M) · M⁻ᵀ`, so it needs no inverse and survives a zero scale (a flattened
/// body keeps the normal of its plane). The sign keeps normals outward under a mirroring `M`
/// (notes §6.6 asks for `M⁻ᵀ`, which this is up to a positive factor).
///
/// ```
/// use glam::{Mat3A, Vec3, Vec3A};
/// let squash = Mat3A::from_diagonal(Vec3::new(1.0, 1.0, 2.0));
/// let n = (sinew::math::normal_from(&squash) * Vec3A::new(0.0, 1.0, 1.0)).normalize();
/// assert!((n - Vec3A::new(0.0, 0.8944272, 0.4472136)).length() < 1e-6);
/// ```
#[inline]
pub fn normal_from(m: &Mat3A) -> Mat3A {
    let cof = Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    let det = m.x_axis.dot(cof.x_axis);
    if det < 0.0 { cof * -1.0 } else { cof }
}

/// A unit normal through `m`; `fallback` where the result has no direction.
#[inline]
pub fn transform_normal(m: &Affine3A, n: Vec3, fallback: Vec3) -> Vec3 {
    let n: Vec3A = normal_from(&m.matrix3) * Vec3A::from(n);
    unit_or(n.into(), fallback)
}

/// `v / ‖v‖`, robust for very small and very large `v`; `fallback` for zero or non-finite input.
#[inline]
pub(crate) fn unit_or(v: Vec3, fallback: Vec3) -> Vec3 {
    let l2 = v.length_squared();
    if (1e-30..1e30).contains(&l2) {
        return v * (1.0 / l2.sqrt());
    }
    let m = v.abs().max_element();
    if m > 0.0 && m.is_finite() { (v / m).normalize() } else { fallback }
}

/// `v / ‖v‖`, or any unit vector orthogonal to the unit vector `n` where `v` has no direction.
pub(crate) fn unit_or_any(v: Vec3, n: Vec3) -> Vec3 {
    let u = unit_or(v, Vec3::ZERO);
    if u == Vec3::ZERO { unit_or(n, Vec3::Z).any_orthonormal_vector() } else { u }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_keeps_normals_outward() {
        let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        assert_eq!(transform_normal(&mirror, Vec3::X, Vec3::ZERO), Vec3::NEG_X);
        assert_eq!(transform_normal(&mirror, Vec3::Y, Vec3::ZERO), Vec3::Y);
    }

    #[test]
    fn a_flattened_body_keeps_the_normal_of_its_plane() {
        let flat = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(transform_normal(&flat, Vec3::new(0.6, 0.0, 0.8), Vec3::ZERO), Vec3::Z);
    }

    #[test]
    fn tiny_and_huge_vectors_have_directions() {
        assert_eq!(unit_or(Vec3::new(0.0, 1e-30, 0.0), Vec3::X), Vec3::Y);
        assert_eq!(unit_or(Vec3::new(0.0, 0.0, 1e30), Vec3::X), Vec3::Z);
        assert_eq!(unit_or(Vec3::ZERO, Vec3::X), Vec3::X);
    }
}
