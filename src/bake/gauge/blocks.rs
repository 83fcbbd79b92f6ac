//! Vertices in small boxes, so that most of them need not be moved to know that others stray farther.
//!
//! A vertex of one clip and the same of another are `Σ_j w_j ΔM_j v` apart, with `ΔM_j` the difference of bone `j`'s two matrices. Over a box
//! of half-size `h` around `c` no `|ΔM_j v|` exceeds the length of `|ΔM_j c| + |ΔL_j| h`, taken by component, and a blend no more than its
//! largest part.

use crate::character::{Binding, Character};
use crate::skeleton::BoneId;
use crate::skin::Weights;
use glam::{Affine3A, Mat3A, Vec3, Vec3A};

/// Vertices a box, at most.
const FULL: usize = 32;

/// What rounding may add to a bound, relative to it.
const ROUNDING: f32 = 1e-5;

/// Vertices that lie together.
struct Block {
    center: Vec3A,
    half: Vec3A,
    /// Places in `Skin::order`.
    vertices: std::ops::Range<usize>,
    /// Palette entries that move any of them, each with its largest weight.
    bones: Vec<(u16, f32)>,
}

/// The vertices of one mesh instance.
pub(super) struct Skin<'a> {
    positions: &'a [Vec3],
    weights: Option<&'a Weights>,
    pub palette: Vec<(BoneId, Affine3A)>,
    order: Vec<u32>,
    blocks: Vec<Block>,
}

/// The farthest vertex so far: its distance squared and its index.
#[derive(Clone, Copy)]
pub(super) struct Far {
    pub d2: f32,
    pub vertex: Option<u32>,
}

impl<'a> Skin<'a> {
    pub fn new(character: &'a Character, instance: usize) -> Self {
        let inst = &character.instances()[instance];
        let positions = &character.mesh(inst).positions[..];
        let (palette, weights) = match &inst.binding {
            Binding::Bone(b) => (vec![(*b, Affine3A::IDENTITY)], None),
            Binding::Skin { palette, weights } => (palette.clone(), Some(weights)),
        };
        let mut skin = Self { positions, weights, palette, order: vec![], blocks: vec![] };
        // Those of one strongest bone together, then halves along the longest side.
        let strongest = |v: u32| weights.and_then(|w| w.of(v as usize).next()).map_or(0, |b| b.0);
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_by_key(|&v| strongest(v));
        for run in order.chunk_by_mut(|a, b| strongest(*a) == strongest(*b)) {
            skin.split(run);
        }
        skin
    }

    fn split(&mut self, run: &mut [u32]) {
        let at = |v: u32| self.positions[v as usize];
        let (lo, hi) = run
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &v| (lo.min(at(v)), hi.max(at(v))));
        if run.len() > FULL {
            let axis = (hi - lo).max_position();
            let middle = run.len() / 2;
            run.select_nth_unstable_by(middle, |&a, &b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b)));
            let (left, right) = run.split_at_mut(middle);
            self.split(left);
            return self.split(right);
        }
        let mut bones: Vec<(u16, f32)> = vec![];
        for &v in run.iter() {
            for (bone, w) in self.influences(v).filter(|i| i.1 > 0.0) {
                match bones.iter_mut().find(|b| b.0 as usize == bone) {
                    Some(known) => known.1 = known.1.max(w),
                    None => bones.push((bone as u16, w)),
                }
            }
        }
        // A little wider, for the middle is rounded.
        let half = Vec3A::from(0.5 * (hi - lo) + ROUNDING * lo.abs().max(hi.abs()));
        let start = self.order.len();
        self.order.extend_from_slice(run);
        let center = Vec3A::from(0.5 * (lo + hi));
        self.blocks.push(Block { center, half, vertices: start..self.order.len(), bones });
    }

    fn influences(&self, v: u32) -> impl Iterator<Item = (usize, f32)> + '_ {
        let rigid = self.weights.is_none().then_some((0, 1.0));
        rigid.into_iter().chain(self.weights.into_iter().flat_map(move |w| w.of(v as usize)))
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
        for (i, b) in self.blocks.iter().enumerate() {
            let bound = b.bound(delta, &size);
            bounds.push(bound);
            if bound > top {
                (first, top) = (Some(i), bound);
            }
        }
        let Some(first) = first else { return far };
        far = self.within(&self.blocks[first], delta, far);
        for (i, b) in self.blocks.iter().enumerate() {
            if i != first && bounds[i] >= far.d2 && bounds[i] > 0.0 {
                far = self.within(b, delta, far);
            }
        }
        far
    }

    fn within(&self, block: &Block, delta: &[Affine3A], mut far: Far) -> Far {
        for &v in &self.order[block.vertices.clone()] {
            let p = Vec3A::from(self.positions[v as usize]);
            let d = match self.weights {
                None => delta[0].transform_point3a(p),
                Some(w) => {
                    let mut m = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
                    for (bone, weight) in w.of(v as usize) {
                        m.matrix3 += delta[bone].matrix3 * weight;
                        m.translation += delta[bone].translation * weight;
                    }
                    m.transform_point3a(p)
                }
            };
            let d2 = d.length_squared();
            let earlier = d2 == far.d2 && far.vertex.is_some_and(|known| v < known);
            if d2 > far.d2 || earlier {
                far = Far { d2, vertex: Some(v) };
            }
        }
        far
    }
}

/// Whether a difference is any at all.
fn largest(m: &Affine3A) -> f32 {
    let a = m.matrix3;
    let s = a.x_axis.abs().max(a.y_axis.abs()).max(a.z_axis.abs()).max(m.translation.abs());
    s.max_element()
}

impl Block {
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
