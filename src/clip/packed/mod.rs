//! The packed form of a clip: a few thousand bytes that play as they are.
//!
//! Every channel is a list of integers, times a step. Where a curve is smooth they are the coefficients of a uniform cubic B-spline, so
//! that a second needs as many as it has wiggles; where it has corners they are values at even times, or at times of their own. A
//! rotation is `base · (p, 1)`, normalised, with `p = tan(θ/2)·axis`: a spline of `p` is a spline of quaternions, which
//! [`Packed::to_clip`] says exactly. All checks are made once, when bytes are read; any moment is then found without those before it.

mod bits;
mod draft;
mod lane;

pub(crate) use draft::{Base, Draft, Form as DraftForm, Grid, base_of, encode, size, step_of};

use super::{Clip, Curve, Interpolation, Target, Track};
use crate::math::rotation;
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use crate::time::Range;
use bits::{BitReader, Bits};
use glam::{DQuat, DVec3, Quat, Vec3};
use lane::Lane;

/// First byte of a packed clip.
const VERSION: u32 = 1;

/// Numbers that a clip may unfold to whatever its size, and so many more for each of its bits.
const UNFOLDED: [usize; 2] = [1 << 20, 256];

/// A clip that plays from its packed bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    bits: Bits,
    range: Range,
    tracks: Vec<Channel>,
}

/// Why bytes are no packed clip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PackedError {
    /// Another version, or something else.
    #[error("a packed clip of version {found}; expected version {VERSION}")]
    Version {
        /// The first byte.
        found: u32,
    },
    /// Bytes that end too early or make no sense.
    #[error("packed clip, track {track}: its {what} is cut off or out of bounds")]
    Broken {
        /// Which track; the number of tracks is read before the first.
        track: usize,
        /// What was being read.
        what: &'static str,
    },
}

/// How the numbers of a track stand in time.
#[derive(Clone, Debug, PartialEq)]
enum Form {
    /// At times of their own; the flag says that they hold.
    Keys(Vec<f64>, bool),
    /// At even times from the first to the last, so many steps apart, with straight lines between.
    Even(usize),
    /// The coefficients of a cubic over so many even pieces.
    Cubic(usize),
}

#[derive(Clone, Debug, PartialEq)]
struct Channel {
    target: Target,
    form: Form,
    step: f64,
    /// What a rotation of three numbers is based on.
    base: Option<DQuat>,
    lanes: Vec<Lane>,
}

/// Which numbers a moment needs, and how much of each.
struct Taps {
    first: usize,
    count: usize,
    weights: [f64; 4],
}

impl Packed {
    /// Check bytes and make them ready to play. Bones and weights have the numbers of the character that was packed.
    ///
    /// # Errors
    /// [`PackedError`]; no bytes make it panic, hang or take more memory than 2 kB for each of them and 8 MB.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PackedError> {
        let bits = Bits::new(bytes);
        let mut r = BitReader { bits: &bits, at: 0 };
        let mut place = (0, "head");
        match r.get(8) {
            Some(VERSION) => {}
            found => return Err(PackedError::Version { found: found.unwrap_or(0) }),
        }
        let read = Self::read(&mut r, &mut place);
        let (range, tracks) = read.ok_or(PackedError::Broken { track: place.0, what: place.1 })?;
        Ok(Self { bits, range, tracks })
    }

    fn read(r: &mut BitReader, place: &mut (usize, &'static str)) -> Option<(Range, Vec<Channel>)> {
        let start = if r.get(1)? == 1 { r.seconds()? } else { 0.0 };
        let range = Range { start, end: r.seconds()? };
        let grid = match r.get(1)? {
            1 => Some(Grid { start, single: r.get(1)? == 1, rate: r.seconds()? }),
            _ => None,
        };
        if !range.duration().is_finite() || range.end < range.start || grid.is_some_and(|g| g.rate <= 0.0) {
            return None;
        }
        let mut targets = vec![];
        for kind in 0..5 {
            let mut next = 0_u32;
            for _ in 0..r.golomb(0)? {
                next = next.checked_add(r.golomb(0)?)?;
                let width = if kind == 4 { r.golomb(2)? as usize + 1 } else { 3 };
                targets.push((target(kind, next), width));
                next = next.checked_add(1)?;
            }
        }
        let mut room = UNFOLDED[0] + UNFOLDED[1] * r.bits.len();
        let mut tracks: Vec<Channel> = vec![];
        let mut times = vec![];
        for (i, (target, width)) in targets.into_iter().enumerate() {
            *place = (i, "times");
            let track = Channel::read(r, target, width, &mut times, (range, grid), &mut room, place)?;
            tracks.push(track);
        }
        Some((range, tracks))
    }

    /// The bytes that it was read from.
    pub fn bytes(&self) -> &[u8] {
        self.bits.bytes()
    }

    /// From the first moment to the last, seconds.
    pub fn range(&self) -> Range {
        self.range
    }

    /// What is moved, and how many numbers each takes.
    pub fn targets(&self) -> impl Iterator<Item = (&Target, usize)> + '_ {
        self.tracks.iter().map(|t| (&t.target, t.width()))
    }

    /// The same clip for a character whose bones and weights have other numbers: tracks that `of` has no target for are left out.
    pub fn onto(mut self, of: impl Fn(&Target) -> Option<Target>) -> Self {
        self.tracks.retain_mut(|t| of(&t.target).map(|new| t.target = new).is_some());
        self
    }

    /// Write the clip at time `t` (seconds) over `pose`, which the caller set to rest; what no track moves is left.
    ///
    /// # Panics
    /// If a track's bone or run of weights is not in `pose`.
    pub fn sample(&self, skeleton: &Skeleton, t: f64, pose: &mut Pose) {
        let u = ((t - self.range.start) / self.range.duration()).clamp(0.0, 1.0);
        let u = if u.is_nan() { 0.0 } else { u };
        for track in &self.tracks {
            let taps = track.taps(t, u);
            match track.target {
                Target::Rotation(b) => {
                    pose.locals[b.index()].rotation = track.rotation(&self.bits, &taps);
                }
                Target::Weights { first } => {
                    for (lane, w) in
                        track.lanes.iter().zip(&mut pose.weights[first..first + track.lanes.len()])
                    {
                        *w = track.number(&self.bits, lane, &taps) as f32;
                    }
                }
                Target::Xzx(b) => pose.set_xzx(skeleton, b, track.vector(&self.bits, &taps)),
                Target::Translation(b) => {
                    pose.locals[b.index()].translation = track.vector(&self.bits, &taps)
                }
                Target::Scale(b) => pose.locals[b.index()].scale = track.vector(&self.bits, &taps),
            }
        }
    }

    /// The same motion as keys: even and own times as straight lines and holds, cubics as cubics with slopes.
    pub fn to_clip(&self, name: &str) -> Clip {
        let track = |c: &Channel| Track { target: c.target.clone(), curve: c.curve(&self.bits, self.range) };
        Clip { name: name.into(), tracks: self.tracks.iter().map(track).collect() }
    }
}

fn target(kind: u32, index: u32) -> Target {
    match kind {
        0 => Target::Rotation(BoneId(index)),
        1 => Target::Translation(BoneId(index)),
        2 => Target::Scale(BoneId(index)),
        3 => Target::Xzx(BoneId(index)),
        _ => Target::Weights { first: index as usize },
    }
}

impl Form {
    /// Numbers of each lane.
    fn count(&self) -> usize {
        match self {
            Form::Keys(times, _) => times.len(),
            Form::Even(n) => n + 1,
            Form::Cubic(n) => n + 3,
        }
    }
}

impl Channel {
    fn read(
        r: &mut BitReader,
        target: Target,
        width: usize,
        known: &mut Vec<f64>,
        (range, grid): (Range, Option<Grid>),
        room: &mut usize,
        place: &mut (usize, &'static str),
    ) -> Option<Self> {
        let form = match r.get(2)? {
            0 => Form::Keys(vec![range.start], true),
            1 => Form::Keys(read_times(r, known, grid)?, r.get(1)? == 1),
            2 => Form::Even(r.golomb(5)? as usize + 1),
            _ => Form::Cubic(r.golomb(5)? as usize + 1),
        };
        place.1 = "base";
        let turns = matches!(target, Target::Rotation(_));
        let based = turns && r.get(1)? == 1;
        let base = if based { Some(read_base(r)?) } else { None };
        place.1 = "numbers";
        let width = if turns && !based { 4 } else { width };
        *room = room.checked_sub(form.count().checked_mul(width)?)?;
        // A rotation that stays is all base.
        let still = based && form == Form::Keys(vec![range.start], true);
        let step = if still { 0.0 } else { step_of(r.get(8)? as u8) };
        let count = form.count();
        let lanes =
            (0..if still { 0 } else { width }).map(|_| Lane::read(r, count)).collect::<Option<_>>()?;
        Some(Self { target, form, step, base, lanes })
    }

    fn width(&self) -> usize {
        match self.target {
            Target::Rotation(_) => 4,
            Target::Weights { .. } => self.lanes.len(),
            _ => 3,
        }
    }

    fn taps(&self, t: f64, u: f64) -> Taps {
        let even = |n: usize| {
            let x = u * n as f64;
            let k = (x as usize).min(n - 1);
            (k, x - k as f64)
        };
        match &self.form {
            Form::Keys(times, hold) => {
                let after = times.partition_point(|&k| k <= t);
                if after == 0 || after == times.len() || *hold || times[after - 1] == t {
                    // Of keys at one time the last holds.
                    let first =
                        after.checked_sub(1).unwrap_or_else(|| times.partition_point(|&k| k <= times[0]) - 1);
                    return Taps { first, count: 1, weights: [1.0, 0.0, 0.0, 0.0] };
                }
                let u = (t - times[after - 1]) / (times[after] - times[after - 1]);
                Taps { first: after - 1, count: 2, weights: [1.0 - u, u, 0.0, 0.0] }
            }
            Form::Even(n) => {
                let (first, u) = even(*n);
                Taps { first, count: 2, weights: [1.0 - u, u, 0.0, 0.0] }
            }
            Form::Cubic(n) => {
                let (first, u) = even(*n);
                let (v, u2, u3) = (1.0 - u, u * u, u * u * u);
                let inner = (4.0 - 6.0 * u2 + 3.0 * u3) / 6.0;
                let weights = [v * v * v / 6.0, inner, (1.0 + 3.0 * u + 3.0 * u2 - 3.0 * u3) / 6.0, u3 / 6.0];
                Taps { first, count: 4, weights }
            }
        }
    }

    fn number(&self, bits: &Bits, lane: &Lane, taps: &Taps) -> f64 {
        let mut out = [0; 4];
        lane.window(bits, taps.first, &mut out[..taps.count]);
        self.step * out.iter().zip(taps.weights).map(|(v, w)| *v as f64 * w).sum::<f64>()
    }

    fn vector(&self, bits: &Bits, taps: &Taps) -> Vec3 {
        let n = |c: usize| self.number(bits, &self.lanes[c], taps);
        DVec3::new(n(0), n(1), n(2)).as_vec3()
    }

    fn rotation(&self, bits: &Bits, taps: &Taps) -> Quat {
        if taps.count == 2 {
            let end = |k: usize| Taps { first: taps.first + k, count: 1, weights: [1.0, 0.0, 0.0, 0.0] };
            let [a, b] = [0, 1].map(|k| self.quaternion(bits, &end(k)));
            return rotation::slerp(a, b, taps.weights[1] as f32);
        }
        self.quaternion(bits, taps)
    }

    fn quaternion(&self, bits: &Bits, taps: &Taps) -> Quat {
        let n = |c: usize| self.lanes.get(c).map_or(0.0, |l| self.number(bits, l, taps));
        let q = match self.base {
            Some(base) => base * DQuat::from_xyzw(n(0), n(1), n(2), 1.0),
            None => DQuat::from_xyzw(n(0), n(1), n(2), n(3)),
        };
        let length = q.length();
        if length > 1e-20 { (q * (1.0 / length)).as_quat() } else { Quat::IDENTITY }
    }

    /// All numbers, one list a lane.
    fn unpacked(&self, bits: &Bits) -> Vec<Vec<f64>> {
        let count = self.form.count();
        let lane = |l: &Lane| {
            let mut out = vec![0; count];
            l.window(bits, 0, &mut out);
            out.into_iter().map(|v| v as f64 * self.step).collect()
        };
        self.lanes.iter().map(lane).collect()
    }

    fn curve(&self, bits: &Bits, range: Range) -> Curve {
        let lists = self.unpacked(bits);
        let width = self.width();
        // `w` is what the fourth component of a rotation with a base is: 1 for values, 0 for slopes.
        let row = |of: &dyn Fn(&[f64]) -> f64, w: f64| -> Vec<f64> {
            let n: Vec<f64> = lists.iter().map(|l| of(l)).collect();
            match self.base {
                Some(base) if n.is_empty() => base.to_array().to_vec(),
                Some(base) => (base * DQuat::from_xyzw(n[0], n[1], n[2], w)).to_array().to_vec(),
                None => n,
            }
        };
        let keyed = |times: Vec<f64>, interpolation| {
            let unit = matches!(self.target, Target::Rotation(_));
            let one = |k: usize| {
                let v = row(&|l| l[k], 1.0);
                let q = || DQuat::from_slice(&v).as_quat();
                if unit {
                    rotation::unit(q()).to_array().to_vec()
                } else {
                    v.iter().map(|v| *v as f32).collect()
                }
            };
            let values: Vec<f32> = (0..times.len()).flat_map(one).collect();
            Curve::new(times, values, width, interpolation).expect("times in order and finite numbers")
        };
        let even = |n: usize| (0..=n).map(|k| range.start + range.duration() * k as f64 / n as f64).collect();
        match &self.form {
            Form::Keys(times, true) => keyed(times.clone(), Interpolation::Hold),
            Form::Keys(times, false) => keyed(times.clone(), Interpolation::Linear),
            Form::Even(n) => keyed(even(*n), Interpolation::Linear),
            Form::Cubic(n) => {
                let h = range.duration() / *n as f64;
                let mut values = vec![];
                for k in 0..=*n {
                    let slope =
                        if h > 0.0 { row(&|l| (l[k + 2] - l[k]) / (2.0 * h), 0.0) } else { vec![0.0; width] };
                    let value = row(&|l| (l[k] + 4.0 * l[k + 1] + l[k + 2]) / 6.0, 1.0);
                    let finite = |v: &f64| (*v as f32).clamp(f32::MIN, f32::MAX);
                    values.extend(slope.iter().chain(&value).chain(&slope).map(finite));
                }
                Curve::new(even(*n), values, width, Interpolation::Hermite)
                    .expect("even times and finite numbers")
            }
        }
    }
}

/// Times of keys: those of the track before, or on a grid, or each for itself.
fn read_times(r: &mut BitReader, known: &mut Vec<f64>, grid: Option<Grid>) -> Option<Vec<f64>> {
    if r.get(1)? == 1 {
        return Some(known.clone()).filter(|k| !k.is_empty());
    }
    let count = r.golomb(3)? as usize + 1;
    let mut times: Vec<f64> = vec![];
    if r.get(1)? == 1 {
        let (grid, width, mut k) = (grid?, r.get(5)?, 0_u64);
        for _ in 0..count {
            // Each takes a bit at least, or all are one.
            k += u64::from(r.get(width.max(1))?);
            times.push(grid.tick(k));
        }
    } else {
        for _ in 0..count {
            times.push(r.seconds()?);
        }
    }
    let ordered = times.windows(2).all(|w| w[0] <= w[1]) && times.iter().all(|t| t.is_finite());
    *known = Some(times).filter(|_| ordered)?;
    Some(known.clone())
}

fn read_base(r: &mut BitReader) -> Option<DQuat> {
    let (largest, bits) = (r.get(2)? as usize, r.get(5)?);
    let mut small = [0; 3];
    for s in &mut small {
        *s = r.bits.get_signed(r.skip(bits as usize)?, bits);
    }
    draft::base(largest, small, bits)
}
