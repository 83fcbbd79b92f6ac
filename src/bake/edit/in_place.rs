//! Root motion taken out of a clip, and kept beside it.

use super::EditError;
use super::keys::Keys;
use crate::character::{Binding, Character};
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::fk;
use crate::skeleton::BoneId;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::BTreeSet;

/// Metres and radians that a straight piece of the motion may be off the way it stands for.
const CLOSE: f64 = 1e-6;

/// Pieces that one key's distance may be cut into: `2^DEEPEST`.
const DEEPEST: u32 = 10;

/// Where a clip takes its character: `world_from_place(t) = T(x, 0, z) · R_y(yaw)`, the identity at the clip's start, straight between its
/// keys. A character that stands in this frame and plays the clip in place moves as the clip did.
#[derive(Clone, Debug, PartialEq)]
pub struct RootMotion {
    /// The bone that it was taken from.
    pub bone: BoneId,
    /// Seconds.
    pub times: Vec<f64>,
    /// Metres, world space; y is 0.
    pub translations: Vec<DVec3>,
    /// Radians about +y, not wrapped; all 0 where the heading was left in.
    pub yaw: Vec<f64>,
}

/// The bone whose translation moves the character about: of those that a track of the clip translates, the one with most of the skin's
/// bones below it (itself included), and of those the first, parents before children.
pub fn motion_root(character: &Character, clip: &Clip) -> Option<BoneId> {
    let skeleton = character.skeleton();
    let mut carries = vec![character.instances().is_empty(); skeleton.len()];
    for i in character.instances() {
        match &i.binding {
            Binding::Bone(b) => carries[b.index()] = true,
            Binding::Skin { palette, .. } => palette.iter().for_each(|p| carries[p.0.index()] = true),
        }
    }
    let moved: BTreeSet<BoneId> =
        clip.tracks.iter().filter(|t| varies(&t.curve)).filter_map(translated).collect();
    let load = |b: BoneId| skeleton.subtree(b).filter(|&i| carries[i]).count();
    let mut best: Option<(usize, BoneId)> = None;
    for bone in moved {
        let load = load(bone);
        if load > best.map_or(0, |b| b.0) {
            best = Some((load, bone));
        }
    }
    best.map(|b| b.1)
}

fn translated(track: &Track) -> Option<BoneId> {
    match track.target {
        Target::Translation(b) => Some(b),
        _ => None,
    }
}

fn varies(curve: &Curve) -> bool {
    (1..curve.times().len()).any(|k| curve.value(k) != curve.value(0))
}

/// The clip on the spot, and where it went: the way of its [`motion_root`] over the ground (world x and z) is taken out, and with `heading` its
/// turning about +y as well. What stands beside that bone and not below it stays where it was.
///
/// # Errors
/// [`EditError::NoRoot`] if nothing that carries the skin is translated.
///
/// # Panics
/// If the clip is not of the character.
pub fn in_place(character: &Character, clip: &Clip, heading: bool) -> Result<(Clip, RootMotion), EditError> {
    let missing = || EditError::NoRoot { clip: clip.name.clone() };
    let bone = motion_root(character, clip).ok_or_else(missing)?;
    let path = Path::new(character, clip, bone, heading);
    let mut times = path.knots();
    let stands = path.above.iter().all(|b| !clip.tracks.iter().any(|t| moves(&t.target, *b)));
    if !(stands && !heading && path.straight()) {
        times = path.refined(&times);
    }
    let motion = path.motion(&times);
    let mut out = clip.clone();
    for track in &mut out.tracks {
        let own = match track.target {
            Target::Translation(b) => b == bone,
            Target::Rotation(b) | Target::Xzx(b) => b == bone && heading,
            _ => false,
        };
        if own && stands && !heading {
            *track = path.over_the_ground(track);
        } else if own {
            *track = path.placed(track, &motion, &times);
        }
    }
    let turned = |t: &Track| matches!(t.target, Target::Rotation(b) | Target::Xzx(b) if b == bone);
    if heading && !out.tracks.iter().any(turned) {
        let held = Curve::new(
            vec![times[0].0],
            character.skeleton().rest(bone).rotation.to_array().to_vec(),
            4,
            Interpolation::Linear,
        );
        let track = Track { target: Target::Rotation(bone), curve: held.expect("one key") };
        out.tracks.push(path.placed(&track, &motion, &times));
    }
    Ok((out, motion))
}

fn moves(target: &Target, bone: BoneId) -> bool {
    match *target {
        Target::Rotation(b) | Target::Translation(b) | Target::Scale(b) | Target::Xzx(b) => b == bone,
        Target::Weights { .. } => false,
    }
}

/// A key's time, and when to look for what it holds: just before a cut, for the key that ends at it.
type Moment = (f64, f64);

/// The way of a bone through a clip.
struct Path<'a> {
    character: &'a Character,
    /// What moves the bone and those above it.
    clip: Clip,
    bone: BoneId,
    above: Vec<BoneId>,
    heading: bool,
    start: DAffine3,
}

impl<'a> Path<'a> {
    fn new(character: &'a Character, clip: &Clip, bone: BoneId, heading: bool) -> Self {
        let skeleton = character.skeleton();
        let above: Vec<BoneId> =
            std::iter::successors(skeleton.parent(bone), |b| skeleton.parent(*b)).collect();
        let matters = |t: &&Track| above.iter().chain([&bone]).any(|b| moves(&t.target, *b));
        let tracks = clip.tracks.iter().filter(matters).cloned().collect();
        let start = clip.range().start;
        let mut path = Self {
            character,
            clip: Clip { name: String::new(), tracks },
            bone,
            above,
            heading,
            start: DAffine3::IDENTITY,
        };
        path.start = path.at(start)[1];
        path
    }

    /// `world_from_parent` and `world_from_bone`.
    fn at(&self, t: f64) -> [DAffine3; 2] {
        let skeleton = self.character.skeleton();
        let mut pose = self.character.rest_pose();
        self.clip.sample(skeleton, t, &mut pose);
        let local = |b: BoneId| match skeleton.fixed(b) {
            Some(m) => fk::widen(m),
            None => {
                let l = pose.locals[b.index()];
                DAffine3::from_scale_rotation_translation(
                    l.scale.as_dvec3(),
                    l.rotation.as_dquat().normalize(),
                    l.translation.as_dvec3(),
                )
            }
        };
        let parent = self.above.iter().rev().fold(DAffine3::IDENTITY, |m, b| m * local(*b));
        [parent, parent * local(self.bone)]
    }

    /// Keys of what moves the bone; two at a cut.
    fn knots(&self) -> Vec<Moment> {
        let mut all: Vec<f64> = vec![];
        let mut cuts = BTreeSet::new();
        for track in &self.clip.tracks {
            let keys = track.curve.times();
            let held = track.curve.interpolation() == Interpolation::Hold;
            cuts.extend(keys.windows(2).filter(|w| held || w[0] == w[1]).map(|w| w[1].to_bits()));
            all.extend(keys);
        }
        all.sort_by(f64::total_cmp);
        all.dedup();
        let before = |t: f64| t - 1e-9 * t.abs().max(1.0);
        all.iter()
            .flat_map(|&t| cuts.contains(&t.to_bits()).then(|| (t, before(t))).into_iter().chain([(t, t)]))
            .collect()
    }

    /// The bone's own translation goes straight from key to key.
    fn straight(&self) -> bool {
        let of = |t: &&Track| matches!(t.target, Target::Translation(_));
        let straight = [Interpolation::Linear, Interpolation::Hold];
        self.clip.tracks.iter().filter(of).all(|t| straight.contains(&t.curve.interpolation()))
    }

    /// Way and heading since the start; the heading's turns count from `near`.
    fn travel(&self, t: f64, near: f64) -> (DVec3, f64) {
        let now = self.at(t)[1];
        let flat = |m: &DAffine3| DVec3::new(m.translation.x, 0.0, m.translation.z);
        if !self.heading {
            return (flat(&now) - flat(&self.start), 0.0);
        }
        // The twist about +y of the turn since the start.
        let q = turn(&now.matrix3) * turn(&self.start.matrix3).conjugate();
        let yaw = 2.0 * q.y.atan2(q.w);
        let full = std::f64::consts::TAU;
        let yaw = yaw + full * ((near - yaw) / full).round();
        (flat(&now) - DQuat::from_rotation_y(yaw) * flat(&self.start), yaw)
    }

    /// With moments between, until pieces of the motion and of what is left are straight.
    fn refined(&self, knots: &[Moment]) -> Vec<Moment> {
        let mut out = vec![knots[0]];
        for w in knots.windows(2) {
            if w[0].0 < w[1].0 {
                self.split(w[0], w[1], DEEPEST, &mut out);
            }
            out.push(w[1]);
        }
        out
    }

    fn split(&self, a: Moment, b: Moment, depth: u32, out: &mut Vec<Moment>) {
        let t = 0.5 * (a.0 + b.0);
        if depth == 0 || [0.25, 0.5, 0.75].iter().all(|u| self.bends(a, b, *u) <= CLOSE) {
            return;
        }
        self.split(a, (t, t), depth - 1, out);
        out.push((t, t));
        self.split((t, t), b, depth - 1, out);
    }

    /// How far the frame that straight pieces from `a` to `b` make is from what it should be, at `u`.
    fn bends(&self, a: Moment, b: Moment, u: f64) -> f64 {
        let (p, q) = (self.travel(a.1, 0.0), self.travel(b.1, 0.0));
        let unwrapped = self.travel(b.1, p.1).1;
        let (x, y) = (self.local(a.1, &p), self.local(b.1, &q));
        let way = p.0.lerp(q.0, u);
        let yaw = p.1 + (unwrapped - p.1) * u;
        let t = a.0 + (b.0 - a.0) * u;
        let [parent, now] = self.at(t);
        let made = DAffine3::from_rotation_translation(DQuat::from_rotation_y(yaw), way)
            * parent
            * DAffine3::from_rotation_translation(x.0.slerp(nearer(x.0, y.0), u), x.1.lerp(y.1, u));
        (made.translation - now.translation)
            .length()
            .max(turn(&made.matrix3).angle_between(turn(&now.matrix3)))
    }

    /// `parent_from_bone` on the spot: rotation and translation.
    fn local(&self, t: f64, travel: &(DVec3, f64)) -> (DQuat, DVec3) {
        let [parent, now] = self.at(t);
        let place = DAffine3::from_rotation_translation(DQuat::from_rotation_y(travel.1), travel.0);
        let left = parent.inverse() * (place.inverse() * now);
        (turn(&parent.matrix3).conjugate() * turn(&(place.inverse() * now).matrix3), left.translation)
    }

    fn motion(&self, times: &[Moment]) -> RootMotion {
        let (mut translations, mut yaw) = (vec![], vec![]);
        for t in times {
            let (way, turned) = self.travel(t.1, yaw.last().copied().unwrap_or(0.0));
            translations.push(way);
            yaw.push(turned);
        }
        RootMotion { bone: self.bone, times: times.iter().map(|t| t.0).collect(), translations, yaw }
    }

    /// A translation's keys without their way over the ground; exact for every kind of curve, as the map is linear.
    fn over_the_ground(&self, track: &Track) -> Track {
        let parent = self.at(self.clip.range().start)[0].matrix3;
        let flat = parent.inverse() * DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)) * parent;
        let mut first = [0.0; 3];
        track.curve.sample(self.clip.range().start, &mut first);
        let first = DVec3::from(first.map(f64::from));
        let mut keys = Keys::of(track);
        let cubic = keys.each() > 3;
        for (i, v) in keys.values.chunks_mut(3).enumerate() {
            let own = DVec3::new(v[0] as f64, v[1] as f64, v[2] as f64);
            let from = if !cubic || i % 3 == 1 { first } else { DVec3::ZERO };
            v.copy_from_slice(&(own - flat * (own - from)).as_vec3().to_array());
        }
        Track { target: track.target.clone(), curve: keys.curve() }
    }

    /// What is left of a channel on the spot, sampled.
    fn placed(&self, track: &Track, motion: &RootMotion, times: &[Moment]) -> Track {
        let mut values = vec![];
        let mut last = DQuat::IDENTITY;
        let turns = !matches!(track.target, Target::Translation(_));
        for (k, t) in times.iter().enumerate() {
            let (rotation, translation) = self.local(t.1, &(motion.translations[k], motion.yaw[k]));
            if turns {
                last = nearer(last, rotation);
                values.extend(last.as_quat().to_array());
            } else {
                values.extend(translation.as_vec3().to_array());
            }
        }
        let target = if turns { Target::Rotation(self.bone) } else { track.target.clone() };
        let width = if turns { 4 } else { 3 };
        let curve = Curve::new(motion.times.clone(), values, width, Interpolation::Linear);
        Track { target, curve: curve.expect("moments in order") }
    }
}

/// The turn of a frame, whatever its scale.
fn turn(m: &DMat3) -> DQuat {
    let unit = |v: DVec3| v.try_normalize().unwrap_or(DVec3::ZERO);
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    let axes = DMat3::from_cols(unit(m.x_axis) * sign, unit(m.y_axis) * sign, unit(m.z_axis) * sign);
    let q = DQuat::from_mat3(&axes).normalize();
    if q.is_finite() { q } else { DQuat::IDENTITY }
}

fn nearer(to: DQuat, q: DQuat) -> DQuat {
    if q.dot(to) < 0.0 { -q } else { q }
}
