//! Triangles that pass through each other: pairs of boxes from the top of two trees, then edges against triangles.

use super::ray::Ray;
use super::tree::{LEAF, Node};
use super::triangle::{EMPTY, Pack, Shear};
use super::{Accel, Span};

impl Accel {
    /// Pairs of a triangle here and one there that meet, sorted; both in one frame.
    ///
    /// Two triangles meet where an edge of one meets the other, touching included. Triangles in one plane only lie on each other,
    /// and do not count. Triangles with a corner at the same place, as neighbours have, must meet somewhere else as well: with
    /// one common corner, by the edge opposite to it; with two they cannot.
    pub fn crossings(&self, other: &Accel) -> Vec<[u32; 2]> {
        let mut found = Vec::new();
        pairs(self, other, false, &mut |a, b| found.extend(meeting(a, b)));
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Pairs of its own triangles that meet, the lower first, sorted; as [`Accel::crossings`].
    pub fn self_crossings(&self) -> Vec<[u32; 2]> {
        let mut found = Vec::new();
        pairs(self, self, true, &mut |a, b| {
            found.extend(meeting(a, b).map(|[i, j]| [i.min(j), i.max(j)]));
        });
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Every two leaves whose boxes meet; of one tree with itself, each two once.
fn pairs(a: &Accel, b: &Accel, same: bool, work: &mut impl FnMut(&Pack, &Pack)) {
    if a.nodes.is_empty() || b.nodes.is_empty() {
        for (i, p) in a.packs.iter().enumerate() {
            b.packs[if same { i } else { 0 }..].iter().for_each(|q| work(p, q));
        }
        return;
    }
    let mut stack = vec![(0u32, a.span, 0u32, b.span)];
    while let Some((i, s, j, t)) = stack.pop() {
        if !(s.lo.cmple(t.hi) & t.lo.cmple(s.hi)).all() {
            continue;
        }
        let leaf = |at: u32| at & LEAF != 0;
        let children = |nodes: &[Node], at: u32| {
            let node = nodes[at as usize];
            (0..8).filter(move |&l| !node.is_empty(l)).map(move |l| (node.children[l], node.get(l)))
        };
        if leaf(i) && leaf(j) {
            work(&a.packs[(i & !LEAF) as usize], &b.packs[(j & !LEAF) as usize]);
        } else if same && i == j {
            let all: Vec<(u32, Span)> = children(&a.nodes, i).collect();
            for (k, &(c, s)) in all.iter().enumerate() {
                stack.extend(all[k..].iter().map(|&(d, t)| (c, s, d, t)));
            }
        } else if leaf(j) || !leaf(i) && s.area() > t.area() {
            stack.extend(children(&a.nodes, i).map(|(c, s)| (c, s, j, t)));
        } else {
            stack.extend(children(&b.nodes, j).map(|(c, t)| (i, s, c, t)));
        }
    }
}

/// The triangles of two leaves that meet.
fn meeting<'a>(a: &'a Pack, b: &'a Pack) -> impl Iterator<Item = [u32; 2]> + 'a {
    let both = (0..16).map(|k| (k / 4, k % 4));
    both.filter(|&(i, j)| a.ids[i] != EMPTY && b.ids[j] != EMPTY)
        .filter(|&(i, j)| meet(a.corners_of(i), b.corners_of(j)))
        .map(|(i, j)| [a.ids[i], b.ids[j]])
}

type Corners = [[f32; 3]; 3];

fn meet(a: Corners, b: Corners) -> bool {
    let apart = |k: usize| {
        let (p, q) = (a.map(|c| c[k]), b.map(|c| c[k]));
        p.iter().all(|x| q.iter().all(|y| x < y)) || p.iter().all(|x| q.iter().all(|y| x > y))
    };
    if (0..3).any(apart) {
        return false;
    }
    let common = |p: &Corners, q: &Corners| p.map(|c| q.contains(&c));
    let (ca, cb) = (common(&a, &b), common(&b, &a));
    match ca.iter().filter(|&&c| c).count() {
        0 => (0..3).any(|k| pierces(&a, k, &b) || pierces(&b, k, &a)),
        1 => {
            // The edge from the corner after the common one.
            let opposite = |c: [bool; 3]| (c.iter().position(|&c| c).unwrap_or(0) + 1) % 3;
            pierces(&a, opposite(ca), &b) || pierces(&b, opposite(cb), &a)
        }
        _ => false,
    }
}

/// Whether the edge from corner `k` of one triangle to the next meets the other.
fn pierces(a: &Corners, k: usize, b: &Corners) -> bool {
    let (from, to) = (a[k].map(f64::from), a[(k + 1) % 3].map(f64::from));
    let direction = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    if direction == [0.0; 3] {
        return false;
    }
    Shear::new(&Ray { origin: from, direction, t_min: 0.0, t_max: 1.0 }).meet(*b).is_some()
}
