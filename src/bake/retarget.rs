//! A clip of one character onto another: rotations by what they change in the world, from rest.
//!
//! `world_from_target = world_from_source · (world_from_source at rest)⁻¹ · world_from_target at rest`: where both stand in their rest
//! poses, frames may differ as they like. The hip goes as far as the legs are long. With [`Map::directions`] bones also point where those
//! of the source point, whatever the rest poses are (arms spread in one, hanging in the other).

use crate::character::Character;
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::fk;
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::BTreeMap;

/// Radians that the arc between two samples may be off before there is a sample between them.
const ARC: f64 = 1e-4;

/// How often the time between two keys is halved.
const DEPTH: u32 = 7;

/// Which bone moves which, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// A bone of the source, and the one of the target that follows it; each at most once.
    pub pairs: Vec<(BoneId, BoneId)>,
    /// Target metres for each of the source; `None`: the ratio of the legs.
    pub scale: Option<f64>,
    /// Turn the target's bones to where the source's point at rest. For bones with one follower only: a hip has no direction.
    pub directions: bool,
}

impl Map {
    /// Pairs by name: those given (`None`: no bone follows this one), then equal names, then names that are equal but for case,
    /// separators and what stands before a colon (`mixamorig:LeftArm` is `left_arm`). Bones point where the source's do.
    ///
    /// ```
    /// use sinew::{bake::retarget::Map, skeleton::{BoneDesc, Skeleton}};
    /// let of = |names: [&str; 2]| Skeleton::new(names.map(BoneDesc::new).to_vec()).unwrap().0;
    /// let (a, b) = (of(["mixamorig:LeftArm", "Hips"]), of(["pelvis", "left_arm"]));
    /// let [arm, hips, pelvis] = [a.find("mixamorig:LeftArm"), a.find("Hips"), b.find("pelvis")].map(Option::unwrap);
    /// let map = Map::by_names(&a, &b, &[(hips, Some(pelvis))]);
    /// assert_eq!(map.pairs, [(arm, b.find("left_arm").unwrap()), (hips, pelvis)]);
    /// ```
    pub fn by_names(source: &Skeleton, target: &Skeleton, given: &[(BoneId, Option<BoneId>)]) -> Self {
        let mut of: BTreeMap<BoneId, Option<BoneId>> = given.iter().copied().collect();
        let mut taken: Vec<BoneId> = of.values().flatten().copied().collect();
        for plain in [str::to_owned as fn(&str) -> String, bare] {
            let mut names: BTreeMap<String, Vec<BoneId>> = BTreeMap::new();
            for b in target.ids().filter(|b| !taken.contains(b)) {
                names.entry(plain(target.name(b))).or_default().push(b);
            }
            for s in source.ids() {
                let found = names.get_mut(&plain(source.name(s))).filter(|found| found.len() == 1);
                if let (false, Some(found)) = (of.contains_key(&s), found) {
                    taken.extend(&*found);
                    of.insert(s, found.pop());
                }
            }
        }
        let pairs = of.into_iter().filter_map(|(s, t)| Some((s, t?))).collect();
        Self { pairs, scale: None, directions: true }
    }
}

fn bare(name: &str) -> String {
    let own = name.rsplit(':').next().unwrap_or(name);
    own.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// A clip for the target, and how it was made.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Retargeted {
    /// Straight pieces and arcs, as many as the motion needs: to be baked.
    pub clip: Clip,
    /// Target metres for each of the source.
    pub scale: f64,
    /// Bones of the source that move in the clip, and that nothing follows.
    pub unmatched_source: Vec<BoneId>,
    /// Bones of the target that keep their rest.
    pub unmatched_target: Vec<BoneId>,
    /// Tracks of scales and morph weights, which are left out.
    pub left_out: usize,
}

/// Let a character do what a clip of another does.
///
/// # Panics
/// If the clip or the map are not of these characters.
pub fn retarget(source: &Character, clip: &Clip, target: &Character, map: &Map) -> Retargeted {
    let way = Way::new(source, clip, target, map);
    let moved = |b: BoneId| clip.tracks.iter().any(|t| bone_of(&t.target) == Some(b));
    let unmatched = |s: &BoneId| moved(*s) && !map.pairs.iter().any(|p| p.0 == *s);
    let lost = |t: &&Track| matches!(t.target, Target::Scale(_) | Target::Weights { .. });
    Retargeted {
        clip: way.clip(),
        scale: way.scale,
        unmatched_source: source.skeleton().ids().filter(unmatched).collect(),
        unmatched_target: target.skeleton().ids().filter(|t| way.of[t.index()].is_none()).collect(),
        left_out: clip.tracks.iter().filter(lost).count(),
    }
}

fn bone_of(target: &Target) -> Option<BoneId> {
    match target {
        Target::Xzx(b) | Target::Rotation(b) | Target::Translation(b) | Target::Scale(b) => Some(*b),
        Target::Weights { .. } => None,
    }
}

/// A skeleton in a pose: rotations in the world, without scales, and whole frames.
struct Stand {
    turned: Vec<DQuat>,
    world: Vec<DAffine3>,
}

impl Stand {
    fn of(character: &Character, pose: &Pose) -> Self {
        let skeleton = character.skeleton();
        let mut turned: Vec<DQuat> = Vec::with_capacity(skeleton.len());
        for b in skeleton.ids() {
            let parent = skeleton.parent(b).map_or(DQuat::IDENTITY, |p| turned[p.index()]);
            turned.push(parent * local(skeleton, pose, b));
        }
        Self { turned, world: fk::forward_f64(skeleton, pose) }
    }

    fn origin(&self, b: BoneId) -> DVec3 {
        self.world[b.index()].translation
    }
}

fn local(skeleton: &Skeleton, pose: &Pose, b: BoneId) -> DQuat {
    let q = match skeleton.fixed(b) {
        Some(m) => fk::widen(m).to_scale_rotation_translation().1,
        None => pose.locals[b.index()].rotation.as_dquat(),
    };
    if q.is_finite() { q.normalize() } else { DQuat::IDENTITY }
}

/// Everything that does not change from moment to moment.
struct Way<'a> {
    source: &'a Character,
    clip: &'a Clip,
    target: &'a Character,
    /// For each bone of the target, whom it follows.
    of: Vec<Option<BoneId>>,
    /// `(world_from_source at rest)⁻¹ · world_from_target at rest`, of those that follow.
    from: Vec<DQuat>,
    scale: f64,
    shifts: Vec<Shift>,
}

/// A bone whose origin moves.
enum Shift {
    /// The topmost: where it stands in both worlds.
    Hip { bone: BoneId, of: BoneId, stood: [DVec3; 2] },
    /// Another one, against its parent.
    Other { bone: BoneId, of: BoneId, turn: DMat3 },
}

impl<'a> Way<'a> {
    fn new(source: &'a Character, clip: &'a Clip, target: &'a Character, map: &Map) -> Self {
        let (a, b) = (source.skeleton(), target.skeleton());
        let mut of = vec![None; b.len()];
        map.pairs.iter().for_each(|(s, t)| of[t.index()] = Some(*s));
        let rests = [Stand::of(source, &source.rest_pose()), Stand::of(target, &target.rest_pose())];
        let above = |t: BoneId| {
            let up = std::iter::successors(b.parent(t), |p| b.parent(*p));
            up.into_iter().find(|p| of[p.index()].is_some())
        };
        let leader: Vec<Option<BoneId>> =
            b.ids().map(|t| above(t).filter(|_| of[t.index()].is_some())).collect();

        // Point bones with one follower where those of the source point; others go on as the bone above does.
        let mut correction = vec![DQuat::IDENTITY; b.len()];
        for t in b.ids().filter(|t| map.directions && of[t.index()].is_some()) {
            let mut followers = b.ids().filter(|f| leader[f.index()] == Some(t));
            correction[t.index()] = match (followers.next(), followers.next()) {
                (Some(f), None) => {
                    let way = |stand: &Stand, from: Option<BoneId>, to: Option<BoneId>| {
                        (stand.origin(to?) - stand.origin(from?)).try_normalize()
                    };
                    let theirs = way(&rests[0], of[t.index()], of[f.index()]);
                    let own = way(&rests[1], Some(t), Some(f));
                    own.zip(theirs)
                        .map_or(DQuat::IDENTITY, |(own, theirs)| DQuat::from_rotation_arc(own, theirs))
                }
                _ => leader[t.index()].map_or(DQuat::IDENTITY, |l| correction[l.index()]),
            };
        }
        let from = |t: BoneId| match of[t.index()] {
            Some(s) => {
                rests[0].turned[s.index()].conjugate() * correction[t.index()] * rests[1].turned[t.index()]
            }
            None => DQuat::IDENTITY,
        };
        let from = b.ids().map(from).collect();
        let mut way = Self { source, clip, target, of, from, scale: 1.0, shifts: vec![] };
        let legs = way.legs(&rests, &leader);
        way.scale = map.scale.unwrap_or(if legs[0] > 0.0 && legs[1] > 0.0 { legs[1] / legs[0] } else { 1.0 });
        let begin = Stand::of(source, &way.source_at(clip.range().start));
        for t in b.ids() {
            let Some(s) = way.of[t.index()] else { continue };
            if leader[t.index()].is_none() {
                // Captures have their rest at the origin and walk at the height of their hips.
                let [low, lift] = [rests[0].origin(s).y, begin.origin(s).y].map(|y| y > 0.5 * legs[0]);
                let stood = [(0, s), (1, t)].map(|(i, bone): (usize, BoneId)| {
                    let p = rests[i].origin(bone);
                    if !low && lift && p.y < 0.5 * legs[i] { DVec3::new(p.x, legs[i], p.z) } else { p }
                });
                way.shifts.push(Shift::Hip { bone: t, of: s, stood });
            } else if clip.tracks.iter().any(|track| track.target == Target::Translation(s)) {
                let frame = |stand: &Stand, p: Option<BoneId>| {
                    p.map_or(DMat3::IDENTITY, |p| stand.world[p.index()].matrix3)
                };
                let turn =
                    frame(&rests[1], b.parent(t)).inverse() * frame(&rests[0], a.parent(s)) * way.scale;
                let turn = if turn.is_finite() { turn } else { DMat3::IDENTITY };
                way.shifts.push(Shift::Other { bone: t, of: s, turn });
            }
        }
        way
    }

    /// Lengths of source and target from the topmost pair to the one that stands lowest in the target.
    fn legs(&self, rests: &[Stand; 2], leader: &[Option<BoneId>]) -> [f64; 2] {
        let b = self.target.skeleton();
        let matched = b.ids().filter(|t| self.of[t.index()].is_some());
        let foot = matched.min_by(|x, y| rests[1].origin(*x).y.total_cmp(&rests[1].origin(*y).y));
        let mut legs = [0.0; 2];
        let mut at = foot;
        while let Some((t, up)) = at.and_then(|t| Some((t, leader[t.index()]?))) {
            let length = |stand: &Stand, x: Option<BoneId>, y: Option<BoneId>| {
                x.zip(y).map_or(0.0, |(x, y)| stand.origin(x).distance(stand.origin(y)))
            };
            legs[0] += length(&rests[0], self.of[t.index()], self.of[up.index()]);
            legs[1] += length(&rests[1], Some(t), Some(up));
            at = Some(up);
        }
        legs
    }

    fn source_at(&self, t: f64) -> Pose {
        let mut pose = self.source.rest_pose();
        self.clip.sample(self.source.skeleton(), t, &mut pose);
        pose
    }

    /// Local rotations of bones that follow, and local origins of those that move.
    fn at(&self, t: f64) -> Moment {
        let pose = self.source_at(t);
        let stand = Stand::of(self.source, &pose);
        let skeleton = self.target.skeleton();
        let rest = self.target.rest_pose();
        let (mut world, mut frames) = (Vec::<DQuat>::new(), Vec::<DAffine3>::new());
        let mut out = Moment { turns: vec![], origins: vec![] };
        for b in skeleton.ids() {
            let up = skeleton.parent(b);
            let parent = up.map_or(DQuat::IDENTITY, |p| world[p.index()]);
            let frame = up.map_or(DAffine3::IDENTITY, |p| frames[p.index()]);
            let q = match self.of[b.index()].filter(|_| skeleton.fixed(b).is_none()) {
                Some(s) => {
                    let q = (parent.conjugate() * stand.turned[s.index()] * self.from[b.index()]).normalize();
                    out.turns.push(q);
                    q
                }
                None => local(skeleton, &rest, b),
            };
            let trs = rest.locals[b.index()];
            let mut origin = trs.translation.as_dvec3();
            for shift in &self.shifts {
                match shift {
                    Shift::Hip { bone, of, stood } if *bone == b => {
                        let place = stood[1] + self.scale * (stand.origin(*of) - stood[0]);
                        let inside = frame.inverse().transform_point3(place);
                        origin = if inside.is_finite() { inside } else { origin };
                        out.origins.push(origin);
                    }
                    Shift::Other { bone, of, turn } if *bone == b => {
                        let rest = self.source.skeleton().rest(*of).translation;
                        origin += *turn * (pose.locals[of.index()].translation - rest).as_dvec3();
                        out.origins.push(origin);
                    }
                    _ => {}
                }
            }
            let own = match skeleton.fixed(b) {
                Some(m) => fk::widen(m),
                None => DAffine3::from_scale_rotation_translation(trs.scale.as_dvec3(), q, origin),
            };
            world.push(parent * q);
            frames.push(frame * own);
        }
        out
    }

    fn clip(&self) -> Clip {
        let mut times: Vec<f64> = self.clip.tracks.iter().flat_map(|t| t.curve.times()).copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut keys: Vec<(f64, Moment)> = vec![];
        for (i, &t) in times.iter().enumerate() {
            let now = self.at(t);
            if let Some(&before) = i.checked_sub(1).map(|k| &times[k]) {
                // Where something jumps, what was before it counts up to it.
                let close = t - 1e-6 * (t - before);
                let cut = self.jumps(t).then(|| self.at(close));
                let begin = keys[keys.len() - 1].1.clone();
                self.fill(&mut keys, (before, &begin), (t, cut.as_ref().unwrap_or(&now)), DEPTH);
                keys.extend(cut.map(|cut| (t, cut)));
            }
            keys.push((t, now));
        }
        let skeleton = self.target.skeleton();
        let followers =
            skeleton.ids().filter(|b| self.of[b.index()].is_some() && skeleton.fixed(*b).is_none());
        let movers = skeleton.ids().filter(|b| {
            self.shifts
                .iter()
                .any(|s| matches!(s, Shift::Hip { bone, .. } | Shift::Other { bone, .. } if bone == b))
        });
        let times: Vec<f64> = keys.iter().map(|k| k.0).collect();
        let mut tracks = vec![];
        let mut push = |target: Target, values: Vec<f32>, width: usize| {
            let curve = Curve::new(times.clone(), values, width, Interpolation::Linear);
            // A clip without keys, or whose numbers single precision does not hold, has no tracks.
            tracks.extend(curve.ok().map(|curve| Track { target, curve }));
        };
        for (i, b) in followers.enumerate() {
            let values = keys.iter().flat_map(|k| k.1.turns[i].as_quat().to_array()).collect();
            push(Target::Rotation(b), values, 4);
        }
        for (i, b) in movers.enumerate() {
            let values = keys.iter().flat_map(|k| k.1.origins[i].as_vec3().to_array()).collect();
            push(Target::Translation(b), values, 3);
        }
        Clip { name: self.clip.name.clone(), tracks }
    }

    fn jumps(&self, t: f64) -> bool {
        self.clip.tracks.iter().any(|track| {
            let times = track.curve.times();
            let k = times.partition_point(|&k| k < t);
            let held = track.curve.interpolation() == Interpolation::Hold;
            times.get(k) == Some(&t) && (held || times.get(k + 1) == Some(&t))
        })
    }

    /// Moments between two, where arcs and straight lines between them are not the way.
    fn fill(&self, keys: &mut Vec<(f64, Moment)>, a: (f64, &Moment), b: (f64, &Moment), depth: u32) {
        let t = (0.5 * (a.0 + b.0)) as f32 as f64;
        if depth == 0 || t <= a.0 || t >= b.0 {
            return;
        }
        let now = self.at(t);
        if now.between(a.1, b.1, (t - a.0) / (b.0 - a.0)) {
            return;
        }
        self.fill(keys, a, (t, &now), depth - 1);
        keys.push((t, now.clone()));
        self.fill(keys, (t, &now), b, depth - 1);
    }
}

#[derive(Clone)]
struct Moment {
    turns: Vec<DQuat>,
    origins: Vec<DVec3>,
}

impl Moment {
    /// Whether this is what arcs and lines between two others give.
    fn between(&self, a: &Self, b: &Self, u: f64) -> bool {
        let turned = self.turns.iter().zip(a.turns.iter().zip(&b.turns)).all(|(q, (a, b))| {
            let b = if a.dot(*b) < 0.0 { -*b } else { *b };
            let d = a.slerp(b, u).conjugate() * *q;
            2.0 * d.xyz().length() <= ARC
        });
        turned
            && self
                .origins
                .iter()
                .zip(a.origins.iter().zip(&b.origins))
                .all(|(p, (a, b))| p.distance(a.lerp(*b, u)) <= ARC * (a.distance(*b) + 1e-3 * p.length()))
    }
}
