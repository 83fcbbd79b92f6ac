//! Work in parallel, results in order, memory that does not grow with their number.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// The receiver wants no more results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop;

struct Queue<T> {
    /// Next job to hand out.
    next: usize,
    /// Results that were received.
    received: usize,
    /// Results that wait for their turn; slot `i % window`.
    waiting: Vec<Option<T>>,
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
    mut receive: impl FnMut(usize, T) -> Result<(), Stop>,
) -> Result<(), Stop> {
    if threads <= 1 || count <= 1 {
        let mut s = state();
        return (0..count).try_for_each(|i| receive(i, job(&mut s, i)));
    }
    let window = 2 * threads;
    let waiting = (0..window).map(|_| None).collect();
    let queue = Mutex::new(Queue { next: 0, received: 0, waiting, stopped: false });
    let changed = Condvar::new();
    std::thread::scope(|scope| {
        // A receiver that dies must not leave the workers waiting: the scope joins them.
        let _stop = StopOnDrop { queue: &queue, changed: &changed };
        for _ in 0..threads.min(count) {
            scope.spawn(|| {
                // A worker that dies must not leave the receiver waiting.
                let guard = StopOnDrop { queue: &queue, changed: &changed };
                work(count, window, &queue, &changed, &state, &job);
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

fn work<S, T>(
    count: usize,
    window: usize,
    queue: &Mutex<Queue<T>>,
    changed: &Condvar,
    state: &impl Fn() -> S,
    job: &impl Fn(&mut S, usize) -> T,
) {
    let mut s = state();
    loop {
        let mut q = lock(queue);
        while !q.stopped && q.next < count && q.next >= q.received + window {
            q = changed.wait(q).unwrap_or_else(PoisonError::into_inner);
        }
        if q.stopped || q.next >= count {
            return;
        }
        let i = q.next;
        q.next += 1;
        drop(q);
        let result = job(&mut s, i);
        lock(queue).waiting[i % window] = Some(result);
        changed.notify_all();
    }
}

fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    m.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends all waiting, however its scope is left.
struct StopOnDrop<'a, T> {
    queue: &'a Mutex<Queue<T>>,
    changed: &'a Condvar,
}

impl<T> Drop for StopOnDrop<'_, T> {
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
