//! From numbers to packed bytes.

use super::bits::BitWriter;
use super::{Target, VERSION, lane};
use crate::time::Range;
use glam::DQuat;

/// How the numbers of a draft stand in time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Form {
    /// One value for ever.
    Still,
    /// At times of their own; the flag says that they hold.
    Keys(Vec<f64>, bool),
    /// At even times from the first to the last, so many steps apart.
    Even(usize),
    /// The coefficients of a cubic over so many even pieces.
    Cubic(usize),
}

/// What a rotation is based on: the largest of its components, the others, and their bits.
pub(crate) type Base = (usize, [i32; 3], u32);

/// A track before it is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Draft {
    pub target: Target,
    pub form: Form,
    pub base: Option<Base>,
    /// The code of [`step_of`].
    pub step: u8,
    /// A list for each component.
    pub lanes: Vec<Vec<i32>>,
}

/// The step of a code: four a doubling.
pub(crate) fn step_of(code: u8) -> f64 {
    ((code as f64 - 176.0) / 4.0).exp2()
}

/// Moments that keys stand on: those of frames, as exporters count them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    pub start: f64,
    /// Ticks a second.
    pub rate: f64,
    /// Times are those of single precision.
    pub single: bool,
}

impl Grid {
    pub fn tick(&self, k: u64) -> f64 {
        let t = k as f64 / self.rate;
        self.start + if self.single { t as f32 as f64 } else { t }
    }

    /// Times as ticks, if all of them are some: to a thousandth of a tick, or exactly, where a value jumps.
    pub fn ticks(&self, times: &[f64], exact: bool) -> Option<Vec<u64>> {
        let one = |t: &f64| {
            let k = ((t - self.start) * self.rate).round() as u64;
            let off = (self.tick(k) - t).abs();
            (off == 0.0 || !exact && off * self.rate < 1e-3).then_some(k).filter(|k| *k < 1 << 30)
        };
        times.iter().map(one).collect()
    }
}

/// A quaternion from its smaller components.
pub(super) fn base(largest: usize, small: [i32; 3], bits: u32) -> Option<DQuat> {
    let full = ((1_i64 << bits.checked_sub(1)?) - 1).max(1) as f64 * std::f64::consts::SQRT_2;
    let s = small.map(|v| v as f64 / full);
    let rest = (1.0 - s.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
    let mut q = [0.0; 4];
    q[largest] = rest;
    (0..4).filter(|&c| c != largest).zip(s).for_each(|(c, v)| q[c] = v);
    Some(DQuat::from_array(q).normalize())
}

/// The base nearest to a rotation, of so many bits a component, and the rotation that it is.
pub(crate) fn base_of(q: DQuat, bits: u32) -> (Base, DQuat) {
    let q = q.to_array();
    let largest = (0..4).max_by(|&a, &b| q[a].abs().total_cmp(&q[b].abs())).expect("four");
    let sign = if q[largest] < 0.0 { -1.0 } else { 1.0 };
    let full = ((1_i64 << (bits - 1)) - 1) as f64;
    let mut small = [0; 3];
    let others = (0..4).filter(|&c| c != largest);
    others.zip(&mut small).for_each(|(c, s)| {
        *s = (sign * q[c] * std::f64::consts::SQRT_2 * full).round().clamp(-full, full) as i32
    });
    ((largest, small, bits), base(largest, small, bits).expect("bits above 1"))
}

/// About how many bits a draft takes; `None` if its numbers are too far apart.
pub(crate) fn size(d: &Draft) -> Option<usize> {
    let times = match &d.form {
        Form::Keys(times, _) => 12 + 10 * times.len(),
        _ => 10,
    };
    d.lanes.iter().try_fold(10 + times, |sum, l| Some(sum + lane::size(l)?))
}

/// Packed bytes of drafts; `None` if numbers are too far apart.
pub(crate) fn encode(range: Range, grid: Option<Grid>, drafts: &[Draft]) -> Option<Vec<u8>> {
    let mut w = BitWriter::default();
    w.put(VERSION.into(), 8);
    w.put(u64::from(range.start != 0.0), 1);
    if range.start != 0.0 {
        w.seconds(range.start);
    }
    w.seconds(range.end);
    w.put(u64::from(grid.is_some()), 1);
    if let Some(g) = grid {
        w.put(g.single.into(), 1);
        w.seconds(g.rate);
    }
    let mut sorted: Vec<(&Draft, (u64, u64))> = drafts.iter().map(|d| (d, place(&d.target))).collect();
    sorted.sort_by_key(|d| d.1);
    for kind in 0..5 {
        let of: Vec<_> = sorted.iter().filter(|d| d.1.0 == kind).collect();
        w.golomb(of.len() as u64, 0);
        let mut next = 0;
        for (d, (_, index)) in of {
            w.golomb(index.checked_sub(next)?, 0);
            if kind == 4 {
                w.golomb(d.lanes.len() as u64 - 1, 2);
            }
            next = index + 1;
        }
    }
    let mut known: &[f64] = &[];
    for (d, _) in sorted {
        draft(&mut w, d, &mut known, grid)?;
    }
    Some(w.into_bytes())
}

fn place(target: &Target) -> (u64, u64) {
    match target {
        Target::Rotation(b) => (0, b.0.into()),
        Target::Translation(b) => (1, b.0.into()),
        Target::Scale(b) => (2, b.0.into()),
        Target::Xzx(b) => (3, b.0.into()),
        Target::Weights { first } => (4, *first as u64),
    }
}

fn draft<'d>(w: &mut BitWriter, d: &'d Draft, known: &mut &'d [f64], grid: Option<Grid>) -> Option<()> {
    match &d.form {
        Form::Still => w.put(0, 2),
        Form::Keys(t, hold) => {
            w.put(1, 2);
            times(w, t, known, *hold, grid);
            w.put((*hold).into(), 1);
        }
        Form::Even(n) => {
            w.put(2, 2);
            w.golomb(*n as u64 - 1, 5);
        }
        Form::Cubic(n) => {
            w.put(3, 2);
            w.golomb(*n as u64 - 1, 5);
        }
    }
    if matches!(d.target, Target::Rotation(_)) {
        w.put(d.base.is_some().into(), 1);
    }
    if let Some((largest, small, bits)) = d.base {
        w.put(largest as u64, 2);
        w.put(bits.into(), 5);
        small.iter().for_each(|s| w.put(*s as u32 as u64, bits));
        if d.form == Form::Still {
            return Some(());
        }
    }
    w.put(d.step.into(), 8);
    d.lanes.iter().try_for_each(|l| lane::write(w, l))
}

fn times<'d>(w: &mut BitWriter, t: &'d [f64], known: &mut &'d [f64], hold: bool, grid: Option<Grid>) {
    w.put(u64::from(t == *known), 1);
    if t == *known {
        return;
    }
    *known = t;
    w.golomb(t.len() as u64 - 1, 3);
    let exact = hold || t.windows(2).any(|w| w[0] == w[1]);
    let ticks = grid.and_then(|g| g.ticks(t, exact));
    w.put(u64::from(ticks.is_some()), 1);
    let Some(ticks) = ticks else { return t.iter().for_each(|t| w.seconds(*t)) };
    let steps: Vec<u64> = ticks.iter().scan(0, |last, t| Some(t - std::mem::replace(last, *t))).collect();
    let width = (64 - steps.iter().max().expect("a key").leading_zeros()).max(1);
    w.put(width.into(), 5);
    steps.iter().for_each(|s| w.put(*s, width));
}
