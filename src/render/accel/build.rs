//! Top-down build in twos by binned surface-area heuristic (Wald 2007), then in eights at the least cost.

use super::lanes::DEPTH;
use super::tree::{LEAF, Node};
use glam::{Vec3, Vec3A, Vec4};

/// Triangles in a leaf at most.
pub(super) const LEAF_SIZE: usize = 4;

const BINS: usize = 16;

/// Set in the bits of an id, so that it is no denormal number: those would halve the speed.
const TAG: u32 = 1 << 30;

/// A box and what it holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// The low corner; the bits of the last component are who it is.
    lo: Vec4,
    hi: Vec4,
}

impl Item {
    pub fn new(lo: Vec3A, hi: Vec3A, id: u32) -> Self {
        Self { lo: lo.extend(f32::from_bits(id | TAG)), hi: hi.extend(0.0) }
    }

    #[inline(always)]
    fn id(&self) -> u32 {
        self.lo.w.to_bits() ^ TAG
    }

    #[inline(always)]
    pub fn span(&self) -> Span {
        Span { lo: Vec3A::from_vec4(self.lo), hi: Vec3A::from_vec4(self.hi) }
    }
}

/// A growing box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    pub lo: Vec3A,
    pub hi: Vec3A,
}

impl Span {
    pub const EMPTY: Self = Self { lo: Vec3A::INFINITY, hi: Vec3A::NEG_INFINITY };

    #[inline(always)]
    pub fn join(&mut self, other: Self) {
        self.lo = self.lo.min(other.lo);
        self.hi = self.hi.max(other.hi);
    }

    /// Twice the centre.
    #[inline(always)]
    fn centre(&self) -> Vec3A {
        self.lo + self.hi
    }

    /// Half its surface; 0 when empty.
    #[inline(always)]
    pub fn area(&self) -> f32 {
        let d = (self.hi - self.lo).max(Vec3A::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Its two corners.
    pub fn corners(&self) -> (Vec3, Vec3) {
        (self.lo.into(), self.hi.into())
    }
}

/// Items `start…end`, their box, and the box of their centres (doubled).
#[derive(Clone, Copy)]
struct Range {
    start: usize,
    end: usize,
    span: Span,
    centres: Span,
}

impl Range {
    fn new(items: &[Item], start: usize, end: usize) -> Self {
        let (mut span, mut centres) = (Span::EMPTY, Span::EMPTY);
        for i in &items[start..end] {
            let own = i.span();
            span.join(own);
            centres.join(Span { lo: own.centre(), hi: own.centre() });
        }
        Self { start, end, span, centres }
    }

    fn len(&self) -> usize {
        self.end - self.start
    }
}

/// A finished tree: nodes parent first, and leaves (their items' ids) in the order of the tree.
#[derive(Default)]
pub(super) struct Grown {
    pub nodes: Vec<Node>,
    pub leaves: Vec<[u32; LEAF_SIZE]>,
    /// Where the root's children end in `nodes` and `leaves`.
    pub cuts: Vec<[usize; 2]>,
}

/// Build over all items; the result does not depend on the number of threads. A leaf holds at most `leaf` items; empty places
/// are `u32::MAX`.
pub(super) fn grow(items: &mut [Item], leaf: usize, threads: usize) -> Grown {
    if items.is_empty() {
        return Grown::default();
    }
    // Split in two until the parts are worth a task each.
    let (mut forks, mut tasks) = (Vec::new(), Vec::new());
    let share = (items.len() / 16).max(1024);
    let all = Range::new(items, 0, items.len());
    fork(items, all, leaf, DEPTH, share, &mut forks, &mut tasks);
    let mut rest = &mut *items;
    let mut parts = Vec::new();
    for (at, range, depth) in tasks {
        let (own, others) = rest.split_at_mut(range.len());
        parts.push((at, own, range, depth, Vec::new()));
        rest = others;
    }
    super::each(parts.iter_mut().collect(), threads, |(_, own, range, depth, part)| {
        let own_range = Range { start: 0, end: range.len(), ..*range };
        fork(own, own_range, leaf, *depth, 0, part, &mut Vec::new());
    });

    // Put the parts one after another.
    for (at, _, range, _, part) in parts {
        let (base, start) = (forks.len() as u32, range.start as u32);
        let moved =
            |f: Fork| Fork { left: f.left + base, right: f.right + base, start: f.start + start, ..f };
        forks.extend(part.into_iter().map(moved));
        forks[at] = forks[base as usize];
    }
    let mut wide = Wide { items, forks: &forks, choices: choices(&forks), grown: Grown::default() };
    wide.emit_root();
    wide.grown
}

/// A node of the tree of twos: two children, or `count` items from `start`.
#[derive(Clone, Copy)]
struct Fork {
    span: Span,
    left: u32,
    right: u32,
    start: u32,
    /// 0 unless it is a leaf.
    count: u32,
}

/// Grow the tree of twos below a range, parents first; ranges of at most `share` items are left to `tasks`.
fn fork(
    items: &mut [Item],
    range: Range,
    leaf: usize,
    depth: usize,
    share: usize,
    out: &mut Vec<Fork>,
    tasks: &mut Vec<(usize, Range, usize)>,
) -> u32 {
    let at = out.len();
    let count = if range.len() <= leaf { range.len() as u32 } else { 0 };
    out.push(Fork { span: range.span, left: 0, right: 0, start: range.start as u32, count });
    if range.len() <= share {
        tasks.push((at, range, depth));
    } else if count == 0 {
        // Close to the last level that there is, halves.
        let room = leaf.saturating_mul(1 << (depth - 1).min(40));
        let [a, b] = split(items, range, leaf, 2 * range.len() > room);
        out[at].left = fork(items, a, leaf, depth - 1, share, out, tasks);
        out[at].right = fork(items, b, leaf, depth - 1, share, out, tasks);
    }
    at as u32
}

/// In two: where the surface-area heuristic is lowest, or in the middle where it cannot tell.
fn split(items: &mut [Item], r: Range, leaf: usize, halve: bool) -> [Range; 2] {
    let plane = if halve { None } else { cheapest(&items[r.start..r.end], &r, leaf) };
    let middle = match plane {
        Some(plane) => r.start + partition(&mut items[r.start..r.end], |i| plane.left(i)),
        None => r.start + r.len() / 2,
    };
    [Range::new(items, r.start, middle), Range::new(items, middle, r.end)]
}

/// Cost of a leaf against that of a node.
const LEAF_COST: f32 = 1.0;

/// For every fork, how many of `j` places its left side gets when its subtree is to fill at most `j` places of a node, at the
/// least surface-area cost (Ylitie, Karras, Laine 2017 §3.1): at `j − 1`; 0 where `j − 1` places are as good. At 0, how a node of
/// its own is filled.
fn choices(forks: &[Fork]) -> Vec<[u8; 8]> {
    let mut costs = vec![[0.0f32; 8]; forks.len()];
    let mut choices = vec![[0u8; 8]; forks.len()];
    for (at, fork) in forks.iter().enumerate().rev() {
        let area = fork.span.area();
        if fork.count > 0 {
            costs[at] = [area * LEAF_COST; 8];
            continue;
        }
        let (left, right) = (costs[fork.left as usize], costs[fork.right as usize]);
        let mut best = [(f32::INFINITY, 0u8); 9];
        for j in 2..=8 {
            for k in 1..j {
                let cost = left[k - 1] + right[j - k - 1];
                if cost < best[j].0 {
                    best[j] = (cost, k as u8);
                }
            }
        }
        (costs[at][0], choices[at][0]) = (area + best[8].0, best[8].1);
        for j in 2..=8 {
            let less = costs[at][j - 2];
            (costs[at][j - 1], choices[at][j - 1]) = if best[j].0 < less { best[j] } else { (less, 0) };
        }
    }
    choices
}

/// The tree of eights taking shape.
struct Wide<'a> {
    items: &'a [Item],
    forks: &'a [Fork],
    choices: Vec<[u8; 8]>,
    grown: Grown,
}

impl Wide<'_> {
    /// The forks that fill `places` of a node with what is below `at`.
    fn gather(&self, at: u32, places: usize, out: &mut Vec<u32>) {
        let fork = &self.forks[at as usize];
        if fork.count > 0 || places == 1 {
            return out.push(at);
        }
        match self.choices[at as usize][places - 1] as usize {
            0 => self.gather(at, places - 1, out),
            k => {
                self.gather(fork.left, k, out);
                self.gather(fork.right, places - k, out);
            }
        }
    }

    /// The children of a node.
    fn children(&self, at: u32) -> Vec<u32> {
        let fork = &self.forks[at as usize];
        let mut out = Vec::with_capacity(8);
        if fork.count > 0 {
            out.push(at);
        } else {
            let k = self.choices[at as usize][0] as usize;
            self.gather(fork.left, k, &mut out);
            self.gather(fork.right, 8 - k, &mut out);
        }
        out
    }

    /// A leaf, or a node with what is below it; gives what its parent writes down.
    fn emit(&mut self, at: u32) -> u32 {
        let Fork { start, count, .. } = self.forks[at as usize];
        if count > 0 {
            let mut ids = [u32::MAX; LEAF_SIZE];
            let own = &self.items[start as usize..][..count as usize];
            ids.iter_mut().zip(own).for_each(|(id, item)| *id = item.id());
            ids[..count as usize].sort_unstable();
            self.grown.leaves.push(ids);
            return LEAF | (self.grown.leaves.len() - 1) as u32;
        }
        let node = self.open(at);
        for (lane, child) in self.children(at).into_iter().enumerate() {
            self.grown.nodes[node].children[lane] = self.emit(child);
        }
        node as u32
    }

    fn emit_root(&mut self) {
        let node = self.open(0);
        for (lane, child) in self.children(0).into_iter().enumerate() {
            self.grown.nodes[node].children[lane] = self.emit(child);
            self.grown.cuts.push([self.grown.nodes.len(), self.grown.leaves.len()]);
        }
    }

    /// A node with the boxes of its children.
    fn open(&mut self, at: u32) -> usize {
        let mut node = Node::EMPTY;
        for (lane, child) in self.children(at).into_iter().enumerate() {
            node.set(lane, self.forks[child as usize].span);
        }
        node.sort();
        self.grown.nodes.push(node);
        self.grown.nodes.len() - 1
    }
}

/// Bins along an axis up to `last` go left.
struct Plane {
    axis: usize,
    last: usize,
    bins: Bins,
}

impl Plane {
    fn left(&self, item: &Item) -> bool {
        self.bins.of(item)[self.axis] <= self.last
    }
}

/// How centres fall into bins.
#[derive(Clone, Copy)]
struct Bins {
    low: Vec3A,
    scale: Vec3A,
    count: usize,
}

impl Bins {
    #[inline(always)]
    fn of(&self, item: &Item) -> [usize; 3] {
        let b = (item.span().centre() - self.low) * self.scale;
        // Casts saturate, and a width of nothing has scale 0.
        [b.x, b.y, b.z].map(|x| (x as usize).min(self.count - 1))
    }
}

fn cheapest(items: &[Item], r: &Range, leaf: usize) -> Option<Plane> {
    let count = if items.len() < 2 * BINS { BINS / 2 } else { BINS };
    let width = r.centres.hi - r.centres.lo;
    let scale =
        |w: f32| if w > 0.0 && w.is_finite() { (count as f32 * 0.9999 / w).min(f32::MAX) } else { 0.0 };
    let bins =
        Bins { low: r.centres.lo, scale: Vec3A::new(scale(width.x), scale(width.y), scale(width.z)), count };
    let mut spans = [[Span::EMPTY; BINS]; 3];
    let mut counts = [[0usize; BINS]; 3];
    for item in items {
        let own = item.span();
        for (axis, b) in bins.of(item).into_iter().enumerate() {
            spans[axis][b].join(own);
            counts[axis][b] += 1;
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    let packs = |n: usize| n.div_ceil(leaf) as f32;
    for axis in (0..3).filter(|&k| bins.scale[k] > 0.0) {
        let (mut right, mut n) = ([(0.0, 0); BINS], 0);
        let mut span = Span::EMPTY;
        for b in (1..count).rev() {
            span.join(spans[axis][b]);
            n += counts[axis][b];
            right[b] = (span.area() * packs(n), n);
        }
        (span, n) = (Span::EMPTY, 0);
        for b in 0..count - 1 {
            span.join(spans[axis][b]);
            n += counts[axis][b];
            let cost = span.area() * packs(n) + right[b + 1].0;
            if n > 0 && right[b + 1].1 > 0 && best.is_none_or(|(c, ..)| cost < c) {
                best = Some((cost, axis, b));
            }
        }
    }
    best.map(|(_, axis, last)| Plane { axis, last, bins })
}

/// Those that go left first; gives how many.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let (mut i, mut j) = (0, items.len());
    while i < j {
        if left(&items[i]) {
            i += 1;
        } else {
            j -= 1;
            items.swap(i, j);
        }
    }
    i
}
