//! What only rays can meet, and whole scenes of it in `f64`.

use glam::{DVec3, Vec3};

/// A surface without a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// All points at `radius` from `center`; the normal points outwards.
    Sphere {
        /// Its middle, metres.
        center: DVec3,
        /// Metres, above 0.
        radius: f64,
    },
    /// All points `p` with `(p − point)·normal = 0`, without end, seen from both sides.
    Plane {
        /// Any point of it.
        point: DVec3,
        /// Any length but 0.
        normal: DVec3,
    },
    /// Three corners, seen from both sides; counter-clockwise from the front, the side of the normal.
    Triangle([DVec3; 3]),
}

impl Geometry {
    /// The same elsewhere.
    pub fn moved(self, by: DVec3) -> Self {
        match self {
            Self::Sphere { center, radius } => Self::Sphere { center: center + by, radius },
            Self::Plane { point, normal } => Self::Plane { point: point + by, normal },
            Self::Triangle(corners) => Self::Triangle(corners.map(|c| c + by)),
        }
    }
}

/// A surface without a mesh, and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Where it is.
    pub geometry: Geometry,
    /// Index into the scene's materials.
    pub material: usize,
}

impl Shape {
    /// Corners of a box around the shapes that have an end; none where none has.
    pub fn bounds(shapes: &[Self]) -> Option<[Vec3; 2]> {
        let ends = |s: &Self| match s.geometry {
            Geometry::Sphere { center, radius } => Some([center - radius, center + radius]),
            Geometry::Plane { .. } => None,
            Geometry::Triangle([a, b, c]) => Some([a.min(b).min(c), a.max(b).max(c)]),
        };
        let all = shapes.iter().filter_map(ends).reduce(|[l, h], [low, high]| [l.min(low), h.max(high)]);
        all.map(|ends| ends.map(|e| e.as_vec3()))
    }
}

/// A camera of the notes (§2.3–2.6): pixel `(i, j)` of `nx × ny`, counted from the top left, looks from `eye` along
/// `u·(W(i+½)/nx − W/2) + v·(H/2 − H(j+½)/ny) − w·d`. That direction is not normalised: at `t = 1` a ray is on the sensor, and
/// what is nearer than that is not seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Where it stands.
    pub eye: DVec3,
    /// `u` (right), `v` (up) and `w` (backwards): orthonormal.
    pub axes: [DVec3; 3],
    /// `d`: from the eye to the sensor.
    pub focal: f64,
    /// `W`: side of the sensor.
    pub width: f64,
    /// `H`: the other side.
    pub height: f64,
}

impl Pinhole {
    /// `w = −look/‖look‖`, `u = up × w` normalised, `v = w × u`; `None` where these are no axes.
    pub fn axes(look: DVec3, up: DVec3) -> Option<[DVec3; 3]> {
        let w = -look.try_normalize()?;
        let u = up.try_normalize()?.cross(w);
        let u = (u.length() > 1e-12).then(|| u.normalize())?;
        Some([u, w.cross(u), w])
    }
}

/// A lamp without fall-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeLight {
    /// Where its light comes from.
    pub source: Source,
    /// `I`: linear RGB.
    pub color: DVec3,
    /// As [`Light::radius`](super::Light::radius).
    pub radius: f64,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// The way it travels, of any length but 0.
    Directional(DVec3),
    /// A point that it leaves.
    Point(DVec3),
}

/// `L = k_a·I_a + Σ I (k_d max(0, n·l) + k_s max(0, n·h)^p) + k_m·(mirrored) + transmission·(refracted)`.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeMaterial {
    /// For people.
    pub name: String,
    /// `k_a`.
    pub ambient: DVec3,
    /// `k_d`.
    pub diffuse: DVec3,
    /// `k_s`.
    pub specular: DVec3,
    /// `p`.
    pub shininess: f64,
    /// `k_m`.
    pub mirror: DVec3,
    /// As [`Material::transmission`](super::Material::transmission).
    pub transmission: DVec3,
    /// As [`Material::ior`](super::Material::ior).
    pub ior: f64,
}

impl Default for ShapeMaterial {
    /// White and matt.
    fn default() -> Self {
        Self {
            name: String::new(),
            ambient: DVec3::ONE,
            diffuse: DVec3::ONE,
            specular: DVec3::ZERO,
            shininess: 1.0,
            mirror: DVec3::ZERO,
            transmission: DVec3::ZERO,
            ior: 1.0,
        }
    }
}

/// Triangles that share nothing, as an STL file holds them; seen from both sides, flat.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Soup {
    /// Corners, counter-clockwise from the front.
    pub triangles: Vec<[Vec3; 3]>,
    /// Index into [`ShapeScene::materials`].
    pub material: usize,
}

/// A scene as the notes' files have it, kept in `f64` throughout, so that their reference pictures come out exactly.
///
/// Objects are numbered in the order of the shapes, then the soups. An index beyond the materials stands for the default.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeScene {
    /// The eye.
    pub camera: Pinhole,
    /// `I_a`; the notes' pictures have 0.1.
    pub ambient: DVec3,
    /// Whether surfaces that are turned away from a lamp (`n·l ≤ 0`) have no highlight of it; the notes' pictures have it.
    pub gated: bool,
    /// Lamps.
    pub lights: Vec<ShapeLight>,
    /// What surfaces are made of.
    pub materials: Vec<ShapeMaterial>,
    /// Spheres, planes and triangles.
    pub shapes: Vec<Shape>,
    /// Meshes.
    pub soups: Vec<Soup>,
}
