//! Sixteen rays at once that go much the same way, as to one lamp: is there anything in between?
//!
//! One interval around all rays is tested against eight boxes, then sixteen rays against each box that is left. Where few rays
//! remain they go on alone. The answers are those of single rays: boxes only choose who looks at which triangle.

use super::Accel;
use super::build::Span;
use super::lanes::{Lanes, Work};
use super::ray::{Hit, Ray, SLACK, Slab};
use super::search::{Any, Packs};
use super::tree::{self, LEAF, Node, Visitor};
use super::triangle::Shear;
use super::world::{Object, Own, Query, World};
use crate::math::simd::{F, F8};
use glam::Vec3A;
use std::marker::PhantomData;

/// Rays in a packet at most.
pub const PACKET: usize = 16;

/// Fewer rays than this go on alone.
const FEW: u32 = 3;

/// Rays of one octant.
pub(super) struct Packet {
    slabs: [Slab; PACKET],
    rays: Rays,
    /// Any origin of a ray (or its end, see `new`), a little beyond, as it matters for entering a box, and for leaving it.
    enter: Vec3A,
    leave: Vec3A,
    /// Smallest and largest slope.
    slopes: [Vec3A; 2],
    octant: usize,
    t_min: f32,
    t_max: f32,
}

/// The same, a lane a ray.
struct Rays {
    slope: [[F8; 2]; 3],
    near: [[F8; 2]; 3],
    far: [[F8; 2]; 3],
    t_min: [F8; 2],
    t_max: [F8; 2],
}

impl Packet {
    /// `None` unless all rays go into one octant and can hit something.
    #[inline(always)]
    pub fn new(rays: &[Ray<f32>], span: &Span, slack: f32) -> Option<Self> {
        let first = Slab::new(rays.first()?, span, slack)?;
        let (mut slabs, mut wide) = ([first; PACKET], Rays::EMPTY);
        let (mut from, mut to, mut slopes) = (Span::EMPTY, Span::EMPTY, Span::EMPTY);
        let (mut t_min, mut t_max) = (f32::INFINITY, 0.0f32);
        for (i, r) in rays.iter().enumerate() {
            let slab = Slab::new(r, span, slack)?;
            if slab.octant != first.octant {
                return None;
            }
            let (o, d) = (Vec3A::from(r.origin), Vec3A::from(r.direction));
            let end = o + d * r.t_max;
            from.join(Span { lo: o, hi: o });
            to.join(Span { lo: end, hi: end });
            slopes.join(Span { lo: slab.slope, hi: slab.slope });
            (t_min, t_max) = (t_min.min(slab.t_min), t_max.max(slab.t_max));
            wide.set(i, &slab);
            slabs[i] = slab;
        }
        // Rays that meet, as in a lamp, are narrower when looked at from there.
        let extent = |s: &Span| (s.hi - s.lo).max_element();
        let mut octant = first.octant;
        if extent(&to) < extent(&from) {
            (slopes, from) = (Span { lo: -slopes.hi, hi: -slopes.lo }, to);
            (t_min, t_max) = (0.0, t_max - t_min);
            octant ^= 7;
        }
        let most = |s: &Span| s.lo.abs().max(s.hi.abs()).max_element();
        let off = Vec3A::splat(2.0 * SLACK * slack * (most(&from) + most(span)));
        let (low, high) = (from.lo - off, from.hi + off);
        let negative = slopes.lo.cmplt(Vec3A::ZERO);
        Some(Self {
            rays: wide,
            slabs,
            enter: Vec3A::select(negative, low, high),
            leave: Vec3A::select(negative, high, low),
            slopes: [slopes.lo, slopes.hi],
            octant,
            t_min,
            t_max,
        })
    }

    /// Children that any ray may enter, a bit each.
    #[inline(always)]
    fn children(&self, node: &Node) -> u32 {
        let (mut enter, mut leave) = (F8::splat(self.t_min), F8::splat(self.t_max));
        let [least, most] = self.slopes;
        for k in 0..3 {
            let row = k + 3 * (self.octant >> k & 1);
            let d = node.planes[row] + -self.enter[k];
            enter = (d * least[k]).min(d * most[k]).max(enter);
            let d = node.planes[(row + 3) % 6] + -self.leave[k];
            leave = (d * least[k]).max(d * most[k]).min(leave);
        }
        leave.ge(enter).bitmask()
    }
}

impl Rays {
    /// No rays: nothing is entered.
    const EMPTY: Self = {
        let (none, zero) = ([F([f32::NEG_INFINITY; 8]); 2], [[F8::ZERO; 2]; 3]);
        Self { slope: zero, near: zero, far: zero, t_min: [F8::ZERO; 2], t_max: none }
    };

    #[inline(always)]
    fn set(&mut self, i: usize, slab: &Slab) {
        let (half, lane) = (i / 8, i % 8);
        for k in 0..3 {
            self.slope[k][half].0[lane] = slab.slope[k];
            self.near[k][half].0[lane] = slab.near[k];
            self.far[k][half].0[lane] = slab.far[k];
        }
        self.t_min[half].0[lane] = slab.t_min;
        self.t_max[half].0[lane] = slab.t_max;
    }

    /// Rays that enter a child, a bit each.
    #[inline(always)]
    fn entering(&self, octant: usize, node: &Node, lane: usize) -> u32 {
        let mut bits = 0;
        for half in 0..2 {
            let (mut enter, mut leave) = (self.t_min[half], self.t_max[half]);
            for k in 0..3 {
                let row = k + 3 * (octant >> k & 1);
                let (near, far) = (node.planes[row].0[lane], node.planes[(row + 3) % 6].0[lane]);
                let slope = self.slope[k][half];
                enter = (slope * near - self.near[k][half]).max(enter);
                leave = (slope * far - self.far[k][half]).min(leave);
            }
            bits |= leave.ge(enter).bitmask() << (8 * half);
        }
        bits
    }
}

/// Who looks at triangles for a packet.
pub(super) trait Crew {
    /// Some rays at a leaf; gives those that need not go on.
    fn leaf(&mut self, leaf: u32, rays: u32) -> u32;
    /// One ray below a node; whether it need not go on.
    fn alone(&mut self, node: u32, ray: usize, slab: &Slab) -> bool;
}

/// Let a crew look at what `alive` rays may meet; gives those that need not go on.
#[inline(always)]
pub(super) fn walk(nodes: &[Node], packet: &Packet, alive: u32, crew: &mut impl Crew) -> u32 {
    let mut done = 0;
    let mut stack = vec![(0u32, alive)];
    while let Some((at, mask)) = stack.pop() {
        let mask = mask & !done;
        if mask.count_ones() < FEW {
            let ones = (0..PACKET).filter(|i| mask >> i & 1 == 1);
            ones.for_each(|i| done |= (crew.alone(at, i, &packet.slabs[i]) as u32) << i);
            continue;
        }
        let node = &nodes[at as usize];
        let mut bits = packet.children(node);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let inside = packet.rays.entering(packet.slabs[0].octant, node, lane) & mask & !done;
            match node.children[lane] {
                _ if inside == 0 => {}
                leaf if leaf & LEAF != 0 => done |= crew.leaf(leaf & !LEAF, inside),
                child => stack.push((child, inside)),
            }
        }
    }
    done
}

/// Whether something blocks each of some rays in a world.
pub(super) struct Together<'a, F> {
    pub world: &'a World,
    pub rays: &'a [Ray<f32>],
    pub accept: &'a F,
}

impl<F: Fn(usize, &Hit<f32>) -> bool> Work for Together<'_, F> {
    type Output = u32;
    #[inline(always)]
    fn run<S: Lanes>(self) -> u32 {
        let (world, all) = (self.world, (1u32 << self.rays.len()) - 1);
        let mut crew = Objects { job: self, blocked: 0, lanes: PhantomData::<S> };
        if let [Object { surface_from_world: None, .. }] = world.objects[..] {
            crew.object(0, all);
        } else if let Some(packet) = Packet::new(crew.job.rays, &world.span, world.slack) {
            walk(&world.nodes, &packet, all, &mut crew);
        } else {
            (0..crew.job.rays.len()).for_each(|i| crew.single(i));
        }
        crew.blocked
    }
}

/// Looks at objects.
struct Objects<'a, F, S> {
    job: Together<'a, F>,
    blocked: u32,
    lanes: PhantomData<S>,
}

impl<F: Fn(usize, &Hit<f32>) -> bool, S: Lanes> Objects<'_, F, S> {
    /// One ray through the whole world.
    fn single(&mut self, i: usize) {
        let Together { world, rays, accept } = self.job;
        let search = Any::new(|h: &Hit<f32>| accept(i, h));
        self.blocked |= (Query { world, ray: &rays[i], search }.run::<S>().found as u32) << i;
    }

    /// Some rays through one object.
    #[inline(always)]
    fn object(&mut self, id: u32, some: u32) {
        let Together { world, rays, accept } = self.job;
        let Some(&first) = rays.first() else { return };
        let object = &world.objects[id as usize];
        let accel = &world.parts[object.placed.surface];
        let mut own = [first; PACKET];
        own.iter_mut().zip(rays).for_each(|(own, ray)| *own = object.own(ray));
        let shears = [None; PACKET];
        let lanes = PhantomData::<S>;
        let mut crew = Leaves { accel, object, id, rays: &own, shears, accept, blocked: 0, lanes };
        match Packet::new(&own[..rays.len()], &accel.span, 1.0) {
            Some(packet) if !accel.nodes.is_empty() => _ = walk(&accel.nodes, &packet, some, &mut crew),
            _ => (0..PACKET).filter(|i| some >> i & 1 == 1).for_each(|i| crew.single(i)),
        }
        self.blocked |= crew.blocked;
    }
}

impl<F: Fn(usize, &Hit<f32>) -> bool, S: Lanes> Crew for Objects<'_, F, S> {
    fn leaf(&mut self, leaf: u32, rays: u32) -> u32 {
        self.object(self.job.world.leaves[leaf as usize][0], rays);
        self.blocked
    }

    fn alone(&mut self, _: u32, ray: usize, _: &Slab) -> bool {
        // From the top, once and for all.
        self.single(ray);
        true
    }
}

/// Looks at the leaves of one object.
struct Leaves<'a, F, S> {
    accel: &'a Accel,
    object: &'a Object,
    id: u32,
    rays: &'a [Ray<f32>; PACKET],
    shears: [Option<Shear<f32>>; PACKET],
    accept: &'a F,
    blocked: u32,
    lanes: PhantomData<S>,
}

impl<F: Fn(usize, &Hit<f32>) -> bool, S: Lanes> Leaves<'_, F, S> {
    fn single(&mut self, i: usize) {
        let mut any = Any::new(|h: &Hit<f32>| (self.accept)(i, h));
        let mut own = Own { object: self.object, search: &mut any };
        self.accel.search::<S, f32>(&self.rays[i], self.id, f32::INFINITY, &mut own);
        self.blocked |= (any.found as u32) << i;
    }
}

impl<F: Fn(usize, &Hit<f32>) -> bool, S: Lanes> Crew for Leaves<'_, F, S> {
    #[inline(always)]
    fn leaf(&mut self, leaf: u32, rays: u32) -> u32 {
        let mut bits = rays;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize & (PACKET - 1);
            bits &= bits - 1;
            let mut any = Any::new(|h: &Hit<f32>| (self.accept)(i, h));
            let search = &mut Own { object: self.object, search: &mut any };
            let (packs, ray, shear) = (&self.accel.packs[..], &self.rays[i], self.shears[i]);
            let mut visitor = Packs { packs, ray, shear, object: self.id, search };
            visitor.leaf::<S>(leaf, f32::INFINITY);
            self.shears[i] = visitor.shear;
            self.blocked |= (any.found as u32) << i;
        }
        self.blocked
    }

    #[inline(always)]
    fn alone(&mut self, node: u32, i: usize, slab: &Slab) -> bool {
        let mut any = Any::new(|h: &Hit<f32>| (self.accept)(i, h));
        let search = &mut Own { object: self.object, search: &mut any };
        let (packs, ray, shear) = (&self.accel.packs[..], &self.rays[i], self.shears[i]);
        let mut visitor = Packs { packs, ray, shear, object: self.id, search };
        tree::walk::<S>(&self.accel.nodes, node, slab, &mut visitor);
        self.shears[i] = visitor.shear;
        self.blocked |= (any.found as u32) << i;
        any.found
    }
}
