//! One track on its way from one form into the other.

use super::Form;
use crate::clip::{Curve, Interpolation};
use crate::math::{euler, rotation};
use crate::skeleton::{BoneId, Skeleton};
use glam::{DQuat, Quat, Vec3};
use std::f64::consts::TAU;

/// Keys of a track beyond which no piece is halved any more: what turns a billion times is no clip.
const MOST: usize = 100_000;

/// How often a piece is halved.
const DEPTH: u32 = 20;

/// Places within a piece at which both paths are compared.
const LOOKS: usize = 8;

/// Three angles, or a quaternion.
type Key = [f64; 4];

/// One track on its way from one form into the other. `rotation = left · turn · right⁻¹`, where the angles are of `turn`.
pub(super) struct Path<'a> {
    source: &'a Curve,
    form: Form,
    left: DQuat,
    right: DQuat,
    /// For each key of the source, the difference of the twists of the next one that is bent.
    ahead: Vec<f64>,
    allowed: f64,
    /// Keys may be added between those of the source.
    halve: bool,
    times: Vec<f64>,
    keys: Vec<Key>,
}

impl<'a> Path<'a> {
    pub fn new(skeleton: &Skeleton, bone: BoneId, source: &'a Curve, form: Form, halve: bool) -> Self {
        let right = skeleton.aim(bone).as_dquat().normalize();
        let left = skeleton.rest(bone).rotation.as_dquat().normalize() * right;
        Self { source, form, left, right, ahead: vec![], allowed: 0.0, halve, times: vec![], keys: vec![] }
    }

    pub fn follow(mut self, allowed: f64) -> Curve {
        self.allowed = allowed;
        let n = self.source.times().len();
        if self.form == Form::Angles {
            self.look_ahead();
        }
        for k in 0..n {
            let (t, end) = (self.source.times()[k], self.end(k));
            let before = self.times.last().copied();
            let split = 0.5 * self.ahead.first().unwrap_or(&0.0);
            let from = self.keys.last().copied().unwrap_or([-split, 0.0, split, 1.0]);
            match before {
                Some(before) if before < t && self.source.interpolation() != Interpolation::Hold => {
                    self.piece(from, [before, t], end, k, 0);
                }
                _ => {
                    let key = self.choices(end, from)[0];
                    self.push(t, key);
                }
            }
        }
        let held = self.source.interpolation() == Interpolation::Hold;
        let kind = if held { Interpolation::Hold } else { Interpolation::Linear };
        let width = if self.form == Form::Angles { 3 } else { 4 };
        let values = self.keys.iter().flat_map(|k| k[..width].iter().map(|v| *v as f32)).collect();
        Curve::new(self.times, values, width, kind).expect("keys of a curve, in order")
    }

    /// What the split of the twists will be once the bone is bent, at each key: backwards, and the last split goes on.
    fn look_ahead(&mut self) {
        let n = self.source.times().len();
        let bent = |k: usize| {
            let t = euler::xzx_from_rotation_f64(self.end(k), None);
            let split = t[2] - t[0];
            (t[1] > self.slack().max(1e-6)).then(|| split - TAU * (split / TAU).round())
        };
        let splits: Vec<Option<f64>> = (0..n).map(bent).collect();
        let mut next = splits.iter().rev().flatten().next().copied().unwrap_or(0.0);
        let mut ahead = vec![0.0; n];
        for k in (0..n).rev() {
            next = splits[k].unwrap_or(next);
            ahead[k] = next;
        }
        self.ahead = ahead;
    }

    /// Radians of a bend that may be left out to keep the twists as they are.
    fn slack(&self) -> f64 {
        0.3 * self.allowed
    }

    fn push(&mut self, t: f64, key: Key) {
        self.times.push(t);
        self.keys.push(key);
    }

    /// From the last key to `end`: one piece if that holds, else two halves.
    fn piece(&mut self, from: Key, [t0, t1]: [f64; 2], end: DQuat, k: usize, depth: u32) {
        let mut choices = self.choices(end, from);
        if depth == 0
            && let Some(swung) = self.swung(from, end, k)
        {
            choices.insert(0, swung);
        }
        let fits = choices.iter().find(|c| self.fits(from, **c, end, [t0, t1])).copied();
        // Halves lie at times that single precision holds, as files do.
        let middle = (0.5 * (t0 + t1)) as f32 as f64;
        let whole = !self.halve || depth == DEPTH || self.times.len() >= MOST || middle <= t0 || middle >= t1;
        if let Some(key) = fits.or(whole.then(|| self.choices(end, from)[0])) {
            return self.push(t1, key);
        }
        self.piece(from, [t0, middle], self.at(middle), k, depth + 1);
        let half = self.keys[self.keys.len() - 1];
        self.piece(half, [middle, t1], end, k, depth + 1);
    }

    /// At rest from key to key: the twists swing on to where the next bend wants them, which moves nothing.
    fn swung(&self, from: Key, end: DQuat, k: usize) -> Option<Key> {
        let rests = |t2: f64| (0.5 * t2).sin().abs() <= (0.5 * self.slack()).sin().max(1e-9);
        let straight = euler::xzx_from_rotation_f64(end, None);
        if self.form == Form::Quaternions || !rests(from[1]) || !rests(straight[1]) {
            return None;
        }
        let (sigma, delta) = (from[2] + from[0], from[2] - from[0]);
        let delta = self.ahead[k] - TAU * ((self.ahead[k] - delta) / TAU).round();
        let previous = [0.5 * (sigma - delta), from[1], 0.5 * (sigma + delta)];
        Some(angles(euler::nearest_xzx(end, previous, self.slack().max(1e-9))[0]))
    }

    /// Ways to write a rotation, the nearest to the key before first.
    fn choices(&self, q: DQuat, from: Key) -> Vec<Key> {
        match self.form {
            Form::Angles => {
                let all = euler::nearest_xzx(q, [from[0], from[1], from[2]], self.slack().max(1e-9));
                all.map(angles).to_vec()
            }
            Form::Quaternions => {
                let q = if q.dot(DQuat::from_array(from)) < 0.0 { -q } else { q };
                vec![q.as_quat().as_dquat().to_array()]
            }
        }
    }

    /// Whether the straight piece between two keys follows the source.
    fn fits(&self, from: Key, to: Key, end: DQuat, [t0, t1]: [f64; 2]) -> bool {
        let near = |u: f64, q: DQuat| angle(self.between(from, to, u), q) <= self.allowed;
        let time = |i: usize| t0 + (t1 - t0) * i as f64 / LOOKS as f64;
        near(1.0, end)
            && self.turned(t0, t1) < 2.0
            && (1..LOOKS).all(|i| near(i as f64 / LOOKS as f64, self.at(time(i))))
    }

    /// Radians that angles of the source pass through between two times, at least; an arc would cut them short.
    fn turned(&self, t0: f64, t1: f64) -> f64 {
        if self.form == Form::Angles {
            return 0.0;
        }
        let at = |i: usize| {
            let mut v = [0.0; 3];
            // Just before the end: there may be another key at the same time.
            let u = if i == LOOKS { 1.0 - 1e-9 } else { i as f64 / LOOKS as f64 };
            self.source.sample(t0 + (t1 - t0) * u, &mut v);
            Vec3::from_array(v).as_dvec3()
        };
        (0..LOOKS).map(|i| (at(i + 1) - at(i)).abs().element_sum()).sum()
    }

    fn between(&self, a: Key, b: Key, u: f64) -> DQuat {
        match self.form {
            Form::Angles => euler::rotation_from_xzx_f64([0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * u)),
            Form::Quaternions => {
                let (a, b) = (DQuat::from_array(a), DQuat::from_array(b));
                a.slerp(if a.dot(b) < 0.0 { -b } else { b }, u)
            }
        }
    }

    /// The source at a time between its keys.
    fn at(&self, t: f64) -> DQuat {
        match self.form {
            Form::Angles => self.turn(self.source.sample_rotation(t)),
            Form::Quaternions => {
                let mut v = [0.0; 3];
                self.source.sample(t, &mut v);
                self.whole(v)
            }
        }
    }

    /// The source at its key `k`, also where another key follows at the same time.
    fn end(&self, k: usize) -> DQuat {
        let v = self.source.value(k);
        match self.form {
            Form::Angles => self.turn(rotation::unit(Quat::from_slice(v))),
            Form::Quaternions => self.whole([v[0], v[1], v[2]]),
        }
    }

    fn turn(&self, q: Quat) -> DQuat {
        self.left.conjugate() * q.as_dquat() * self.right
    }

    fn whole(&self, theta: [f32; 3]) -> DQuat {
        self.left * euler::rotation_from_xzx_f64(theta.map(f64::from)) * self.right.conjugate()
    }
}

/// Angles as they will be stored.
fn angles(t: [f64; 3]) -> Key {
    let [a, b, c] = t.map(|x| x as f32 as f64);
    [a, b, c, 0.0]
}

fn angle(a: DQuat, b: DQuat) -> f64 {
    let d = a.conjugate() * b;
    2.0 * d.xyz().length().atan2(d.w.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::BoneDesc;
    use crate::test_rng::Rng;
    use glam::DVec3;

    fn bone() -> Skeleton {
        let mut desc = BoneDesc { length: 1.0, ..BoneDesc::new("bone") };
        desc.rest.rotation = Quat::from_rotation_y(0.7);
        desc.aim = Quat::from_rotation_z(-1.2);
        Skeleton::new(vec![desc]).unwrap().0
    }

    fn rotations(keys: &[DQuat], kind: Interpolation) -> Curve {
        let values = keys.iter().flat_map(|q| q.as_quat().to_array()).collect();
        Curve::new((0..keys.len()).map(|k| k as f64).collect(), values, 4, kind).unwrap()
    }

    fn followed(source: &Curve, form: Form, allowed: f64) -> Curve {
        Path::new(&bone(), BoneId(0), source, form, true).follow(allowed)
    }

    /// The largest angle between what two tracks of the bone show.
    fn apart(a: (&Curve, Form), b: (&Curve, Form), looks: usize) -> f64 {
        let skeleton = bone();
        let range = a.0.range().unwrap();
        let whole = |(c, of): (&Curve, Form), t: f64| match of {
            Form::Angles => Path::new(&skeleton, BoneId(0), c, Form::Quaternions, true).at(t),
            Form::Quaternions => c.sample_rotation(t).as_dquat(),
        };
        (0..=looks)
            .map(|i| range.start + range.duration() * i as f64 / looks as f64)
            .map(|t| angle(whole(a, t), whole(b, t)))
            .fold(0.0, f64::max)
    }

    #[test]
    fn jitter_about_rest_neither_flips_nor_needs_many_keys() {
        let mut rng = Rng::new(7);
        let rest = bone().rest(BoneId(0)).rotation.as_dquat();
        for size in [1e-4, 1e-2, 0.3] {
            let (mut keys, mut largest) = (0, 0.0_f64);
            for _ in 0..200 {
                let jitter = |rng: &mut Rng| {
                    let axis = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
                    rest * DQuat::from_axis_angle(axis.normalize(), rng.range(-size, size))
                };
                let list: Vec<DQuat> = (0..6).map(|_| jitter(&mut rng)).collect();
                let source = rotations(&list, Interpolation::Linear);
                let curve = followed(&source, Form::Angles, 1e-3);
                largest = largest.max(apart((&source, Form::Quaternions), (&curve, Form::Angles), 1000));
                keys += curve.times().len();
            }
            assert!(largest < 1.05e-3, "{size}: {largest}");
            let most = if size < 1e-3 { 6 } else { 200 };
            assert!(keys <= 200 * most, "{size}: {keys} keys");
        }
    }

    #[test]
    fn whole_turns_and_cubics_come_back() {
        let turn = Curve::new(
            vec![0.0, 1.0, 2.0],
            vec![0.0, 0.2, 0.0, 9.0, 0.4, 30.0, 9.0, -0.5, 30.0],
            3,
            Interpolation::Linear,
        );
        let turn = turn.unwrap();
        let back = followed(&turn, Form::Quaternions, 1e-4);
        assert!(apart((&turn, Form::Angles), (&back, Form::Quaternions), 5000) < 1.05e-4);
        let again = followed(&back, Form::Angles, 1e-4);
        assert!(apart((&turn, Form::Angles), (&again, Form::Angles), 5000) < 2.1e-4);
        // Angles that turn on and on are found again as such.
        assert!(
            (again.value(again.times().len() - 1)[0] + again.value(again.times().len() - 1)[2]).abs() > 30.0
        );
        let mut rng = Rng::new(8);
        let cubic: Vec<f32> = (0..48).map(|_| rng.unit()).collect();
        let cubic = Curve::new((0..4).map(f64::from).collect(), cubic, 4, Interpolation::Hermite).unwrap();
        let angles = followed(&cubic, Form::Angles, 1e-4);
        assert!(apart((&cubic, Form::Quaternions), (&angles, Form::Angles), 3000) < 1.1e-4);
    }

    #[test]
    fn steps_and_cuts_stay_what_they_are() {
        let keys = [0.1, 2.9, -2.9].map(|a| DQuat::from_rotation_x(a) * DQuat::from_rotation_z(0.2));
        let held = followed(&rotations(&keys, Interpolation::Hold), Form::Angles, 1e-3);
        assert_eq!((held.interpolation(), held.times()), (Interpolation::Hold, &[0.0, 1.0, 2.0][..]));
        let values = keys.iter().flat_map(|q| q.as_quat().to_array()).collect();
        let cut = Curve::new(vec![0.0, 1.0, 1.0], values, 4, Interpolation::Linear).unwrap();
        let angles = followed(&cut, Form::Angles, 1e-3);
        let times = angles.times();
        assert_eq!(times[times.len() - 2..], [1.0, 1.0]);
        assert!(apart((&cut, Form::Quaternions), (&angles, Form::Angles), 999) < 1.05e-3);
    }

    #[test]
    fn a_billion_turns_end() {
        let wild =
            Curve::new(vec![0.0, 1.0], vec![0.0, 0.0, 0.0, 1e30, -1e30, 1e9], 3, Interpolation::Linear)
                .unwrap();
        assert!(followed(&wild, Form::Quaternions, 1e-3).times().len() <= MOST + DEPTH as usize + 2);
    }
}
