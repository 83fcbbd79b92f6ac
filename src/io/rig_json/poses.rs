//! Files of poses: clips as rows of keys, and the curves that they become.

use super::bones::find;
use super::error::RigError;
use crate::character::Character;
use crate::clip::{self, Curve, Target};
use crate::math::{euler, rotation, spline};
use crate::skeleton::{BoneId, Skeleton};
use crate::time::{ClipTimeline, Marker, Range, Rate, Timeline};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// A whole file of poses.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poses {
    /// Version of the format: 1.
    pub sinew_poses: u32,
    /// Frames in so many seconds that keys were set by, for editors: `[24, 1]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<[u16; 2]>,
    /// In the order in which they are listed and chosen.
    pub clips: Vec<Clip>,
}

/// One animation.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clip {
    /// For people and the command line.
    pub name: String,
    /// The last key of each track stands for its first: slopes there are taken across the seam.
    #[serde(default, rename = "loop")]
    pub repeats: bool,
    /// How values run between keys, unless a track says otherwise.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// The slopes of Catmull-Rom keys, unless a track says otherwise.
    #[serde(default)]
    pub tangents: Tangents,
    /// First and last second of what an editor plays, where that is not from the first key to the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// The part of it that somebody was looking at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preview: Option<[f64; 2]>,
    /// Named moments: rows of a second and a name, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<(f64, String)>,
    /// What moves.
    pub tracks: Vec<Track>,
}

/// Keys of one channel of one bone: rows of a time in seconds and the channel's numbers.
///
/// A row of a `hermite` track holds the time, the slope on the way in (per second), the value and the slope on the way out.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// Name of the bone.
    #[serde(default)]
    pub bone: String,
    /// Instead of a bone: which run of morph weights, counted from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub morph: Option<usize>,
    /// Overrides the clip's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interpolation: Option<Interpolation>,
    /// Overrides the clip's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangents: Option<Tangents>,
    /// Rows of `t, θ₁, θ₂, θ₃`: twist, bend, twist in degrees, from rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub xzx_deg: Option<Vec<Vec<f64>>>,
    /// Rows of `t, x, y, z, w`: the whole rotation against the parent as a quaternion; of `q` and `−q` the one nearer to the key
    /// before is meant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Vec<Vec<f64>>>,
    /// Rows of `t, x, y, z`: the bone's origin in the parent's frame, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<Vec<Vec<f64>>>,
    /// Rows of `t, x, y, z`: the same, as a displacement from rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<Vec<Vec<f64>>>,
    /// Rows of `t, x, y, z`: factors along the bone's axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<Vec<Vec<f64>>>,
    /// Rows of `t, w₁, …`: the weights of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<Vec<Vec<f64>>>,
}

impl Track {
    /// The channels that have keys, by their field's name.
    pub(super) fn channels(&self) -> impl Iterator<Item = (&'static str, &Vec<Vec<f64>>)> {
        let all = [
            ("xzx_deg", &self.xzx_deg),
            ("rotation", &self.rotation),
            ("translation", &self.translation),
            ("offset", &self.offset),
            ("scale", &self.scale),
            ("weights", &self.weights),
        ];
        all.into_iter().filter_map(|(key, rows)| Some((key, rows.as_ref()?)))
    }
}

/// How values run between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// The earlier key.
    Hold,
    /// Straight.
    #[default]
    Linear,
    /// Cubic through the keys.
    CatmullRom,
    /// Cubic with slopes in the file.
    Hermite,
}

/// The slopes of Catmull-Rom keys, as [`spline::Tangents`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tangents {
    /// `(θ_{k+1} − θ_{k−1}) / (t_{k+1} − t_{k−1})`.
    #[default]
    Notes,
    /// The slope of the parabola through three keys.
    ThreePoint,
    /// Limited so that nothing overshoots.
    Monotone,
}

impl Poses {
    /// The document in a file.
    ///
    /// # Errors
    /// [`RigError::Json`], [`RigError::Version`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RigError> {
        let poses: Self = serde_json::from_slice(bytes)?;
        match poses.sinew_poses {
            1 => Ok(poses),
            found => Err(RigError::Version { field: "sinew_poses", found }),
        }
    }

    /// The clips, for a character that has their bones and morph weights.
    ///
    /// # Errors
    /// [`RigError`] names clip, track and bone of the first thing that does not fit.
    pub fn to_clips(&self, character: &Character) -> Result<Vec<clip::Clip>, RigError> {
        let runs = character.weight_runs();
        self.clips.iter().map(|c| one_clip(c, character.skeleton(), &runs)).collect()
    }

    /// Rate, ranges and markers.
    ///
    /// # Errors
    /// [`RigError::Value`]: a rate of zero, a range that ends before it starts, markers out of order.
    pub fn timeline(&self) -> Result<Timeline, RigError> {
        let rate = self.rate.map(|[frames, seconds]| Rate::new(frames, seconds)).transpose();
        let rate = rate.map_err(|e| RigError::value("rate", e.to_string()))?;
        Ok(Timeline { rate, clips: self.clips.iter().map(Clip::timeline).collect::<Result<_, _>>()? })
    }

    /// The same clips with rate, ranges and markers.
    pub fn with_timeline(mut self, timeline: &Timeline) -> Self {
        let ends = |r: Range| [r.start, r.end];
        self.rate = timeline.rate.map(|r| [r.frames(), r.seconds()]);
        for (clip, of) in self.clips.iter_mut().zip(&timeline.clips) {
            (clip.range, clip.preview) = (of.range.map(ends), of.preview.map(ends));
            clip.markers = of.markers.iter().map(|m| (m.time, m.name.clone())).collect();
        }
        self
    }
}

impl Clip {
    fn timeline(&self) -> Result<ClipTimeline, RigError> {
        let bad = |why| RigError::value(format!("clip `{}`", self.name), why);
        let range = |what: &str, ends: Option<[f64; 2]>| match ends {
            Some([start, end]) if start > end => {
                Err(bad(format!("its {what} ends at {end} s, before it starts at {start} s")))
            }
            ends => Ok(ends.map(|[start, end]| Range { start, end })),
        };
        if let Some([(before, _), (time, name)]) = self.markers.windows(2).find(|w| w[0].0 >= w[1].0) {
            let why =
                format!("marker `{name}` at {time} s follows one at {before} s; expected them in order");
            return Err(bad(why));
        }
        let markers = self.markers.iter().map(|(time, name)| Marker { time: *time, name: name.clone() });
        let [range, preview] = [range("range", self.range)?, range("preview", self.preview)?];
        Ok(ClipTimeline { range, preview, markers: markers.collect() })
    }
}

/// First morph weight of a run, and how many there are.
type Run = (usize, usize);

fn one_clip(c: &Clip, skeleton: &Skeleton, runs: &[Run]) -> Result<clip::Clip, RigError> {
    let mut out = clip::Clip { name: c.name.clone(), tracks: Vec::with_capacity(c.tracks.len()) };
    for (i, t) in c.tracks.iter().enumerate() {
        let of = t.morph.map_or_else(|| format!("bone `{}`", t.bone), |run| format!("morph run {run}"));
        let place = format!("clip `{}`, track {i} of {of}", c.name);
        out.tracks.push(one_track(c, t, skeleton, runs, &place)?);
    }
    if c.repeats {
        one_length(&out)?;
    }
    Ok(out)
}

/// Check that tracks of a loop begin and end together: each repeats at its own ends.
fn one_length(clip: &clip::Clip) -> Result<(), RigError> {
    let whole = clip.range();
    for (i, t) in clip.tracks.iter().enumerate() {
        let times = t.curve.times();
        let (first, last) = (times[0], times[times.len() - 1]);
        if times.len() > 1 && (first, last) != (whole.start, whole.end) {
            let why = format!(
                "runs from {first} s to {last} s, but the loop from {} s to {} s; give it keys at both ends",
                whole.start, whole.end
            );
            return Err(RigError::value(format!("clip `{}`, track {i}", clip.name), why));
        }
    }
    Ok(())
}

fn one_track(
    c: &Clip,
    t: &Track,
    skeleton: &Skeleton,
    runs: &[Run],
    place: &str,
) -> Result<clip::Track, RigError> {
    let mut channels = t.channels();
    let (Some((channel, rows)), None) = (channels.next(), channels.next()) else {
        let why = "expected keys of exactly one of `xzx_deg`, `rotation`, `translation`, `offset`, `scale`, `weights`";
        return Err(RigError::value(place, why));
    };
    if (channel == "weights") != t.morph.is_some() {
        return Err(RigError::value(place, "`weights` and `morph` belong together"));
    }
    let (target, width, origin) = match t.morph {
        Some(run) => {
            let why = || format!("there are {} runs of morph weights", runs.len());
            let &(first, width) = runs.get(run).ok_or_else(|| RigError::value(place, why()))?;
            (Target::Weights { first }, width, Vec3::ZERO)
        }
        None => {
            let bone = find(skeleton, &t.bone, place)?;
            let width = if channel == "rotation" { 4 } else { 3 };
            (target(channel, bone), width, skeleton.rest(bone).translation)
        }
    };
    let interpolation = t.interpolation.unwrap_or(c.interpolation);
    let keys = Keys::read(channel, rows, width, interpolation == Interpolation::Hermite, place)?;
    let mut keys = keys.in_engine_units(channel, origin);
    if channel == "rotation" && interpolation != Interpolation::Hold {
        keys.align_signs();
    }
    let rule = match t.tangents.unwrap_or(c.tangents) {
        Tangents::Notes => spline::Tangents::Notes,
        Tangents::ThreePoint => spline::Tangents::ThreePoint,
        Tangents::Monotone => spline::Tangents::Monotone,
    };
    let curve = if c.repeats && keys.times.len() > 1 {
        keys.check_seam(&target, place)?;
        keys.into_loop(interpolation, rule)
    } else {
        keys.into_curve(interpolation, rule)
    };
    let curve = curve.map_err(|source| RigError::Curve { place: place.into(), source })?;
    Ok(clip::Track { target, curve })
}

fn target(channel: &str, bone: BoneId) -> Target {
    match channel {
        "xzx_deg" => Target::Xzx(bone),
        "rotation" => Target::Rotation(bone),
        "scale" => Target::Scale(bone),
        _ => Target::Translation(bone),
    }
}

/// Keys in f64, before they become a curve: `width` numbers a key, or in-slope, value and out-slope.
struct Keys {
    times: Vec<f64>,
    values: Vec<f64>,
    width: usize,
    /// They are quaternions.
    turns: bool,
    /// Slopes are in `values`.
    sloped: bool,
}

impl Keys {
    fn read(
        channel: &str,
        rows: &[Vec<f64>],
        width: usize,
        sloped: bool,
        place: &str,
    ) -> Result<Self, RigError> {
        let each = if sloped { 3 * width } else { width };
        let turns = channel == "rotation";
        let mut out = Self { times: Vec::new(), values: Vec::new(), width, turns, sloped };
        for (k, row) in rows.iter().enumerate() {
            if row.len() != each + 1 {
                let why = format!(
                    "key {k} of `{channel}`: expected {} numbers (a time and {each} values), found {}",
                    each + 1,
                    row.len()
                );
                return Err(RigError::value(place, why));
            }
            out.times.push(row[0]);
            out.values.extend(&row[1..]);
        }
        Ok(out)
    }

    /// Degrees to radians; displacements to places.
    fn in_engine_units(mut self, channel: &str, rest: Vec3) -> Self {
        let width = self.width;
        match channel {
            "xzx_deg" => self.values.iter_mut().for_each(|v| *v = v.to_radians()),
            "offset" => {
                for (i, v) in self.values.iter_mut().enumerate() {
                    let is_value = !self.sloped || (i / width) % 3 == 1;
                    *v += if is_value { rest[i % width] as f64 } else { 0.0 };
                }
            }
            _ => (),
        }
        self
    }

    /// Give each quaternion the sign that is nearer to the one before: `q` and `−q` are one rotation, but what is mixed from
    /// them component by component passes through zero.
    fn align_signs(&mut self) {
        let w = self.width;
        let (each, skip) = if self.sloped { (3 * w, w) } else { (w, 0) };
        for k in 1..self.times.len() {
            let (before, row) = self.values.split_at_mut(k * each);
            let (last, row) = (&before[(k - 1) * each + skip..][..w], &mut row[..each]);
            if last.iter().zip(&row[skip..]).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                row.iter_mut().for_each(|v| *v = -*v);
            }
        }
    }

    fn into_curve(self, of: Interpolation, rule: spline::Tangents) -> Result<Curve, clip::CurveError> {
        let interpolation = match of {
            Interpolation::Hold => clip::Interpolation::Hold,
            Interpolation::Linear => clip::Interpolation::Linear,
            Interpolation::CatmullRom => clip::Interpolation::CatmullRom(rule),
            Interpolation::Hermite => clip::Interpolation::Hermite,
        };
        Curve::new(self.times, narrow(&self.values), self.width, interpolation)
    }

    /// A seamless curve: Catmull-Rom keys become Hermite keys, the neighbour of an end found across the seam.
    fn into_loop(self, of: Interpolation, rule: spline::Tangents) -> Result<Curve, clip::CurveError> {
        if of != Interpolation::CatmullRom || self.times.is_sorted_by(|a, b| a >= b) {
            return self.into_curve(of, rule);
        }
        // Let the constructor say what is wrong with the keys before their slopes are taken.
        Curve::new(self.times.clone(), narrow(&self.values), self.width, clip::Interpolation::Linear)?;
        let n = self.times.len();
        let mut values = Vec::with_capacity(3 * self.values.len());
        for k in 0..n {
            let slopes: Vec<f64> = (0..self.width).map(|c| self.slope(rule, k, c)).collect();
            values.extend(&slopes);
            values.extend(&self.values[k * self.width..][..self.width]);
            values.extend(&slopes);
        }
        Curve::new(self.times, narrow(&values), self.width, clip::Interpolation::Hermite)
    }

    /// Slope of component `c` at key `k` of a loop, whose keys 0 and n−1 are one.
    fn slope(&self, rule: spline::Tangents, k: usize, c: usize) -> f64 {
        let last = self.times.len() - 1;
        let at = |i: usize| (self.times[i], self.values[i * self.width + c]);
        let period = self.times[last] - self.times[0];
        let (first, end) = (at(0).1, at(last).1);

        // A loop may end whole turns away from its start, or on the other sign of a quaternion: carry that across.
        let sign = if self.turns && self.seam_dot() < 0.0 { -1.0 } else { 1.0 };
        let turn = if self.turns { 0.0 } else { end - first };
        let prev = match k {
            0 => (at(last - 1).0 - period, sign * at(last - 1).1 - turn),
            _ => at(k - 1),
        };
        let next = match k {
            _ if k == last => (at(1).0 + period, sign * at(1).1 + turn),
            _ => at(k + 1),
        };
        let distinct = |p: (f64, f64)| Some(p).filter(|p| p.0 != at(k).0);
        spline::tangent(rule, distinct(prev), at(k), distinct(next))
    }

    fn seam_dot(&self) -> f64 {
        let last = (self.times.len() - 1) * self.width;
        (0..self.width).map(|c| self.values[c] * self.values[last + c]).sum()
    }

    /// Check that the last key repeats the first.
    fn check_seam(&self, target: &Target, place: &str) -> Result<(), RigError> {
        let each = self.width * if self.sloped { 3 } else { 1 };
        let skip = if self.sloped { self.width } else { 0 };
        let key = |k: usize| &self.values[k * each + skip..][..self.width];
        let (a, b) = (key(0), key(self.times.len() - 1));
        let gap = match target {
            Target::Xzx(_) => {
                let q = |v: &[f64]| euler::rotation_from_xzx_f64([v[0], v[1], v[2]]).as_quat();
                rotation::angle_between(q(a), q(b)) as f64
            }
            Target::Rotation(_) => {
                let q = |v: &[f64]| {
                    rotation::unit(Quat::from_xyzw(v[0] as f32, v[1] as f32, v[2] as f32, v[3] as f32))
                };
                rotation::angle_between(q(a), q(b)) as f64
            }
            _ => a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
        };
        // A thousandth of a radian or a millimetre cannot be seen to jump.
        if gap <= 1e-3 {
            return Ok(());
        }
        let why = format!("the last key of a loop must repeat the first, but they differ by {gap:.3}");
        Err(RigError::value(place, why))
    }
}

fn narrow(values: &[f64]) -> Vec<f32> {
    values.iter().map(|v| *v as f32).collect()
}
