//! A tree of boxes, eight to a node; what its leaves are is the caller's business.

use super::build::Span;
use super::lanes::{Lanes, Stack};
use super::ray::Slab;
use crate::math::simd::{F, F8};
use glam::Vec3A;

/// A child that is a leaf; the other bits say which.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight boxes, lane by lane; those that are empty (+∞…−∞) are missed by every ray.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Low x, y, z, then high x, y, z.
    pub planes: [F8; 6],
    /// Nodes, or leaves.
    pub children: [u32; 8],
    /// For each octant of directions, the lanes from the nearest to the farthest, four bits each.
    pub order: [u32; 8],
}

impl Node {
    pub const EMPTY: Self = {
        let (lo, hi) = (F([f32::INFINITY; 8]), F([f32::NEG_INFINITY; 8]));
        Self { planes: [lo, lo, lo, hi, hi, hi], children: [LEAF; 8], order: [0x7654_3210; 8] }
    };

    /// Put a child's box into its lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, span: Span) {
        let (lo, hi) = (span.lo.to_array(), span.hi.to_array());
        for k in 0..3 {
            self.planes[k].0[lane] = lo[k];
            self.planes[k + 3].0[lane] = hi[k];
        }
    }

    /// Write down in which order rays meet the children: by the centres of their boxes along the diagonal of an octant.
    pub fn sort(&mut self) {
        for octant in 0..8 {
            let sign = |k: usize| if octant >> k & 1 == 1 { -1.0 } else { 1.0 };
            let along = |k: usize| (self.planes[k] + self.planes[k + 3]) * sign(k);
            let key = (along(0) + along(1) + along(2)).0;
            let mut lanes = [0, 1, 2, 3, 4, 5, 6, 7];
            lanes.sort_by(|&a, &b| key[a as usize].total_cmp(&key[b as usize]));
            self.order[octant] = lanes.iter().rev().fold(0, |bits, lane| bits << 4 | lane);
        }
    }

    /// Whether a lane has no child.
    pub fn is_empty(&self, lane: usize) -> bool {
        self.planes[0].0[lane] > self.planes[3].0[lane]
    }

    /// The box of one child.
    pub fn get(&self, lane: usize) -> Span {
        let at = |k: usize| self.planes[k].0[lane];
        Span { lo: Vec3A::new(at(0), at(1), at(2)), hi: Vec3A::new(at(3), at(4), at(5)) }
    }

    /// Half the area of all children together: the chance that a ray has to look at them.
    #[inline(always)]
    pub fn cost(&self) -> f64 {
        let p = &self.planes;
        let side = |k: usize| (p[k + 3] - p[k]).max(F8::ZERO);
        let (x, y, z) = (side(0), side(1), side(2));
        let area = (x * y + y * z + z * x).0;
        let four: [f32; 4] = std::array::from_fn(|i| area[i] + area[i + 4]);
        ((four[0] + four[2]) + (four[1] + four[3])) as f64
    }

    /// Which children a ray enters before `t_max`, and where.
    #[inline(always)]
    pub fn entered(&self, ray: &Slab, t_max: f32) -> (u32, F8) {
        let row = |k: usize| k + 3 * (ray.octant >> k & 1);
        let near = |k: usize| self.planes[row(k)] * ray.slope[k] + -ray.near[k];
        let far = |k: usize| self.planes[(row(k) + 3) % 6] * ray.slope[k] + -ray.far[k];
        let enter = near(0).max(near(1)).max(near(2).max(F8::splat(ray.t_min)));
        let leave = far(0).min(far(1)).min(far(2).min(F8::splat(t_max)));
        (leave.ge(enter).bitmask(), enter)
    }
}

/// What is done with leaves. No closure: those would not be compiled for the machine.
pub(super) trait Visitor {
    /// Gets a leaf and the last `t` of interest, and gives that `t` back, or a smaller one: −∞ ends the walk.
    fn leaf<S: Lanes>(&mut self, leaf: u32, t_max: f32) -> f32;
}

/// Visit the leaves below a node that a ray enters, about nearest first.
#[inline(always)]
pub(super) fn walk<S: Lanes>(nodes: &[Node], mut at: u32, slab: &Slab, visitor: &mut impl Visitor) {
    if nodes.is_empty() {
        return;
    }
    let (ray, mut t_max) = (S::ray(slab), slab.t_max);
    let mut stack = Stack::new();
    loop {
        if at & LEAF == 0 {
            if let Some(child) = S::enter(&nodes[at as usize], &ray, t_max, &mut stack) {
                at = child;
                continue;
            }
        } else {
            t_max = visitor.leaf::<S>(at & !LEAF, t_max);
        }
        at = loop {
            match stack.pop() {
                None => return,
                Some((t, at)) if t <= t_max => break at,
                _ => {}
            }
        };
    }
}

/// Fit boxes from the leaves up. `nodes` begin at `from` in the whole; `fit` gives a leaf's box. Gives the box of `at`.
pub(super) fn refit(
    at: u32,
    nodes: &mut [Node],
    from: [usize; 2],
    fit: &mut impl FnMut(usize) -> Span,
) -> Span {
    if at & LEAF != 0 {
        return fit((at & !LEAF) as usize);
    }
    let own = at as usize - from[0];
    let mut all = Span::EMPTY;
    for lane in 0..8 {
        if !nodes[own].is_empty(lane) {
            let span = refit(nodes[own].children[lane], nodes, from, fit);
            nodes[own].set(lane, span);
            all.join(span);
        }
    }
    all
}
