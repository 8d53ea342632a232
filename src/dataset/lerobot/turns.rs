//! Jobs on several threads whose results are taken one at a time and in order, so that no more of them than threads wait.

use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    thread,
};

struct State<F, E> {
    /// The next job that nobody works on.
    next: usize,
    /// The job whose result is taken next.
    turn: usize,
    /// Why it has ended early.
    failed: Option<E>,
    /// A thread has panicked.
    abandoned: bool,
    take: F,
}

struct Turns<F, E> {
    state: Mutex<State<F, E>>,
    changed: Condvar,
}

impl<F, E> Turns<F, E> {
    fn lock(&self) -> MutexGuard<'_, State<F, E>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lets nobody wait for the turn of a thread that has panicked.
struct Watch<'a, F, E>(&'a Turns<F, E>);

impl<F, E> Drop for Watch<'_, F, E> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.lock().abandoned = true;
            self.0.changed.notify_all();
        }
    }
}

/// Does `jobs` jobs on `threads` threads; `take` gets each result in the order of the jobs, whoever finished first. A thread
/// holds its result until its turn has come.
///
/// # Errors
/// The error of the lowest-numbered job that failed, or that of `take`: no job behind it is taken.
pub(super) fn in_order<T, E: Send>(
    jobs: usize,
    threads: usize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    take: impl FnMut(usize, T) -> Result<(), E> + Send,
) -> Result<(), E> {
    let state = State { next: 0, turn: 0, failed: None, abandoned: false, take };
    let turns = Turns { state: Mutex::new(state), changed: Condvar::new() };
    let one = || {
        let _watch = Watch(&turns);
        loop {
            let mut state = turns.lock();
            if state.failed.is_some() || state.abandoned || state.next == jobs {
                break;
            }
            let job = state.next;
            state.next += 1;
            drop(state);
            let made = work(job);
            let mut state = turns.lock();
            while state.turn != job && state.failed.is_none() && !state.abandoned {
                state = turns.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if state.failed.is_some() || state.abandoned {
                break;
            }
            match made.and_then(|made| (state.take)(job, made)) {
                Ok(()) => state.turn += 1,
                Err(error) => state.failed = Some(error),
            }
            turns.changed.notify_all();
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, jobs.max(1)) {
            scope.spawn(one);
        }
    });
    turns.state.into_inner().unwrap_or_else(PoisonError::into_inner).failed.map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicUsize, Ordering},
        time::Duration,
    };

    use super::*;

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
        let done = in_order(20, 3, work, |job, result| {
            taken.fetch_add(1, Ordering::SeqCst);
            order.push((job, result));
            Ok(())
        });
        assert_eq!(done, Ok(()));
        assert_eq!(order, (0..20).map(|job| (job, 10 * job)).collect::<Vec<_>>());
        assert!(most.into_inner() <= 3);
    }

    #[test]
    fn the_first_failure_in_order_is_told_and_nothing_behind_it_is_taken() {
        for threads in [1, 4] {
            let mut taken = Vec::new();
            let work = |job: usize| if job == 5 || job == 7 { Err(job) } else { Ok(()) };
            let done = in_order(20, threads, work, |job, ()| {
                taken.push(job);
                Ok(())
            });
            assert_eq!((done, taken), (Err(5), vec![0, 1, 2, 3, 4]));
            assert_eq!(in_order(3, threads, |_| Ok(()), |job, ()| Err(job)), Err(0));
        }
    }

    #[test]
    fn a_panic_ends_it_instead_of_hanging_it() {
        let ended = std::panic::catch_unwind(|| {
            in_order(8, 3, |job| if job == 1 { panic!("boom") } else { Ok::<_, ()>(()) }, |_, ()| Ok(()))
        });
        assert!(ended.is_err());
    }
}
