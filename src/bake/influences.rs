//! What it costs to drop influences: `v − v' = Σ_dropped w_j (T_j v − v')`, and `v'` is a mean of the kept `T_k v`.

use super::gauge::{Spot, Worst};
use super::times;
use crate::character::{Binding, Character, Scratch};
use crate::clip::Clip;
use crate::skeleton::BoneId;
use glam::{Affine3A, Vec3};

/// What dropping influences costs over some clips.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Vertices that lost influences.
    pub vertices: usize,
    /// The largest sum of weights that a vertex lost.
    pub dropped: f32,
    /// Metres that no vertex exceeds at any moment looked at: the dropped weights, each times the farthest that its bone's place for the
    /// vertex is from those of the bones that were kept.
    pub bound: f64,
    /// The vertex that was measured to be farthest off; its limit has no meaning.
    pub worst: Worst,
    /// Moments looked at: keys, and at least 240 a second between them.
    pub moments: usize,
}

/// Looks a second.
const RATE: f64 = 240.0;

/// The most looks at a clip.
const MOST: usize = 20_000;

/// The cost of `less`, which is `character` with fewer influences, over these clips and at rest.
pub fn cost(character: &Character, less: &Character, clips: &[&Clip]) -> Cost {
    let lost = lost(character, less);
    let mut out = Cost { vertices: lost.len(), ..Cost::default() };
    out.dropped = lost.iter().map(|l| l.dropped.iter().map(|d| d.1).sum()).fold(0.0, f32::max);
    if lost.is_empty() {
        return out;
    }
    let mut buffers = Buffers::default();
    for clip in clips {
        for t in moments(clip) {
            at(character, less, clip, t, &lost, &mut buffers, &mut out);
        }
    }
    out
}

fn moments(clip: &Clip) -> Vec<f64> {
    let knots = times::knots(&[clip]);
    let Some((first, last)) = knots.first().zip(knots.last()) else { return vec![0.0] };
    let n = (((last - first) * RATE).ceil() as usize).clamp(1, MOST);
    let mut all: Vec<f64> =
        (0..=n).map(|k| first + (last - first) * k as f64 / n as f64).chain(knots.iter().copied()).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// A vertex and the places in its palette of what it kept and lost.
struct Lost {
    instance: usize,
    vertex: usize,
    kept: Vec<usize>,
    dropped: Vec<(usize, f32)>,
}

fn lost(character: &Character, less: &Character) -> Vec<Lost> {
    let mut out = vec![];
    for (instance, (a, b)) in character.instances().iter().zip(less.instances()).enumerate() {
        let (Binding::Skin { weights: a, .. }, Binding::Skin { weights: b, .. }) = (&a.binding, &b.binding)
        else {
            continue;
        };
        for vertex in 0..a.vertex_count() {
            let kept: Vec<usize> = b.of(vertex).filter(|w| w.1 > 0.0).map(|w| w.0).collect();
            let dropped: Vec<(usize, f32)> =
                a.of(vertex).skip(b.per_vertex()).filter(|w| w.1 > 0.0).collect();
            if !dropped.is_empty() {
                out.push(Lost { instance, vertex, kept, dropped });
            }
        }
    }
    out
}

#[derive(Default)]
struct Buffers {
    scratch: Scratch,
    positions: [Vec<Vec3>; 2],
    rest: Vec<Vec3>,
    palette: Vec<Affine3A>,
}

fn at(
    character: &Character,
    less: &Character,
    clip: &Clip,
    time: f64,
    lost: &[Lost],
    b: &mut Buffers,
    out: &mut Cost,
) {
    let mut pose = character.rest_pose();
    clip.sample(character.skeleton(), time, &mut pose);
    let posed = character.posed(&pose);
    let center = character.center(&posed);
    out.moments += 1;
    for of in lost.chunk_by(|a, b| a.instance == b.instance) {
        let instance = of[0].instance;
        let [p, q] = &mut b.positions;
        character.positions(instance, &pose, &posed, center, &mut b.scratch, p);
        less.positions(instance, &pose, &posed, center, &mut b.scratch, q);
        let Binding::Skin { palette, .. } = &character.instances()[instance].binding else { continue };
        b.palette.clear();
        b.palette.extend(palette.iter().map(|(bone, m): &(BoneId, Affine3A)| posed.near(*bone, center) * *m));
        character.morphed(instance, &pose, &mut b.scratch, &mut b.rest);
        for l in of {
            let place = |bone: usize| b.palette[bone].transform_point3(b.rest[l.vertex]);
            let far =
                |bone: usize| l.kept.iter().map(|k| place(*k).distance(place(bone))).fold(0.0, f32::max);
            let bound: f64 = l.dropped.iter().map(|(bone, w)| (w * far(*bone)) as f64).sum();
            out.bound = out.bound.max(bound);
            let spot = Some(Spot::Vertex { instance, vertex: l.vertex });
            let distance = p[l.vertex].distance(q[l.vertex]) as f64;
            if distance > out.worst.distance {
                out.worst = Worst { distance, limit: f64::INFINITY, time, spot };
            }
        }
    }
}
