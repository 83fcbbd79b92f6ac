//! Frames drawn in parallel and received in order.

use super::super::film::Job;
use super::super::time::Frame;
use crate::cli::{Failure, say::Say};
use sinew::frames::{Stop, Worker, in_order};

/// Do `one` with every frame on the job's threads, and hand the results on in order.
pub fn frames<S, T: Send>(
    job: &Job,
    frames: &[Frame],
    say: &Say,
    state: impl Fn() -> S + Sync,
    one: impl Fn(&mut S, &mut Worker, &Frame) -> T + Sync,
    mut receive: impl FnMut(usize, T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let bar = say.progress(frames.len());
    let mut fault = None;
    let start = || (Worker::default(), state());
    let work = |(worker, state): &mut (Worker, S), i: usize| one(state, worker, &frames[i]);
    let done = in_order(frames.len(), job.threads, start, work, |i, result| {
        bar.inc(1);
        receive(i, result).map_err(|e| {
            fault = Some(e);
            Stop
        })
    });
    bar.finish_and_clear();
    match (done, fault) {
        (Ok(()), _) => Ok(()),
        (_, Some(e)) => Err(e),
        (Err(Stop), None) => Err(Failure::Run("drawing stopped".into())),
    }
}
