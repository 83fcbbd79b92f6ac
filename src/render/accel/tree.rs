//! A tree of boxes, eight to a node; what its leaves are is the caller's business.

use super::lanes::{Lanes, Stack};
use super::ray::Slab;
use crate::math::simd::F8;
use glam::Vec3;

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
        let (lo, hi) = (F8([f32::INFINITY; 8]), F8([f32::NEG_INFINITY; 8]));
        Self { planes: [lo, lo, lo, hi, hi, hi], children: [LEAF; 8], order: [0x7654_3210; 8] }
    };

    /// Put a child's box into its lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, (lo, hi): (Vec3, Vec3)) {
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
    pub fn get(&self, lane: usize) -> (Vec3, Vec3) {
        let at = |k: usize| self.planes[k].0[lane];
        (Vec3::new(at(0), at(1), at(2)), Vec3::new(at(3), at(4), at(5)))
    }

    /// The box of all children.
    #[inline(always)]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let fold = |k: usize, f: fn(f32, f32) -> f32| {
            let p = &self.planes[k].0;
            let four: [f32; 4] = std::array::from_fn(|i| f(p[i], p[i + 4]));
            f(f(four[0], four[2]), f(four[1], four[3]))
        };
        let low = |k| fold(k, |a, b| if a < b { a } else { b });
        let high = |k| fold(k, |a, b| if a > b { a } else { b });
        (Vec3::new(low(0), low(1), low(2)), Vec3::new(high(3), high(4), high(5)))
    }

    /// Half the area of all children together: the chance that a ray has to look at them.
    #[inline(always)]
    pub fn cost(&self) -> f64 {
        let p = &self.planes;
        let [x, y, z] = [0, 1, 2].map(|k| p[k + 3] - p[k]);
        let area = x * y + y * z + z * x;
        let full = |i: usize| if self.is_empty(i) { 0.0 } else { area.0[i] as f64 };
        (0..8).map(full).sum()
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

/// Visit the leaves that a ray enters, about nearest first.
#[inline(always)]
pub(super) fn walk<S: Lanes>(nodes: &[Node], slab: &Slab, visitor: &mut impl Visitor) {
    if nodes.is_empty() {
        return;
    }
    let (ray, mut t_max) = (S::ray(slab), slab.t_max);
    let mut stack = Stack::new();
    let mut at = 0;
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

/// Fit boxes from the leaves up. `nodes` and `leaves` begin at `from` in the whole; `fit` gives a leaf's box. Gives the box
/// around all, which is what the first node, or the only leaf, is in.
pub(super) fn refit<L>(
    nodes: &mut [Node],
    leaves: &mut [L],
    from: [usize; 2],
    mut fit: impl FnMut(&mut L) -> (Vec3, Vec3),
) -> (Vec3, Vec3) {
    for at in (0..nodes.len()).rev() {
        for lane in 0..8 {
            let child = nodes[at].children[lane];
            let span = if nodes[at].is_empty(lane) {
                continue;
            } else if child & LEAF != 0 {
                fit(&mut leaves[(child & !LEAF) as usize - from[1]])
            } else {
                nodes[child as usize - from[0]].bounds()
            };
            nodes[at].set(lane, span);
        }
    }
    nodes.first().map_or_else(|| fit(&mut leaves[0]), Node::bounds)
}
