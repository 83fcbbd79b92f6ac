//! What a surface is made of: Blinn-Phong coefficients and the textures that vary them.

use super::TextureId;
use glam::{Affine2, Vec3, Vec4};

/// A texture and how it lies on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Which texture.
    pub texture: TextureId,
    /// Which of the mesh's two sets of coordinates.
    pub uv_set: u8,
    /// Applied to the coordinates first (KHR_texture_transform).
    pub transform: Affine2,
}

/// What alpha means.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// The surface is there where alpha is at least the cut-off.
    Mask(f32),
    /// The surface lets light through.
    Blend,
}

/// `L = emissive + k_d·I_a·occlusion + Σ I (k_d max(0, n·l) + k_s max(0, n·h)^p)` (notes §3.4–3.6), all linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For people.
    pub name: String,
    /// `k_d` and alpha, straight.
    pub diffuse: Vec4,
    /// Multiplies `diffuse`: sRGB colour, linear alpha.
    pub diffuse_map: Option<TextureRef>,
    /// `k_s`, at the exponent `shininess` (already normalised for it, if the importer wants energy kept).
    pub specular: Vec3,
    /// `p`.
    pub shininess: f32,
    /// Multiplies `specular` by its RGB (sRGB) and maps its alpha (linear) to the exponent: `p = shininess^alpha`.
    pub specular_map: Option<TextureRef>,
    /// Light of its own.
    pub emissive: Vec3,
    /// Multiplies `emissive`: sRGB.
    pub emissive_map: Option<TextureRef>,
    /// Tangent-space normals: linear, `2c − 1`.
    pub normal_map: Option<TextureRef>,
    /// Scales x and y of the mapped normal.
    pub normal_scale: f32,
    /// Red darkens the ambient term: linear.
    pub occlusion_map: Option<TextureRef>,
    /// 0: no darkening; 1: all of it.
    pub occlusion_strength: f32,
    /// What alpha means.
    pub alpha: AlphaMode,
    /// Seen from behind too, with the normal turned towards the eye.
    pub double_sided: bool,
    /// `L = k_d` alone, no light needed.
    pub unlit: bool,
    /// `k_a`, instead of `k_d` in the ambient term.
    pub ambient: Option<Vec3>,
    /// `k_m`: the share of the light from the mirrored direction that is added. Rays alone see it.
    pub mirror: Vec3,
    /// The share of the light that is left when it passes through: glass, if not zero. What arrives at the surface then divides by
    /// Fresnel's equations into mirrored and refracted light. Rays alone see it.
    pub transmission: Vec3,
    /// Refractive index of what lies behind the surface; 1 before it.
    pub ior: f32,
}

impl Default for Material {
    /// Matt light grey with a faint highlight.
    fn default() -> Self {
        Self {
            name: String::new(),
            diffuse: Vec4::new(0.8, 0.8, 0.8, 1.0),
            diffuse_map: None,
            specular: Vec3::splat(0.04),
            shininess: 32.0,
            specular_map: None,
            emissive: Vec3::ZERO,
            emissive_map: None,
            normal_map: None,
            normal_scale: 1.0,
            occlusion_map: None,
            occlusion_strength: 1.0,
            alpha: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ambient: None,
            mirror: Vec3::ZERO,
            transmission: Vec3::ZERO,
            ior: 1.5,
        }
    }
}
