//! Motion as functions of time, sampled into XZX keys.
//!
//! A turn is a rotation in axes that are named at rest: `G_bone = G_parent · Q_bone`, where `G` is how far a bone has
//! turned away from its rest in the world. So a nod is a turn about x whatever way the bone points.

use super::bones::Bones;
use super::round;
use glam::{DMat3, DQuat, DVec3};
use sinew::io::rig_json::{Clip, Interpolation, Tangents, Track};
use sinew::math::euler;

/// How every bone stands at one moment.
pub struct Stance<'a> {
    pub bones: &'a Bones,
    /// `Q`, in axes named at rest, against the parent.
    pub turns: Vec<DQuat>,
    /// Displacement of the head from rest, in axes named at rest, against the parent.
    pub offsets: Vec<DVec3>,
    /// Factors along the bone's own axes.
    pub scales: Vec<DVec3>,
}

impl<'a> Stance<'a> {
    pub fn rest(bones: &'a Bones) -> Self {
        let n = bones.list.len();
        Self {
            bones,
            turns: vec![DQuat::IDENTITY; n],
            offsets: vec![DVec3::ZERO; n],
            scales: vec![DVec3::ONE; n],
        }
    }

    /// Turn a bone further, by degrees about an axis named at rest.
    pub fn turn(&mut self, bone: &str, axis: DVec3, deg: f64) {
        let i = self.bones.id(bone);
        self.turns[i] = DQuat::from_axis_angle(axis.normalize(), deg.to_radians()) * self.turns[i];
    }

    /// Turn a bone by degrees about the axes x (nod), y (yaw) and z (roll), roll first.
    pub fn pose(&mut self, bone: &str, x: f64, y: f64, z: f64) {
        self.turn(bone, DVec3::Z, z);
        self.turn(bone, DVec3::X, x);
        self.turn(bone, DVec3::Y, y);
    }

    pub fn shift(&mut self, bone: &str, by: DVec3) {
        self.offsets[self.bones.id(bone)] += by;
    }

    /// `G` of a bone.
    pub fn world_turn(&self, bone: usize) -> DQuat {
        let up = self.bones.parents[bone].map_or(DQuat::IDENTITY, |p| self.world_turn(p));
        up * self.turns[bone]
    }

    /// Where a bone's head stands.
    pub fn world_head(&self, bone: usize) -> DVec3 {
        let own = self.bones.heads[bone] + self.offsets[bone];
        match self.bones.parents[bone] {
            None => own,
            Some(p) => self.world_head(p) + self.world_turn(p) * (own - self.bones.heads[p]),
        }
    }

    /// Where a point of a bone stands.
    pub fn world_point(&self, bone: usize, rest: DVec3) -> DVec3 {
        self.world_head(bone) + self.world_turn(bone) * (rest - self.bones.heads[bone])
    }

    /// Turn a bone so that it has turned by `g` in the world.
    pub fn set_world_turn(&mut self, bone: usize, g: DQuat) {
        let up = self.bones.parents[bone].map_or(DQuat::IDENTITY, |p| self.world_turn(p));
        self.turns[bone] = (up.conjugate() * g).normalize();
    }

    /// Bend two bones, one below the other, so that the lower one's tail reaches `goal`; the joint between them goes
    /// towards `pole`. What is out of reach is reached for.
    pub fn reach(&mut self, upper: &str, lower: &str, goal: DVec3, pole: DVec3) {
        let (u, l) = (self.bones.id(upper), self.bones.id(lower));
        let (a, b, c) = (self.bones.heads[u], self.bones.heads[l], self.bones.tails[l]);
        let (l1, l2) = (a.distance(b), b.distance(c));
        let from = self.world_head(u);
        let to = goal - from;
        let d = to.length().clamp((l1 - l2).abs() + 1e-4, (l1 + l2) * 0.9995);
        let dir = to.normalize();

        // The law of cosines gives the angle at the upper joint, the pole the plane.
        let side = (pole - dir * dir.dot(pole)).normalize();
        let cos = ((l1 * l1 + d * d - l2 * l2) / (2.0 * l1 * d)).clamp(-1.0, 1.0);
        let knee = from + dir * (l1 * cos) + side * (l1 * (1.0 - cos * cos).sqrt());
        let end = from + dir * d;
        let normal = side.cross(dir);

        // The same plane at rest, so that neither bone twists.
        let rest_dir = (c - a).normalize();
        let rest_side = pole - rest_dir * rest_dir.dot(pole);
        let bent = (b - a) - rest_dir * rest_dir.dot(b - a);
        let rest_side = if bent.length() > 0.02 * l1 { bent } else { rest_side };
        let rest_normal = rest_side.normalize().cross(rest_dir);
        let turn = |from: DVec3, to: DVec3| axes(to, normal) * axes(from, rest_normal).conjugate();
        self.set_world_turn(u, turn(b - a, knee - from));
        self.set_world_turn(l, turn(c - b, end - knee));
    }
}

fn axes(along: DVec3, normal: DVec3) -> DQuat {
    let x = along.normalize();
    let z = (normal - x * x.dot(normal)).normalize();
    DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize()
}

/// Sample `stance` at `n` equal steps of a clip of `seconds`; its argument runs from 0 to 1. A loop ends as it begins.
pub fn clip<'a>(
    name: &str,
    bones: &'a Bones,
    seconds: f64,
    n: usize,
    repeats: bool,
    stance: impl Fn(f64) -> Stance<'a>,
) -> Clip {
    let phase = |k: usize| if repeats && k == n { 0.0 } else { k as f64 / n as f64 };
    let samples: Vec<Stance> = (0..=n).map(|k| stance(phase(k))).collect();
    let time = |k: usize| round(seconds * k as f64 / n as f64, 4);
    let mut tracks = Vec::new();
    for bone in 0..bones.list.len() {
        tracks.extend(rotation_track(bones, bone, &samples, &time));
        tracks.extend(offset_track(bones, bone, &samples, &time));
        tracks.extend(scale_track(bones, bone, &samples, &time));
    }
    Clip {
        name: name.into(),
        repeats,
        interpolation: Interpolation::CatmullRom,
        tangents: Tangents::Notes,
        tracks,
    }
}

fn rotation_track(
    bones: &Bones,
    bone: usize,
    samples: &[Stance],
    time: &dyn Fn(usize) -> f64,
) -> Option<Track> {
    let frame = bones.frames[bone];
    let mut previous = [0.0; 3];
    let mut rows = Vec::new();
    for (k, s) in samples.iter().enumerate() {
        let local = frame.conjugate() * s.turns[bone] * frame;
        let theta = euler::xzx_from_rotation_f64(local, Some(previous));
        previous = if k == 0 { tame(theta) } else { euler::unwrap_xzx(theta, previous) };
        let mut row = vec![time(k)];
        row.extend(previous.map(|a| round(a.to_degrees(), 2)));
        rows.push(row);
    }
    let moves = rows.iter().any(|r| r[1..].iter().any(|a| a.abs() > 0.0));
    let rows = if constant(&rows) { rows[..1].to_vec() } else { rows };
    moves.then(|| Track { bone: bones.list[bone].name.clone(), xzx_deg: Some(rows), ..Default::default() })
}

/// Of the two triples of a first key, the one with the smaller twist.
fn tame(theta: [f64; 3]) -> [f64; 3] {
    euler::unwrap_xzx(theta, [0.0, 0.0, 0.0])
}

fn offset_track(
    bones: &Bones,
    bone: usize,
    samples: &[Stance],
    time: &dyn Fn(usize) -> f64,
) -> Option<Track> {
    let parent = bones.parents[bone].map_or(DQuat::IDENTITY, |p| bones.frames[p]);
    let mut rows = Vec::new();
    for (k, s) in samples.iter().enumerate() {
        let local = parent.conjugate() * s.offsets[bone];
        let mut row = vec![time(k)];
        row.extend(local.to_array().map(|x| round(x, 4)));
        rows.push(row);
    }
    let moves = rows.iter().any(|r| r[1..].iter().any(|a| a.abs() > 0.0));
    let rows = if constant(&rows) { rows[..1].to_vec() } else { rows };
    moves.then(|| Track { bone: bones.list[bone].name.clone(), offset: Some(rows), ..Default::default() })
}

fn scale_track(bones: &Bones, bone: usize, samples: &[Stance], time: &dyn Fn(usize) -> f64) -> Option<Track> {
    let row = |(k, s): (usize, &Stance)| {
        let mut row = vec![time(k)];
        row.extend(s.scales[bone].to_array().map(|x| round(x, 4)));
        row
    };
    let rows: Vec<Vec<f64>> = samples.iter().enumerate().map(row).collect();
    let moves = rows.iter().any(|r| r[1..].iter().any(|x| *x != 1.0));
    moves.then(|| Track { bone: bones.list[bone].name.clone(), scale: Some(rows), ..Default::default() })
}

fn constant(rows: &[Vec<f64>]) -> bool {
    rows.iter().all(|r| r[1..] == rows[0][1..])
}

/// `3u² − 2u³` between 0 and 1.
pub fn ease(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}
