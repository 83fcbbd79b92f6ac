//! What hides between two moments: a bound, not an estimate.
//!
//! Let `e(t)` be the way from a point of one clip to the same point of the other. Between two moments `h` apart, within one piece of every
//! curve, `|e| ≤ max(|e₀|, |e₁|) + h²/8 · max|e″|`. The bones' chain gives `max|e″|`: with `A` the product of the linear parts above a bone,
//! `L` and `T` its own linear part and translation, and `Δ` the difference between the clips,
//!
//! ```text
//! ΔAᵢ = Aₚ ΔLᵢ + ΔAₚ L̂ᵢ        Δoᵢ = Δoₚ + Aₚ ΔTᵢ + ΔAₚ T̂ᵢ        e = Δo + ΔA x̂ + A Δx
//! ```
//!
//! so norms of all of them, of their first and of their second derivatives follow from those of the tracks by the product rule. A skinned
//! vertex is a mean of such points. The bound holds for exact arithmetic; rounding adds what single precision does to the vertices themselves.

mod vertices;

pub(super) use vertices::Change;

use super::gauge::{Gauge, Metric};
use crate::character::{Binding, Character};
use crate::clip::{Clip, Curve, Interpolation, Target};
use crate::pose::Pose;
use crate::skeleton::BoneId;
use glam::{DMat3, DQuat, DVec3, Mat3A, Vec3, Vec3A};
use std::ops::{Add, Mul};

/// Bounds on the norm of something and of its first and second derivatives by time, over a span.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Jet {
    value: f64,
    rate: f64,
    bend: f64,
}

impl Jet {
    const ZERO: Self = Self::constant(0.0);

    const fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, bend: 0.0 }
    }

    /// Of a smooth vector by its norms at both ends, the distance between them, and the norm of its second derivative.
    fn of(ends: [f64; 2], apart: f64, bend: f64, h: f64) -> Self {
        Self { value: ends[0].max(ends[1]) + h * h / 8.0 * bend, rate: apart / h + 0.5 * h * bend, bend }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, rate: self.rate + o.rate, bend: self.bend + o.bend }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            rate: self.rate * o.value + self.value * o.rate,
            bend: self.bend * o.value + 2.0 * self.rate * o.rate + self.value * o.bend,
        }
    }
}

/// One quantity in the first clip, in the second, and between them.
#[derive(Clone, Copy)]
struct Pair {
    a: Jet,
    b: Jet,
    between: Jet,
}

impl Pair {
    fn still(value: f64) -> Self {
        Self { a: Jet::constant(value), b: Jet::constant(value), between: Jet::ZERO }
    }
}

/// Curves of both clips that move one channel.
#[derive(Clone, Copy, Default)]
struct Channel<'a> {
    curves: [Option<&'a Curve>; 2],
    /// Both are the same, or missing.
    same: bool,
    /// Angles about the aim frame, where it is a rotation.
    xzx: [bool; 2],
}

/// A skin's part on one bone.
struct Reach {
    bone: usize,
    instance: usize,
    /// Metres from the bone's origin to its farthest vertex.
    radius: f64,
    /// What the inverse bind matrix stretches by.
    stretch: f64,
}

/// Bounds what two clips of a character do between two moments.
pub(super) struct Bound<'a> {
    gauge: &'a Gauge<'a>,
    /// Rotation, translation, scale of each bone.
    channels: Vec<[Channel<'a>; 3]>,
    /// Runs of morph weights: the first, its metres a unit, and the curves.
    weights: Vec<(usize, Vec<f64>, Channel<'a>)>,
    reach: Vec<Reach>,
    /// Times at which a curve jumps, ascending.
    jumps: Vec<f64>,
}

/// Both poses at both ends of a span.
struct Ends {
    times: [f64; 2],
    a: [Pose; 2],
    b: [Pose; 2],
}

impl<'a> Bound<'a> {
    pub fn new(gauge: &'a Gauge<'a>, clips: [&'a Clip; 2]) -> Self {
        let c = gauge.character;
        let mut channels = vec![[Channel::default(); 3]; c.skeleton().len()];
        let mut runs: std::collections::BTreeMap<usize, Channel> = Default::default();
        for (side, clip) in clips.into_iter().enumerate() {
            for track in &clip.tracks {
                let channel = match track.target {
                    Target::Rotation(b) | Target::Xzx(b) => &mut channels[b.index()][0],
                    Target::Translation(b) => &mut channels[b.index()][1],
                    Target::Scale(b) => &mut channels[b.index()][2],
                    Target::Weights { first } => runs.entry(first).or_default(),
                };
                channel.curves[side] = Some(&track.curve);
                channel.xzx[side] = matches!(track.target, Target::Xzx(_));
            }
        }
        let all = channels.iter_mut().flatten().chain(runs.values_mut());
        all.for_each(|c| c.same = c.curves[0] == c.curves[1] && c.xzx[0] == c.xzx[1]);
        let reach = c.target_reach();
        let weights = runs.into_iter().map(|(first, channel)| {
            let width = channel.curves.iter().flatten().map(|c| c.width()).max().unwrap_or(0);
            (first, reach[first..first + width].to_vec(), channel)
        });
        let curves = clips.into_iter().flat_map(|c| &c.tracks).map(|t| &t.curve);
        let mut jumps: Vec<f64> = curves.flat_map(jumps).collect();
        jumps.sort_by(f64::total_cmp);
        jumps.dedup();
        Self { gauge, channels, weights: weights.collect(), reach: reaches(c), jumps }
    }

    /// The end of a span as seen from within it: just before, where a curve jumps there.
    pub fn end_before(&self, t: f64) -> f64 {
        if self.jumps.binary_search_by(|j| j.total_cmp(&t)).is_ok() { t.next_down() } else { t }
    }

    /// The largest second derivative of any point's way, as a part of its limit; infinite where the span is too long to tell.
    pub fn bend(&self, clips: [&Clip; 2], times: [f64; 2]) -> f64 {
        // The end belongs to the piece before it.
        let times = [times[0], times[1].next_down().max(times[0])];
        let at = |clip| times.map(|t| self.gauge.pose(clip, t));
        let ends = Ends { times, a: at(clips[0]), b: at(clips[1]) };
        let h = times[1] - times[0];
        let skeleton = self.gauge.character.skeleton();
        // Linear part of the first clip, its difference, and that of the origin.
        let mut frames = vec![[Jet::ZERO; 3]; skeleton.len()];
        for bone in skeleton.ids() {
            let [up, d_up, d_origin] = skeleton
                .parent(bone)
                .map_or([Jet::constant(1.0), Jet::ZERO, Jet::ZERO], |p| frames[p.index()]);
            let (linear, shift) = self.local(bone, &ends, h);
            frames[bone.index()] = [
                up * linear.a,
                up * linear.between + d_up * linear.b,
                d_origin + up * shift.between + d_up * shift.b,
            ];
        }
        self.largest(&frames, &ends, h)
    }

    fn largest(&self, frames: &[[Jet; 3]], ends: &Ends, h: f64) -> f64 {
        let g = self.gauge;
        let point = |bone: usize, radius: f64| {
            let [_, linear, origin] = frames[bone];
            origin.bend + linear.bend * radius
        };
        let pins = g
            .pins
            .iter()
            .map(|&(b, limit)| point(b.index(), g.character.skeleton().tip(b).length() as f64) / limit);
        let worst = most(pins);
        let all = match g.metric {
            // The shell is measured by the Frobenius norm, which is up to √3 times as large.
            Metric::Shell(radius) => most((0..frames.len()).map(|b| point(b, 3.0_f64.sqrt() * radius))),
            Metric::Vertices => {
                let morphs: Vec<Pair> = self.morphs(ends, h);
                let of = |r: &Reach| {
                    let [linear, d_linear, d_origin] = frames[r.bone];
                    let m = morphs[r.instance];
                    let stretch = Jet::constant(r.stretch);
                    let x = Jet::constant(r.radius) + stretch * m.b;
                    (d_origin + d_linear * x + linear * stretch * m.between).bend
                };
                most(self.reach.iter().map(of))
            }
        };
        worst.max(all / g.limit)
    }

    /// Linear part and translation of a bone against its parent.
    fn local(&self, bone: BoneId, ends: &Ends, h: f64) -> (Pair, Pair) {
        let skeleton = self.gauge.character.skeleton();
        if let Some(m) = skeleton.fixed(bone) {
            return (Pair::still(norm(m.matrix3)), Pair::still(m.translation.length() as f64));
        }
        let [turn, shift, scale] = &self.channels[bone.index()];
        let i = bone.index();
        let vectors = |of: fn(&crate::math::Trs) -> Vec3| {
            [&ends.a, &ends.b].map(|p| [0, 1].map(|k: usize| of(&p[k].locals[i]).as_dvec3()))
        };
        let r = self.rotation(bone, turn, ends, h);
        let s = vector(scale, vectors(|l| l.scale), ends.times, h, DVec3::abs_max);
        let t = vector(shift, vectors(|l| l.translation), ends.times, h, |v| v.length());
        let linear = Pair { a: r.a * s.a, b: r.b * s.b, between: r.a * s.between + r.between * s.b };
        (linear, t)
    }

    fn rotation(&self, bone: BoneId, channel: &Channel, ends: &Ends, h: f64) -> Pair {
        let i = bone.index();
        let turns =
            [&ends.a, &ends.b].map(|p| [0, 1].map(|k: usize| unit(p[k].locals[i].rotation.as_dquat())));
        if channel.curves.iter().all(Option::is_none) {
            return Pair::still(1.0);
        }
        let spins = [0, 1].map(|k| Spin::of(channel.curves[k], channel.xzx[k], turns[k], ends.times, h));
        let jet = |s: &Spin| Jet { value: 1.0, rate: s.rate, bend: s.rate * s.rate + s.turn };
        let (a, b) = (jet(&spins[0]), jet(&spins[1]));
        if channel.same {
            return Pair { a, b, between: Jet::ZERO };
        }
        let apart = [0, 1].map(|k| angle(turns[0][k], turns[1][k]));
        Pair { a, b, between: Spin::between(&spins, apart, turns, h) }
    }

    /// What morph targets do to the vertices of each instance, metres in the mesh's frame.
    fn morphs(&self, ends: &Ends, h: f64) -> Vec<Pair> {
        let c = self.gauge.character;
        let of = |instance: &crate::character::Instance| {
            let n = c.mesh(instance).targets.len();
            let mut sum = Pair::still(0.0);
            for (first, reach, channel) in &self.weights {
                // Only this instance's run; tracks are as wide as one.
                if !(instance.first_weight..instance.first_weight + n).contains(first) {
                    continue;
                }
                for (k, reach) in reach.iter().enumerate() {
                    let values = [&ends.a, &ends.b]
                        .map(|p| [0, 1].map(|e: usize| DVec3::X * p[e].weights[first + k] as f64));
                    let p = component(channel, k, values, ends.times, h);
                    let reach = Jet::constant(*reach);
                    sum = Pair {
                        a: sum.a + reach * p.a,
                        b: sum.b + reach * p.b,
                        between: sum.between + reach * p.between,
                    };
                }
            }
            sum
        };
        c.instances().iter().map(of).collect()
    }
}

/// The largest; infinite where one of them is not known, as what is infinite makes no number times zero.
fn most(bounds: impl Iterator<Item = f64>) -> f64 {
    bounds.fold(0.0, |top, b| if b.is_nan() { f64::INFINITY } else { top.max(b) })
}

/// How a rotation runs over a span.
struct Spin {
    /// Radians a second, at most.
    rate: f64,
    /// Radians a second squared, at most: beside `rate²`, what the second derivative is made of.
    turn: f64,
    /// The rates of its three angles, or of the one turn that it makes about a fixed axis; none where neither is so.
    rates: Option<(bool, DVec3)>,
    /// Second derivatives of the three angles at both ends.
    bends: [DVec3; 2],
}

impl Spin {
    fn of(curve: Option<&Curve>, xzx: bool, turns: [DQuat; 2], times: [f64; 2], h: f64) -> Self {
        let bends = [0, 1].map(|k| curve.map_or([0.0; 4], |c| bend_at(c, times[k])));
        let wide = bends.map(|b| DVec3::new(b[0], b[1], b[2]));
        let straight = bends.iter().flatten().all(|b| *b == 0.0);
        if let Some(curve) = curve.filter(|_| xzx) {
            let [a, b] = times.map(|t| {
                let mut v = [0.0; 3];
                curve.sample(t, &mut v);
                DVec3::from(v.map(f64::from))
            });
            let bend = wide[0].abs().max(wide[1].abs());
            let rates = (b - a) / h;
            let rate = (rates.abs() + 0.5 * h * bend).element_sum();
            return Self { rate, turn: bend.element_sum(), rates: Some((true, rates)), bends: wide };
        }
        if straight {
            // On an arc at constant speed; in the frame that it turns.
            let rates = 2.0 / h * log(turns[0].conjugate() * turns[1]);
            return Self { rate: rates.length(), turn: 0.0, rates: Some((false, rates)), bends: wide };
        }
        // A cubic, normalised: q = c/|c|.
        let curve = curve.expect("what bends is a curve");
        let [a, b] = times.map(|t| {
            let mut v = [0.0; 4];
            curve.sample(t, &mut v);
            glam::DVec4::from(v.map(f64::from))
        });
        let bend = bends.iter().map(|b| glam::DVec4::from(*b).length()).fold(0.0, f64::max);
        let least = a.length().min(b.length()) - 0.5 * (b - a).length() - h * h / 8.0 * bend;
        if least <= 0.0 {
            return Self { rate: f64::INFINITY, turn: f64::INFINITY, rates: None, bends: wide };
        }
        let rate = ((b - a).length() / h + 0.5 * h * bend) / least;
        let turn = 2.0 * (bend / least + 4.0 * rate * rate);
        Self { rate: 2.0 * rate, turn, rates: None, bends: wide }
    }

    /// The difference of two rotations, by the angle between them at both ends.
    fn between(spins: &[Self; 2], apart: [f64; 2], turns: [[DQuat; 2]; 2], h: f64) -> Jet {
        let [a, b] = spins;
        let most = apart[0].max(apart[1]);
        let alike = a.rates.zip(b.rates).filter(|(a, b)| a.0 == b.0);
        let Some(((angles, own), (_, other))) = alike else {
            let bend = a.rate * a.rate + a.turn + b.rate * b.rate + b.turn;
            let [first, last] = [0, 1].map(|k| DMat3::from_quat(turns[0][k]) - DMat3::from_quat(turns[1][k]));
            return Jet::of([most, most], frobenius(last - first), bend, h);
        };
        // R′ = R[ω] and R″ = R([ω]² + [ω′]), with the same for each factor of three turns.
        let (ends, size): ([DVec3; 2], fn(DVec3) -> f64) = if angles {
            ([0, 1].map(|k| a.bends[k] - b.bends[k]), |v| v.abs().element_sum())
        } else {
            ([DVec3::ZERO; 2], |v| v.length())
        };
        let bend = size(ends[0]).max(size(ends[1]));
        let rates = size(own - other) + h * bend;
        let fixed = rates * (a.rate + b.rate) + bend;
        let scaled = a.rate * a.rate + a.turn;
        // value ≤ most + h²/8 · (fixed + scaled · value)
        let room = 1.0 - h * h / 8.0 * scaled;
        if room < 0.5 {
            return Jet { value: 2.0, rate: f64::INFINITY, bend: f64::INFINITY };
        }
        let value = (most + h * h / 8.0 * fixed) / room;
        Jet { value, rate: rates + a.rate * value, bend: fixed + scaled * value }
    }
}

trait AbsMax {
    fn abs_max(self) -> f64;
}

impl AbsMax for DVec3 {
    fn abs_max(self) -> f64 {
        self.abs().max_element()
    }
}

/// A vector channel, by its values at both ends.
fn vector(
    channel: &Channel,
    values: [[DVec3; 2]; 2],
    times: [f64; 2],
    h: f64,
    norm: impl Fn(DVec3) -> f64,
) -> Pair {
    let bends = channel.curves.map(|c| times.map(|t| c.map_or([0.0; 4], |c| bend_at(c, t))));
    let bends = bends.map(|b| b.map(|b| DVec3::new(b[0], b[1], b[2])));
    pair(channel.same, values, bends, h, norm)
}

/// One component of a channel, along x.
fn component(channel: &Channel, k: usize, values: [[DVec3; 2]; 2], times: [f64; 2], h: f64) -> Pair {
    let bends = channel.curves.map(|c| times.map(|t| DVec3::X * c.map_or(0.0, |c| c.bend_at(t, k))));
    pair(channel.same, values, bends, h, |v| v.x.abs())
}

fn pair(
    same: bool,
    values: [[DVec3; 2]; 2],
    bends: [[DVec3; 2]; 2],
    h: f64,
    norm: impl Fn(DVec3) -> f64,
) -> Pair {
    let jet = |v: [DVec3; 2], b: [DVec3; 2]| {
        Jet::of(v.map(&norm), norm(v[1] - v[0]), norm(b[0]).max(norm(b[1])), h)
    };
    let minus = |p: [[DVec3; 2]; 2]| [p[0][0] - p[1][0], p[0][1] - p[1][1]];
    let between = if same { Jet::ZERO } else { jet(minus(values), minus(bends)) };
    Pair { a: jet(values[0], bends[0]), b: jet(values[1], bends[1]), between }
}

/// Second derivatives of up to four components.
fn bend_at(curve: &Curve, t: f64) -> [f64; 4] {
    std::array::from_fn(|k| if k < curve.width() { curve.bend_at(t, k) } else { 0.0 })
}

/// Whether a curve changes at once anywhere.
pub(super) fn has_jumps(curve: &Curve) -> bool {
    !jumps(curve).is_empty()
}

fn jumps(curve: &Curve) -> Vec<f64> {
    let times = curve.times();
    match curve.interpolation() {
        Interpolation::Hold => times.to_vec(),
        _ => times.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect(),
    }
}

fn unit(q: DQuat) -> DQuat {
    if q.length() > 1e-20 { q.normalize() } else { DQuat::IDENTITY }
}

/// Half the rotation vector of a unit quaternion, on the short way.
fn log(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let sine = q.xyz().length();
    if sine < 1e-12 { q.xyz() } else { q.xyz() * (sine.atan2(q.w) / sine) }
}

fn angle(a: DQuat, b: DQuat) -> f64 {
    2.0 * log(a.conjugate() * b).length()
}

fn frobenius(m: DMat3) -> f64 {
    (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
}

fn norm(m: Mat3A) -> f64 {
    frobenius(DMat3::from_cols(wide(m.x_axis), wide(m.y_axis), wide(m.z_axis)))
}

fn wide(v: Vec3A) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// How far each instance's vertices are from the bones that move them.
fn reaches(c: &Character) -> Vec<Reach> {
    let mut out = vec![];
    for (instance, i) in c.instances().iter().enumerate() {
        let vertices = &c.mesh(i).positions;
        match &i.binding {
            Binding::Bone(b) => {
                let radius = vertices.iter().map(|v| v.length()).fold(0.0, f32::max) as f64;
                out.push(Reach { bone: b.index(), instance, radius, stretch: 1.0 });
            }
            Binding::Skin { palette, weights } => {
                let mut far = vec![None::<f32>; palette.len()];
                for (v, p) in vertices.iter().enumerate() {
                    for (slot, _) in weights.of(v).filter(|w| w.1 > 0.0) {
                        let d = palette[slot].1.transform_point3(*p).length();
                        far[slot] = Some(far[slot].map_or(d, |f| f.max(d)));
                    }
                }
                let parts = far.iter().zip(palette).filter_map(|(far, (bone, m))| {
                    let radius = (*far)? as f64;
                    Some(Reach { bone: bone.index(), instance, radius, stretch: norm(m.matrix3) })
                });
                out.extend(parts);
            }
        }
    }
    out
}
