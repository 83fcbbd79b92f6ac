//! Vertices in small boxes, so that most of them need not be moved to know that others stray farther.
//!
//! A vertex of one clip and the same of another are `Σ_j w_j ΔM_j v` apart, with `ΔM_j` the difference of bone `j`'s two matrices. Over a box
//! of half-size `h` around `c` no `|ΔM_j v|` exceeds the length of `|ΔM_j c| + |ΔL_j| h`, taken by component, and a blend no more than its
//! largest part.

use crate::character::{Binding, Character};
use crate::skeleton::BoneId;
use crate::skin::Weights;
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use std::ops::Range;

/// Vertices a box, at most.
const FULL: usize = 32;

/// Blocks a group, at most.
const GROUP: usize = 12;

/// What rounding may add to a bound, relative to it.
const ROUNDING: f32 = 1e-5;

/// Vertices that lie together.
struct Block {
    center: Vec3A,
    half: Vec3A,
    /// Places in the skin's lists.
    vertices: Range<usize>,
    /// Palette entries that move any of them, each with its largest weight.
    bones: Vec<(u16, f32)>,
}

/// The vertices of one mesh instance.
pub(super) struct Skin {
    pub palette: Vec<(BoneId, Affine3A)>,
    /// Vertices block by block: where they are at rest, their index, and what moves them.
    points: Vec<Vec3A>,
    order: Vec<u32>,
    influences: Vec<(u16, f32)>,
    /// Influences a vertex.
    width: usize,
    blocks: Vec<Block>,
    /// Blocks that lie together, as blocks of their own, each with those that it is made of.
    groups: Vec<(Block, Range<usize>)>,
}

/// The farthest vertex so far: its distance squared and its index.
#[derive(Clone, Copy)]
pub(super) struct Far {
    pub d2: f32,
    pub vertex: Option<u32>,
}

impl Skin {
    pub fn new(character: &Character, instance: usize) -> Self {
        let inst = &character.instances()[instance];
        let positions = &character.mesh(inst).positions[..];
        let (palette, weights) = match &inst.binding {
            Binding::Bone(b) => (vec![(*b, Affine3A::IDENTITY)], None),
            Binding::Skin { palette, weights } => (palette.clone(), Some(weights)),
        };
        // Those of one strongest bone together, then halves along the longest side.
        let strongest = |v: u32| weights.and_then(|w| w.of(v as usize).next()).map_or(0, |b| b.0);
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_by_key(|&v| strongest(v));
        let (mut runs, mut together) = (vec![], vec![]);
        let mut start = 0;
        for run in order.chunk_by_mut(|a, b| strongest(*a) == strongest(*b)) {
            let first = runs.len();
            split(positions, run, start, &mut runs);
            start += run.len();
            together.extend((first..runs.len()).step_by(GROUP).map(|b| b..(b + GROUP).min(runs.len())));
        }
        let width = weights.map_or(1, Weights::per_vertex);
        let of = |v: &u32| {
            let rigid = weights.is_none().then_some((0, 1.0));
            let skinned = weights.into_iter().flat_map(|w| w.of(*v as usize));
            rigid.into_iter().chain(skinned.map(|(b, w)| (b as u16, w))).collect::<Vec<_>>()
        };
        let influences: Vec<(u16, f32)> = order.iter().flat_map(of).collect();
        let points: Vec<Vec3A> = order.iter().map(|&v| positions[v as usize].into()).collect();
        let block = |r: Range<usize>| {
            Block::new(r.clone(), &points[r.clone()], &influences[r.start * width..r.end * width])
        };
        let blocks: Vec<Block> = runs.into_iter().map(block).collect();
        let whole = |g: &Range<usize>| blocks[g.start].vertices.start..blocks[g.end - 1].vertices.end;
        let groups = together.into_iter().map(|g| (block(whole(&g)), g)).collect();
        Self { palette, points, order, influences, width, blocks, groups }
    }

    /// The vertex that a difference of palettes moves farthest, if farther than `far`. The first of equals.
    pub fn farthest(&self, delta: &[Affine3A], bounds: &mut Vec<f32>, mut far: Far) -> Far {
        let size: Vec<f32> = delta.iter().map(largest).collect();
        if size.iter().all(|s| *s == 0.0) {
            return far;
        }
        // Where it may be farthest, look first: what is found there rules out most others.
        bounds.clear();
        let (mut first, mut top) = (None, far.d2);
        for (i, (group, _)) in self.groups.iter().enumerate() {
            let bound = group.bound(delta, &size);
            bounds.push(bound);
            if bound > top {
                (first, top) = (Some(i), bound);
            }
        }
        let Some(first) = first else { return far };
        let others = (0..self.groups.len()).filter(|i| *i != first);
        for i in std::iter::once(first).chain(others) {
            if bounds[i] < far.d2 || bounds[i] == 0.0 {
                continue;
            }
            for block in &self.blocks[self.groups[i].1.clone()] {
                let bound = block.bound(delta, &size);
                if bound >= far.d2 && bound > 0.0 {
                    far = self.within(block, delta, far);
                }
            }
        }
        far
    }

    fn within(&self, block: &Block, delta: &[Affine3A], mut far: Far) -> Far {
        let w = self.width;
        for i in block.vertices.clone() {
            let influences = &self.influences[i * w..(i + 1) * w];
            let d = match influences {
                [(bone, 1.0), ..] => delta[*bone as usize].transform_point3a(self.points[i]),
                _ => {
                    let mut m = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
                    for &(bone, weight) in influences {
                        let part = &delta[bone as usize];
                        m.matrix3 += part.matrix3 * weight;
                        m.translation += part.translation * weight;
                    }
                    m.transform_point3a(self.points[i])
                }
            };
            let d2 = d.length_squared();
            let v = self.order[i];
            let earlier = d2 == far.d2 && far.vertex.is_some_and(|known| v < known);
            if d2 > far.d2 || earlier {
                far = Far { d2, vertex: Some(v) };
            }
        }
        far
    }
}

/// Runs of vertices that lie together; they are sorted so.
fn split(positions: &[Vec3], run: &mut [u32], start: usize, out: &mut Vec<Range<usize>>) {
    if run.len() <= FULL {
        return out.push(start..start + run.len());
    }
    let at = |v: u32| positions[v as usize];
    let (lo, hi) =
        run.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &v| (lo.min(at(v)), hi.max(at(v))));
    let axis = (hi - lo).max_position();
    let middle = run.len() / 2;
    run.select_nth_unstable_by(middle, |&a, &b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b)));
    let (left, right) = run.split_at_mut(middle);
    split(positions, left, start, out);
    split(positions, right, start + middle, out);
}

/// Whether a difference is any at all.
fn largest(m: &Affine3A) -> f32 {
    let a = m.matrix3;
    let s = a.x_axis.abs().max(a.y_axis.abs()).max(a.z_axis.abs()).max(m.translation.abs());
    s.max_element()
}

impl Block {
    fn new(vertices: Range<usize>, points: &[Vec3A], influences: &[(u16, f32)]) -> Self {
        let fold = |(lo, hi): (Vec3A, Vec3A), p: &Vec3A| (lo.min(*p), hi.max(*p));
        let (lo, hi) = points.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), fold);
        let mut bones: Vec<(u16, f32)> = vec![];
        for &(bone, w) in influences.iter().filter(|i| i.1 > 0.0) {
            match bones.iter_mut().find(|b| b.0 == bone) {
                Some(known) => known.1 = known.1.max(w),
                None => bones.push((bone, w)),
            }
        }
        // A little wider, for the middle is rounded.
        let half = 0.5 * (hi - lo) + ROUNDING * lo.abs().max(hi.abs());
        Self { center: 0.5 * (lo + hi), half, vertices, bones }
    }

    /// No vertex of the block goes farther: the square of that.
    fn bound(&self, delta: &[Affine3A], size: &[f32]) -> f32 {
        let (mut most, mut blend) = (0.0_f32, 0.0_f32);
        for &(bone, weight) in &self.bones {
            let bone = bone as usize;
            if size[bone] == 0.0 {
                continue;
            }
            let m = &delta[bone];
            let reach = m.transform_point3a(self.center).abs()
                + m.matrix3.x_axis.abs() * self.half.x
                + m.matrix3.y_axis.abs() * self.half.y
                + m.matrix3.z_axis.abs() * self.half.z;
            let d = reach.length();
            most = most.max(d);
            blend += weight * d;
        }
        let bound = most.min(blend) * (1.0 + ROUNDING) + self.noise(size);
        let bound = bound * bound;
        // What overflows rules nothing out.
        if bound.is_nan() { f32::INFINITY } else { bound }
    }

    /// What rounding may add where large terms cancel.
    fn noise(&self, size: &[f32]) -> f32 {
        let far = self.center.abs().max_element() + 1.0;
        1e-6 * far * self.bones.iter().map(|b| size[b.0 as usize]).fold(0.0, f32::max)
    }
}
