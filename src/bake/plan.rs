//! How the error is shared among the tracks.

mod job;

use super::cost::Costs;
use super::fit::{Kind, Samples};
use super::gauge::{Gauge, Looks};
use super::{BakeDesc, Baked, Report, SEAM, edit, times};
use crate::character::Character;
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use job::{Effort, Form, Job, Made};
use std::collections::BTreeSet;

/// Moments at which the search compares vertices.
pub(super) const SEARCH_MOMENTS: usize = 400;

/// Vertices times moments that the search may compare in all.
const SEARCH_WORK: usize = 400_000_000;

/// What the search goes for, as a part of what is allowed: what lies between its moments may be a little more.
const AIM: f64 = 0.97;

/// And where they leave out keys.
const SPARSE_AIM: f64 = 0.94;

/// Less than this part of the aim is not used up.
const UNUSED: f64 = 0.85;

/// How often shares are raised then, by what, and how many tracks may be given less each time.
const RAISES: usize = 16;
const RAISE: f64 = 1.3;
const BLAMED: usize = 8;

/// Shares, and what was made with them.
struct State {
    share: f64,
    /// Of each track, its weight.
    tracks: Vec<(f64, Option<Made>)>,
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
        let error = self.narrow(gauge, &looks, aim, false);
        if error < UNUSED * aim {
            self.relieve(gauge, &looks, aim);
        }
        self.widen(gauge, &looks, aim);
        self.finish()
    }

    /// Bring the share close to the largest that keeps `aim`, and return the error that is left with it.
    fn narrow(&mut self, gauge: &Gauge, looks: &Looks, aim: f64, draft: bool) -> f64 {
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
            let (error, _) = gauge.most(looks, &self.assemble());
            if error <= aim {
                low = self.share;
                best = Some((error, self.state()));
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
        let Some((error, state)) = best else { return f64::INFINITY };
        self.restore(state);
        error
    }

    /// Raise the share where a few tracks are what keeps it low: those get less.
    fn relieve(&mut self, gauge: &Gauge, looks: &Looks, aim: f64) {
        let much = |plan: &Self| plan.desc.goal.left(&plan.finish().report);
        for _ in 0..RAISES {
            let (before, was) = (self.state(), much(self));
            self.share *= RAISE;
            self.make_all(gauge, Effort::Again);
            let mut blamed = 0;
            let error = loop {
                let clip = self.assemble();
                let (error, moment) = gauge.most(looks, &clip);
                if error <= aim || blamed == BLAMED {
                    break error;
                }
                blamed += 1;
                let i = self.to_blame(gauge, looks, moment, &clip);
                self.jobs[i].weight /= RAISE * RAISE;
                self.jobs[i].made = self.made(i, Effort::Again);
            };
            if error > aim || much(self) > was {
                return self.restore(before);
            }
        }
    }

    /// The track without whose error a moment would be least off.
    fn to_blame(&self, gauge: &Gauge, looks: &Looks, moment: usize, clip: &Clip) -> usize {
        let (shown, time) = looks.at(moment);
        let made = gauge.pose(clip, time);
        let all: Vec<usize> = (0..self.jobs.len()).collect();
        let left = gauge.map(&all, |i| {
            let mut pose = made.clone();
            let local = |b: crate::skeleton::BoneId| &shown.locals[b.index()];
            match self.jobs[i].target {
                Target::Rotation(b) | Target::Xzx(b) => pose.locals[b.index()].rotation = local(b).rotation,
                Target::Translation(b) => pose.locals[b.index()].translation = local(b).translation,
                Target::Scale(b) => pose.locals[b.index()].scale = local(b).scale,
                Target::Weights { first } => {
                    let run = first..first + self.jobs[i].source.width();
                    pose.weights[run.clone()].copy_from_slice(&shown.weights[run]);
                }
            }
            gauge.between(shown, &pose).share()
        });
        (0..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b])).unwrap_or(0)
    }

    fn state(&self) -> State {
        State { share: self.share, tracks: self.jobs.iter().map(|j| (j.weight, j.made.clone())).collect() }
    }

    fn restore(&mut self, state: State) {
        self.share = state.share;
        self.jobs.iter_mut().zip(state.tracks).for_each(|(job, kept)| (job.weight, job.made) = kept);
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

    /// All keys where they are, with no more bits than they need.
    pub fn kept(&mut self, gauge: &Gauge) -> Baked {
        let asked = std::mem::replace(&mut self.desc.keep_keys, true);
        self.make_all(gauge, Effort::Full);
        self.desc.keep_keys = asked;
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
        let want = crate::time::Range { start: times::single(want.start), end: times::single(want.end) };
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
