//! Inverse kinematics: bones turned so that points of the body stand where they are wanted.
//!
//! Minimises `E(θ) = Σ ‖p_g(θ) − goal_g‖²` within the limits of XZX angles (notes §7.5, which names projected gradients) by
//! Levenberg–Marquardt steps `(JᵀJ + λI) Δ = Jᵀe` on the variables that no limit holds back, with exact derivatives. A bone
//! with limits has its three angles as variables; a free one turns about any axis, which XZX angles cannot near rest.

mod joint;

use crate::fk::widen;
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use glam::{DMat3, DVec3, Vec3};
use joint::Joint;

/// A point of the body and where it is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// The bone that the point is fixed to.
    pub bone: BoneId,
    /// The point in the bone's frame; [`Skeleton::tip`] as a rule.
    pub point: Vec3,
    /// Where it is to be, world space, metres.
    pub target: DVec3,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Steps tried at most.
    pub steps: u32,
    /// A residual that is small enough, metres.
    pub tolerance: f64,
}

impl Default for Settings {
    /// 200 steps, a micrometre.
    fn default() -> Self {
        Self { steps: 200, tolerance: 1e-6 }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Root of the sum of squared distances that are left, metres; infinite where a goal is not finite.
    pub residual: f64,
    /// The residual is within the tolerance.
    pub reached: bool,
    /// Steps tried.
    pub steps: u32,
    /// XZX angles of the bones that have limits, within them.
    pub angles: Vec<(BoneId, Vec3)>,
}

/// A bone and those above it, at most `count` of them, the bone first; bones that cannot move are left out.
pub fn chain(skeleton: &Skeleton, bone: BoneId, count: usize) -> Vec<BoneId> {
    let up = std::iter::successors(Some(bone), |b| skeleton.parent(*b));
    up.filter(|b| skeleton.fixed(*b).is_none()).take(count).collect()
}

/// Turn `bones` so that the goals are met as nearly as can be found; their translations and scales stay.
///
/// Deterministic, and never worse than `pose` once the limits hold. Goals that are not finite change nothing.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use sinew::{fk, ik, pose::Pose, skeleton::{BoneDesc, BoneId, Skeleton}};
/// let mut forearm = BoneDesc { parent: Some(0), length: 1.0, ..BoneDesc::new("forearm") };
/// forearm.rest.translation = Vec3::X;
/// let (skeleton, _) = Skeleton::new(vec![BoneDesc { length: 1.0, ..BoneDesc::new("upper arm") }, forearm])?;
/// let mut pose = Pose::rest(&skeleton);
/// let goal = ik::Goal { bone: BoneId(1), point: skeleton.tip(BoneId(1)), target: DVec3::new(0.0, 1.0, 0.5) };
/// let found = ik::solve(&skeleton, &mut pose, &ik::chain(&skeleton, BoneId(1), 2), &[goal], &ik::Settings::default());
/// assert!(found.reached);
/// let hand = fk::forward_f64(&skeleton, &pose)[1].transform_point3(DVec3::X);
/// assert!(hand.distance(goal.target) < 2e-6);
/// # Ok::<(), sinew::skeleton::SkeletonError>(())
/// ```
///
/// # Panics
/// If a bone is not of this skeleton, or the pose has not one transform a bone.
pub fn solve(
    skeleton: &Skeleton,
    pose: &mut Pose,
    bones: &[BoneId],
    goals: &[Goal],
    settings: &Settings,
) -> Solution {
    assert_eq!(pose.locals.len(), skeleton.len(), "a pose needs one transform a bone");
    let mut body = Body::new(skeleton, pose, bones, goals);
    if !body.is_sound() {
        return Solution { residual: f64::INFINITY, reached: false, steps: 0, angles: vec![] };
    }
    let steps = body.descend(settings);
    let residual = body.error().sqrt();
    let angles = body.joints.iter().filter_map(|(b, j)| Some((*b, j.angles()?))).collect();
    let turned: Vec<_> = body.joints.iter().map(|(b, j)| (*b, j.rotation(skeleton, *b).as_quat())).collect();
    for (bone, rotation) in turned {
        pose.locals[bone.index()].rotation = rotation;
    }
    Solution { residual, reached: residual <= settings.tolerance, steps, angles }
}

/// The bones from the goals up, and what turns them.
struct Body<'a> {
    skeleton: &'a Skeleton,
    pose: &'a Pose,
    goals: &'a [Goal],
    joints: Vec<(BoneId, Joint)>,
    /// All bones above goals, parents first.
    line: Vec<BoneId>,
}

/// `world_from_bone` of the bones in line.
type World = Vec<(DMat3, DVec3)>;

impl<'a> Body<'a> {
    fn new(skeleton: &'a Skeleton, pose: &'a Pose, bones: &[BoneId], goals: &'a [Goal]) -> Self {
        let above = |b: BoneId| std::iter::successors(Some(b), |b| skeleton.parent(*b));
        let mut line: Vec<BoneId> = goals.iter().flat_map(|g| above(g.bone)).collect();
        line.sort_unstable();
        line.dedup();
        let moves = |b: &&BoneId| skeleton.fixed(**b).is_none() && line.binary_search(b).is_ok();
        let mut bones: Vec<BoneId> = bones.iter().filter(moves).copied().collect();
        bones.sort_unstable();
        bones.dedup();
        let joints = bones.into_iter().map(|b| (b, Joint::new(skeleton, pose, b))).collect();
        Self { skeleton, pose, goals, joints, line }
    }

    fn is_sound(&self) -> bool {
        let goals = self.goals.iter().all(|g| g.target.is_finite() && g.point.is_finite());
        goals && self.error().is_finite()
    }

    fn place(&self, bone: BoneId) -> usize {
        self.line.binary_search(&bone).expect("goals' ancestors are in line")
    }

    fn world(&self) -> World {
        let mut out: World = Vec::with_capacity(self.line.len());
        let mut joints = self.joints.iter().peekable();
        for &b in &self.line {
            let local = &self.pose.locals[b.index()];
            let joint = joints.next_if(|j| j.0 == b).map(|j| j.1.rotation(self.skeleton, b));
            let (turn, at) = match self.skeleton.fixed(b) {
                Some(m) => (widen(m).matrix3, widen(m).translation),
                None => {
                    let turn = DMat3::from_quat(joint.unwrap_or(local.rotation.as_dquat().normalize()));
                    (turn * DMat3::from_diagonal(local.scale.as_dvec3()), local.translation.as_dvec3())
                }
            };
            let place = (self.pose.placement.matrix3, self.pose.placement.translation);
            let (up, origin) = self.skeleton.parent(b).map_or(place, |p| out[self.place(p)]);
            out.push((up * turn, origin + up * at));
        }
        out
    }

    /// What is left to each goal.
    fn missing(&self, world: &World) -> Vec<DVec3> {
        let tip = |g: &Goal| {
            let (m, at) = world[self.place(g.bone)];
            at + m * g.point.as_dvec3()
        };
        self.goals.iter().map(|g| g.target - tip(g)).collect()
    }

    fn error(&self) -> f64 {
        self.missing(&self.world()).iter().map(|e| e.length_squared()).sum()
    }

    /// Metres by which each goal's point moves, a radian of each variable: `G` entries a variable.
    fn jacobian(&self, world: &World) -> Vec<Vec<DVec3>> {
        let mut columns = Vec::new();
        for (b, joint) in &self.joints {
            let place = self.pose.placement.matrix3;
            let up = self.skeleton.parent(*b).map_or(place, |p| world[self.place(p)].0);
            let back = up.inverse();
            let origin = world[self.place(*b)].1;
            let tip = |g: &Goal| {
                let (m, at) = world[self.place(g.bone)];
                let below = self.skeleton.subtree(*b).contains(&g.bone.index()) && back.is_finite();
                below.then(|| back * (at + m * g.point.as_dvec3() - origin))
            };
            let arms: Vec<Option<DVec3>> = self.goals.iter().map(tip).collect();
            for axis in joint.axes(self.skeleton, *b) {
                columns.push(arms.iter().map(|a| a.map_or(DVec3::ZERO, |a| up * axis.cross(a))).collect());
            }
        }
        columns
    }

    fn descend(&mut self, settings: &Settings) -> u32 {
        let (mut best, mut error) = (self.joints.clone(), self.error());
        let enough = settings.tolerance * settings.tolerance;
        let (mut steps, mut nudges) = (0, 0);
        let mut least = f64::INFINITY;
        loop {
            let used = self.slide(settings.steps - steps, enough, &mut error);
            steps += used;
            if error < least {
                (best, least) = (self.joints.clone(), error);
            }
            // A straight chain that points at its goal feels no pull to either side: it is bent a little, both ways.
            if least <= enough || steps >= settings.steps || nudges == 4 {
                break;
            }
            self.joints.clone_from(&best);
            self.joints.iter_mut().enumerate().for_each(|(i, j)| j.1.nudge(nudges, i));
            nudges += 1;
            error = self.error();
        }
        self.joints = best;
        steps
    }

    /// Steps downhill until none helps; returns how many were tried.
    fn slide(&mut self, most: u32, enough: f64, error: &mut f64) -> u32 {
        let mut damping = 1e-3;
        for step in 0..most {
            if *error <= enough || damping > 1e6 {
                return step;
            }
            let world = self.world();
            let (missing, before) = (self.missing(&world), self.joints.clone());
            self.unlock(&world, &missing);
            let moves = self.step(&self.jacobian(&world), &missing, damping);
            let longest = moves.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let shorter = (0.7 / longest.max(1e-300)).min(1.0);
            for (joint, v) in self.joints.iter_mut().zip(moves.chunks_exact(3)) {
                joint.1.turn(DVec3::from_slice(v) * shorter);
            }
            let found = self.error();
            if found < *error * (1.0 - 1e-9) {
                *error = found;
                damping = (damping * 0.2).max(1e-9);
            } else {
                self.joints = before;
                damping *= 8.0;
            }
        }
        most
    }

    /// Split the twists of unbent joints so that their bend can follow the goals.
    fn unlock(&mut self, world: &World, missing: &[DVec3]) {
        for i in 0..self.joints.len() {
            let (b, joint) = self.joints[i];
            if !joint.is_locked() {
                continue;
            }
            let up = self.skeleton.parent(b).map_or(self.pose.placement.matrix3, |p| world[self.place(p)].0);
            let origin = world[self.place(b)].1;
            let mut pull = DVec3::ZERO;
            for (g, e) in self.goals.iter().zip(missing) {
                let below = self.skeleton.subtree(b).contains(&g.bone.index());
                pull += if below { (g.target - *e - origin).cross(*e) } else { DVec3::ZERO };
            }
            self.joints[i].1.unlock(self.skeleton, b, up.transpose() * pull);
        }
    }

    /// `(JᵀJ + λs I) Δ = Jᵀe` over the variables that may go where they are pulled; `s` is the mean of the diagonal.
    fn step(&self, columns: &[Vec<DVec3>], missing: &[DVec3], damping: f64) -> Vec<f64> {
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let pull: Vec<f64> = columns.iter().map(|c| dot(c, missing)).collect();
        let held = |i: usize, v: f64| self.joints[i / 3].1.is_held(i % 3, v);
        let mut free: Vec<usize> = (0..pull.len()).filter(|&i| !held(i, pull[i])).collect();
        let mut out = vec![0.0; pull.len()];

        // What a limit stops at once is left out, and the others are solved for again.
        for _ in 0..4 {
            let n = free.len();
            let mut a: Vec<f64> = vec![0.0; n * n];
            for (i, &ci) in free.iter().enumerate() {
                for (j, &cj) in free.iter().enumerate().take(i + 1) {
                    a[i * n + j] = dot(&columns[ci], &columns[cj]);
                }
            }
            let mean = (0..n).map(|i| a[i * n + i]).sum::<f64>() / n.max(1) as f64;
            (0..n).for_each(|i| a[i * n + i] += damping * mean + 1e-30);
            let solved = cholesky(a, free.iter().map(|&i| pull[i]).collect());
            out.fill(0.0);
            free.iter().zip(&solved).for_each(|(&i, &v)| out[i] = v);
            free.retain(|&i| !held(i, out[i]));
            if free.len() == n {
                break;
            }
        }
        (0..out.len()).for_each(|i| {
            if held(i, out[i]) {
                out[i] = 0.0;
            }
        });
        out
    }
}

/// Solve `A x = b` for a symmetric positive definite `A`, of which the lower half is read.
fn cholesky(mut a: Vec<f64>, mut x: Vec<f64>) -> Vec<f64> {
    let n = x.len();
    for i in 0..n {
        for j in 0..=i {
            let sum = a[i * n + j] - (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum::<f64>();
            a[i * n + j] = if i == j { sum.max(1e-300).sqrt() } else { sum / a[j * n + j] };
        }
        x[i] = (x[i] - (0..i).map(|k| a[i * n + k] * x[k]).sum::<f64>()) / a[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| a[k * n + i] * x[k]).sum::<f64>()) / a[i * n + i];
    }
    x
}

#[cfg(test)]
mod tests;
