//! Handles of a bone: rings for twist, bend, twist and any turn, arrows, and the end that pulls its chain.

use super::orbit::Lens;
use crate::state::{Change, State};
use glam::{DAffine3, DQuat, DVec3};
use sinew::clip::Target;
use sinew::fk::Posed;
use sinew::ik;
use sinew::pose::Pose;
use sinew::skeleton::{BoneId, Skeleton};
use std::f64::consts::TAU;

/// What can be taken hold of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// An angle of XZX, 0 to 2.
    Angle(usize),
    /// About the line of sight.
    Free,
    /// Along an axis of the world, 0 to 2.
    Along(usize),
    /// In the picture's plane.
    Across,
    /// The bone's tip: its chain follows.
    Tip,
}

/// A circle that an angle is read from.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    /// What it turns.
    pub part: Part,
    /// Unit, world space.
    pub axis: DVec3,
    /// Where the angle is 0: unit, orthogonal to the axis.
    pub zero: DVec3,
    /// Where it stands, radians.
    pub angle: f64,
    /// What limits leave of it.
    pub range: Option<[f64; 2]>,
    /// Metres.
    pub radius: f64,
}

/// All handles of a bone.
#[derive(Clone, Debug)]
pub struct Gizmo {
    /// Whose.
    pub bone: BoneId,
    /// Its origin, world space.
    pub origin: DVec3,
    /// Its tip.
    pub tip: DVec3,
    /// Outermost last.
    pub rings: Vec<Ring>,
    /// Length of the arrows, metres; none where the bone does not move against its parent.
    pub arrows: Option<f64>,
}

/// Rotation of what a bone is posed against; an edited character stands at the origin.
fn above(skeleton: &Skeleton, posed: &Posed, bone: BoneId) -> DQuat {
    let m = skeleton.parent(bone).map_or(DAffine3::IDENTITY, |p| posed.world_from_bone(p));
    let q = m.to_scale_rotation_translation().1;
    if q.is_finite() { q.normalize() } else { DQuat::IDENTITY }
}

impl Gizmo {
    /// Handles of a bone; none where it never moves.
    pub fn of(state: &State, bone: BoneId, posed: &Posed, lens: &Lens) -> Option<Self> {
        let skeleton = state.document.skeleton();
        if skeleton.fixed(bone).is_some() || bone.index() >= posed.len() {
            return None;
        }
        let [origin, tip] = super::ends(skeleton, posed, bone);
        let radius = 80.0 * lens.metres(origin);
        let rest = skeleton.rest(bone).rotation.as_dquat() * skeleton.aim(bone).as_dquat();
        let frame = above(skeleton, posed, bone) * rest.normalize();
        let theta = state.theta(bone).as_dvec3();
        let outer = frame * DQuat::from_rotation_x(theta.z);
        let inner = outer * DQuat::from_rotation_z(theta.y);
        let limits = skeleton.limits(bone);
        let ring = |k: usize, axis: DVec3, zero: DVec3, size: f64| Ring {
            part: Part::Angle(k),
            axis,
            zero,
            angle: theta[k],
            range: limits.map(|l| [f64::from(l.min[k]), f64::from(l.max[k])]),
            radius: size * radius,
        };
        let [right, _, back] = lens.orbit.axes();
        let free =
            Ring { part: Part::Free, axis: back, zero: right, angle: 0.0, range: None, radius: 1.2 * radius };
        let rings = vec![
            ring(0, inner * DVec3::X, inner * DVec3::Z, 0.6),
            ring(1, outer * DVec3::Z, outer * DVec3::X, 0.8),
            ring(2, frame * DVec3::X, frame * DVec3::Z, 1.0),
            free,
        ];
        let moves = skeleton.parent(bone).is_none() || state.track_of(&Target::Translation(bone)).is_some();
        Some(Self { bone, origin, tip, rings, arrows: moves.then_some(1.5 * radius) })
    }

    /// A point of a ring.
    pub fn on(&self, ring: &Ring, angle: f64) -> DVec3 {
        let side = ring.axis.cross(ring.zero);
        self.origin + ring.radius * (angle.cos() * ring.zero + angle.sin() * side)
    }

    /// What is within `reach` points of a place of the pane; the smallest first, as it is hardest to hit.
    pub fn hit(&self, lens: &Lens, at: [f32; 2], reach: f32) -> Option<Part> {
        let far = |p: DVec3| lens.project(p).map_or(f32::INFINITY, |q| (q[0] - at[0]).hypot(q[1] - at[1]));
        let mut found: Vec<(f32, Part)> = vec![];
        if self.tip.distance(self.origin) > 0.0 {
            found.push((far(self.tip) - 4.0, Part::Tip));
        }
        for ring in &self.rings {
            found.push((far(self.on(ring, ring.angle)) - 4.0, ring.part));
            let points: Vec<_> =
                (0..=64).map(|i| lens.project(self.on(ring, f64::from(i) * TAU / 64.0))).collect();
            for pair in points.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    found.push((super::off_segment(at, *a, *b), ring.part));
                }
            }
        }
        if let Some(length) = self.arrows {
            found.push((far(self.origin), Part::Across));
            found.extend((0..3).map(|k| (far(self.origin + DVec3::AXES[k] * length), Part::Along(k))));
        }
        let nearest = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= reach).then_some(nearest.1)
    }

    /// The angle of a ring below the pointer; a ring seen from its edge is read along its line.
    fn angle_at(&self, lens: &Lens, ring: &Ring, at: [f32; 2]) -> Option<f64> {
        let (_, along) = lens.ray(at);
        if ring.axis.dot(along).abs() > 0.15 {
            let v = lens.on_plane(at, self.origin, ring.axis)? - self.origin;
            return Some(v.dot(ring.axis.cross(ring.zero)).atan2(v.dot(ring.zero)));
        }
        let line = ring.axis.cross(along).normalize();
        let p = lens.on_plane(at, self.origin, lens.orbit.axes()[2])?;
        Some(-(p - self.origin).dot(line) / ring.radius)
    }
}

/// A handle in somebody's hand.
#[derive(Clone, Debug)]
pub struct Hold {
    gizmo: Gizmo,
    part: Part,
    /// What it was when it was taken.
    pose: Pose,
    theta: glam::Vec3,
    above: DQuat,
    start: DVec3,
    last: f64,
    total: f64,
    /// Bones that a pull turns.
    chain: Vec<BoneId>,
}

impl Hold {
    /// Take a handle at a place of the pane; a pull takes `count` bones along.
    pub fn new(
        state: &State,
        posed: &Posed,
        lens: &Lens,
        gizmo: Gizmo,
        part: Part,
        at: [f32; 2],
        count: usize,
    ) -> Option<Self> {
        let (skeleton, pose, bone) = (state.document.skeleton(), state.pose(), gizmo.bone);
        let ring = gizmo.rings.iter().find(|r| r.part == part);
        let last = match ring {
            Some(ring) => gizmo.angle_at(lens, ring, at)?,
            None => 0.0,
        };
        let start = gizmo.grip(lens, part, at)?;
        let (theta, above) = (state.theta(bone), above(skeleton, posed, bone));
        let chain = ik::chain(skeleton, bone, count);
        Some(Self { part, pose, theta, above, start, last, total: 0.0, chain, gizmo })
    }

    /// The name of the step of undo.
    pub fn name(&self) -> &'static str {
        match self.part {
            Part::Angle(1) => "Bend bone",
            Part::Angle(_) => "Twist bone",
            Part::Free => "Turn bone",
            Part::Along(_) | Part::Across => "Move bone",
            Part::Tip => "Pull chain",
        }
    }

    /// What the pose becomes with the pointer there; `coarse` goes by 5°.
    pub fn change(
        &mut self,
        state: &State,
        lens: &Lens,
        at: [f32; 2],
        coarse: bool,
    ) -> Vec<(BoneId, Change)> {
        let bone = self.gizmo.bone;
        let local = self.pose.locals[bone.index()];
        let angle = self.turned(lens, at, coarse);
        match self.part {
            Part::Angle(k) => {
                let mut theta = self.theta;
                theta[k] += angle as f32;
                vec![(bone, Change::Xzx(theta))]
            }
            Part::Free => {
                let turn = DQuat::from_axis_angle(self.gizmo.rings[3].axis, angle);
                let q = self.above.conjugate() * turn * self.above * local.rotation.as_dquat();
                vec![(bone, Change::Rotation(q.as_quat()))]
            }
            Part::Along(_) | Part::Across => {
                let by = self.gizmo.grip(lens, self.part, at).map_or(DVec3::ZERO, |p| p - self.start);
                let skeleton = state.document.skeleton();
                let posed = state.document.asset.character.posed(&self.pose);
                let up = skeleton.parent(bone).map_or(DAffine3::IDENTITY, |p| posed.world_from_bone(p));
                let by = (up.matrix3.inverse() * by).as_vec3();
                vec![(bone, Change::Translation(local.translation + by))]
            }
            Part::Tip => self.pulled(state, lens, at),
        }
    }

    fn turned(&mut self, lens: &Lens, at: [f32; 2], coarse: bool) -> f64 {
        let ring = self.gizmo.rings.iter().find(|r| r.part == self.part);
        if let Some(now) = ring.and_then(|r| self.gizmo.angle_at(lens, r, at)) {
            let by = now - self.last;
            self.total += by - TAU * (by / TAU).round();
            self.last = now;
        }
        let step = 5_f64.to_radians();
        if coarse { (self.total / step).round() * step } else { self.total }
    }

    fn pulled(&self, state: &State, lens: &Lens, at: [f32; 2]) -> Vec<(BoneId, Change)> {
        let skeleton = state.document.skeleton();
        let Some(target) = self.gizmo.grip(lens, Part::Tip, at) else { return vec![] };
        let target = self.gizmo.tip + target - self.start;
        let goal = ik::Goal { bone: self.gizmo.bone, point: skeleton.tip(self.gizmo.bone), target };
        let mut pose = self.pose.clone();
        let settings = ik::Settings { tolerance: 1e-5 * lens.orbit.distance, ..ik::Settings::default() };
        let found = ik::solve(skeleton, &mut pose, &self.chain, &[goal], &settings);
        let change = |b: &BoneId| match found.angles.iter().find(|a| a.0 == *b) {
            Some((_, theta)) => (*b, Change::Xzx(*theta)),
            None => (*b, Change::Rotation(pose.locals[b.index()].rotation)),
        };
        self.chain.iter().map(change).collect()
    }
}

impl Gizmo {
    /// The point of the world that a handle has below the pointer.
    fn grip(&self, lens: &Lens, part: Part, at: [f32; 2]) -> Option<DVec3> {
        let back = lens.orbit.axes()[2];
        match part {
            Part::Along(k) => lens.on_line(at, self.origin, DVec3::AXES[k]),
            Part::Tip => lens.on_plane(at, self.tip, back),
            _ => lens.on_plane(at, self.origin, back),
        }
    }
}
