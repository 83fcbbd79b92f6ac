//! Where a ray meets triangles: trees of boxes, and what they are measured against.
//!
//! Every way of looking gives the same answer to the last bit: candidates come from boxes that never miss, a hit is computed in one
//! place, and of equal `t` the lowest object and triangle wins.
//!
//! ```
//! use glam::Vec3;
//! use sinew::render::accel::{Kind, Placed, Ray, Surface, World};
//! let surface = Surface { positions: &[Vec3::ZERO, Vec3::X, Vec3::Y], triangles: &[[0, 1, 2]] };
//! let world = World::new(Kind::Tree, &[surface], &[Placed::default()], 1);
//! let ray = Ray { origin: [0.25, 0.25, 2.0], direction: [0.0, 0.0, -1.0], t_min: 0.0, t_max: f32::INFINITY };
//! let hit = world.nearest(&ray, |_| true).unwrap();
//! assert_eq!((hit.t, hit.u, hit.v, hit.back), (2.0, 0.25, 0.25, false));
//! assert!(!world.blocked(&Ray { t_max: 1.5, ..ray }, |_| true));
//! ```

mod bounds;
mod build;
mod crossing;
mod lanes;
mod overlap;
mod packet;
mod point;
mod ray;
mod search;
mod tree;
mod triangle;
mod world;

pub use bounds::{OrientedBox, Sphere};
pub use packet::PACKET;
pub use point::Closest;
pub use ray::{Hit, Ray, Real};
pub use world::{Motion, Placed, Surface, Updated, World};

use crate::math::simd::Isa;
use build::{Item, Span};
use glam::Vec3;
use lanes::{Lanes, Machine, Work};
use overlap::{Grid, Octree};
use ray::Slab;
use search::{Any, Nearest, Packs, Search};
use tree::{Node, Visitor};
use triangle::{EMPTY, Pack, Vertices, standing};

/// How triangles are found. The answers are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Kind {
    /// Eight boxes to a node, four triangles to a leaf, split where the surface-area heuristic is lowest. The fastest.
    #[default]
    Tree,
    /// Cells cut in eight while that separates triangles.
    Octree,
    /// Equal cells.
    Grid,
    /// Every triangle is looked at.
    Brute,
}

/// How much worse than when it was built a tree may become before it is built anew.
const DECAY: f64 = 1.3;

/// The triangles of one surface, ready for rays in the frame of its positions.
///
/// Coordinates that are not finite, or beyond 2⁴⁰, are taken for 0.
#[derive(Clone, Debug)]
pub struct Accel {
    kind: Kind,
    machine: Machine,
    /// How many.
    triangles: usize,
    span: Span,
    packs: Vec<Pack>,
    vertices: Vec<Vertices>,
    nodes: Vec<Node>,
    grid: Grid,
    /// Where the parts below the root end in `nodes` and `packs`.
    cuts: Vec<[usize; 2]>,
    /// Surface-area cost as built.
    built: f64,
}

impl Accel {
    /// Of `V` positions and `F` triangles; the same for any number of threads.
    ///
    /// # Panics
    /// If a triangle names a vertex that does not exist, or there are 2³⁰ triangles.
    pub fn new(kind: Kind, positions: &[Vec3], triangles: &[[u32; 3]], threads: usize) -> Self {
        assert!(triangles.len() < 1 << 30, "{} triangles: fewer than 2^30 are possible", triangles.len());
        let mut accel = Self {
            kind,
            machine: Machine::new(Isa::Best),
            triangles: triangles.len(),
            span: Span::EMPTY,
            packs: Vec::new(),
            vertices: Vec::new(),
            nodes: Vec::new(),
            grid: Grid::default(),
            cuts: Vec::new(),
            built: 0.0,
        };
        accel.build(positions, triangles, threads);
        accel
    }

    /// The same with another build of the kernels; for tests and measurements.
    pub fn with_isa(self, isa: Isa) -> Self {
        Self { machine: Machine::new(isa), ..self }
    }

    /// Whether these are the triangles that it was built of: then [`Accel::update`] is enough when vertices move.
    pub fn is_of(&self, triangles: &[[u32; 3]]) -> bool {
        let same = |(pack, v): (&Pack, &Vertices)| {
            let lanes = (0..4).filter(|&lane| pack.ids[lane] != EMPTY);
            lanes.into_iter().all(|k| triangles[pack.ids[k] as usize] == [v[0][k], v[1][k], v[2][k]])
        };
        self.triangles == triangles.len() && self.packs.iter().zip(&self.vertices).all(same)
    }

    /// Corner of the box with the smallest coordinates, and with the largest; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (self.triangles > 0).then_some(self.span.corners())
    }

    fn build(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], threads: usize) {
        let corner = |&i: &u32| standing(positions[i as usize]);
        let item = |(id, t): (usize, &[u32; 3])| {
            let [a, b, c] = t.each_ref().map(corner);
            Item::new(a.min(b).min(c), a.max(b).max(c), id as u32)
        };
        let mut items: Vec<Item> = triangles.iter().enumerate().map(item).collect();
        self.span = Span::EMPTY;
        items.iter().for_each(|i| self.span.join(i.span()));
        let wide = || -> Vec<overlap::Corners> {
            triangles.iter().map(|t| t.each_ref().map(|i| corner(i).as_dvec3())).collect()
        };
        let leaves = match self.kind {
            Kind::Tree => {
                let grown = build::grow(&mut items, build::LEAF_SIZE, threads);
                (self.nodes, self.cuts) = (grown.nodes, grown.cuts);
                grown.leaves
            }
            Kind::Octree => {
                let wide = wide();
                let tree = Octree::new(&wide, &self.span);
                self.nodes = tree.nodes;
                tree.leaves
            }
            Kind::Grid => {
                let (grid, leaves) = Grid::new(&wide(), &self.span);
                self.grid = grid;
                leaves
            }
            Kind::Brute => {
                let ids: Vec<u32> = (0..self.triangles as u32).collect();
                let four = |c: &[u32]| std::array::from_fn(|i| c.get(i).copied().unwrap_or(EMPTY));
                ids.chunks(4).map(four).collect()
            }
        };
        let known =
            |ids: &[u32; 4], lane: usize| if ids[lane] == EMPTY { ids[0] } else { ids[lane] } as usize;
        let corner = |ids: &[u32; 4], c: usize| std::array::from_fn(|lane| triangles[known(ids, lane)][c]);
        self.vertices = leaves.iter().map(|ids| [corner(ids, 0), corner(ids, 1), corner(ids, 2)]).collect();
        self.packs = leaves.into_iter().map(Pack::new).collect();
        const SHARE: usize = 1 << 14;
        let shares = self.packs.chunks_mut(SHARE).zip(self.vertices.chunks(SHARE));
        each(shares.collect(), threads, |(packs, vertices)| {
            packs.iter_mut().zip(vertices).for_each(|(p, v)| _ = p.fill(positions, v));
        });
        self.built = self.cost();
    }

    /// Surface-area cost of a ray that meets the box around everything: boxes and leaves that it is expected to look at.
    pub fn cost(&self) -> f64 {
        let area = self.span.area() as f64;
        if area > 0.0 { self.nodes.iter().map(Node::cost).sum::<f64>() / area } else { 0.0 }
    }

    /// Follow moved vertices: boxes are fitted again; the tree is built anew where that has become too loose, and `true` given.
    ///
    /// # Panics
    /// If there are fewer positions than triangles name.
    pub fn update(&mut self, positions: &[Vec3], threads: usize) -> bool {
        // Cells do not move with triangles.
        let cells = matches!(self.kind, Kind::Octree | Kind::Grid);
        if !cells {
            self.refit(positions, threads);
        }
        let rebuild = cells || self.cost() > DECAY * self.built;
        if rebuild {
            let triangles = self.list();
            self.build(positions, &triangles, threads);
        }
        rebuild
    }

    /// The triangles as they were given.
    fn list(&self) -> Vec<[u32; 3]> {
        let mut list = vec![[0; 3]; self.triangles];
        for (pack, v) in self.packs.iter().zip(&self.vertices) {
            for lane in (0..4).filter(|&lane| pack.ids[lane] != EMPTY) {
                list[pack.ids[lane] as usize] = [v[0][lane], v[1][lane], v[2][lane]];
            }
        }
        list
    }

    fn refit(&mut self, positions: &[Vec3], threads: usize) {
        let vertices = &self.vertices;
        self.span = Span::EMPTY;
        let Some((root, mut nodes)) = self.nodes.split_first_mut() else {
            let each = self.packs.iter_mut().zip(vertices);
            return each.for_each(|(p, v)| self.span.join(p.fill(positions, v)));
        };
        // Cut nodes and leaves where the children of the root end; fit each part from its leaves up, then the root.
        let (mut packs, mut from, mut parts) = (&mut self.packs[..], [1, 0], Vec::new());
        for (&child, &to) in root.children.iter().zip(&self.cuts) {
            let (own_nodes, rest) = nodes.split_at_mut(to[0] - from[0]);
            let (own_packs, others) = packs.split_at_mut(to[1] - from[1]);
            parts.push((child, own_nodes, own_packs, from, Span::EMPTY));
            (nodes, packs, from) = (rest, others, to);
        }
        each(parts.iter_mut().collect(), threads, |(child, nodes, packs, from, span)| {
            *span = tree::refit(*child, nodes, *from, &mut |leaf| {
                packs[leaf - from[1]].fill(positions, &vertices[leaf])
            });
        });
        for (lane, (.., span)) in parts.into_iter().enumerate() {
            root.set(lane, span);
            self.span.join(span);
        }
    }

    /// The first hit that `accept` takes, as [`World::nearest`]; the object is 0.
    #[inline]
    pub fn nearest<R: Real>(&self, ray: &Ray<R>, accept: impl Fn(&Hit<R>) -> bool) -> Option<Hit<R>> {
        self.machine.run(Alone { accel: self, ray, search: Nearest::new(accept) }).best
    }

    /// Whether `accept` takes any hit.
    #[inline]
    pub fn blocked<R: Real>(&self, ray: &Ray<R>, accept: impl Fn(&Hit<R>) -> bool) -> bool {
        self.machine.run(Alone { accel: self, ray, search: Any::new(accept) }).found
    }

    /// Search among all hits of a ray as far as `t_max`.
    #[inline(always)]
    fn search<S: Lanes, R: Real>(&self, ray: &Ray<R>, object: u32, t_max: f32, search: &mut impl Search<R>) {
        let Some(mut slab) = Slab::new(ray, &self.span, 1.0) else { return };
        slab.t_max = slab.t_max.min(t_max);
        let mut packs = Packs { packs: &self.packs, ray, shear: None, object, search };
        match self.kind {
            Kind::Tree | Kind::Octree => tree::walk::<S>(&self.nodes, 0, &slab, &mut packs),
            Kind::Grid => self.grid.walk(ray, &slab, &self.span, |at, t| packs.leaf::<S>(at, t)),
            Kind::Brute => {
                (0..self.packs.len()).fold(slab.t_max, |t, at| packs.leaf::<S>(at as u32, t));
            }
        }
    }
}

/// A search in one surface.
struct Alone<'a, R, Q> {
    accel: &'a Accel,
    ray: &'a Ray<R>,
    search: Q,
}

impl<R: Real, Q: Search<R>> Work for Alone<'_, R, Q> {
    type Output = Q;
    #[inline(always)]
    fn run<S: Lanes>(mut self) -> Q {
        self.accel.search::<S, R>(self.ray, 0, f32::INFINITY, &mut self.search);
        self.search
    }
}

/// Do every task, on as many threads.
fn each<T: Send>(tasks: Vec<T>, threads: usize, work: impl Fn(T) + Sync) {
    if threads <= 1 || tasks.len() <= 1 {
        return tasks.into_iter().for_each(work);
    }
    let tasks = std::sync::Mutex::new(tasks.into_iter());
    let next = || tasks.lock().expect("no worker panics").next();
    std::thread::scope(|s| {
        for _ in 1..threads {
            s.spawn(|| std::iter::from_fn(next).for_each(&work));
        }
        std::iter::from_fn(next).for_each(&work);
    });
}

#[cfg(test)]
mod tests;
