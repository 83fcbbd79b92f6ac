//! How far two clips move a character's vertices apart: the measure that every bound is stated in.

mod blocks;
mod levers;

pub use levers::Lever;

use super::{BakeDesc, edit};
use crate::character::{Character, Scratch};
use crate::clip::Clip;
use crate::fk::{self, Posed};
use crate::pose::Pose;
use crate::skeleton::BoneId;
use blocks::{Far, Skin};
use glam::{Affine3A, Vec3};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

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

/// What a clip shows at one moment.
#[derive(Clone, Default)]
struct Shown {
    pose: Pose,
    posed: Posed,
}

/// Buffers of one thread.
#[derive(Default)]
struct Bench {
    shown: [Shown; 2],
    scratch: Scratch,
    positions: [Vec<Vec3>; 2],
    /// Of every bone, one clip's frame less the other's.
    frames: Vec<Affine3A>,
    delta: Vec<Affine3A>,
    bounds: Vec<f32>,
}

/// What a bake is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// How far each bone moves the skin.
    Levers,
    /// Which keys to keep.
    Search,
    /// Whether the bound holds at all times.
    Check,
}

/// Called with what is being done and the number of poses that were compared since the last call.
pub type Watch<'a> = &'a (dyn Fn(Stage, usize) + Sync);

/// A clip as it is at some moments, to be compared with several others.
pub struct Looks {
    times: Vec<f64>,
    shown: Vec<Shown>,
}

/// Evaluates clips of one character.
pub struct Gauge<'a> {
    pub(super) character: &'a Character,
    rest: Pose,
    threads: usize,
    pub(super) limit: f64,
    pub(super) metric: Metric,
    pub(super) pins: &'a [(BoneId, f64)],
    over: Option<&'a Pose>,
    watch: Option<Watch<'a>>,
    stage: Stage,
    skins: OnceLock<Vec<Skin>>,
}

impl<'a> Gauge<'a> {
    /// For the vertices of a character, with a limit of a metre; the results do not depend on `threads`.
    pub fn new(character: &'a Character, threads: usize) -> Self {
        let (rest, metric, skins) = (character.rest_pose(), Metric::Vertices, OnceLock::new());
        let threads = threads.max(1);
        Self {
            character,
            rest,
            threads,
            limit: 1.0,
            metric,
            pins: &[],
            over: None,
            watch: None,
            stage: Stage::Levers,
            skins,
        }
    }

    /// For what a bake promises.
    pub fn of(character: &'a Character, desc: &'a BakeDesc) -> Self {
        let BakeDesc { tolerance, metric, ref pins, ref over, .. } = *desc;
        Self { limit: tolerance, metric, pins, over: over.as_ref(), ..Self::new(character, desc.threads) }
    }

    /// Tell how the work goes on.
    pub fn watched(self, watch: Watch<'a>) -> Self {
        Self { watch: Some(watch), ..self }
    }

    /// What comes is part of this.
    pub(super) fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.watch.iter().for_each(|w| w(stage, 0));
    }

    /// What a clip of no tracks holds: the rest pose, or, where clips are additive, no difference.
    pub fn unmoved(&self) -> Pose {
        let mut pose = self.rest.clone();
        if self.over.is_some() {
            let none = crate::math::Trs { scale: Vec3::ZERO, ..crate::math::Trs::IDENTITY };
            pose.locals.fill(none);
            pose.weights.fill(0.0);
        }
        pose
    }

    /// The diagonal of the box around all vertices at rest, metres; around the bones' origins and tips where there are none.
    pub fn diagonal(&self) -> f64 {
        let c = self.character;
        let mut bench = Bench::default();
        let posed = c.posed(&self.rest);
        let center = c.center(&posed);
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for instance in 0..c.instances().len() {
            let p = &mut bench.positions[0];
            c.positions(instance, &self.rest, &posed, center, &mut bench.scratch, p);
            bounds = p.iter().fold(bounds, |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
        }
        if bounds[0].x > bounds[1].x {
            for bone in c.skeleton().ids() {
                let frame = posed.near(bone, center);
                let ends = [Vec3::ZERO, c.skeleton().tip(bone)].map(|p| frame.transform_point3(p));
                bounds = ends.iter().fold(bounds, |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
            }
        }
        if bounds[0].x > bounds[1].x { 0.0 } else { (bounds[1] - bounds[0]).as_dvec3().length() }
    }

    /// The worst point at any of these times, in seconds. Times outside a clip hold its ends.
    pub fn worst(&self, a: &Clip, b: &Clip, times: &[f64]) -> Worst {
        let parts = self.chunks(times.len(), |bench, range| {
            range.fold(Worst::default(), |top, i| {
                self.show(a, times[i], &mut bench.shown[0]);
                top.worse(self.at(b, times[i], bench, None, top.share()))
            })
        });
        parts.into_iter().fold(Worst::default(), Worst::worse)
    }

    /// The worst point at each time; where nothing strays by more than `floor`, a share, there may be none.
    pub fn profile(&self, a: &Clip, b: &Clip, times: &[f64], floor: f64) -> Vec<Worst> {
        let parts = self.chunks(times.len(), |bench, range| {
            let each = range.map(|i| {
                self.show(a, times[i], &mut bench.shown[0]);
                self.at(b, times[i], bench, None, floor)
            });
            each.collect::<Vec<_>>()
        });
        parts.concat()
    }

    /// What a clip shows at these times: a memory of some hundred bytes a bone and moment.
    pub fn looks(&self, clip: &Clip, times: &[f64]) -> Looks {
        let parts = self.chunks(times.len(), |_, range| {
            let each = range.map(|i| {
                let mut shown = Shown::default();
                self.show(clip, times[i], &mut shown);
                shown
            });
            each.collect::<Vec<_>>()
        });
        Looks { times: times.to_vec(), shown: parts.concat() }
    }

    /// How far a clip strays at most at any of these moments, as a part of what is allowed.
    pub fn most(&self, looks: &Looks, clip: &Clip) -> f64 {
        // What one thread found rules vertices out for all; shares are not negative, so that their bits are in order.
        let top = AtomicU64::new(0);
        self.chunks(looks.times.len(), |bench, range| {
            for i in range {
                let floor = f64::from_bits(top.load(Ordering::Relaxed));
                let found = self.at(clip, looks.times[i], bench, Some(&looks.shown[i]), floor);
                top.fetch_max(found.share().to_bits(), Ordering::Relaxed);
            }
        });
        f64::from_bits(top.into_inner())
    }

    /// Whether a clip strays by more than `share` of what is allowed at any of these moments.
    pub fn strays(&self, looks: &Looks, clip: &Clip, share: f64) -> bool {
        let found = AtomicBool::new(false);
        self.chunks(looks.times.len(), |bench, range| {
            for i in range {
                if found.load(Ordering::Relaxed) {
                    return;
                }
                if self.at(clip, looks.times[i], bench, Some(&looks.shown[i]), share).share() > share {
                    found.store(true, Ordering::Relaxed);
                }
            }
        });
        found.into_inner()
    }

    /// How far a clip's last pose is from its first.
    pub fn seam(&self, clip: &Clip) -> Worst {
        let crate::time::Range { start, end } = clip.range();
        Worst { time: end, ..self.between(&self.pose(clip, start), &self.pose(clip, end)) }
    }

    /// How far one pose is from another.
    pub fn between(&self, a: &Pose, b: &Pose) -> Worst {
        let mut bench = Bench::default();
        let shown = |pose: &Pose| Shown { pose: pose.clone(), posed: self.character.posed(pose) };
        let first = shown(a);
        bench.shown[1] = shown(b);
        self.apart(0.0, &mut bench, Some(&first), 0.0)
    }

    /// Work on every item, on all threads, results in order.
    pub(super) fn map<S: Sync + Copy, T: Send>(&self, items: &[S], work: impl Fn(S) -> T + Sync) -> Vec<T> {
        let parts = self.parts(items.len(), |_, range| range.map(|i| work(items[i])).collect::<Vec<_>>());
        parts.into_iter().flatten().collect()
    }

    /// Pose `0..n` in parts, and tell whoever watches of each.
    fn chunks<T: Send>(&self, n: usize, work: impl Fn(&mut Bench, Range<usize>) -> T + Sync) -> Vec<T> {
        self.parts(n, |bench, part| {
            let count = part.len();
            let out = work(bench, part);
            self.watch.iter().for_each(|w| w(self.stage, count));
            out
        })
    }

    /// Work on all of `0..n` in parts, on all threads, results in order.
    fn parts<T: Send>(&self, n: usize, work: impl Fn(&mut Bench, Range<usize>) -> T + Sync) -> Vec<T> {
        let threads = self.threads.min(n).max(1);
        let share = n.div_ceil(8 * threads).max(1);
        let parts: Vec<Range<usize>> = (0..n).step_by(share).map(|i| i..(i + share).min(n)).collect();
        if threads == 1 {
            let mut bench = Bench::default();
            return parts.into_iter().map(|p| work(&mut bench, p)).collect();
        }
        let next = AtomicUsize::new(0);
        let out: Vec<Mutex<Option<T>>> = parts.iter().map(|_| Mutex::new(None)).collect();
        std::thread::scope(|s| {
            for _ in 0..threads {
                s.spawn(|| {
                    let mut bench = Bench::default();
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        let Some(part) = parts.get(i) else { break };
                        *out[i].lock().expect("each part is taken once") =
                            Some(work(&mut bench, part.clone()));
                    }
                });
            }
        });
        out.into_iter().filter_map(|o| o.into_inner().expect("no thread is left")).collect()
    }

    /// The pose that a clip makes, over the base if it is additive.
    pub(super) fn pose(&self, clip: &Clip, t: f64) -> Pose {
        let mut pose = Pose::default();
        self.pose_into(clip, t, &mut pose);
        pose
    }

    fn pose_into(&self, clip: &Clip, t: f64, pose: &mut Pose) {
        match self.over {
            Some(base) => *pose = edit::added(base, clip, t),
            None => {
                pose.locals.clone_from(&self.rest.locals);
                pose.weights.clone_from(&self.rest.weights);
                clip.sample(self.character.skeleton(), t, pose);
            }
        }
    }

    fn show(&self, clip: &Clip, t: f64, out: &mut Shown) {
        self.pose_into(clip, t, &mut out.pose);
        fk::forward(self.character.skeleton(), &out.pose, &mut out.posed);
    }

    /// The worst point of a clip against what is shown; points that stray by no more than `floor` may be left out.
    fn at(&self, clip: &Clip, time: f64, bench: &mut Bench, against: Option<&Shown>, floor: f64) -> Worst {
        let mut own = std::mem::take(&mut bench.shown[1]);
        self.show(clip, time, &mut own);
        bench.shown[1] = own;
        self.apart(time, bench, against, floor)
    }

    /// The bench's second against its first, or against another.
    fn apart(&self, time: f64, bench: &mut Bench, against: Option<&Shown>, floor: f64) -> Worst {
        let c = self.character;
        let skeleton = c.skeleton();
        let Bench { shown: [first, second], scratch, positions: [p, q], frames, delta, bounds } = bench;
        let first = against.unwrap_or(first);
        frames.clear();
        frames.extend(skeleton.ids().map(|bone| {
            let [a, b] = [first, &*second].map(|s| (s.posed.origin(bone), &s.posed));
            let [l, m] = [a, b].map(|(origin, posed)| posed.near(bone, origin).matrix3);
            Affine3A { matrix3: m - l, translation: (b.0 - a.0).as_vec3a() }
        }));
        let mut worst = Worst { time, ..Worst::default() };
        let limit = self.limit;
        match self.metric {
            Metric::Vertices => {
                let skins =
                    self.skins.get_or_init(|| (0..c.instances().len()).map(|i| Skin::new(c, i)).collect());
                // A little below the floor, which rounding may have lifted.
                let mut far = Far { d2: ((floor * limit).powi(2) * (1.0 - 1e-5)) as f32, vertex: None };
                for (instance, skin) in skins.iter().enumerate() {
                    far.vertex = None;
                    if self.morphs(instance, &first.pose) || self.morphs(instance, &second.pose) {
                        // Both around one centre, so that f32 holds their difference wherever the character stands.
                        let center = c.center(&first.posed);
                        c.positions(instance, &first.pose, &first.posed, center, scratch, p);
                        c.positions(instance, &second.pose, &second.posed, center, scratch, q);
                        far = farthest(p, q, far);
                    } else {
                        delta.clear();
                        delta.extend(skin.palette.iter().map(|(b, bind)| frames[b.index()] * *bind));
                        far = skin.farthest(delta, bounds, far);
                    }
                    if let Some(vertex) = far.vertex {
                        let spot = Some(Spot::Vertex { instance, vertex: vertex as usize });
                        worst = worst.worse(Worst { distance: (far.d2 as f64).sqrt(), limit, time, spot });
                    }
                }
            }
            Metric::Shell(radius) => {
                for bone in skeleton.ids() {
                    let Affine3A { matrix3: m, translation } = frames[bone.index()];
                    // No point of the shell turns farther than its radius times the norm of the difference.
                    let turn =
                        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared())
                            .sqrt();
                    let distance = translation.length() as f64 + radius * turn as f64;
                    worst = worst.worse(Worst { distance, limit, time, spot: Some(Spot::Bone(bone)) });
                }
            }
        }
        for &(bone, limit) in self.pins {
            let frame = frames[bone.index()];
            for point in [Vec3::ZERO, skeleton.tip(bone)] {
                let distance = frame.transform_point3(point).length() as f64;
                worst = worst.worse(Worst { distance, limit, time, spot: Some(Spot::Bone(bone)) });
            }
        }
        worst
    }

    /// Whether blend shapes are at work on an instance.
    fn morphs(&self, instance: usize, pose: &Pose) -> bool {
        let inst = &self.character.instances()[instance];
        let targets = self.character.mesh(inst).targets.len();
        pose.weights[inst.first_weight..][..targets].iter().any(|w| *w != 0.0)
    }
}

/// The pair that is farthest apart, if farther than `far`.
fn farthest(p: &[Vec3], q: &[Vec3], mut far: Far) -> Far {
    for (v, (p, q)) in p.iter().zip(q).enumerate() {
        let d2 = p.distance_squared(*q);
        if d2 > far.d2 {
            far = Far { d2, vertex: Some(v as u32) };
        }
    }
    far
}
