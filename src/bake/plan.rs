//! How the error is shared among the tracks.

use super::cost::Costs;
use super::fit::{self, Kind, Samples};
use super::gauge::{Gauge, Looks};
use super::{BakeDesc, Baked, Goal, Report, SEAM, cubic, edit, times};
use crate::character::Character;
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use std::collections::BTreeSet;

/// Moments at which the search compares vertices.
pub(super) const SEARCH_MOMENTS: usize = 400;

/// Vertices times moments that the search may compare in all.
const SEARCH_WORK: usize = 400_000_000;

/// What the search goes for, as a part of what is allowed: what lies between its moments may be a little more.
const AIM: f64 = 0.97;

/// And where they leave out keys.
const SPARSE_AIM: f64 = 0.94;

/// Largest error of a normalised 16-bit quaternion, radians, and of its interpolation.
const SHORT_ERROR: f64 = 7e-5;

/// A track on its way.
struct Job {
    target: Target,
    source: Curve,
    samples: Samples,
    /// What it shows without keys.
    rest: Vec<f32>,
    /// Metres that a unit of its error may move a vertex by.
    lever: f64,
    /// Its share beside the others'.
    weight: f64,
    /// What it was made into with the share at hand; none if it only shows the rest.
    made: Option<Made>,
}

/// What a track was made into.
#[derive(Clone)]
struct Made {
    curve: Curve,
    /// Whether its values are integers in the file.
    short: bool,
    form: Form,
    /// By how much wider pieces were tried (see [`fit::fitted`]).
    wider: f64,
}

/// How keys were found.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Straight pieces.
    Straight,
    /// As they were.
    Kept,
    /// Cubics with slopes by a rule.
    Rule,
    /// Cubics with slopes of their own.
    Slopes,
}

/// How much is tried for a track.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Effort {
    /// Straight pieces: enough to see where the share will be.
    Draft,
    /// What served last time.
    Again,
    /// All forms.
    Full,
}

/// All tracks of a clip.
pub(super) struct Plan<'a> {
    clip: &'a Clip,
    desc: BakeDesc,
    jobs: Vec<Job>,
    share: f64,
    moments: Vec<f64>,
    /// Whether the moments leave out keys, so that more may hide between them.
    sparse: bool,
    vertices: usize,
}

impl<'a> Plan<'a> {
    /// `start` holds the keys to choose from; what they make is compared with `clip`.
    pub fn new(character: &Character, clip: &'a Clip, start: &Clip, gauge: &Gauge, desc: &BakeDesc) -> Self {
        let costs = Costs::new(gauge, clip);
        let vertices = character.instances().iter().map(|i| character.mesh(i).positions.len()).sum();
        let mut jobs: Vec<Job> = vec![];
        for track in &start.tracks {
            let (lever, rest) = costs.of(track);
            let kind = match track.target {
                Target::Rotation(_) => Kind::Rotation,
                Target::Xzx(_) => Kind::Angles,
                Target::Weights { .. } => Kind::Weights,
                Target::Translation(_) | Target::Scale(_) => Kind::Vector,
            };
            let mut samples = Samples::of(&track.curve, kind);
            if desc.fps.is_some() && track.curve.interpolation() == Interpolation::Linear {
                samples = samples.at_keys();
            }
            let job = Job {
                target: track.target.clone(),
                source: track.curve.clone(),
                samples,
                rest,
                lever,
                weight: 1.0,
                made: None,
            };
            jobs.push(job);
        }
        let moments = times::coarse(clip, SEARCH_MOMENTS);
        let sparse = times::knots(&[clip]).len() > SEARCH_MOMENTS;
        Self { clip, desc: desc.clone(), jobs, share: 0.5, moments, sparse, vertices }
    }

    /// The largest shares that keep the bound at the search's moments: all together first, then one after the other.
    pub fn search(&mut self, gauge: &Gauge) -> Baked {
        let aim = if self.sparse { SPARSE_AIM } else { AIM };
        let looks = gauge.looks(self.clip, &self.moments);
        self.narrow(gauge, &looks, aim, true);
        self.narrow(gauge, &looks, aim, false);
        self.widen(gauge, &looks, aim);
        self.finish()
    }

    /// Bring the share close to the largest that keeps `aim`.
    fn narrow(&mut self, gauge: &Gauge, looks: &Looks, aim: f64, draft: bool) {
        // Drafts only show the neighbourhood.
        let (rounds, close) = if draft { (14, 0.85) } else { (6, 0.95) };
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut best = None;
        for round in 0..rounds {
            let effort = match (draft, round) {
                (true, _) => Effort::Draft,
                (false, 0) => Effort::Full,
                (false, _) => Effort::Again,
            };
            self.make_all(gauge, effort);
            let error = gauge.most(looks, &self.assemble());
            if error <= aim {
                low = self.share;
                best = Some((low, self.jobs.iter().map(|j| j.made.clone()).collect::<Vec<_>>()));
            } else {
                high = self.share;
            }
            if (error <= aim && error > close * aim) || high < 1.05 * low {
                break;
            }
            // Errors grow about as the share does.
            let guess = (self.share * 0.98 * aim / error.max(1e-30)).min(4.0 * self.share);
            self.share = if guess > 1.02 * low && guess < 0.99 * high {
                guess
            } else if low > 0.0 {
                (low * high.min(1.7 * low)).sqrt()
            } else {
                0.5 * self.share
            };
        }
        if let Some((share, made)) = best {
            self.share = share;
            self.jobs.iter_mut().zip(made).for_each(|(job, made)| job.made = made);
        }
    }

    /// The same with more moments.
    pub fn search_with(&mut self, gauge: &Gauge, more: Vec<f64>) -> Baked {
        self.moments.extend(more);
        self.moments.sort_by(f64::total_cmp);
        self.moments.dedup();
        self.jobs.iter_mut().for_each(|j| j.weight = 1.0);
        self.search(gauge)
    }

    /// Give single tracks more where the worst vertex does not notice.
    fn widen(&mut self, gauge: &Gauge, looks: &Looks, aim: f64) {
        let mut work = SEARCH_WORK / (self.vertices * self.moments.len()).max(1);
        for factor in [2.5, 1.6, 1.25] {
            // Those with most keys have most to give.
            let mut order: Vec<usize> = (0..self.jobs.len()).collect();
            order.sort_by_key(|&i| (std::cmp::Reverse(self.jobs[i].keys()), i));
            for i in order {
                let before = self.jobs[i].keys();
                if before <= 1 || work == 0 {
                    continue;
                }
                let kept = (self.jobs[i].weight, self.jobs[i].made.clone());
                self.jobs[i].weight *= factor;
                self.jobs[i].made = self.made(i, Effort::Full);
                if self.jobs[i].keys() < before {
                    work -= 1;
                    if !gauge.strays(looks, &self.assemble(), aim) {
                        continue;
                    }
                }
                (self.jobs[i].weight, self.jobs[i].made) = kept;
            }
        }
    }

    /// With a part of the shares.
    pub fn within(&mut self, gauge: &Gauge, part: f64) -> Baked {
        self.share *= part;
        self.make_all(gauge, Effort::Again);
        self.finish()
    }

    /// Nothing left out.
    pub fn untouched(&mut self) -> Baked {
        for job in &mut self.jobs {
            job.made = Some(Made { curve: job.source.clone(), short: false, form: Form::Kept, wider: 1.0 });
        }
        self.finish()
    }

    fn make_all(&mut self, gauge: &Gauge, effort: Effort) {
        let all: Vec<usize> = (0..self.jobs.len()).collect();
        let made = gauge.map(&all, |i| self.made(i, effort));
        self.jobs.iter_mut().zip(made).for_each(|(job, made)| job.made = made);
    }

    fn made(&self, i: usize, effort: Effort) -> Option<Made> {
        let job = &self.jobs[i];
        let allowed = self.share * job.weight * self.desc.tolerance / job.lever;
        job.reduced(allowed, &self.desc, effort)
    }

    fn assemble(&self) -> Clip {
        let tracks = self
            .jobs
            .iter()
            .filter_map(|j| Some(Track { target: j.target.clone(), curve: j.made.as_ref()?.curve.clone() }));
        let mut clip = Clip { name: self.clip.name.clone(), tracks: tracks.collect() };
        self.hold_ends(&mut clip);
        if self.desc.cycle { edit::close(&clip, SEAM) } else { clip }
    }

    /// A clip lasts as long as it did: the shortest track says so where what moved at the ends is gone.
    fn hold_ends(&self, clip: &mut Clip) {
        let (want, found) = (self.clip.range(), clip.range());
        if clip.tracks.is_empty() {
            // One that moves nothing still lasts.
            let Some(job) = self.jobs.iter().min_by_key(|j| j.rest.len()) else { return };
            let curve = Curve::new(vec![want.start], job.rest.clone(), job.rest.len(), Interpolation::Hold);
            clip.tracks.extend(curve.ok().map(|curve| Track { target: job.target.clone(), curve }));
            return self.hold_ends(clip);
        }
        for (missing, time, first) in
            [(found.start > want.start, want.start, true), (found.end < want.end, want.end, false)]
        {
            let shortest = clip.tracks.iter_mut().min_by_key(|t| (t.curve.times().len(), t.curve.width()));
            let Some(track) = shortest.filter(|_| missing) else { continue };
            track.curve = with_end(&track.curve, time, first);
        }
    }

    fn finish(&self) -> Baked {
        let clip = self.assemble();
        let short: Vec<bool> = self.jobs.iter().filter_map(|j| j.made.as_ref()).map(|m| m.short).collect();
        let keys = [self.clip.key_count(), clip.key_count()];
        let bytes = [bytes(self.clip, &[]), bytes(&clip, &short)];
        Baked { clip, short, report: Report { keys, bytes, ..Report::default() } }
    }
}

/// A curve that holds its first or last value for longer.
fn with_end(curve: &Curve, time: f64, first: bool) -> Curve {
    let (mut times, mut values) = (curve.times().to_vec(), curve.values().to_vec());
    let n = times.len();
    let each = values.len() / n;
    let (at, from) = if first { (0, 0) } else { (n, (n - 1) * each) };
    times.insert(at, time);
    let end = values[from..from + each].to_vec();
    values.splice(at * each..at * each, end);
    Curve::new(times, values, curve.width(), curve.interpolation()).expect("a curve and a key beyond its end")
}

/// Bytes of a clip's keys in glTF.
pub(super) fn bytes(clip: &Clip, short: &[bool]) -> usize {
    let mut times = BTreeSet::new();
    let mut sum = 0;
    for (i, track) in clip.tracks.iter().enumerate() {
        let bits: Vec<u64> = track.curve.times().iter().map(|t| t.to_bits()).collect();
        if times.insert(bits) {
            sum += 4 * track.curve.times().len();
        }
        let bits = match track.target {
            _ if short.get(i) != Some(&true) => 32,
            Target::Weights { .. } => track.curve.integers().map_or(32, |form| form.bits),
            _ => 16,
        };
        sum += track.curve.values().len() * bits / 8;
    }
    sum
}

impl Goal {
    /// What a curve costs beside others of its track.
    fn cost(self, curve: &Curve, short: bool, source: &Curve) -> usize {
        match self {
            Self::Keys => curve.times().len(),
            Self::Bytes => {
                let times = if curve.times() == source.times() { 0 } else { 4 * curve.times().len() };
                times + curve.values().len() * if short { 2 } else { 4 }
            }
        }
    }
}

impl Job {
    fn keys(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.curve.times().len())
    }

    /// The fewest keys within `allowed`.
    fn reduced(&self, allowed: f64, desc: &BakeDesc, effort: Effort) -> Option<Made> {
        let (s, goal) = (&self.samples, desc.goal);
        if s.is_constant(&self.rest, allowed) {
            return None;
        }
        let unit = self.unit(allowed).filter(|_| desc.quantize);
        let short = unit.is_some();
        let stored = |v: &[f32]| match unit {
            Some(unit) => v.iter().map(|x| (x * unit).round().clamp(-unit, unit) / unit).collect(),
            None => v.to_vec(),
        };
        let made = |curve, short, form| Made { curve, short, form, wider: 1.0 };
        let first = stored(s.value(0));
        if s.is_constant(&first, allowed) {
            let curve = Curve::new(vec![s.times[0]], first, s.width, Interpolation::Hold);
            return curve.ok().map(|c| made(c, short, Form::Straight));
        }
        if desc.keep_keys {
            // Slopes need more than 16 bits hold.
            let source = self.source.with_slopes();
            let short = short && source.interpolation() != Interpolation::Hermite;
            let values = if short { stored(source.values()) } else { source.values().to_vec() };
            let curve = Curve::new(source.times().to_vec(), values, s.width, source.interpolation());
            return curve.ok().map(|c| made(c, short, Form::Kept));
        }
        if self.source.interpolation() == Interpolation::Hold {
            return Some(made(self.steps(allowed, stored), short, Form::Straight));
        }
        let last = self.made.as_ref().filter(|_| effort == Effort::Again);
        let tried = |form: Form| last.is_none_or(|last| last.form == form);
        if last.is_some_and(|last| last.form == Form::Slopes) {
            return Some(made(cubic::own_slopes(s, allowed), false, Form::Slopes));
        }
        let own = [Interpolation::Linear, Interpolation::Hermite].contains(&self.source.interpolation());
        let wider = match last {
            Some(last) if last.wider > 1.0 => std::slice::from_ref(&last.wider),
            Some(_) => &[],
            None if effort == Effort::Draft => &fit::WIDER_DRAFT,
            None => &fit::WIDER,
        };
        let (pieces, wider) = fit::fitted(s, allowed, wider, stored);
        let mut best = Made { wider, ..made(self.straight(&pieces), short, Form::Straight) };
        let mut others = vec![];
        // Keys that stay where all of them were share their times with other tracks.
        if goal == Goal::Bytes && self.source.interpolation() == Interpolation::Linear {
            others.push(made(self.straight(&fit::all(s, stored)), short, Form::Kept));
        } else if own || goal == Goal::Keys {
            others.push(made(self.source.clone(), false, Form::Kept));
        }
        // No cubic is smaller than three straight pieces, and for a draft both cost the same error.
        if pieces.keys.len() > 4 && effort != Effort::Draft {
            if goal == Goal::Keys && tried(Form::Rule) {
                others.push(made(cubic::by_rule(s, allowed), false, Form::Rule));
            }
            if tried(Form::Slopes) {
                others.push(made(cubic::own_slopes(s, allowed), false, Form::Slopes));
            }
        }
        let cost = |made: &Made| goal.cost(&made.curve, made.short, &self.source);
        for other in others {
            if cost(&other) < cost(&best) {
                best = Made { wider, ..other };
            }
        }
        Some(best)
    }

    /// The integer that stands for 1, if integers hold the track's values well enough: a third of what is allowed, or exactly.
    fn unit(&self, allowed: f64) -> Option<f32> {
        match self.samples.kind {
            Kind::Rotation => (SHORT_ERROR < 0.3 * allowed).then_some(32_767.0),
            Kind::Weights => {
                let values = self.source.values();
                let within = |least: f32| values.iter().all(|v| (least..=1.0).contains(v));
                let units = if within(0.0) { [255.0, 65_535.0] } else { [127.0, 32_767.0] };
                let exact = self.source.integers().map(|form| form.unit());
                let fine = |unit: &f32| 0.5 / (*unit as f64) < 0.3 * allowed || exact == Some(*unit);
                units.into_iter().find(fine).filter(|_| within(-1.0))
            }
            _ => None,
        }
    }

    fn straight(&self, pieces: &fit::Pieces) -> Curve {
        let s = &self.samples;
        let times = pieces.keys.iter().map(|&k| s.times[k]).collect();
        let curve = Curve::new(times, pieces.values.clone(), s.width, Interpolation::Linear);
        curve.expect("keys of a curve, in order")
    }

    /// Steps whose value changes.
    fn steps(&self, allowed: f64, stored: impl Fn(&[f32]) -> Vec<f32>) -> Curve {
        let (mut times, mut values) = (vec![], Vec::<f32>::new());
        let width = self.samples.width;
        for (k, &t) in self.source.times().iter().enumerate() {
            let v = self.source.value(k);
            let last = values.len().checked_sub(width).map(|from| &values[from..]);
            if last.is_none_or(|last| self.samples.distance(last, v) > allowed) {
                times.push(t);
                values.extend(stored(v));
            }
        }
        Curve::new(times, values, width, Interpolation::Hold).expect("keys of a curve, in order")
    }
}
