//! Numbered jobs on a pool of threads: episodes, points of an experiment, rows of a dataset.
//!
//! The threads are those of a rayon pool. Rayon's parallel iterators are not used, because results must reach their
//! consumer while later jobs still run, an error must keep the rank of its job, and the number of results in memory
//! must be bounded. Each thread of the pool runs one loop over the queue of jobs, so a job that itself uses rayon
//! never starts another job while it waits.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Condvar, Mutex, MutexGuard, PoisonError, mpsc},
};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Locks a mutex. The value of a poisoned mutex is used as it is: callers must leave it valid wherever they can panic.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs the jobs `0..jobs` on up to `threads` threads and passes each result to `sink` as soon as it is there, in no
/// particular order. `sink` runs on the calling thread.
///
/// After the first error, a panic, or once `cancelled` returns true, no further job starts; those that run are finished
/// and their results are passed on. A panic of a job is resumed on the calling thread.
///
/// # Errors
/// The error of the lowest-numbered job that failed, in `work` or in `sink`. Errors from before the cancellation take
/// precedence over later ones, which the cancellation may have caused.
pub fn run<T: Send, E: Send>(
    jobs: usize,
    threads: usize,
    cancelled: impl Fn() -> bool + Sync,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    mut sink: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let mut failures: Vec<((bool, usize), E)> = Vec::new();
    let queue = JobQueue::new(jobs, jobs);
    let timed = |job| {
        let result = work(job);
        (result, cancelled())
    };
    run_queue(&queue, threads, &cancelled, timed, |job, (result, late)| {
        if let Err(error) = result.and_then(|value| sink(job, value)) {
            queue.close();
            failures.push(((late, job), error));
        }
    });
    failures.into_iter().min_by_key(|(rank, _)| *rank).map_or(Ok(()), |(_, error)| Err(error))
}

/// Runs the jobs `0..jobs` on up to `threads` threads and passes their results to `sink` in the order of the jobs.
/// `sink` runs on the calling thread. At most `threads` results exist at a time, counting those in progress.
///
/// Stops as [`run`] does, but no result after the first error is passed on.
///
/// # Errors
/// The first error in the order of the jobs, of `work` or of `sink`.
pub fn run_in_order<T: Send, E: Send>(
    jobs: usize,
    threads: usize,
    cancelled: impl Fn() -> bool + Sync,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    mut sink: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let queue = JobQueue::new(jobs, threads.max(1));
    let (mut waiting, mut next) = (BTreeMap::new(), 0);
    let mut outcome = Ok(());
    run_queue(&queue, threads, &cancelled, work, |job, result| {
        waiting.insert(job, result);
        while outcome.is_ok()
            && let Some(result) = waiting.remove(&next)
        {
            outcome = result.and_then(|value| sink(next, value));
            next += 1;
            match outcome {
                Ok(()) => queue.allow(next + threads.max(1)),
                Err(_) => queue.close(),
            }
        }
    });
    outcome
}

/// Runs the jobs of `queue` and passes their results to `take`, on the calling thread.
fn run_queue<T: Send>(
    queue: &JobQueue,
    threads: usize,
    cancelled: &(impl Fn() -> bool + Sync),
    work: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T),
) {
    let threads = threads.min(queue.jobs);
    let Some(pool) = pool(threads) else {
        while let Some(job) = queue.next(cancelled) {
            take(job, work(job));
        }
        return;
    };
    let mut panicked = None;
    pool.in_place_scope(|scope| {
        // Also if `take` panics, so that no thread waits for it.
        let _close = CloseOnDrop(queue);
        let (sender, results) = mpsc::channel();
        for _ in 0..threads {
            let (sender, work) = (sender.clone(), &work);
            scope.spawn(move |_| {
                while let Some(job) = queue.next(cancelled) {
                    let result = catch_unwind(AssertUnwindSafe(|| work(job)));
                    if sender.send((job, result)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (job, result) in results {
            match result {
                Ok(result) => take(job, result),
                Err(payload) => {
                    queue.close();
                    panicked.get_or_insert(payload);
                }
            }
        }
    });
    if let Some(payload) = panicked {
        resume_unwind(payload);
    }
}

/// A pool of more than one thread. `None` for fewer, or if the system refuses them: then the calling
/// thread does the work.
fn pool(threads: usize) -> Option<ThreadPool> {
    if threads < 2 {
        return None;
    }
    ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("worker-{index}")).build().ok()
}

/// Hands out job numbers in increasing order.
struct JobQueue {
    jobs: usize,
    state: Mutex<QueueState>,
    changed: Condvar,
}

struct QueueState {
    next: usize,
    /// Jobs from this number on have to wait.
    limit: usize,
    closed: bool,
}

impl JobQueue {
    fn new(jobs: usize, limit: usize) -> Self {
        Self {
            jobs,
            state: Mutex::new(QueueState { next: 0, limit, closed: false }),
            changed: Condvar::new(),
        }
    }

    /// Number of the next job, once it is below the limit; `None` if all jobs have started or the queue is closed.
    fn next(&self, cancelled: &impl Fn() -> bool) -> Option<usize> {
        let waits =
            |state: &mut QueueState| !state.closed && state.next < self.jobs && state.next >= state.limit;
        let state = self.changed.wait_while(lock(&self.state), waits);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        if state.closed || state.next == self.jobs || cancelled() {
            return None;
        }
        state.next += 1;
        Some(state.next - 1)
    }

    fn allow(&self, limit: usize) {
        lock(&self.state).limit = limit;
        self.changed.notify_all();
    }

    fn close(&self) {
        lock(&self.state).closed = true;
        self.changed.notify_all();
    }
}

struct CloseOnDrop<'a>(&'a JobQueue);

impl Drop for CloseOnDrop<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicBool, AtomicUsize, Ordering},
        thread,
        time::Duration,
    };

    use super::*;

    const NEVER: fn() -> bool = || false;

    #[test]
    fn every_job_runs_once_and_the_first_failure_is_returned() {
        let mut seen = [0; 20];
        let all = run(
            20,
            3,
            NEVER,
            |job| Ok::<_, ()>(job * job),
            |job, value| {
                assert_eq!(value, job * job);
                seen[job] += 1;
                Ok(())
            },
        );
        assert!(all.is_ok() && seen.iter().all(|n| *n == 1));
        let failed = run(20, 1, NEVER, |job| if job >= 5 { Err(job) } else { Ok(()) }, |_, ()| Ok(()));
        assert_eq!(failed, Err(5));
    }

    #[test]
    fn a_failure_before_the_cancellation_takes_precedence_over_one_after_it() {
        let (cancel, waits) = (AtomicBool::new(false), AtomicBool::new(true));
        let work = |job| {
            while job == 0 && waits.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            // The last job to end is the first one, after the cancellation.
            cancel.store(job == 0, Ordering::Relaxed);
            Err::<(), _>(job)
        };
        let mut found = None;
        thread::scope(|scope| {
            let all = scope.spawn(|| run(2, 2, || cancel.load(Ordering::Relaxed), work, |_, ()| Ok(())));
            thread::sleep(Duration::from_millis(50));
            waits.store(false, Ordering::Relaxed);
            found = all.join().ok();
        });
        assert_eq!(found, Some(Err(1)));
    }

    #[test]
    fn no_job_starts_after_a_cancellation() {
        let count = AtomicUsize::new(0);
        let work = |_| {
            count.fetch_add(1, Ordering::Relaxed);
            Ok::<_, ()>(())
        };
        assert!(run(5, 2, || true, work, |_, ()| Ok(())).is_ok());
        assert_eq!(count.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn results_come_in_order_and_no_more_wait_than_there_are_threads() {
        let (begun, taken, most) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let mut order = Vec::new();
        let work = |job: usize| {
            let open = begun.fetch_add(1, Ordering::SeqCst) + 1 - taken.load(Ordering::SeqCst);
            most.fetch_max(open, Ordering::SeqCst);
            // The first is the slowest by far.
            thread::sleep(Duration::from_millis(if job == 0 { 60 } else { 1 }));
            Ok::<_, ()>(10 * job)
        };
        let done = run_in_order(20, 3, NEVER, work, |job, result| {
            taken.fetch_add(1, Ordering::SeqCst);
            order.push((job, result));
            Ok(())
        });
        assert_eq!(done, Ok(()));
        assert_eq!(order, (0..20).map(|job| (job, 10 * job)).collect::<Vec<_>>());
        assert!(most.into_inner() <= 3);
    }

    #[test]
    fn the_first_failure_in_order_is_returned_and_no_later_result_is_taken() {
        for threads in [1, 4] {
            let mut taken = Vec::new();
            let work = |job: usize| if job == 5 || job == 7 { Err(job) } else { Ok(()) };
            let done = run_in_order(20, threads, NEVER, work, |job, ()| {
                taken.push(job);
                Ok(())
            });
            assert_eq!((done, taken), (Err(5), vec![0, 1, 2, 3, 4]));
            assert_eq!(run_in_order(3, threads, NEVER, |_| Ok(()), |job, ()| Err(job)), Err(0));
        }
    }

    #[test]
    fn a_panic_ends_the_run_instead_of_blocking_it() {
        let work = |job| if job == 1 { panic!("boom") } else { Ok::<_, ()>(()) };
        let sink = |job, ()| if job == 1 { panic!("boom") } else { Ok::<_, ()>(()) };
        assert!(catch_unwind(|| run(8, 3, NEVER, work, |_, ()| Ok(()))).is_err());
        assert!(catch_unwind(|| run_in_order(8, 3, NEVER, work, |_, ()| Ok(()))).is_err());
        assert!(catch_unwind(|| run_in_order(8, 3, NEVER, |_| Ok(()), sink)).is_err());
    }
}
