//! Top-down build by binned surface-area heuristic (Wald 2007), eight children at once.

use super::lanes::DEPTH;
use super::tree::{LEAF, Node};
use glam::Vec3;

/// Triangles in a leaf at most.
pub(super) const LEAF_SIZE: usize = 4;

const BINS: usize = 16;

/// A box and what it holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub lo: Vec3,
    pub id: u32,
    pub hi: Vec3,
}

impl Item {
    fn centre(&self) -> Vec3 {
        self.lo + self.hi
    }
}

/// A growing box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    pub lo: Vec3,
    pub hi: Vec3,
}

impl Span {
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    #[inline(always)]
    pub fn add(&mut self, lo: Vec3, hi: Vec3) {
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }

    /// Half its surface; 0 when empty.
    pub fn area(&self) -> f32 {
        let d = (self.hi - self.lo).max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
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
            span.add(i.lo, i.hi);
            centres.add(i.centre(), i.centre());
        }
        Self { start, end, span, centres }
    }

    fn len(&self) -> usize {
        self.end - self.start
    }
}

/// What grows: nodes parent first, and leaves (their items' ids) in the order of the tree.
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
    let mut grown = Grown::default();
    if items.is_empty() {
        return grown;
    }
    let all = Range::new(items, 0, items.len());
    let ranges = eight(items, all, leaf, DEPTH);
    let mut node = Node::EMPTY;
    ranges.iter().enumerate().for_each(|(i, r)| node.set(i, (r.span.lo, r.span.hi)));
    node.sort();
    grown.nodes.push(node);

    // Each child is grown by itself.
    let mut tasks = Vec::new();
    let mut rest = items;
    for r in &ranges {
        let (own, others) = rest.split_at_mut(r.len());
        let moved = Range { start: 0, end: r.len(), ..*r };
        tasks.push((own, moved, Grown::default()));
        rest = others;
    }
    super::each(tasks.iter_mut().collect(), threads, |(own, range, part)| {
        part.nodes.reserve(own.len() / 4);
        part.leaves.reserve(own.len() / 3);
        child(own, *range, leaf, DEPTH - 1, part);
    });

    // Put the parts one after another.
    for (lane, (_, _, part)) in tasks.into_iter().enumerate() {
        let base = [grown.nodes.len() as u32, grown.leaves.len() as u32];
        let moved = |c: u32| c + base[(c & LEAF != 0) as usize];
        grown.nodes[0].children[lane] = moved(if part.nodes.is_empty() { LEAF } else { 0 });
        let nodes = part.nodes.into_iter().map(|n| Node { children: n.children.map(moved), ..n });
        grown.nodes.extend(nodes);
        grown.leaves.extend(part.leaves);
        grown.cuts.push([grown.nodes.len(), grown.leaves.len()]);
    }
    grown
}

/// A leaf, or a node with what is below it; gives what its parent writes down.
fn child(items: &mut [Item], range: Range, leaf: usize, depth: usize, grown: &mut Grown) -> u32 {
    if range.len() <= leaf {
        let mut ids = [u32::MAX; LEAF_SIZE];
        ids.iter_mut().zip(&items[range.start..range.end]).for_each(|(id, item)| *id = item.id);
        ids[..range.len()].sort_unstable();
        grown.leaves.push(ids);
        return LEAF | (grown.leaves.len() - 1) as u32;
    }
    let at = grown.nodes.len();
    grown.nodes.push(Node::EMPTY);
    for (i, r) in eight(items, range, leaf, depth).into_iter().enumerate() {
        grown.nodes[at].set(i, (r.span.lo, r.span.hi));
        grown.nodes[at].children[i] = child(items, r, leaf, depth - 1, grown);
    }
    grown.nodes[at].sort();
    at as u32
}

/// Split until there are eight: always the one with the largest surface.
fn eight(items: &mut [Item], range: Range, leaf: usize, depth: usize) -> Vec<Range> {
    // What a child may hold so that halving alone still fits below it.
    let room = leaf.saturating_mul(8usize.saturating_pow(depth as u32 - 1));
    let mut ranges = vec![range];
    while ranges.len() < 8 {
        let worth = |r: &Range| if r.len() > leaf { (r.len() > room, r.span.area()) } else { (false, -1.0) };
        let (mut best, mut most) = (0, (false, -1.0));
        for (i, r) in ranges.iter().enumerate() {
            if worth(r) > most {
                (best, most) = (i, worth(r));
            }
        }
        if ranges[best].len() <= leaf {
            break;
        }
        // Close to the last level that there is, halves.
        let [a, b] = split(items, ranges[best], leaf, range.len() > room);
        ranges[best] = a;
        ranges.insert(best + 1, b);
    }
    ranges
}

/// In two: where the surface-area heuristic is lowest, or in the middle where it cannot tell.
fn split(items: &mut [Item], r: Range, leaf: usize, halve: bool) -> [Range; 2] {
    let middle = if halve { None } else { cheapest(&items[r.start..r.end], &r, leaf) };
    let middle = match middle {
        Some(plane) => r.start + partition(&mut items[r.start..r.end], |i| plane.left(i)),
        None => r.start + r.len() / 2,
    };
    [Range::new(items, r.start, middle), Range::new(items, middle, r.end)]
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
    low: Vec3,
    scale: Vec3,
    count: usize,
}

impl Bins {
    #[inline(always)]
    fn of(&self, item: &Item) -> [usize; 3] {
        let b = (item.centre() - self.low) * self.scale;
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
        Bins { low: r.centres.lo, scale: Vec3::new(scale(width.x), scale(width.y), scale(width.z)), count };
    let mut spans = [[Span::EMPTY; BINS]; 3];
    let mut counts = [[0usize; BINS]; 3];
    for item in items {
        for (axis, b) in bins.of(item).into_iter().enumerate() {
            spans[axis][b].add(item.lo, item.hi);
            counts[axis][b] += 1;
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    let packs = |n: usize| n.div_ceil(leaf) as f32;
    for axis in (0..3).filter(|&k| bins.scale[k] > 0.0) {
        let (mut right, mut n) = ([(0.0, 0); BINS], 0);
        let mut span = Span::EMPTY;
        for b in (1..count).rev() {
            span.add(spans[axis][b].lo, spans[axis][b].hi);
            n += counts[axis][b];
            right[b] = (span.area() * packs(n), n);
        }
        (span, n) = (Span::EMPTY, 0);
        for b in 0..count - 1 {
            span.add(spans[axis][b].lo, spans[axis][b].hi);
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
