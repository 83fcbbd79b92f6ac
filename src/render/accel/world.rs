//! Many surfaces, each as often as it is placed: a tree over objects, and a tree in each surface.

use super::lanes::{Lanes, Machine, Work};
use super::packet::{PACKET, Together};
use super::ray::{Hit, Ray, Real, Slab};
use super::search::{Any, Nearest, Search};
use super::{Accel, Kind, build, each, tree};
use crate::math::simd::Isa;
use build::{Item, Span};
use glam::{DAffine3, DVec3, Vec3};
use tree::{Node, Visitor};

/// Triangles as they stand now.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// `V` positions, metres.
    pub positions: &'a [Vec3],
    /// `F` triangles, counter-clockwise in front.
    pub triangles: &'a [[u32; 3]],
}

/// An object: a surface somewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placed {
    /// Which surface.
    pub surface: usize,
    /// Where; `None` leaves it where its positions are.
    pub world_from_surface: Option<DAffine3>,
    /// Rays pass through its back.
    pub cull_back: bool,
    /// Its triangles wind the other way round: clockwise in front. What a placement mirrors keeps its front without this.
    pub mirrored: bool,
}

/// What has changed since the last time.
#[derive(Clone, Copy, Debug)]
pub enum Motion<'a> {
    /// A surface has other positions.
    Deformed {
        /// Which.
        surface: usize,
        /// `V` positions.
        positions: &'a [Vec3],
    },
    /// An object is elsewhere.
    Moved {
        /// Which.
        object: usize,
        /// Where.
        world_from_surface: Option<DAffine3>,
    },
}

/// Work done by an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// Surfaces whose boxes were fitted again.
    pub refitted: usize,
    /// Surfaces whose tree had become too loose and was built anew.
    pub rebuilt: usize,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Object {
    pub placed: Placed,
    /// Inverse of the placement, if that has one.
    pub surface_from_world: Option<DAffine3>,
}

/// All objects that a ray can meet.
#[derive(Clone, Debug)]
pub struct World {
    machine: Machine,
    pub(super) parts: Vec<Accel>,
    pub(super) objects: Vec<Object>,
    pub(super) span: Span,
    /// How much wider boxes are made for rays: placements round, too.
    pub(super) slack: f32,
    pub(super) nodes: Vec<Node>,
    /// The objects of each leaf of `nodes`.
    pub(super) leaves: Vec<[u32; build::LEAF_SIZE]>,
}

impl World {
    /// Objects in the order of `placed`; the same for any number of threads.
    ///
    /// # Panics
    /// If an object names a surface, or a triangle a vertex, that does not exist.
    pub fn new(kind: Kind, surfaces: &[Surface], placed: &[Placed], threads: usize) -> Self {
        // Small surfaces share the threads; a large one has them all.
        let parts = surfaces.iter().map(|s| Accel::new(kind, s.positions, s.triangles, threads));
        let mut world = Self {
            machine: Machine::new(Isa::Best),
            parts: parts.collect(),
            objects: placed.iter().map(|p| Object::new(*p)).collect(),
            span: Span::EMPTY,
            slack: 1.0,
            nodes: Vec::new(),
            leaves: Vec::new(),
        };
        world.gather();
        world
    }

    /// The same with another build of the kernels; for tests and measurements.
    pub fn with_isa(self, isa: Isa) -> Self {
        Self { machine: Machine::new(isa), ..self }
    }

    /// The surfaces, in the order of [`World::new`].
    pub fn surfaces(&self) -> &[Accel] {
        &self.parts
    }

    /// The objects, in the order of [`World::new`].
    pub fn objects(&self) -> impl ExactSizeIterator<Item = &Placed> {
        self.objects.iter().map(|o| &o.placed)
    }

    /// Corner of the box around all objects with the smallest coordinates, and with the largest.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.nodes.is_empty()).then_some(self.span.corners())
    }

    /// Follow what has moved: a deformed surface is fitted again (or built anew, see [`Accel::update`]), a moved object costs
    /// its box.
    ///
    /// # Panics
    /// If something does not exist, or there are fewer positions than before.
    pub fn update(&mut self, motions: &[Motion], threads: usize) -> Updated {
        let mut positions = vec![None; self.parts.len()];
        for motion in motions {
            match *motion {
                Motion::Deformed { surface, positions: p } => positions[surface] = Some(p),
                Motion::Moved { object, world_from_surface } => {
                    let placed = Placed { world_from_surface, ..self.objects[object].placed };
                    self.objects[object] = Object::new(placed);
                }
            }
        }
        let mut tasks: Vec<(&mut Accel, &[Vec3], bool)> =
            self.parts.iter_mut().zip(positions).filter_map(|(a, p)| p.map(|p| (a, p, false))).collect();
        // Few large surfaces: threads inside; many: a thread each.
        let (outer, inner) = if tasks.len() < 2 * threads { (1, threads) } else { (threads, 1) };
        each(tasks.iter_mut().collect(), outer, |(accel, p, rebuilt)| *rebuilt = accel.update(p, inner));
        let rebuilt = tasks.iter().filter(|t| t.2).count();
        let refitted = tasks.len() - rebuilt;
        self.gather();
        Updated { refitted, rebuilt }
    }

    /// The tree over objects.
    fn gather(&mut self) {
        self.slack =
            if self.objects.iter().any(|o| o.placed.world_from_surface.is_some()) { 16.0 } else { 1.0 };
        let item = |(id, o): (usize, &Object)| {
            let (lo, hi) = o.bounds(self.parts[o.placed.surface].bounds()?)?;
            Some(Item::new(lo.into(), hi.into(), id as u32))
        };
        let mut items: Vec<Item> = self.objects.iter().enumerate().filter_map(item).collect();
        self.span = Span::EMPTY;
        items.iter().for_each(|i| self.span.join(i.span()));
        let grown = build::grow(&mut items, 1, 1);
        (self.nodes, self.leaves) = (grown.nodes, grown.leaves);
    }

    /// The first hit that `accept` takes; of equal `t`, the one of the lowest object and triangle.
    ///
    /// `accept` must not change its mind: it may be asked about any hit, in any order.
    #[inline]
    pub fn nearest<R: Real>(&self, ray: &Ray<R>, accept: impl Fn(&Hit<R>) -> bool) -> Option<Hit<R>> {
        self.machine.run(Query { world: self, ray, search: Nearest::new(accept) }).best
    }

    /// Whether `accept` takes any hit.
    #[inline]
    pub fn blocked<R: Real>(&self, ray: &Ray<R>, accept: impl Fn(&Hit<R>) -> bool) -> bool {
        self.machine.run(Query { world: self, ray, search: Any::new(accept) }).found
    }

    /// Which of up to [`PACKET`] rays `accept` (given which ray it is) takes a hit of, a bit each: the answers of
    /// [`World::blocked`], sooner if the rays go much the same way, as to one lamp.
    ///
    /// # Panics
    /// If there are more rays.
    pub fn blocked_packet(&self, rays: &[Ray<f32>], accept: impl Fn(usize, &Hit<f32>) -> bool) -> u32 {
        assert!(rays.len() <= PACKET, "{} rays in a packet of {PACKET}", rays.len());
        self.machine.run(Together { world: self, rays, accept: &accept })
    }
}

/// A search among all objects.
pub(super) struct Query<'a, R, Q> {
    pub world: &'a World,
    pub ray: &'a Ray<R>,
    pub search: Q,
}

impl<R: Real, Q: Search<R>> Work for Query<'_, R, Q> {
    type Output = Q;
    #[inline(always)]
    fn run<S: Lanes>(mut self) -> Q {
        let world = self.world;
        // One object, where its positions are: no more than a search in its surface.
        if let [Object { surface_from_world: None, placed, .. }] = &world.objects[..] {
            let mut own = Own { object: &world.objects[0], search: &mut self.search };
            world.parts[placed.surface].search::<S, R>(self.ray, 0, f32::INFINITY, &mut own);
        } else if let Some(slab) = Slab::new(self.ray, &world.span, world.slack) {
            tree::walk::<S>(&world.nodes, 0, &slab, &mut self);
        }
        self.search
    }
}

impl<R: Real, Q: Search<R>> Visitor for Query<'_, R, Q> {
    #[inline(always)]
    fn leaf<S: Lanes>(&mut self, leaf: u32, t_max: f32) -> f32 {
        let id = self.world.leaves[leaf as usize][0];
        let object = &self.world.objects[id as usize];
        let ray = object.own(self.ray);
        let mut own = Own { object, search: &mut self.search };
        self.world.parts[object.placed.surface].search::<S, R>(&ray, id, t_max, &mut own);
        self.search.limit(t_max)
    }
}

/// A search that sees the hits of one object as they are in the world.
pub(super) struct Own<'a, Q> {
    pub object: &'a Object,
    pub search: &'a mut Q,
}

impl<R: Real, Q: Search<R>> Search<R> for Own<'_, Q> {
    #[inline(always)]
    fn found(&mut self, hit: Hit<R>) {
        let back = hit.back != self.object.placed.mirrored;
        if !(back && self.object.placed.cull_back) {
            self.search.found(Hit { back, ..hit });
        }
    }

    #[inline(always)]
    fn limit(&self, t_max: f32) -> f32 {
        self.search.limit(t_max)
    }
}

impl Object {
    fn new(placed: Placed) -> Self {
        let m = placed.world_from_surface;
        // A flattened surface has no inside that a ray could be carried into.
        let inverse = m.map(|m| m.inverse()).filter(|i| i.is_finite());
        Self { placed, surface_from_world: inverse }
    }

    /// The box in the world, with room for the rounding of rays that are carried into the surface's frame.
    fn bounds(&self, (lo, hi): (Vec3, Vec3)) -> Option<(Vec3, Vec3)> {
        let Some(m) = self.placed.world_from_surface else { return Some((lo, hi)) };
        self.surface_from_world?;
        let (centre, half) = ((lo.as_dvec3() + hi.as_dvec3()) / 2.0, (hi.as_dvec3() - lo.as_dvec3()) / 2.0);
        let c = m.transform_point3(centre);
        let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
        let h = columns.iter().zip(half.to_array()).map(|(c, h)| c.abs() * h).sum::<DVec3>();
        let h = h + (c.abs().max_element() + h.max_element()) * 1e-6;
        Some(((c - h).as_vec3(), (c + h).as_vec3()))
    }

    /// A ray in the frame of the surface; `t` stays what it is.
    #[inline(always)]
    pub fn own<R: Real>(&self, ray: &Ray<R>) -> Ray<R> {
        let Some(m) = self.surface_from_world else { return *ray };
        let wide = |v: [R; 3]| DVec3::from_array(v.map(Into::into));
        let (o, d) = (m.transform_point3(wide(ray.origin)), m.transform_vector3(wide(ray.direction)));
        let narrow = |v: DVec3| v.to_array().map(R::from_f64);
        Ray { origin: narrow(o), direction: narrow(d), ..*ray }
    }
}
