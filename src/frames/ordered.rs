//! Work in parallel, results in order, memory that does not grow with their number.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The receiver wants no more results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop;

struct Queue<T, U> {
    /// Next job to hand out.
    next: usize,
    /// Results that were received.
    received: usize,
    /// First halves that a second one still needs; slot `i % (window + 1)`.
    first: Vec<Option<Half<T>>>,
    /// Results that wait for their turn; slot `i % window`.
    waiting: Vec<Option<U>>,
    stopped: bool,
}

/// Run jobs `0..count` on `threads` workers and hand every result to `receive` in order, on the calling thread.
///
/// Each worker makes its state once with `state`. At most `2 · threads` results wait, so memory does not grow with `count`.
/// The results do not depend on `threads`. Ends early when `receive` returns [`Stop`].
///
/// ```
/// use sinew::frames::in_order;
/// let mut seen = Vec::new();
/// in_order(5, 2, || (), |_, i| i * i, |i, square| { seen.push((i, square)); Ok(()) }).unwrap();
/// assert_eq!(seen, [(0, 0), (1, 1), (2, 4), (3, 9), (4, 16)]);
/// ```
///
/// # Errors
/// [`Stop`], if `receive` asked for it.
///
/// # Panics
/// If a job or `receive` panics; all workers have ended by then.
pub fn in_order<S, T: Send>(
    count: usize,
    threads: usize,
    state: impl Fn() -> S + Sync,
    job: impl Fn(&mut S, usize) -> T + Sync,
    receive: impl FnMut(usize, T) -> Result<(), Stop>,
) -> Result<(), Stop> {
    in_order_pairs(count, threads, state, |_, i| i, |s, _, i| job(s, *i), receive)
}

/// The same in two halves: `second` sees what `first` made of its own job and of the one before (none for job 0).
///
/// Both halves run on any worker, each exactly once a job: the second half of job `i` on the worker that completes the pair
/// `i − 1`, `i`. For films whose frames are stored as what changed.
///
/// ```
/// use sinew::frames::in_order_pairs;
/// let difference = |_: &mut (), before: Option<&usize>, now: &usize| now - before.unwrap_or(&0);
/// let mut seen = Vec::new();
/// in_order_pairs(5, 2, || (), |_, i| i * i, difference, |_, d| { seen.push(d); Ok(()) }).unwrap();
/// assert_eq!(seen, [0, 1, 3, 5, 7]);
/// ```
///
/// # Errors
/// [`Stop`], if `receive` asked for it.
///
/// # Panics
/// If a job or `receive` panics; all workers have ended by then.
pub fn in_order_pairs<S, T: Send + Sync, U: Send>(
    count: usize,
    threads: usize,
    state: impl Fn() -> S + Sync,
    first: impl Fn(&mut S, usize) -> T + Sync,
    second: impl Fn(&mut S, Option<&T>, &T) -> U + Sync,
    mut receive: impl FnMut(usize, U) -> Result<(), Stop>,
) -> Result<(), Stop> {
    if threads <= 1 || count <= 1 {
        let (mut s, mut before) = (state(), None);
        return (0..count).try_for_each(|i| {
            let now = first(&mut s, i);
            let result = second(&mut s, before.as_ref(), &now);
            before = Some(now);
            receive(i, result)
        });
    }
    let window = 2 * threads;
    let queue = Mutex::new(Queue {
        next: 0,
        received: 0,
        first: (0..=window).map(|_| None).collect(),
        waiting: (0..window).map(|_| None).collect(),
        stopped: false,
    });
    let changed = Condvar::new();
    std::thread::scope(|scope| {
        // A receiver that dies must not leave the workers waiting: the scope joins them.
        let _stop = StopOnDrop { queue: &queue, changed: &changed };
        for _ in 0..threads.min(count) {
            scope.spawn(|| {
                // A worker that dies must not leave the receiver waiting.
                let guard = StopOnDrop { queue: &queue, changed: &changed };
                work(count, &queue, &changed, &state, &first, &second);
                std::mem::forget(guard);
            });
        }
        for i in 0..count {
            let mut q = lock(&queue);
            while q.waiting[i % window].is_none() && !q.stopped {
                q = changed.wait(q).unwrap_or_else(PoisonError::into_inner);
            }
            let Some(result) = q.waiting[i % window].take() else { return Err(Stop) };
            q.received = i + 1;
            drop(q);
            changed.notify_all();
            receive(i, result)?;
        }
        Ok(())
    })
}

fn work<S, T, U>(
    count: usize,
    queue: &Mutex<Queue<T, U>>,
    changed: &Condvar,
    state: &impl Fn() -> S,
    first: &impl Fn(&mut S, usize) -> T,
    second: &impl Fn(&mut S, Option<&T>, &T) -> U,
) {
    let mut s = state();
    loop {
        let mut q = lock(queue);
        while !q.stopped && q.next < count && q.next >= q.received + q.waiting.len() {
            q = changed.wait(q).unwrap_or_else(PoisonError::into_inner);
        }
        if q.stopped || q.next >= count {
            return;
        }
        let i = q.next;
        q.next += 1;
        drop(q);
        let half = Arc::new(first(&mut s, i));
        let pairs = lock(queue).complete(i, half, count);
        for (k, before, now) in pairs.into_iter().flatten() {
            let result = second(&mut s, before.as_deref(), &now);
            // Buffers go back before anybody is told.
            drop((before, now));
            let mut q = lock(queue);
            let slot = k % q.waiting.len();
            q.waiting[slot] = Some(result);
            drop(q);
            changed.notify_all();
        }
    }
}

/// A job whose second half can be done: its number, the first half before it and its own.
type Pair<T> = (usize, Option<Arc<T>>, Arc<T>);

/// What a job's first half made.
struct Half<T> {
    job: usize,
    made: Arc<T>,
    /// Second halves that have yet to begin with it: the job's own, and the next one's.
    uses: u8,
}

impl<T, U> Queue<T, U> {
    /// Keep the first half of a job, and hand out the pairs that it completes.
    fn complete(&mut self, job: usize, made: Arc<T>, count: usize) -> [Option<Pair<T>>; 2] {
        let slot = job % self.first.len();
        self.first[slot] = Some(Half { job, made, uses: if job + 1 < count { 2 } else { 1 } });
        [self.pair(job), self.pair(job + 1)]
    }

    /// Both halves for the second half of a job, if both are there.
    fn pair(&mut self, job: usize) -> Option<Pair<T>> {
        let before = job.checked_sub(1);
        let there = |j: usize| self.first[j % self.first.len()].as_ref().is_some_and(|h| h.job == j);
        if !there(job) || !before.is_none_or(there) {
            return None;
        }
        let before = before.and_then(|j| self.take(j));
        self.take(job).map(|now| (job, before, now))
    }

    /// One of the uses of a first half; after the last nobody keeps it.
    fn take(&mut self, job: usize) -> Option<Arc<T>> {
        let slot = job % self.first.len();
        let half = self.first[slot].as_mut()?;
        half.uses -= 1;
        if half.uses > 0 {
            return Some(half.made.clone());
        }
        self.first[slot].take().map(|h| h.made)
    }
}

fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends all waiting, however its scope is left.
struct StopOnDrop<'a, T, U> {
    queue: &'a Mutex<Queue<T, U>>,
    changed: &'a Condvar,
}

impl<T, U> Drop for StopOnDrop<'_, T, U> {
    fn drop(&mut self) {
        lock(self.queue).stopped = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn results_come_in_order_and_few_wait() {
        let (made, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let mut received = 0;
        let job = |_: &mut (), i: usize| {
            if i.is_multiple_of(7) {
                std::thread::yield_now();
            }
            made.fetch_add(1, Ordering::SeqCst);
            i
        };
        in_order(
            500,
            3,
            || (),
            job,
            |i, r| {
                assert_eq!((i, r), (received, received));
                received += 1;
                most.fetch_max(made.load(Ordering::SeqCst) - received, Ordering::SeqCst);
                Ok(())
            },
        )
        .unwrap();
        assert_eq!(received, 500);
        assert!(most.into_inner() <= 6 + 3);
    }

    #[test]
    fn each_pair_is_seen_once_whatever_comes_first() {
        for threads in [1, 2, 3, 8] {
            let alive = AtomicUsize::new(0);
            struct Counted<'a>(usize, &'a AtomicUsize);
            impl Drop for Counted<'_> {
                fn drop(&mut self) {
                    self.1.fetch_sub(1, Ordering::SeqCst);
                }
            }
            let first = |_: &mut (), i: usize| {
                // Some jobs take longer than all that may follow them.
                if i.is_multiple_of(5) {
                    std::thread::sleep(std::time::Duration::from_micros(200));
                }
                assert!(alive.fetch_add(1, Ordering::SeqCst) <= 4 * threads + 1);
                Counted(i, &alive)
            };
            let second = |_: &mut (), before: Option<&Counted>, now: &Counted| (before.map(|b| b.0), now.0);
            let mut received = 0;
            in_order_pairs(
                300,
                threads,
                || (),
                first,
                second,
                |i, pair| {
                    assert_eq!((i, pair), (received, (i.checked_sub(1), i)));
                    received += 1;
                    Ok(())
                },
            )
            .unwrap();
            assert_eq!((received, alive.load(Ordering::SeqCst)), (300, 0), "{threads} threads");
        }
    }

    #[test]
    fn stopping_ends_all_workers() {
        let r = in_order(1_000_000, 2, || (), |_, i| i, |i, _| if i == 10 { Err(Stop) } else { Ok(()) });
        assert_eq!(r, Err(Stop));
    }

    #[test]
    #[should_panic]
    fn a_panic_in_a_job_reaches_the_caller() {
        let _ = in_order(10, 2, || (), |_, i| assert_ne!(i, 3), |_, _| Ok(()));
    }

    #[test]
    fn a_panic_in_the_receiver_reaches_the_caller() {
        // On a thread of its own, so that a deadlock fails instead of hanging.
        let (done, wait) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let run = || {
                in_order(1000, 2, || (), |_, i| i, |i, _| if i == 3 { panic!("as asked") } else { Ok(()) })
            };
            let _ = done.send(std::panic::catch_unwind(run).is_err());
        });
        assert_eq!(wait.recv_timeout(std::time::Duration::from_secs(20)), Ok(true));
    }
}
