//! How far two clips move a character's vertices apart: the measure that every bound is stated in.

use crate::character::{Character, Scratch};
use crate::clip::Clip;
use crate::fk::{self, Posed};
use crate::pose::Pose;
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The largest distance that was found, and where.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Worst {
    /// Metres between a vertex of one clip and the same vertex of the other, world space.
    pub distance: f64,
    /// Seconds.
    pub time: f64,
    /// Mesh instance.
    pub instance: usize,
    /// Vertex of its mesh.
    pub vertex: usize,
}

impl Worst {
    fn worse(self, other: Self) -> Self {
        if other.distance > self.distance { other } else { self }
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
    character: &'a Character,
    threads: usize,
}

impl<'a> Gauge<'a> {
    /// For a character; the results do not depend on `threads`.
    pub fn new(character: &'a Character, threads: usize) -> Self {
        Self { character, threads: threads.max(1) }
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

    /// The worst vertex at any of these times, in seconds. Times outside a clip hold its ends.
    pub fn worst(&self, a: &Clip, b: &Clip, times: &[f64]) -> Worst {
        self.each(times, |bench, t| self.at(a, b, t, bench)).into_iter().fold(Worst::default(), Worst::worse)
    }

    /// The worst distance at each time, metres.
    pub fn profile(&self, a: &Clip, b: &Clip, times: &[f64]) -> Vec<Worst> {
        self.each(times, |bench, t| self.at(a, b, t, bench))
    }

    /// Work on every time, on all threads, results in order.
    fn each<T: Send + Default + Clone>(
        &self,
        times: &[f64],
        work: impl Fn(&mut Bench, f64) -> T + Sync,
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

    fn pose(&self, clip: &Clip, t: f64) -> Pose {
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
        for instance in 0..c.instances().len() {
            let [p, q] = &mut bench.positions;
            c.positions(instance, &poses[0], &first, center, &mut bench.scratch, p);
            c.positions(instance, &poses[1], &bench.posed, center, &mut bench.scratch, q);
            let (vertex, d2) = farthest(p, q);
            let distance = (d2 as f64).sqrt();
            worst = worst.worse(Worst { distance, time, instance, vertex });
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
        // The box around all that a bone moves holds those of its children.
        let mut boxes = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; skeleton.len()];
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
        let reach = |bone: crate::skeleton::BoneId| {
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
