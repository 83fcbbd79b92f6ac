//! What every stage reads: the picture's geometry and the objects that can be drawn.

use super::Stats;
use super::setup::Setup;
use crate::math::simd::{F8, Isa, V8};
use crate::render::Settings;
use crate::render::shade::Lamp;
use crate::scene::{AlphaMode, Material, Object, Projection, Scene, Texture, TextureRef};
use glam::{Vec3, Vec4};

pub(super) use crate::render::ROTATED;

/// How an object takes part in visibility.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Class {
    Opaque,
    Mask,
    Blend,
}

/// An object whose lists fit its mesh.
pub(super) struct Draw<'a> {
    pub object: &'a Object<'a>,
    pub material: &'a Material,
    /// Place in `Scene::objects`.
    pub index: usize,
    /// Number of its first triangle and vertex, counted over all draws.
    pub first_triangle: u32,
    pub first_vertex: usize,
    pub class: Class,
    /// Triangles seen from behind are left out.
    pub cull: bool,
    /// What shading reads is continuous where triangles share a vertex.
    pub continuous: bool,
    /// Nothing but lamps lights it, and nothing but its colour differs from point to point.
    pub clay: bool,
    /// The picture of that colour, and the transform of its coordinates.
    pub skin: Option<(&'a Texture, &'a TextureRef)>,
}

/// Rows of `picture_from_scene`: homogeneous pixels relative to the picture's centre, y down, and depth.
#[derive(Clone, Copy)]
pub(super) struct Projector {
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
    pub w: Vec4,
}

pub(super) struct Frame<'a> {
    pub isa: Isa,
    pub scene: &'a Scene<'a>,
    pub draws: Vec<Draw<'a>>,
    pub project: Projector,
    pub width: i32,
    pub height: i32,
    pub tiles_x: usize,
    pub tiles_y: usize,
    pub samples: usize,
    pub vertex_count: usize,
    pub triangle_count: u32,
    /// Whether a draw is masked.
    pub masks: bool,
    /// How much depth may differ within a smooth surface and a pixel.
    pub depth_step: [f32; 2],
    pub stats: Stats,
    /// The scene's lights.
    pub lamps: Vec<Lamp<f32>>,
}

static FALLBACK: std::sync::LazyLock<Material> = std::sync::LazyLock::new(Material::default);

impl Draw<'_> {
    /// Numbers of its triangles.
    #[inline(always)]
    pub fn ids(&self) -> std::ops::Range<u32> {
        self.first_triangle..self.first_triangle + self.object.mesh.triangles.len() as u32
    }
}

impl<'a> Frame<'a> {
    pub fn new(isa: Isa, scene: &'a Scene<'a>, settings: &Settings) -> Self {
        let (w, h) = (settings.width, settings.height);
        let clip = scene.camera.clip_from_scene(w as f32 / h.max(1) as f32);
        let (half_w, half_h) = (w as f32 * 0.5, h as f32 * 0.5);
        let project =
            Projector { x: clip.row(0) * half_w, y: clip.row(1) * -half_h, z: clip.row(2), w: clip.row(3) };
        let mut frame = Self {
            isa,
            scene,
            draws: Vec::with_capacity(scene.objects.len()),
            project,
            width: w as i32,
            height: h as i32,
            tiles_x: w.div_ceil(super::TILE),
            tiles_y: h.div_ceil(super::TILE),
            samples: settings.samples as usize,
            vertex_count: 0,
            triangle_count: 0,
            masks: false,
            depth_step: super::merge::depth_step(h, &scene.camera),
            stats: Stats::default(),
            lamps: scene.lights.iter().map(Lamp::from).collect(),
        };
        for (index, object) in scene.objects.iter().enumerate() {
            frame.admit(index, object);
        }
        frame
    }

    /// Take an object in, if its lists fit.
    fn admit(&mut self, index: usize, object: &'a Object<'a>) {
        let (v, f) = (object.positions.len(), object.mesh.triangles.len());
        self.stats.triangles += f as u64;
        let list_fits = |len: usize| len == 0 || len == v;
        let lists_fit = list_fits(object.normals.len()) && list_fits(object.tangents.len());
        let end = self.triangle_count as u64 + f as u64;
        if v != object.mesh.positions.len() || !lists_fit || end > u32::MAX as u64 {
            self.stats.skipped += f as u64;
            return;
        }
        let material = self.scene.materials.get(object.material).unwrap_or(&FALLBACK);
        let skin = material.diffuse_map.as_ref();
        let skin = skin.and_then(|m| Some((self.scene.textures.get(m.texture.0 as usize)?, m)));
        let uvs = |m: &TextureRef| &object.mesh.uvs[(m.uv_set & 1) as usize];
        self.draws.push(Draw {
            object,
            material,
            index,
            first_triangle: self.triangle_count,
            first_vertex: self.vertex_count,
            class: match material.alpha {
                AlphaMode::Opaque => Class::Opaque,
                AlphaMode::Mask(_) => Class::Mask,
                AlphaMode::Blend => Class::Blend,
            },
            cull: !material.double_sided,
            continuous: material.unlit || !object.normals.is_empty(),
            clay: !object.normals.is_empty()
                && object.mesh.colors.is_empty()
                && skin.is_none_or(|(_, m)| !uvs(m).is_empty())
                && is_simple(material)
                && self.scene.style.is_plain(),
            skin,
        });
        self.masks |= matches!(material.alpha, AlphaMode::Mask(_));
        self.triangle_count = end as u32;
        self.vertex_count += v;
        self.stats.vertices += v as u64;
    }

    /// Which draw a triangle belongs to.
    pub fn draw_of(&self, id: u32) -> usize {
        self.draws.partition_point(|d| d.first_triangle <= id) - 1
    }

    /// Whether a triangle is of a masked draw.
    #[inline(always)]
    pub fn is_masked(&self, setup: &Setup) -> bool {
        self.masks && self.draws[setup.draw as usize].class == Class::Mask
    }

    /// Distance along the view direction at a depth value.
    pub fn distance(&self, z: f32) -> f32 {
        let c = &self.scene.camera;
        match c.projection {
            Projection::Perspective { .. } => c.near / z,
            Projection::Orthographic { .. } => c.near + (1.0 - z) * (c.far - c.near).max(f32::MIN_POSITIVE),
        }
    }
}

/// Lit, not seen through, and with no map but one of its colour.
fn is_simple(m: &Material) -> bool {
    let maps = [&m.specular_map, &m.emissive_map, &m.normal_map, &m.occlusion_map];
    maps.iter().all(|m| m.is_none()) && !m.unlit && m.alpha != AlphaMode::Blend
}

impl Projector {
    /// Homogeneous picture coordinates of a point.
    #[inline(always)]
    pub fn point(&self, p: Vec3) -> Vec4 {
        let row = |r: Vec4| r.x * p.x + r.y * p.y + r.z * p.z + r.w;
        Vec4::new(row(self.x), row(self.y), row(self.z), row(self.w))
    }

    #[inline(always)]
    pub fn row8(r: Vec4, p: V8) -> F8 {
        p.x * r.x + p.y * r.y + p.z * r.z + r.w
    }
}
