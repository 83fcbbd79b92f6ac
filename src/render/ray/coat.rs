//! What surfaces are made of, at the places that rays meet: a scene's materials by the code that every renderer shares, or the
//! notes' plain coefficients in either precision.

use super::stage::{Body, Hit, Real, Spot};
use super::wave::Path;
use crate::math::lanes::{Lanes, Mask, V3};
use crate::math::simd::{self, F, F8, I8, Isa, Kernel, V8};
use crate::render::material::{self, Points};
use crate::render::sample::Uv;
use crate::render::shade::{self, Lamp, Surface};
use crate::render::styled;
use crate::render::varying::{Slopes, Varying, corners, mix, vectors};
use crate::scene::{AlphaMode, Material, Scene, ShapeScene, TextureRef};
use glam::{DVec3, Vec3};
use std::sync::LazyLock;

static FALLBACK: LazyLock<Material> = LazyLock::new(Material::default);

/// A scene's material; the default where there is none.
pub(super) fn material<'a>(scene: &'a Scene, index: usize) -> &'a Material {
    scene.materials.get(index).unwrap_or(&FALLBACK)
}

/// What alpha means to rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Alpha {
    Opaque,
    Mask(f64),
    Blend,
}

impl Alpha {
    pub fn of(m: &Material) -> Self {
        match m.alpha {
            AlphaMode::Opaque => Self::Opaque,
            AlphaMode::Mask(cut_off) => Self::Mask(f64::from(cut_off)),
            AlphaMode::Blend => Self::Blend,
        }
    }
}

pub(super) enum Coat<'a, R: Real> {
    Scene(&'a Scene<'a>),
    Plain { materials: Vec<Surface<R::Wide>>, ambient: V3<R>, gated: bool },
}

/// Up to eight hits of one object.
pub(super) struct Batch<'a> {
    pub body: Option<&'a Body<'a>>,
    pub material: usize,
    pub paths: [Path; 8],
    pub hits: [Hit; 8],
    pub spots: [Spot; 8],
}

/// What is to be lit. One at a time lives, on the stack.
#[allow(clippy::large_enum_variant)]
pub(super) enum Dressed<R: Real> {
    Scene(Surface<F8>),
    Plain(Surface<R::Wide>),
}

impl<'a, R: Real> Coat<'a, R> {
    pub fn plain(scene: &ShapeScene) -> Self {
        let all = |v: DVec3| V3::<R::Wide>::all(V3::of(v));
        let one = |m: &crate::scene::ShapeMaterial| Surface {
            position: V3::ZERO,
            normal: V3::ZERO,
            view: V3::ZERO,
            ambient: all(m.ambient),
            diffuse: all(m.diffuse),
            specular: all(m.specular),
            shininess: R::Wide::all(m.shininess),
            openness: R::Wide::all(1.0),
            emissive: V3::ZERO,
        };
        let default = one(&Default::default());
        let materials = scene.materials.iter().map(one).chain([default]).collect();
        Self::Plain { materials, ambient: V3::of(scene.ambient), gated: scene.gated }
    }

    /// Surfaces at eight hits, and their alpha.
    pub fn dress(&self, isa: Isa, batch: &Batch) -> (Dressed<R>, [f64; 8]) {
        match self {
            Self::Scene(scene) => {
                let (surface, alpha) = simd::run(isa, Dress { isa, scene, batch });
                (Dressed::Scene(surface), alpha.0.map(f64::from))
            }
            Self::Plain { materials, .. } => {
                let mut s = materials[batch.material.min(materials.len() - 1)];
                for k in 0..8 {
                    s.position.set(k, V3::of(batch.spots[k].position));
                    s.normal.set(k, V3::of(batch.faced(k)));
                    s.view.set(k, V3::of(batch.view(k)));
                }
                (Dressed::Plain(s), [1.0; 8])
            }
        }
    }

    /// What leaves them towards the eye; `reached` is the share of each lamp's light that arrives, lamp by lamp.
    pub fn light(
        &self,
        isa: Isa,
        dressed: &Dressed<R>,
        lamps: &[Lamp<R>],
        reached: &[[DVec3; 8]],
    ) -> [DVec3; 8] {
        match (self, dressed) {
            (Self::Scene(scene), Dressed::Scene(s)) => {
                let reached: Vec<V8> = reached.iter().map(|r| gather(|k| r[k])).collect();
                let c = styled::light(isa, s, scene, &reached);
                std::array::from_fn(|k| c.lane(k).wide())
            }
            (Self::Plain { ambient, gated, .. }, Dressed::Plain(s)) => {
                let wide = |r: &[DVec3; 8]| {
                    let mut v = V3::<R::Wide>::ZERO;
                    (0..8).for_each(|k| v.set(k, V3::of(r[k])));
                    v
                };
                let reached: Vec<V3<R::Wide>> = reached.iter().map(wide).collect();
                let c = shade::shadowed(s, V3::all(*ambient), lamps, &reached, *gated);
                std::array::from_fn(|k| c.lane(k).wide())
            }
            _ => unreachable!("a coat dresses in its own kind"),
        }
    }

    /// Whether lamps light surfaces that are turned away from them.
    pub fn gated(&self) -> bool {
        !matches!(self, Self::Plain { gated: false, .. })
    }

    /// Alpha of a body where it is hit.
    pub fn alpha(&self, isa: Isa, body: &Body, hit: &Hit) -> f64 {
        let (Self::Scene(scene), Some(object)) = (self, body.object) else { return 1.0 };
        let b = [1.0 - hit.u - hit.v, hit.u, hit.v].map(|b| F8::splat(b as f32));
        let material = material(scene, body.finish.material);
        f64::from(simd::run(isa, OneAlpha { isa, scene, material, object, triangle: hit.triangle, b }))
    }

    /// Alpha of a solid.
    pub fn solid_alpha(&self, index: usize) -> f64 {
        match self {
            Self::Scene(scene) => f64::from(material(scene, index).diffuse.w.clamp(0.0, 1.0)),
            Self::Plain { .. } => 1.0,
        }
    }
}

impl<R: Real> Dressed<R> {
    /// Unit shading normal.
    pub fn normal(&self, k: usize) -> DVec3 {
        match self {
            Self::Scene(s) => s.normal.lane(k).wide(),
            Self::Plain(s) => s.normal.lane(k).wide(),
        }
    }

    /// Whether lamps make a difference.
    pub fn takes_light(&self) -> bool {
        fn any<L: Lanes>(s: &Surface<L>) -> bool {
            [s.diffuse, s.specular].iter().any(|c| [c.x, c.y, c.z].iter().any(|x| x.gt(L::ZERO).any()))
        }
        match self {
            Self::Scene(s) => any(s),
            Self::Plain(s) => any(s),
        }
    }
}

impl<'a> Batch<'a> {
    /// Unit, towards where the ray came from.
    fn view(&self, k: usize) -> DVec3 {
        -self.paths[k].direction.normalize_or(DVec3::NEG_Z)
    }

    /// Eight points of an object's triangles.
    #[inline(always)]
    fn on_object(&self) -> Option<Varying<'a, false, Spread>> {
        let object = self.body.and_then(|b| b.object)?;
        let b = [0, 1, 2].map(|i| F(self.spots.each_ref().map(|s| s.b[i] as f32)));
        let moved = [0, 1].map(|axis| {
            gather(|k| {
                let s = &self.paths[k].spread;
                s[axis].as_dvec3() + s[axis + 2].as_dvec3() * self.hits[k].t
            })
        });
        let spread = Spread { direction: gather(|k| self.paths[k].direction), moved };
        Some(varying(object, &self.hits.map(|h| h.triangle), b, gather(|k| self.view(k)), spread))
    }

    /// Eight points of a solid.
    #[inline(always)]
    fn on_solid(&self) -> Bare {
        let (position, normal) = (gather(|k| self.spots[k].position), gather(|k| self.faced(k)));
        Bare { position, normal, view: gather(|k| self.view(k)) }
    }

    /// The geometric normal on the side that the ray comes from.
    pub fn faced(&self, k: usize) -> DVec3 {
        let n = self.spots[k].face;
        if n.dot(self.paths[k].direction) > 0.0 { -n } else { n }
    }
}

fn gather(at: impl Fn(usize) -> DVec3) -> V8 {
    V8::gather(std::array::from_fn(|k| at(k).as_vec3()))
}

/// Shading normals and texture coordinates (of the first set) of a batch.
pub(super) fn look(isa: Isa, scene: &Scene, batch: &Batch) -> (V8, [F8; 2]) {
    simd::run(isa, Look { isa, scene, batch })
}

struct Look<'a> {
    isa: Isa,
    scene: &'a Scene<'a>,
    batch: &'a Batch<'a>,
}

impl Kernel for Look<'_> {
    type Output = (V8, [F8; 2]);

    #[inline(always)]
    fn run(self) -> (V8, [F8; 2]) {
        let Self { isa, scene, batch } = self;
        let m = material(scene, batch.material);
        let tell = |normal: V8, uv: Uv| (normal, [uv.u, uv.v]);
        match batch.on_object() {
            Some(p) => tell(material::shading_normal(isa, scene, m, &p), p.uv(0)),
            None => tell(material::shading_normal(isa, scene, m, &batch.on_solid()), Uv::ZERO),
        }
    }
}

struct Dress<'a> {
    isa: Isa,
    scene: &'a Scene<'a>,
    batch: &'a Batch<'a>,
}

impl Kernel for Dress<'_> {
    type Output = (Surface<F8>, F8);

    #[inline(always)]
    fn run(self) -> (Surface<F8>, F8) {
        let Self { isa, scene, batch } = self;
        let m = material(scene, batch.material);
        match batch.on_object() {
            Some(p) => material::surface(isa, scene, m, &p),
            None => material::surface(isa, scene, m, &batch.on_solid()),
        }
    }
}

#[inline(always)]
fn varying<'a, S: Slopes>(
    object: &'a crate::scene::Object<'a>,
    ids: &[u32; 8],
    b: [F8; 3],
    view: V8,
    slopes: S,
) -> Varying<'a, false, S> {
    let corner = corners::<false>(object, ids);
    let p = [0, 1, 2].map(|i| vectors::<false>(object.positions, &corner[i]));
    Varying { object, corner, b, p, normals: None, position: mix(&b, &p), view, slopes }
}

struct OneAlpha<'a> {
    isa: Isa,
    scene: &'a Scene<'a>,
    material: &'a Material,
    object: &'a crate::scene::Object<'a>,
    triangle: u32,
    b: [F8; 3],
}

impl Kernel for OneAlpha<'_> {
    type Output = f32;

    #[inline(always)]
    fn run(self) -> f32 {
        let still = Spread { direction: V8::splat(Vec3::Y), moved: [V8::ZERO; 2] };
        let p = varying(self.object, &[self.triangle; 8], self.b, V8::splat(Vec3::Y), still);
        material::alpha(self.isa, self.scene, self.material, &p).0[0]
    }
}

/// How far a ray's neighbours are at its end, by their differences (Igehy 1999).
struct Spread {
    direction: V8,
    moved: [V8; 2],
}

impl Slopes for Spread {
    /// The neighbour's end slides along the ray into the triangle's plane: `∂p = m − d (m·n)/(d·n)`.
    #[inline(always)]
    fn slopes(&self, _: &[F8; 3], p: &[V8; 3]) -> [[F8; 3]; 2] {
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let n = e1.cross(e2);
        let (rise, n2) = (self.direction.dot(n), n.dot(n).max(F8::splat(1e-38)));
        let level = rise * rise;
        let rise = rise / level.max(F8::splat(1e-38));
        self.moved.map(|m| {
            let dp = m - self.direction * (m.dot(n) * rise);
            let (b1, b2) = (dp.cross(e2).dot(n) / n2, e1.cross(dp).dot(n) / n2);
            [-(b1 + b2), b1, b2]
        })
    }
}

/// A surface without coordinates.
struct Bare {
    position: V8,
    normal: V8,
    view: V8,
}

impl Points for Bare {
    #[inline(always)]
    fn position(&self) -> V8 {
        self.position
    }
    #[inline(always)]
    fn view(&self) -> V8 {
        self.view
    }
    #[inline(always)]
    fn normal(&self) -> V8 {
        self.normal
    }
    #[inline(always)]
    fn away(&self) -> I8 {
        I8::ZERO
    }
    #[inline(always)]
    fn uv(&self, _: u8) -> Uv {
        Uv::ZERO
    }
    #[inline(always)]
    fn color(&self) -> Option<[F8; 4]> {
        None
    }
    #[inline(always)]
    fn tangent_frame(&self, _: V8, _: &TextureRef) -> (V8, V8) {
        (V8::ZERO, V8::ZERO)
    }
}
