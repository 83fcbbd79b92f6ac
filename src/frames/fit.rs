//! Which points a framing must hold: all vertices, over the whole clip.

use super::framing::Framing;
use super::worker::Worker;
use crate::asset::Asset;
use crate::skeleton::BoneId;
use crate::time::Range;
use glam::{DVec3, Vec3};

/// A clip of an asset, seen from the scene's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span<'a> {
    pub asset: &'a Asset,
    /// The rest pose for `None`.
    pub clip: Option<usize>,
    /// The world point that the scene has its origin at.
    pub center: DVec3,
    /// A box around the shapes in it, as far as they end.
    pub shapes: Option<[Vec3; 2]>,
}

impl Span<'_> {
    /// Seconds that the clip plays.
    pub fn range(&self) -> Range {
        self.clip.map(|c| self.asset.character.clips()[c].playback()).unwrap_or_default()
    }
}

/// What is left of all points that were shown, whoever looked at which.
pub(super) trait Sight: Clone + Send + Sync {
    /// Take points in.
    fn see(&mut self, points: &[Vec3]);
    /// Take in what was seen of later moments.
    fn join(&mut self, later: &Self);
}

/// Corners of a box; what is not finite is passed over.
impl Sight for [Vec3; 2] {
    fn see(&mut self, points: &[Vec3]) {
        let [mut low, mut high] = *self;
        for p in points.iter().filter(|p| p.is_finite()) {
            (low, high) = (low.min(*p), high.max(*p));
        }
        *self = [low, high];
    }

    fn join(&mut self, later: &Self) {
        *self = [self[0].min(later[0]), self[1].max(later[1])];
    }
}

/// Corners of a box that holds all that [`each_moment`] shows; not finite where that is nothing.
pub(super) fn bounds(span: &Span, anchor: Option<(BoneId, DVec3)>, worker: &mut Worker) -> [Vec3; 2] {
    each_moment(span, anchor, worker, [Vec3::INFINITY, Vec3::NEG_INFINITY])
}

/// A moment each 24th of a second of the clip, both ends included, and the vertices of one; long clips of large meshes are looked at
/// more thinly.
pub(super) fn times(span: &Span) -> (Vec<f64>, usize) {
    let character = &span.asset.character;
    let vertices: usize = character.instances().iter().map(|i| character.mesh(i).positions.len()).sum();
    let most = (Framing::VERTICES / vertices.max(1)).clamp(Framing::FEWEST, Framing::MOST);
    let range = span.range();
    let count = (range.duration() * 24.0).clamp(0.0, (most - 1) as f64).ceil() as usize + 1;
    let time = |k: usize| range.start + range.duration() * k as f64 / (count - 1).max(1) as f64;
    ((0..count).map(time).collect(), vertices)
}

/// Vertices of all moments from which on several threads are worth their start.
const PARALLEL: usize = 1 << 17;

/// Show the vertices of every mesh at moments of the whole clip, as seen by a camera that follows `anchor`: a bone, and where it
/// stands in the world when the camera does not move. `nothing` is what was seen before.
///
/// Where there is no triangle, the bones' ends stand for the meshes; where there is no bone either, the shapes do.
pub(super) fn each_moment<S: Sight>(
    span: &Span,
    anchor: Option<(BoneId, DVec3)>,
    worker: &mut Worker,
    nothing: S,
) -> S {
    let (times, vertices) = times(span);
    let threads = match times.len() * vertices {
        0..PARALLEL => 1,
        _ => std::thread::available_parallelism().map_or(1, |n| n.get().min(8)),
    };
    let look = |worker: &mut Worker, times: &[f64]| {
        let mut seen = nothing.clone();
        look(span, anchor, worker, times, &mut seen);
        seen
    };
    // Each looks at moments that follow each other, the first at its own on this thread.
    let mut shares = times.chunks(times.len().div_ceil(threads));
    let own = shares.next().unwrap_or(&[]);
    std::thread::scope(|scope| {
        let look = &look;
        let others: Vec<_> =
            shares.map(|share| scope.spawn(move || look(&mut Worker::default(), share))).collect();
        let mut seen = look(worker, own);
        for other in others {
            seen.join(&other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        seen
    })
}

/// Show what there is at some moments.
pub(super) fn look(
    span: &Span,
    anchor: Option<(BoneId, DVec3)>,
    worker: &mut Worker,
    times: &[f64],
    seen: &mut impl Sight,
) {
    let character = &span.asset.character;
    let solid = |i: &usize| !character.mesh(&character.instances()[*i]).triangles.is_empty();
    let instances: Vec<usize> = (0..character.instances().len()).filter(solid).collect();
    let mut points = Vec::new();
    for &time in times {
        worker.evaluate(span.asset, span.clip, time);
        let Worker { pose, posed, scratch, .. } = &mut *worker;
        let center = span.center + anchor.map_or(DVec3::ZERO, |(bone, at)| posed.origin(bone) - at);
        for &i in &instances {
            character.positions(i, pose, posed, center, scratch, &mut points);
            seen.see(&points);
        }
        if instances.is_empty() {
            points.clear();
            let skeleton = character.skeleton();
            for bone in skeleton.ids() {
                let m = posed.near(bone, center);
                points.extend([m.translation.into(), m.transform_point3(skeleton.tip(bone))]);
            }
            if let Some(ends) = span.shapes.filter(|_| points.is_empty()) {
                let end = |corner: usize, axis: usize| ends[corner >> axis & 1][axis];
                points.extend((0..8).map(|k| Vec3::new(end(k, 0), end(k, 1), end(k, 2))));
            }
            seen.see(&points);
        }
    }
}
