//! What is drawn: camera, lights, materials, textures and surfaces, as plain data.

mod camera;
mod light;
mod lighting;
mod material;
mod mips;
mod patch;
mod shadow;
mod shape;
mod style;
pub(crate) mod texels;
mod texture;

pub use camera::{Camera, CameraError, Projection};
pub use light::{Light, LightKind};
pub use lighting::{Lamp, LampFrame, Lighting};
pub use material::{AlphaMode, Material, TextureRef};
pub use patch::MaterialPatch;
pub use shadow::ShadowMap;
pub use shape::{Geometry, Pinhole, Shape, ShapeLight, ShapeMaterial, ShapeScene, Soup, Source};
pub use style::Style;
pub use texture::{Content, Filter, Texture, TextureError, TextureId, WrapMode};

use crate::mesh::Mesh;
use glam::{Vec3, Vec4};

/// A surface as it stands now. Lists are as in `MeshData`; positions and directions are in the scene's frame.
#[derive(Clone, Copy, Debug)]
pub struct Object<'a> {
    /// Triangles, texture coordinates and colours.
    pub mesh: &'a Mesh,
    /// `V` positions, scene space.
    pub positions: &'a [Vec3],
    /// `V` unit normals, or none: then faces are flat.
    pub normals: &'a [Vec3],
    /// `V` unit tangents and handedness, or none.
    pub tangents: &'a [Vec4],
    /// Index into `Scene::materials`.
    pub material: usize,
    /// Triangles wind the other way round (a mirroring transform).
    pub mirrored: bool,
    /// Numbers that tell parts of the surface apart, 0 for none: one a vertex, one for all of them, or an empty list. What they mean is
    /// for the scene's maker to say; only channels show them.
    pub labels: &'a [u32],
}

impl Object<'_> {
    /// The label of a vertex.
    pub fn label(&self, vertex: u32) -> u32 {
        let only = if self.labels.len() == 1 { 0 } else { vertex as usize };
        self.labels.get(only).copied().unwrap_or(0)
    }
}

/// Everything that a renderer reads.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The eye.
    pub camera: Camera,
    /// Light from everywhere: `I_a`, linear RGB.
    pub ambient: Vec3,
    /// Lamps.
    pub lights: Vec<Light>,
    /// How light is turned into colour.
    pub style: Style<'a>,
    /// Linear RGBA behind everything, alpha premultiplied.
    pub background: [f32; 4],
    /// Surfaces.
    pub objects: Vec<Object<'a>>,
    /// Surfaces without a mesh: rays meet them, the rasterizer does not draw them.
    pub shapes: &'a [Shape],
    /// What surfaces are made of.
    pub materials: &'a [Material],
    /// What materials refer to.
    pub textures: &'a [Texture],
}
