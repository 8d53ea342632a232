//! Many jobs on several threads, their results in the order of the jobs whoever finished first.

use std::sync::{
    atomic::{AtomicBool, AtomicUsize, Ordering},
    mpsc,
};

use super::{ControlError, Controller, Simulation};
use crate::policy::{Action, Observation, SensorStreams};

/// Runs `jobs` jobs on `threads` threads; `done` gets each result as it comes, on this thread.
///
/// After the first error no new job is started; those that run are finished. `stop` ends the run in the same way.
///
/// # Errors
/// The error of the lowest-numbered job that failed, or that of `done`. One from before `stop` comes first: what fails
/// afterwards may fail because of it.
pub fn run<T: Send, E: Send>(
    jobs: usize,
    threads: usize,
    stop: &AtomicBool,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    mut done: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let halt = AtomicBool::new(false);
    let (sender, results) = mpsc::channel();
    let mut failures: Vec<((bool, usize), E)> = Vec::new();
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, jobs.max(1)) {
            let sender = sender.clone();
            scope.spawn(|| {
                let sender = sender;
                while !halt.load(Ordering::Relaxed) && !stop.load(Ordering::Relaxed) {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= jobs {
                        break;
                    }
                    let result = work(job);
                    let late = stop.load(Ordering::Relaxed);
                    if sender.send((job, late, result)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (job, late, result) in results {
            let outcome = result.and_then(|value| done(job, value));
            if let Err(error) = outcome {
                halt.store(true, Ordering::Relaxed);
                failures.push(((late, job), error));
            }
        }
    });
    failures.into_iter().min_by_key(|(rank, _)| *rank).map_or(Ok(()), |(_, error)| Err(error))
}

/// Whoever drives, until the run is told to stop.
pub struct Cancellable<'a> {
    /// Who drives.
    pub driver: Box<dyn Controller>,
    /// Set when the run must end.
    pub stop: &'a AtomicBool,
}

impl Controller for Cancellable<'_> {
    fn streams(&self) -> SensorStreams {
        self.driver.streams()
    }

    fn gave_up(&self) -> Option<&str> {
        self.driver.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(ControlError::Interrupted);
        }
        self.driver.act(sim, observation)
    }

    fn wants_observation(&self) -> bool {
        self.driver.wants_observation()
    }

    fn finish(&mut self) {
        self.driver.finish();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_is_done_once_and_the_first_failure_is_told() {
        let stop = AtomicBool::new(false);
        let mut seen = [0; 20];
        let all = run(
            20,
            3,
            &stop,
            |job| Ok::<_, ()>(job * job),
            |job, value| {
                assert_eq!(value, job * job);
                seen[job] += 1;
                Ok(())
            },
        );
        assert!(all.is_ok() && seen.iter().all(|n| *n == 1));
        let failed = run(20, 1, &stop, |job| if job >= 5 { Err(job) } else { Ok(()) }, |_, ()| Ok(()));
        assert_eq!(failed, Err(5));
    }

    #[test]
    fn what_failed_before_the_stop_is_told_rather_than_what_failed_after_it() {
        let (stop, waits) = (AtomicBool::new(false), AtomicBool::new(true));
        let work = |job| {
            while job == 0 && waits.load(Ordering::Relaxed) {
                std::thread::yield_now();
            }
            // The last one to end is the first job, and by then the end was asked for.
            stop.store(job == 0, Ordering::Relaxed);
            Err::<(), _>(job)
        };
        let mut told = None;
        std::thread::scope(|scope| {
            let all = scope.spawn(|| run(2, 2, &stop, work, |_, ()| Ok(())));
            std::thread::sleep(std::time::Duration::from_millis(50));
            waits.store(false, Ordering::Relaxed);
            told = all.join().ok();
        });
        assert_eq!(told, Some(Err(1)));
    }

    #[test]
    fn nothing_starts_after_a_stop() {
        let stop = AtomicBool::new(true);
        let count = AtomicUsize::new(0);
        let work = |_| {
            count.fetch_add(1, Ordering::Relaxed);
            Ok::<_, ()>(())
        };
        assert!(run(5, 2, &stop, work, |_, ()| Ok(())).is_ok());
        assert_eq!(count.load(Ordering::Relaxed), 0);
    }
}
