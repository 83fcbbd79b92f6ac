//! How far two clips move a character's vertices apart: the measure that every bound is stated in.

use super::BakeDesc;
use crate::character::{Character, Scratch};
use crate::clip::Clip;
use crate::fk::{self, Posed};
use crate::pose::Pose;
use crate::skeleton::BoneId;
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which points of a character must not stray.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Metric {
    /// Every vertex of the skin, skinned and morphed.
    #[default]
    Vertices,
    /// Points at this distance around every bone's origin, metres: for skeletons without a skin, and for whatever may hang there.
    Shell(f64),
}

/// Where something strayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spot {
    /// A vertex of a mesh instance.
    Vertex {
        /// Mesh instance.
        instance: usize,
        /// Vertex of its mesh.
        vertex: usize,
    },
    /// A point on or around a bone.
    Bone(BoneId),
}

/// The point that strayed farthest, measured by what it may.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Worst {
    /// Metres between the point of one clip and the same point of the other, world space.
    pub distance: f64,
    /// Metres that it may stray.
    pub limit: f64,
    /// Seconds.
    pub time: f64,
    /// Which point; none where nothing strayed.
    pub spot: Option<Spot>,
}

impl Worst {
    /// Distance as a part of the limit.
    pub fn share(&self) -> f64 {
        if self.distance > 0.0 { self.distance / self.limit } else { 0.0 }
    }

    /// The one of larger share; the first of equals.
    pub fn worse(self, other: Self) -> Self {
        if other.share() > self.share() { other } else { self }
    }
}

/// What errors of a bone's channels cost.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Lever {
    /// Metres a radian: the distance from its origin to the farthest vertex that it or a bone below it moves; zero where it moves
    /// nothing.
    pub turn: f64,
    /// Metres a unit of translation: the scale of the frame that it stands in.
    pub shift: f64,
}

/// Buffers of one thread.
#[derive(Default)]
struct Bench {
    posed: Posed,
    scratch: Scratch,
    positions: [Vec<Vec3>; 2],
}

/// Evaluates clips of one character.
pub struct Gauge<'a> {
    pub(super) character: &'a Character,
    threads: usize,
    pub(super) limit: f64,
    pub(super) metric: Metric,
    pub(super) pins: &'a [(BoneId, f64)],
}

impl<'a> Gauge<'a> {
    /// For the vertices of a character, with a limit of a metre; the results do not depend on `threads`.
    pub fn new(character: &'a Character, threads: usize) -> Self {
        Self { character, threads: threads.max(1), limit: 1.0, metric: Metric::Vertices, pins: &[] }
    }

    /// For what a bake promises.
    pub fn of(character: &'a Character, desc: &'a BakeDesc) -> Self {
        let BakeDesc { tolerance, metric, ref pins, .. } = *desc;
        Self { limit: tolerance, metric, pins, ..Self::new(character, desc.threads) }
    }

    /// The diagonal of the box around all vertices at rest, metres.
    pub fn diagonal(&self) -> f64 {
        let c = self.character;
        let pose = c.rest_pose();
        let mut bench = Bench { posed: c.posed(&pose), ..Bench::default() };
        let center = c.center(&bench.posed);
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for instance in 0..c.instances().len() {
            let p = &mut bench.positions[0];
            c.positions(instance, &pose, &bench.posed, center, &mut bench.scratch, p);
            bounds = p.iter().fold(bounds, |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
        }
        if bounds[0].x > bounds[1].x { 0.0 } else { (bounds[1] - bounds[0]).as_dvec3().length() }
    }

    /// The worst point at any of these times, in seconds. Times outside a clip hold its ends.
    pub fn worst(&self, a: &Clip, b: &Clip, times: &[f64]) -> Worst {
        self.each(times, |bench, t| self.at(a, b, t, bench)).into_iter().fold(Worst::default(), Worst::worse)
    }

    /// The worst point at each time.
    pub fn profile(&self, a: &Clip, b: &Clip, times: &[f64]) -> Vec<Worst> {
        self.each(times, |bench, t| self.at(a, b, t, bench))
    }

    /// Work on every item, on all threads, results in order.
    pub(super) fn map<S: Sync + Copy, T: Send + Default + Clone>(
        &self,
        items: &[S],
        work: impl Fn(S) -> T + Sync,
    ) -> Vec<T> {
        self.each(items, |_, item| work(item))
    }

    /// Work on every time, on all threads, results in order.
    fn each<S: Sync + Copy, T: Send + Default + Clone>(
        &self,
        times: &[S],
        work: impl Fn(&mut Bench, S) -> T + Sync,
    ) -> Vec<T> {
        let threads = self.threads.min(times.len()).max(1);
        let share = times.len().div_ceil(8 * threads).max(1);
        let mut out = vec![T::default(); times.len()];
        if threads == 1 {
            let mut bench = Bench::default();
            out.iter_mut().zip(times).for_each(|(o, &t)| *o = work(&mut bench, t));
            return out;
        }
        let next = AtomicUsize::new(0);
        let chunks: Vec<_> =
            out.chunks_mut(share).zip(times.chunks(share)).map(std::sync::Mutex::new).collect();
        std::thread::scope(|s| {
            for _ in 0..threads {
                s.spawn(|| {
                    let mut bench = Bench::default();
                    while let Some(chunk) = chunks.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let mut chunk = chunk.lock().expect("each chunk is taken once");
                        let (out, times) = &mut *chunk;
                        out.iter_mut().zip(times.iter()).for_each(|(o, &t)| *o = work(&mut bench, t));
                    }
                });
            }
        });
        drop(chunks);
        out
    }

    pub(super) fn pose(&self, clip: &Clip, t: f64) -> Pose {
        let mut pose = self.character.rest_pose();
        clip.sample(self.character.skeleton(), t, &mut pose);
        pose
    }

    fn at(&self, a: &Clip, b: &Clip, time: f64, bench: &mut Bench) -> Worst {
        let c = self.character;
        let poses = [self.pose(a, time), self.pose(b, time)];
        let mut worst = Worst { time, ..Worst::default() };
        // Both around one centre, so that f32 holds their difference wherever the character stands.
        fk::forward(c.skeleton(), &poses[0], &mut bench.posed);
        let center = c.center(&bench.posed);
        let first = std::mem::take(&mut bench.posed);
        fk::forward(c.skeleton(), &poses[1], &mut bench.posed);
        let limit = self.limit;
        match self.metric {
            Metric::Vertices => {
                for instance in 0..c.instances().len() {
                    let [p, q] = &mut bench.positions;
                    c.positions(instance, &poses[0], &first, center, &mut bench.scratch, p);
                    c.positions(instance, &poses[1], &bench.posed, center, &mut bench.scratch, q);
                    let (vertex, d2) = farthest(p, q);
                    let spot = Some(Spot::Vertex { instance, vertex });
                    worst = worst.worse(Worst { distance: (d2 as f64).sqrt(), limit, time, spot });
                }
            }
            Metric::Shell(radius) => {
                for bone in c.skeleton().ids() {
                    let [a, b] = [&first, &bench.posed].map(|p| p.near(bone, center));
                    // No point of the shell turns farther than its radius times the norm of the difference.
                    let m = a.matrix3 - b.matrix3;
                    let turn =
                        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared())
                            .sqrt();
                    let distance = a.translation.distance(b.translation) as f64 + radius * turn as f64;
                    worst = worst.worse(Worst { distance, limit, time, spot: Some(Spot::Bone(bone)) });
                }
            }
        }
        for &(bone, limit) in self.pins {
            let tip = c.skeleton().tip(bone);
            let [a, b] = [&first, &bench.posed].map(|p| p.near(bone, center));
            for point in [Vec3::ZERO, tip] {
                let distance = a.transform_point3(point).distance(b.transform_point3(point)) as f64;
                worst = worst.worse(Worst { distance, limit, time, spot: Some(Spot::Bone(bone)) });
            }
        }
        worst
    }

    /// The lever of each bone over these times of a clip.
    pub fn levers(&self, clip: &Clip, times: &[f64]) -> Vec<Lever> {
        let mut longest = vec![Lever::default(); self.character.skeleton().len()];
        for at in self.each(times, |bench, t| self.levers_at(clip, t, bench)) {
            for (l, now) in longest.iter_mut().zip(at) {
                *l = Lever { turn: l.turn.max(now.turn), shift: l.shift.max(now.shift) };
            }
        }
        longest
    }

    fn levers_at(&self, clip: &Clip, t: f64, bench: &mut Bench) -> Vec<Lever> {
        let c = self.character;
        let skeleton = c.skeleton();
        let pose = self.pose(clip, t);
        fk::forward(skeleton, &pose, &mut bench.posed);
        let center = c.center(&bench.posed);
        let mut boxes = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; skeleton.len()];
        if let Metric::Shell(radius) = self.metric {
            for bone in skeleton.ids() {
                let origin: Vec3 = bench.posed.near(bone, center).translation.into();
                boxes[bone.index()] =
                    [Vec3::splat(-radius as f32), Vec3::splat(radius as f32)].map(|r| r + origin);
            }
        }
        for &(bone, _) in self.pins {
            let origin: Vec3 = bench.posed.near(bone, center).translation.into();
            let b = &mut boxes[bone.index()];
            *b = [b[0].min(origin), b[1].max(origin)];
        }
        // The box around all that a bone moves holds those of its children.
        for instance in 0..c.instances().len() {
            let p = &mut bench.positions[0];
            c.positions(instance, &pose, &bench.posed, center, &mut bench.scratch, p);
            for (v, p) in p.iter().enumerate() {
                for bone in c.bones_of(instance, v) {
                    let b = &mut boxes[bone.index()];
                    *b = [b[0].min(*p), b[1].max(*p)];
                }
            }
        }
        for bone in skeleton.ids().rev() {
            if let Some(parent) = skeleton.parent(bone) {
                let [lo, hi] = boxes[bone.index()];
                let b = &mut boxes[parent.index()];
                *b = [b[0].min(lo), b[1].max(hi)];
            }
        }
        let reach = |bone: BoneId| {
            let [lo, hi] = boxes[bone.index()];
            if lo.x > hi.x {
                return Lever::default();
            }
            let origin: DVec3 = bench.posed.origin(bone) - center;
            let far = (lo.as_dvec3() - origin).abs().max((hi.as_dvec3() - origin).abs());
            let parent = skeleton.parent(bone).map(|p| bench.posed.world_from_bone(p).matrix3);
            let stretch = |m: glam::DMat3| m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
            Lever { turn: far.length(), shift: parent.map_or(1.0, stretch) }
        };
        skeleton.ids().map(reach).collect()
    }
}

/// The pair that is farthest apart: its index, and the distance squared.
fn farthest(p: &[Vec3], q: &[Vec3]) -> (usize, f32) {
    let mut worst = (0, 0.0);
    for (v, (p, q)) in p.iter().zip(q).enumerate() {
        let d2 = p.distance_squared(*q);
        if d2 > worst.1 {
            worst = (v, d2);
        }
    }
    worst
}
