//! A scene made ready for rays: the one form that whatever can be drawn is brought into.

use super::coat::{Alpha, Coat};
use super::eye::{Eye, NOTHING};
use super::solid;
use super::wave::Path;
use crate::math::lanes::{self, V3};
use crate::math::simd::Isa;
use crate::render::accel::{self, World};
use crate::render::shade::{Lamp, LampKind};
use crate::scene::{Geometry, Object, Scene, ShapeLight, ShapeMaterial, ShapeScene, Source, Style};
use glam::{DVec3, Vec3};
use std::cell::Cell;

/// What rays and shading are computed in.
pub(super) trait Real: lanes::Real + accel::Real {
    /// As rays through triangles have it.
    fn kept(v: DVec3) -> DVec3 {
        V3::<Self>::of(v).wide()
    }

    /// Which of some rays `accept` takes a hit of, a bit each.
    fn blocked(
        world: &World,
        rays: &[accel::Ray<Self>],
        accept: impl Fn(usize, &accel::Hit<Self>) -> bool,
    ) -> u32 {
        let one = |(i, ray)| u32::from(world.blocked(ray, |h| accept(i, h))) << i;
        rays.iter().enumerate().map(one).sum()
    }
}

impl Real for f32 {
    fn blocked(
        world: &World,
        rays: &[accel::Ray<f32>],
        accept: impl Fn(usize, &accel::Hit<f32>) -> bool,
    ) -> u32 {
        world.blocked_packet(rays, accept)
    }
}

impl Real for f64 {}

/// Triangles of one object.
pub(super) struct Body<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    /// Where varyings come from; none for soups.
    pub object: Option<&'a Object<'a>>,
    pub finish: Finish,
    /// Seen from the front alone.
    culled: bool,
    pub mirrored: bool,
}

/// What rays need to know of a material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish {
    pub material: usize,
    pub mirror: DVec3,
    pub transmission: DVec3,
    pub ior: f64,
    pub alpha: Alpha,
}

impl Finish {
    pub fn is_glass(&self) -> bool {
        self.transmission.max_element() > 0.0
    }
}

pub(super) struct Stage<'a, R: Real> {
    pub isa: Isa,
    pub eye: Eye,
    pub world: &'a World,
    pub bodies: Vec<Body<'a>>,
    pub solids: Vec<(Geometry, Finish)>,
    pub lamps: Vec<Lamp<R>>,
    pub coat: Coat<'a, R>,
    pub background: [f32; 4],
}

/// What a ray meets. Objects beyond the bodies are solids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub t: f64,
    pub u: f64,
    pub v: f64,
    pub object: u32,
    pub triangle: u32,
    pub back: bool,
}

/// A ray to a lamp, which is at `far`.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToLamp {
    pub origin: DVec3,
    pub direction: DVec3,
    pub far: f64,
}

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub position: DVec3,
    /// Unit, geometric, on the front.
    pub face: DVec3,
    /// How far the true place may lie before or behind it.
    pub error: f64,
    /// Barycentric coordinates.
    pub b: [f64; 3],
}

impl<R: Real> From<accel::Hit<R>> for Hit {
    fn from(h: accel::Hit<R>) -> Self {
        let (t, u, v) = (h.t.wide(), h.u.wide(), h.v.wide());
        Self { t, u, v, object: h.object, triangle: h.triangle, back: h.back }
    }
}

/// Bodies of a scene, in the order of its objects; those whose lists do not fit have no triangles.
pub(super) fn bodies_of<'a>(scene: &'a Scene) -> Vec<Body<'a>> {
    let body = |object: &'a Object| {
        let v = object.positions.len();
        let fits = |n: usize| n == 0 || n == v;
        let sound =
            v == object.mesh.positions.len() && fits(object.normals.len()) && fits(object.tangents.len());
        let finish = Finish::of_scene(scene, object.material);
        Body {
            positions: object.positions,
            triangles: if sound { &object.mesh.triangles } else { &[] },
            object: Some(object),
            culled: scene.materials.get(object.material).is_none_or(|m| !m.double_sided)
                && !finish.is_glass(),
            mirrored: object.mirrored,
            finish,
        }
    };
    scene.objects.iter().map(body).collect()
}

/// Positions and triangles of a soup.
pub(super) fn soup_mesh(soup: &crate::scene::Soup) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = soup.triangles.len() as u32;
    (soup.triangles.as_flattened().to_vec(), (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Bodies of the notes' soups, from what [`soup_mesh`] made of them.
pub(super) fn bodies_of_soups<'a>(
    scene: &'a ShapeScene,
    meshes: &'a [(Vec<Vec3>, Vec<[u32; 3]>)],
) -> Vec<Body<'a>> {
    let body = |(soup, (positions, triangles)): (&crate::scene::Soup, &'a (Vec<Vec3>, Vec<[u32; 3]>))| Body {
        positions,
        triangles,
        object: None,
        finish: Finish::of_shapes(scene, soup.material),
        culled: false,
        mirrored: false,
    };
    scene.soups.iter().zip(meshes).map(body).collect()
}

impl Finish {
    fn of_scene(scene: &Scene, material: usize) -> Self {
        let m = super::coat::material(scene, material);
        Self {
            material,
            mirror: m.mirror.as_dvec3(),
            transmission: m.transmission.as_dvec3(),
            ior: f64::from(m.ior),
            alpha: Alpha::of(m),
        }
    }

    fn of_shapes(scene: &ShapeScene, material: usize) -> Self {
        let m = scene.materials.get(material).cloned().unwrap_or_default();
        let ShapeMaterial { mirror, transmission, ior, .. } = m;
        Self { material, mirror, transmission, ior, alpha: Alpha::Opaque }
    }
}

fn lamp_of<R: Real>(light: &ShapeLight) -> Lamp<R> {
    let kind = match light.source {
        Source::Directional(d) => LampKind::Directional { towards: V3::of(-d.normalize_or(DVec3::NEG_Y)) },
        Source::Point(p) => LampKind::Point { position: V3::of(p), falloff: None },
    };
    Lamp { kind, color: V3::of(light.color), radius: R::of(light.radius) }
}

impl<'a, R: Real> Stage<'a, R> {
    pub fn of_scene(
        isa: Isa,
        scene: &'a Scene<'a>,
        bodies: Vec<Body<'a>>,
        world: &'a World,
        size: [usize; 2],
    ) -> Self {
        Self {
            isa,
            eye: Eye::of_camera(&scene.camera, size[0], size[1]),
            world,
            bodies,
            solids: scene.shapes.iter().map(|s| (s.geometry, Finish::of_scene(scene, s.material))).collect(),
            lamps: scene.lights.iter().map(Lamp::from).collect(),
            coat: Coat::Scene(scene),
            background: scene.background,
        }
    }

    pub fn of_shapes(
        isa: Isa,
        scene: &'a ShapeScene,
        bodies: Vec<Body<'a>>,
        world: &'a World,
        size: [usize; 2],
    ) -> Self {
        Self {
            isa,
            eye: Eye::of_pinhole(&scene.camera, size[0], size[1]),
            world,
            bodies,
            solids: scene.shapes.iter().map(|s| (s.geometry, Finish::of_shapes(scene, s.material))).collect(),
            lamps: scene.lights.iter().map(lamp_of).collect(),
            coat: Coat::plain(scene),
            background: [0.0, 0.0, 0.0, 1.0],
        }
    }

    /// What a path shows that meets nothing: the background; mirrored or refracted, the sky if there is one; in a mirror, where all that
    /// is nothing, the ambient light.
    pub fn beyond(&self, path: &Path) -> (DVec3, f64) {
        let [r, g, b, a] = self.background.map(f64::from);
        let behind = DVec3::new(r, g, b);
        match &self.coat {
            Coat::Scene(Scene { style: Style { sky: Some([above, below]), .. }, .. }) if path.bounce > 0 => {
                let up = path.direction.normalize_or(DVec3::Y).y as f32;
                (below.lerp(*above, 0.5 + 0.5 * up).as_dvec3(), 1.0)
            }
            Coat::Scene(scene) if path.bounce > 0 && path.cover == 0.0 => {
                let (above, up) = (scene.ambient.as_dvec3(), path.direction.normalize_or(DVec3::Y).y);
                let below = scene.style.below.map_or(above, |b| b.as_dvec3());
                (behind + below.lerp(above, 0.5 + 0.5 * up) * (1.0 - a), a)
            }
            _ => (behind, a),
        }
    }

    /// What an object is made of.
    pub fn finish(&self, object: u32) -> &Finish {
        let n = self.bodies.len();
        match self.bodies.get(object as usize) {
            Some(b) => &b.finish,
            None => &self.solids[object as usize - n].1,
        }
    }

    /// What a primary path meets where another renderer has found an object (counted from 1; 0 is nothing) and its triangle: nothing
    /// is looked for but what it cannot know, shapes and what blends. `None` if it is no use.
    pub fn known(&self, path: &Path, object: u32, triangle: u32) -> Option<Option<Hit>> {
        let blends = self.bodies.iter().any(|b| b.finish.alpha == Alpha::Blend);
        if blends {
            return None;
        }
        let mut best = match object.checked_sub(1) {
            Some(object) => Some(self.meet(path, object, triangle)?),
            None => None,
        };
        self.meet_solids(path, f64::INFINITY, &mut best);
        Some(best)
    }

    /// Where a path meets a triangle, or the nearest point of it where it passes by.
    pub fn meet(&self, path: &Path, object: u32, triangle: u32) -> Option<Hit> {
        let body = self.bodies.get(object as usize)?;
        let ([p0, p1, p2], d) = (body.corners(triangle), path.direction);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let n = e1.cross(e2);
        let t = (p0 - path.origin).dot(n) / d.dot(n);
        let p = path.origin + d * t - p0;
        let (u, v) = (p.cross(e2).dot(n).max(0.0), e1.cross(p).dot(n).max(0.0));
        let sum = n.length_squared().max(u + v);
        let back = (d.dot(n) > 0.0) != body.mirrored;
        t.is_finite().then_some(Hit { t, u: u / sum, v: v / sum, object, triangle, back })
    }

    /// Put a nearer solid in the place of a hit.
    fn meet_solids(&self, path: &Path, far: f64, best: &mut Option<Hit>) {
        for (i, (geometry, _)) in self.solids.iter().enumerate() {
            let object = (self.bodies.len() + i) as u32;
            let range = [path.near, best.map_or(far, |b| b.t)];
            let found = solid::meet(geometry, [path.origin, path.direction], path.left == object, range);
            if let Some(t) = found.filter(|t| best.is_none_or(|b| *t < b.t)) {
                let [_, face] = solid::settle(geometry, path.origin + path.direction * t);
                let back = face.dot(path.direction) > 0.0;
                *best = Some(Hit { t, u: 0.0, v: 0.0, object, triangle: 0, back });
            }
        }
    }

    fn ray(&self, origin: DVec3, direction: DVec3, near: f64, far: f64) -> accel::Ray<R> {
        let list = |v: DVec3| v.to_array().map(<R as lanes::Real>::of);
        let one = <R as lanes::Real>::of;
        accel::Ray { origin: list(origin), direction: list(direction), t_min: one(near), t_max: one(far) }
    }

    /// The first surface on a path that the eye would see there, not beyond `far`; with what blends, or without.
    pub fn nearest(&self, path: &Path, far: f64, blends: bool) -> Option<Hit> {
        let ray = self.ray(path.origin, path.direction, path.near, far);
        let line = [path.origin, path.direction].map(R::kept);
        let seen = |h: &accel::Hit<R>| {
            let body = &self.bodies[h.object as usize];
            !(body.culled && h.back)
                && body.corners(h.triangle).iter().all(|p| p.is_finite())
                && (path.left == NOTHING || body.ahead(h.triangle, line))
                && match body.finish.alpha {
                    Alpha::Mask(cut_off) => self.coat.alpha(self.isa, body, &(*h).into()) >= cut_off,
                    Alpha::Blend => blends,
                    Alpha::Opaque => true,
                }
        };
        let mut best: Option<Hit> = self.world.nearest(&ray, seen).map(Hit::from);
        self.meet_solids(path, far, &mut best);
        best
    }

    /// The shares of light that get along some rays, at most eight: what blends, and glass, let theirs through, straight on.
    pub fn passing(&self, rays: &[ToLamp], left: u32) -> [DVec3; 8] {
        let passed: [Cell<DVec3>; 8] = Default::default();
        let stops = |i: usize, finish: &Finish, alpha: &dyn Fn() -> f64| {
            let cell: &Cell<DVec3> = &passed[i];
            let share = match finish.alpha {
                _ if finish.is_glass() => finish.transmission,
                Alpha::Opaque => return true,
                Alpha::Mask(cut_off) => return alpha() >= cut_off,
                Alpha::Blend => DVec3::splat(1.0 - alpha()),
            };
            cell.set(cell.get() * share);
            false
        };

        // Shapes are the quickest to ask; what they leave goes through the triangles together.
        let (mut open, mut n) = ([0; 8], 0);
        for (i, ray) in rays.iter().enumerate() {
            passed[i].set(DVec3::ONE);
            let hidden = self.solids.iter().enumerate().any(|(k, (geometry, finish))| {
                let own = left as usize == self.bodies.len() + k;
                let range = [f64::MIN_POSITIVE, ray.far];
                solid::meet(geometry, [ray.origin, ray.direction], own, range).is_some()
                    && stops(i, finish, &|| self.coat.solid_alpha(finish.material))
            });
            if hidden {
                passed[i].set(DVec3::ZERO);
            } else {
                (open[n], n) = (i, n + 1);
            }
        }
        if n > 0 && !self.bodies.is_empty() {
            let made = open.map(|i| {
                let r = &rays[i];
                (self.ray(r.origin, r.direction, 0.0, r.far), [r.origin, r.direction].map(R::kept))
            });
            let blocked = R::blocked(self.world, &made.map(|m| m.0)[..n], |k, h| {
                let body = &self.bodies[h.object as usize];
                body.ahead(h.triangle, made[k].1)
                    && stops(open[k], &body.finish, &|| self.coat.alpha(self.isa, body, &(*h).into()))
            });
            (0..n).filter(|k| blocked >> k & 1 == 1).for_each(|k| passed[open[k]].set(DVec3::ZERO));
        }
        passed.map(|p| p.get())
    }

    /// Where a path meets a surface.
    ///
    /// Places are computed in `f64`, from corners or in closed form and never by running along the ray, so that they lie within
    /// rounding of the surface whatever the distance.
    pub fn spot(&self, path: &Path, hit: &Hit) -> Spot {
        let along = |position: DVec3, face: DVec3, reach: f64, b: [f64; 3]| {
            // Rounding to `R` moves each coordinate by its share; the rest was computed in f64 from numbers up to `reach`.
            let slip = position.abs() * (2.0 * R::ROUNDOFF) + DVec3::splat(32.0 * f64::EPSILON * reach);
            Spot { position, face, error: 2.0 * face.abs().dot(slip), b }
        };
        match self.bodies.get(hit.object as usize) {
            Some(body) => {
                let [p0, p1, p2] = body.corners(hit.triangle);
                let b = [1.0 - hit.u - hit.v, hit.u, hit.v];
                let position = p0 * b[0] + p1 * b[1] + p2 * b[2];
                let n = (p1 - p0).cross(p2 - p0).normalize_or(DVec3::Y);
                let reach = p0.abs().max(p1.abs()).max(p2.abs()).max_element();
                along(position, if body.mirrored { -n } else { n }, reach, b)
            }
            None => {
                let (geometry, _) = &self.solids[hit.object as usize - self.bodies.len()];
                let [position, face] = solid::settle(geometry, path.origin + path.direction * hit.t);
                along(position, face, solid::reach(geometry) + position.abs().max_element(), [0.0; 3])
            }
        }
    }
}

impl Spot {
    /// A start for rays that leave along `direction`: off the surface by the error bound, on that side.
    pub fn leave(&self, direction: DVec3) -> DVec3 {
        let side = self.error.copysign(self.face.dot(direction));
        self.position + self.face * side
    }
}

impl Body<'_> {
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize].as_dvec3())
    }

    /// How far a place lies below the smooth surface that the normals at its triangle's corners tell of, on the side of `normal`: no
    /// ray to a lamp must start there, or facets would show in the shadow's edge (Hanika, "Hacking the Shadow Terminator", 2021).
    pub fn lift(&self, triangle: u32, spot: &Spot, normal: DVec3) -> Option<DVec3> {
        let object = self.object.filter(|o| !o.normals.is_empty())?;
        let lift = |(v, b): (u32, f64)| {
            let n = object.normals[v as usize].as_dvec3();
            let n = if n.dot(normal) < 0.0 { -n } else { n };
            let below = (spot.position - self.positions[v as usize].as_dvec3()).dot(n).min(0.0);
            n * (-below * b)
        };
        Some(self.triangles[triangle as usize].into_iter().zip(spot.b).map(lift).sum())
    }

    /// Whether a ray that starts at a surface truly has a triangle before it: a plane that runs through the start, or lies behind it,
    /// may come out a little ahead.
    fn ahead(&self, triangle: u32, [o, d]: [DVec3; 2]) -> bool {
        let [p0, p1, p2] = self.corners(triangle);
        let n = (p1 - p0).cross(p2 - p0);
        n.dot(p0 - o) * n.dot(d) > 0.0
    }
}
