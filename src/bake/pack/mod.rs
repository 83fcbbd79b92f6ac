//! Packed clips within an error: each track in the form that takes the fewest bits for its share of it.

mod job;
mod spline;
use super::cost::Costs;
use super::gauge::Gauge;
use super::{BakeDesc, BakeError, Report, plan, times};
use crate::character::Character;
use crate::clip::packed::{self, Draft, DraftForm, Grid};
use crate::clip::{Clip, Packed};
use job::Job;

/// A packed clip and what was reached with it.
#[derive(Clone, Debug)]
pub struct PackedBake {
    /// Plays from its bytes.
    pub packed: Packed,
    /// Keys and bytes, before and after: here a key is a moment that numbers are stored for.
    pub report: Report,
}

/// Pack a clip so that no point of the character strays farther than `desc` allows; `quantize` has no meaning here.
///
/// # Errors
/// [`BakeError`]: a tolerance that is none, or one that is finer than single precision.
///
/// # Panics
/// If the clip is not of the character.
pub fn pack(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<PackedBake, BakeError> {
    super::check(character, clip, desc)?;
    let gauge = Gauge::of(character, desc);
    let mut search = Search::new(character, clip, &gauge, desc);
    search.share();
    search.widen();
    let mut worst = super::Worst::default();
    let mut found = 0.0;
    for _ in 0..12 {
        let Some(packed) = search.packed() else { break };
        let verdict = times::verify(&gauge, clip, &packed.to_clip(&clip.name));
        let (ceiling, moments) = (verdict.ceiling, verdict.moments);
        worst = verdict.worst;
        if ceiling <= 1.0 {
            let keys = [clip.key_count(), search.jobs.iter().map(Job::keys).sum()];
            let bytes = [plan::bytes(clip, &[]), packed.bytes().len()];
            return Ok(PackedBake { packed, report: Report { worst, ceiling, moments, keys, bytes } });
        }
        found = ceiling;
        let over = if worst.share() > 1.0 { worst.share() } else { ceiling };
        search.within((0.97 / over).min(0.97));
    }
    let clip = clip.name.clone();
    Err(BakeError::Missed { clip, tolerance: worst.limit, reached: found * worst.limit, time: worst.time })
}

/// Moments at which the search compares vertices.
const SEARCH_MOMENTS: usize = 300;

/// Vertices times moments that the search may compare in all.
const SEARCH_WORK: usize = 400_000_000;

/// All tracks of a clip, and how the error is shared among them.
struct Search<'a> {
    clip: &'a Clip,
    gauge: &'a Gauge<'a>,
    tolerance: f64,
    jobs: Vec<Job>,
    share: f64,
    moments: Vec<f64>,
    grid: Option<Grid>,
    work: usize,
}

impl<'a> Search<'a> {
    fn new(character: &Character, clip: &'a Clip, gauge: &'a Gauge, desc: &BakeDesc) -> Self {
        let costs = Costs::new(gauge, clip);
        let range = clip.range();
        let mut jobs: Vec<Job> = vec![];
        for track in &clip.tracks {
            let (lever, rest) = costs.of(track);
            // The last track of a channel is the one that shows.
            jobs.retain(|j| j.target != track.target);
            jobs.push(Job::new(track, range, rest, lever));
        }
        let moments = times::coarse(clip, SEARCH_MOMENTS);
        let vertices: usize = character.instances().iter().map(|i| character.mesh(i).positions.len()).sum();
        let work = SEARCH_WORK / (vertices.max(character.skeleton().len()) * moments.len()).max(1);
        let grid = job::grid(clip);
        Self { clip, gauge, tolerance: desc.tolerance, jobs, share: 0.5, moments, grid, work }
    }

    /// The largest share for all that keeps the bound at the search's moments.
    fn share(&mut self) {
        self.bracket(4);
        // Those that have most numbers have most to gain from a larger part.
        let each: Vec<f64> = self.jobs.iter().map(|j| (j.numbers() as f64).max(3.0)).collect();
        let mean = each.iter().sum::<f64>() / each.len().max(1) as f64;
        self.jobs.iter_mut().zip(each).for_each(|(j, n)| j.weight = (n / mean).sqrt().clamp(0.3, 2.0));
        self.bracket(9);
    }

    fn bracket(&mut self, rounds: usize) {
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        for round in 0.. {
            self.make_all();
            let error = self.error();
            if error <= 1.0 {
                low = self.share
            } else {
                high = self.share
            }
            if high < 1.04 * low || round >= rounds && low > 0.0 || round > 40 {
                break;
            }
            // Errors grow about as the share does.
            let guess = self.share * (0.97 / error.max(1e-3)).clamp(0.2, 4.0);
            let inside = guess > 1.01 * low && guess < 0.99 * high;
            self.share = if inside {
                guess
            } else {
                (low.max(0.2 * high.min(self.share)) * high.min(4.0 * self.share)).sqrt()
            };
        }
        self.share = low;
        self.make_all();
    }

    fn error(&self) -> f64 {
        match self.packed() {
            Some(p) => self.gauge.worst(self.clip, &p.to_clip(""), &self.moments).share(),
            None => f64::INFINITY,
        }
    }

    /// Give single tracks more where the worst point does not notice.
    fn widen(&mut self) {
        for factor in [2.0, 1.5, 1.25] {
            // Those of most bits have most to give.
            let mut order: Vec<usize> = (0..self.jobs.len()).collect();
            order.sort_by_key(|&i| (std::cmp::Reverse(self.jobs[i].size()), i));
            for i in order {
                let before = self.jobs[i].size();
                if before == 0 || self.work == 0 {
                    continue;
                }
                let kept = (self.jobs[i].weight, self.jobs[i].made.clone());
                self.jobs[i].weight *= factor;
                self.make(i);
                if self.jobs[i].size() < before {
                    self.work -= 1;
                    if self.error() <= 0.99 {
                        continue;
                    }
                }
                (self.jobs[i].weight, self.jobs[i].made) = kept;
            }
        }
    }

    fn within(&mut self, part: f64) {
        self.share *= part;
        self.make_all();
    }

    fn make_all(&mut self) {
        (0..self.jobs.len()).for_each(|i| self.make(i));
    }

    fn make(&mut self, i: usize) {
        let job = &mut self.jobs[i];
        job.make(self.share * job.weight * self.tolerance / job.lever);
    }

    fn packed(&self) -> Option<Packed> {
        let mut drafts: Vec<Draft> =
            self.jobs.iter().filter_map(|j| j.made.as_ref()).map(|m| m.0.clone()).collect();
        // A clip that moves nothing still lasts.
        if drafts.is_empty() {
            let job = self.jobs.first()?;
            drafts.push(job.resting());
        }
        let keyed = drafts.iter().any(|d| matches!(d.form, DraftForm::Keys(..)));
        let bytes = packed::encode(self.clip.range(), self.grid.filter(|_| keyed), &drafts)?;
        Packed::from_bytes(&bytes).ok()
    }
}
