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

/// Finest steps in one of a clip's own: near rest a bone's twists may turn so fast that it needs more keys.
const FINE: usize = 4;

/// How far a rotation halfway between two keys may be off before a bone gets twice as many, radians.
const TOLERANCE: f64 = 0.002;

/// Sample `stance` at `n` equal steps of a clip of `seconds`; its argument runs from 0 to 1. A loop ends as it begins.
pub fn clip<'a>(
    name: &str,
    bones: &'a Bones,
    seconds: f64,
    n: usize,
    repeats: bool,
    stance: impl Fn(f64) -> Stance<'a>,
) -> Clip {
    let fine = n * FINE;
    let phase = |k: usize| if repeats && k == fine { 0.0 } else { k as f64 / fine as f64 };
    let samples: Vec<Stance> = (0..=fine).map(|k| stance(phase(k))).collect();
    let time = |k: usize| round(seconds * k as f64 / fine as f64, 4);
    let coarse: Vec<(f64, &Stance)> =
        samples.iter().enumerate().step_by(FINE).map(|(k, s)| (time(k), s)).collect();
    let mut tracks = Vec::new();
    for bone in 0..bones.list.len() {
        tracks.extend(rotation_track(bones, bone, &samples, &time));
        tracks.extend(offset_track(bones, bone, &coarse));
        tracks.extend(scale_track(bones, bone, &coarse));
    }
    Clip {
        name: name.into(),
        repeats,
        interpolation: Interpolation::CatmullRom,
        tangents: Tangents::Notes,
        tracks,
        ..Clip::default()
    }
}

fn rotation_track(
    bones: &Bones,
    bone: usize,
    samples: &[Stance],
    time: &dyn Fn(usize) -> f64,
) -> Option<Track> {
    // Turns in the bone's own frame, and the coarsest keys that follow them.
    let frame = bones.frames[bone];
    let turns: Vec<DQuat> = samples.iter().map(|s| frame.conjugate() * s.turns[bone] * frame).collect();
    let good = |step: &usize| *step == 1 || midway_error(&turns, &triples(&turns, *step), *step) < TOLERANCE;
    let step = [4, 2, 1].into_iter().find(good).unwrap_or(1);

    let row = |(k, theta): (usize, &[f64; 3])| {
        let mut row = vec![time(k * step)];
        row.extend(theta.map(|a| round(a.to_degrees(), 2)));
        row
    };
    let rows: Vec<Vec<f64>> = triples(&turns, step).iter().enumerate().map(row).collect();
    let moves = rows.iter().any(|r| r[1..].iter().any(|a| a.abs() > 0.0));
    let rows = if constant(&rows) { rows[..1].to_vec() } else { rows };
    moves.then(|| Track { bone: bones.list[bone].name.clone(), xzx_deg: Some(rows), ..Default::default() })
}

/// Unwrapped triples of every `step`-th turn.
fn triples(turns: &[DQuat], step: usize) -> Vec<[f64; 3]> {
    let mut out: Vec<[f64; 3]> = Vec::new();
    for q in turns.iter().step_by(step) {
        let previous = out.last().copied().unwrap_or_default();
        let theta = euler::xzx_from_rotation_f64(*q, Some(previous));
        out.push(euler::unwrap_xzx(theta, previous));
    }
    out
}

/// The largest angle, halfway between two keys of a loop, between the turns and the Catmull-Rom curve through the keys.
fn midway_error(turns: &[DQuat], triples: &[[f64; 3]], step: usize) -> f64 {
    // Keys beyond the ends lie across the seam, whole turns away.
    let last = triples.len() - 1;
    let key = |k: usize, i: usize| match k {
        0 => triples[last - 1][i] - (triples[last][i] - triples[0][i]),
        k if k > last + 1 => triples[1][i] + (triples[last][i] - triples[0][i]),
        k => triples[k - 1][i],
    };
    let error = |k: usize| {
        let at = |i| (9.0 * (key(k + 1, i) + key(k + 2, i)) - key(k, i) - key(k + 3, i)) / 16.0;
        let d = euler::rotation_from_xzx_f64([0, 1, 2].map(at)).conjugate() * turns[k * step + step / 2];
        2.0 * d.xyz().length().atan2(d.w.abs())
    };
    (0..last).map(error).fold(0.0, f64::max)
}

fn offset_track(bones: &Bones, bone: usize, samples: &[(f64, &Stance)]) -> Option<Track> {
    let parent = bones.parents[bone].map_or(DQuat::IDENTITY, |p| bones.frames[p]);
    let rows = rows(samples, |s| parent.conjugate() * s.offsets[bone]);
    let moves = rows.iter().any(|r| r[1..].iter().any(|x| *x != 0.0));
    moves.then(|| Track { bone: bones.list[bone].name.clone(), offset: Some(rows), ..Default::default() })
}

fn scale_track(bones: &Bones, bone: usize, samples: &[(f64, &Stance)]) -> Option<Track> {
    let rows = rows(samples, |s| s.scales[bone]);
    let moves = rows.iter().any(|r| r[1..].iter().any(|x| *x != 1.0));
    moves.then(|| Track { bone: bones.list[bone].name.clone(), scale: Some(rows), ..Default::default() })
}

/// One key a sample, or a single one if nothing changes.
fn rows(samples: &[(f64, &Stance)], value: impl Fn(&Stance) -> DVec3) -> Vec<Vec<f64>> {
    let row = |(t, s): &(f64, &Stance)| {
        let mut row = vec![*t];
        row.extend(value(s).to_array().map(|x| round(x, 4)));
        row
    };
    let rows: Vec<Vec<f64>> = samples.iter().map(row).collect();
    if constant(&rows) { rows[..1].to_vec() } else { rows }
}

fn constant(rows: &[Vec<f64>]) -> bool {
    rows.iter().all(|r| r[1..] == rows[0][1..])
}

/// `3u² − 2u³` between 0 and 1.
pub fn ease(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}
