//! Space cut into cells: an octree and a uniform grid. Both are here to be measured against the tree, which is faster.
//!
//! A triangle is in every cell that it meets, by separating axes (Akenine-Möller 2001), not by where its corners are.

use super::build::{LEAF_SIZE, Span};
use super::ray::{Ray, Real, SLACK, Slab};
use super::tree::{LEAF, Node};
use glam::{DVec3, Vec3A};

/// Corners of a triangle.
pub(super) type Corners = [DVec3; 3];

/// Whether a triangle meets a box: no axis of the box, normal of the triangle or product of their edges separates them.
pub(super) fn meets([a, b, c]: Corners, center: DVec3, half: DVec3) -> bool {
    let (a, b, c) = (a - center, b - center, c - center);
    let edges = [b - a, c - b, a - c];
    let apart = |axis: DVec3| {
        let p = [a.dot(axis), b.dot(axis), c.dot(axis)];
        let reach = half.dot(axis.abs());
        p.iter().all(|&x| x > reach) || p.iter().all(|&x| x < -reach)
    };
    let own = DVec3::AXES;
    let crossed = own.iter().flat_map(|u| edges.iter().map(|e| u.cross(*e)));
    !own.into_iter().chain([edges[0].cross(edges[1])]).chain(crossed).any(apart)
}

/// Middle and half size of a box, a little larger: triangles that touch a cell from outside are in it.
fn padded(span: &Span, pad: f64) -> (DVec3, DVec3) {
    let (lo, hi) = (span.lo.as_dvec3(), span.hi.as_dvec3());
    ((lo + hi) / 2.0, (hi - lo) / 2.0 + pad)
}

fn pad(span: &Span) -> f64 {
    (span.lo.abs().max(span.hi.abs()).max_element() as f64) * 1e-6
}

/// How many times each triangle may be stored on average.
const COPIES: usize = 32;

/// An octree as nodes of eight: a leaf is up to four triangles, and a cell that cannot be cut usefully has nodes of leaves.
pub(super) struct Octree<'a> {
    triangles: &'a [Corners],
    spans: Vec<Span>,
    pad: f64,
    left: usize,
    pub nodes: Vec<Node>,
    pub leaves: Vec<[u32; LEAF_SIZE]>,
}

impl<'a> Octree<'a> {
    pub fn new(triangles: &'a [Corners], span: &Span) -> Self {
        let spans = triangles.iter().map(|t| {
            t.iter().fold(Span::EMPTY, |mut s, p| {
                s.join(Span { lo: p.as_vec3a(), hi: p.as_vec3a() });
                s
            })
        });
        let left = COPIES * triangles.len();
        let mut tree =
            Self { triangles, spans: spans.collect(), pad: pad(span), left, nodes: vec![], leaves: vec![] };
        if !triangles.is_empty() {
            tree.nodes.push(Node::EMPTY);
            let ids: Vec<u32> = (0..triangles.len() as u32).collect();
            let child = tree.cell(&ids, *span, 12);
            tree.nodes[0].set(0, *span);
            tree.nodes[0].children[0] = child;
            tree.nodes[0].sort();
        }
        tree
    }

    /// Triangles that meet a cell, with what cells are below it.
    fn cell(&mut self, ids: &[u32], cell: Span, depth: usize) -> u32 {
        if ids.len() <= LEAF_SIZE || depth == 0 || self.left == 0 {
            return self.list(ids);
        }
        let middle = (cell.lo + cell.hi) * 0.5;
        let octant = |k: usize| {
            let high = glam::BVec3A::new(k & 1 == 1, k & 2 == 2, k & 4 == 4);
            Span { lo: Vec3A::select(high, middle, cell.lo), hi: Vec3A::select(high, cell.hi, middle) }
        };
        let inside = |span: Span| -> Vec<u32> {
            let (center, half) = padded(&span, self.pad);
            ids.iter().copied().filter(|&i| meets(self.triangles[i as usize], center, half)).collect()
        };
        let parts: Vec<(Span, Vec<u32>)> = (0..8).map(|k| (octant(k), inside(octant(k)))).collect();
        let stored: usize = parts.iter().map(|p| p.1.len()).sum();
        if stored >= 4 * ids.len() {
            return self.list(ids);
        }
        self.left = self.left.saturating_sub(stored - ids.len().min(stored));
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        for (lane, (span, ids)) in parts.into_iter().enumerate().filter(|(_, p)| !p.1.is_empty()) {
            let child = self.cell(&ids, span, depth - 1);
            self.nodes[at].children[lane] = child;
            let tight = self.tight(&ids, span);
            self.nodes[at].set(lane, tight);
        }
        self.nodes[at].sort();
        at as u32
    }

    /// The part of a cell where triangles are.
    fn tight(&self, ids: &[u32], cell: Span) -> Span {
        let mut all = Span::EMPTY;
        ids.iter().for_each(|&i| all.join(self.spans[i as usize]));
        // A triangle may be just outside.
        let pad = Vec3A::splat(2.0 * self.pad as f32);
        Span { lo: all.lo.max(cell.lo - pad), hi: all.hi.min(cell.hi + pad) }
    }

    /// Any number of triangles without cells.
    fn list(&mut self, ids: &[u32]) -> u32 {
        if ids.len() <= LEAF_SIZE {
            self.leaves.push(std::array::from_fn(|i| ids.get(i).copied().unwrap_or(u32::MAX)));
            return LEAF | (self.leaves.len() - 1) as u32;
        }
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let share = ids.len().div_ceil(8).next_multiple_of(LEAF_SIZE);
        for (lane, part) in ids.chunks(share).enumerate() {
            let child = self.list(part);
            let mut span = Span::EMPTY;
            part.iter().for_each(|&i| span.join(self.spans[i as usize]));
            self.nodes[at].children[lane] = child;
            self.nodes[at].set(lane, span);
        }
        self.nodes[at].sort();
        at as u32
    }
}

/// Equal cells, each with leaves of up to four triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    low: DVec3,
    size: DVec3,
    count: [usize; 3],
    /// Where the leaves of each cell begin, x fastest; one more than there are cells.
    starts: Vec<u32>,
}

impl Grid {
    pub fn new(triangles: &[Corners], span: &Span) -> (Self, Vec<[u32; LEAF_SIZE]>) {
        if triangles.is_empty() {
            return Default::default();
        }
        let (low, extent) = (span.lo.as_dvec3(), (span.hi - span.lo).as_dvec3());
        let mut fineness = (1.5 * (triangles.len() as f64).cbrt()).min(200.0);
        loop {
            let part = |k: usize| (fineness * extent[k] / extent.max_element()).ceil().max(1.0) as usize;
            let count = [part(0), part(1), part(2)];
            let size = extent / DVec3::from_array(count.map(|n| n as f64));
            let grid = Self { low, size, count, starts: Vec::new() };
            let mut left = COPIES * triangles.len();
            let cells = grid.fill(triangles, pad(span), &mut left);
            if left > 0 || fineness <= 1.0 {
                return grid.pack(cells);
            }
            // Large triangles: larger cells.
            fineness /= 2.0;
        }
    }

    /// The triangles of each cell, until nothing is left to be stored.
    fn fill(&self, triangles: &[Corners], pad: f64, left: &mut usize) -> Vec<Vec<u32>> {
        let mut cells = vec![Vec::new(); self.count.iter().product()];
        for (id, &t) in triangles.iter().enumerate() {
            let (lo, hi) = (t[0].min(t[1]).min(t[2]) - pad, t[0].max(t[1]).max(t[2]) + pad);
            let range = |k: usize| self.cells(k, lo[k], hi[k]);
            for (z, y) in range(2).flat_map(|z| range(1).map(move |y| (z, y))) {
                for x in range(0) {
                    let at = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                    if meets(t, self.low + at * self.size, self.size / 2.0 + pad) {
                        if *left == 0 {
                            return cells;
                        }
                        *left -= 1;
                        cells[self.index(x, y, z)].push(id as u32);
                    }
                }
            }
        }
        cells
    }

    fn pack(mut self, cells: Vec<Vec<u32>>) -> (Self, Vec<[u32; LEAF_SIZE]>) {
        let mut leaves = Vec::new();
        for ids in cells {
            self.starts.push(leaves.len() as u32);
            let four = |c: &[u32]| std::array::from_fn(|i| c.get(i).copied().unwrap_or(u32::MAX));
            leaves.extend(ids.chunks(LEAF_SIZE).map(four));
        }
        self.starts.push(leaves.len() as u32);
        (self, leaves)
    }

    fn index(&self, x: usize, y: usize, z: usize) -> usize {
        x + self.count[0] * (y + self.count[1] * z)
    }

    /// Cells along an axis that reach into `lo…hi`.
    fn cells(&self, k: usize, lo: f64, hi: f64) -> std::ops::Range<usize> {
        // Flat grids have one cell; casts saturate.
        let at = |x: f64| if self.size[k] > 0.0 { (x - self.low[k]) / self.size[k] } else { x - self.low[k] };
        let pad = if self.size[k] > 0.0 { 0.0 } else { f64::INFINITY };
        let (from, to) = ((at(lo) - pad).floor().max(0.0) as usize, at(hi) + pad);
        from..if to < 0.0 { 0 } else { self.count[k].min((to as usize).saturating_add(1)) }
    }

    /// Show the leaves that a ray may meet, layer by layer along its longest axis: within a layer it passes a few cells.
    #[inline(always)]
    pub fn walk<R: Real>(
        &self,
        ray: &Ray<R>,
        slab: &Slab,
        span: &Span,
        mut leaf: impl FnMut(u32, f32) -> f32,
    ) {
        let (o, d) =
            (DVec3::from_array(ray.origin.map(Into::into)), DVec3::from_array(ray.direction.map(Into::into)));
        let main = (0..3).fold(0, |m, k| if d[k].abs() > d[m].abs() { k } else { m });
        let [a, b] = [(main + 1) % 3, (main + 2) % 3];
        let reach = (o.as_vec3a() - span.lo).abs().max((span.hi - o.as_vec3a()).abs()).max_element();
        let off = (SLACK * (reach + o.abs().max_element() as f32)) as f64;
        let (mut t_max, layers) = (slab.t_max, self.count[main]);
        for i in 0..layers {
            let layer = if d[main] < 0.0 { layers - 1 - i } else { i };
            // Where the ray is between the two faces of the layer.
            let face = |n: usize| self.low[main] + self.size[main] * n as f64;
            let (lo, hi) = (face(layer) - off, face(layer + 1) + off);
            let (t0, t1) = ((lo - o[main]) / d[main], (hi - o[main]) / d[main]);
            let (t0, t1) = (t0.min(t1).max(slab.t_min as f64), t0.max(t1).min(t_max as f64));
            if t0 > t1 {
                continue;
            }
            let range = |k: usize| {
                let (p, q) = (o[k] + d[k] * t0, o[k] + d[k] * t1);
                self.cells(k, p.min(q) - off, p.max(q) + off)
            };
            for (i, j) in range(a).flat_map(|i| range(b).map(move |j| (i, j))) {
                let mut cell = [0; 3];
                (cell[main], cell[a], cell[b]) = (layer, i, j);
                let cell = self.index(cell[0], cell[1], cell[2]);
                for at in self.starts[cell]..self.starts[cell + 1] {
                    t_max = leaf(at, t_max);
                }
            }
        }
    }
}
