//! The rasterizer: geometry against a ray caster, light against formulas, bytes against themselves.

mod geometry;
mod light;
mod robust;
mod surface;

pub use crate::rng::Rng;
use glam::{Vec2, Vec3, Vec4};
use sinew::image::{Image, Rgba8};
use sinew::mesh::{Mesh, MeshData};
use sinew::render::Settings;
use sinew::render::raster::{IdImage, Rasterizer, Stats};
use sinew::scene::{AlphaMode, Camera, Light, Material, Object, Projection, Scene, Style, Texture};

/// A scene that owns what it shows.
pub struct Stage {
    pub camera: Camera,
    pub ambient: Vec3,
    pub lights: Vec<Light>,
    pub background: [f32; 4],
    pub meshes: Vec<(Mesh, usize)>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
}

pub fn material(diffuse: Vec4) -> Material {
    Material { diffuse, unlit: true, double_sided: true, ..Default::default() }
}

/// Looking down −z from `distance` at a square of the given height around the origin.
pub fn from_front(distance: f32, height: f32) -> Camera {
    let projection = Projection::Orthographic { height };
    Camera::look_at(Vec3::Z * distance, Vec3::ZERO, Vec3::Y, projection).expect("it looks ahead")
}

pub fn perspective(eye: Vec3, target: Vec3, fov_y: f32) -> Camera {
    Camera::look_at(eye, target, Vec3::Y, Projection::Perspective { fov_y }).expect("it looks ahead")
}

pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh::new(MeshData { positions, triangles, ..Default::default() }).expect("a mesh")
}

/// A square of side `2·half` at height `z`, counter-clockwise from the lower left, (0,0) of the texture at the upper left.
pub fn quad(half: f32, z: f32) -> MeshData {
    let p = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    MeshData {
        positions: p.iter().map(|&(x, y)| Vec3::new(x * half, y * half, z)).collect(),
        uvs: [p.iter().map(|&(x, y)| Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y)).collect(), vec![]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

impl Stage {
    /// One mesh of one material, unlit and double-sided, before nothing.
    pub fn of(camera: Camera, mesh: Mesh, material: Material) -> Self {
        Self {
            camera,
            ambient: Vec3::ZERO,
            lights: vec![],
            background: [0.0; 4],
            meshes: vec![(mesh, 0)],
            materials: vec![material],
            textures: vec![],
        }
    }

    pub fn scene(&self) -> Scene<'_> {
        let mut objects = vec![];
        for (mesh, material) in &self.meshes {
            objects.push(Object {
                mesh,
                positions: &mesh.positions,
                normals: &mesh.normals,
                tangents: &mesh.tangents,
                material: *material,
                mirrored: false,
                labels: &[],
            });
        }
        Scene {
            camera: self.camera,
            ambient: self.ambient,
            lights: self.lights.clone(),
            style: Style::default(),
            background: self.background,
            objects,
            shapes: &[],
            materials: &self.materials,
            textures: &self.textures,
        }
    }

    pub fn linear(&self, size: usize, samples: u8) -> (Image, Stats) {
        let mut out = Image::default();
        let settings = Settings { width: size, height: size, samples, threads: 1 };
        let stats = Rasterizer::default().draw_linear(&self.scene(), &settings, &mut out);
        (out, stats)
    }

    pub fn bytes(&self, size: usize, samples: u8) -> (Rgba8, Stats) {
        let mut out = Rgba8::default();
        let settings = Settings { width: size, height: size, samples, threads: 1 };
        let stats = Rasterizer::default().draw(&self.scene(), &settings, &mut out);
        (out, stats)
    }

    pub fn ids(&self, size: usize) -> (IdImage, Stats) {
        let mut out = IdImage::default();
        let settings = Settings { width: size, height: size, samples: 1, threads: 1 };
        let stats = Rasterizer::default().draw_ids(&self.scene(), &settings, &mut out);
        (out, stats)
    }
}

pub fn blending(rgb: Vec3, alpha: f32) -> Material {
    Material { alpha: AlphaMode::Blend, ..material(rgb.extend(alpha)) }
}
