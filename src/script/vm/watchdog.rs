//! Time limits: a hook that Lua cannot swallow, and a watchdog for C functions that never come back.
//!
//! Limits are of the processor time of the script's own thread, so that a busy machine makes no honest script late. The
//! hook is called every few thousand instructions of Lua. Once the time is up it asks to be called at *every*
//! instruction and raises an error each time, so that a `pcall` that catches the error only gains one instruction. A C
//! function (`string.find` with a hostile pattern) never reaches the hook; nothing can stop it but the end of the
//! process, which the [`Watchdog`] brings about with a message: it spares a script whose hook has been called since it last
//! looked, and waits on while the whole process has not had as much processor time as the script may take.

use std::{
    collections::BTreeMap,
    sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError, Weak},
    thread,
    time::{Duration, Instant},
};

use cpu_time::{ProcessTime, ThreadTime};
use mlua::{HookTriggers, Lua, VmState, debug::Debug};

use crate::rollout::cancel;
use crate::script::{vm::error::ScriptError, vm::here};

/// Instructions between two looks at the clock; about 0.3 ms.
const STRIDE: u32 = 20_000;

/// What the watchdog does with its message; ends the process unless a test says otherwise.
pub type OnStuck = Arc<dyn Fn(&str) + Send + Sync>;

/// Prints the message and ends the process with the exit code of bad input; finished episodes are already on disk.
pub fn end_process() -> OnStuck {
    Arc::new(|message| {
        crate::text::eprint_line(&format!("softvt: {message}"));
        std::process::exit(2);
    })
}

type Slot = (Instant, u64);

/// What the watchdog does when a time has come.
#[derive(Clone)]
struct Alarm {
    clock: Weak<Mutex<State>>,
    /// The clock's beat when the alarm was set.
    beat: u64,
    /// Processor time of the process before which it does not sound: a script that hangs takes all that its thread gets.
    not_before: Duration,
    message: String,
    on_stuck: OnStuck,
}

impl Alarm {
    /// The same for a script that may take `wait` more.
    fn set(self, beat: u64, wait: Duration) -> (Instant, Self) {
        (Instant::now() + wait, Self { beat, not_before: used_by_all() + wait, ..self })
    }

    /// Sounds, unless the script has shown life since, or others had the processor; then it is set anew.
    fn ring(self) {
        let Some(clock) = self.clock.upgrade() else { return };
        let mut state = lock(&clock);
        if state.until.is_none() {
            return;
        }
        let owed = self.not_before.saturating_sub(used_by_all());
        let (at, alarm) = match state.beat == self.beat {
            true if owed.is_zero() => {
                drop(state);
                return (self.on_stuck)(&self.message);
            }
            true => (Instant::now() + owed, self),
            false => self.set(state.beat, state.grace),
        };
        state.slot = Some(watchdog().add(at, alarm));
    }
}

#[derive(Default)]
struct Queue {
    waiting: BTreeMap<Slot, Alarm>,
    next: u64,
}

/// One thread for the process that knows every running deadline.
struct Watchdog {
    queue: Mutex<Queue>,
    changed: Condvar,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn watchdog() -> &'static Watchdog {
    static DOG: OnceLock<&'static Watchdog> = OnceLock::new();
    DOG.get_or_init(|| {
        let dog: &'static Watchdog =
            Box::leak(Box::new(Watchdog { queue: Mutex::default(), changed: Condvar::new() }));
        // Without this thread a hostile C call would hang the run; everything else still works.
        let _ = thread::Builder::new().name("script-watchdog".into()).spawn(|| dog.watch());
        dog
    })
}

impl Watchdog {
    fn watch(&self) {
        let mut queue = lock(&self.queue);
        loop {
            let now = Instant::now();
            let first = queue.waiting.keys().next().copied();
            queue = match first {
                Some(slot) if slot.0 <= now => {
                    let expired = queue.waiting.remove(&slot);
                    drop(queue);
                    if let Some(alarm) = expired {
                        alarm.ring();
                    }
                    lock(&self.queue)
                }
                Some(slot) => {
                    let wait = self.changed.wait_timeout(queue, slot.0 - now);
                    wait.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    fn add(&self, at: Instant, alarm: Alarm) -> Slot {
        let mut queue = lock(&self.queue);
        let slot = (at, queue.next);
        queue.next += 1;
        let earliest = queue.waiting.keys().next().is_none_or(|first| at < first.0);
        queue.waiting.insert(slot, alarm);
        drop(queue);
        // Every new deadline that is not the first is found when the first comes up: no need to wake anyone.
        if earliest {
            self.changed.notify_one();
        }
        slot
    }

    fn remove(&self, slot: Slot) -> Option<Alarm> {
        lock(&self.queue).waiting.remove(&slot)
    }
}

#[derive(Default)]
struct State {
    /// Processor time of the thread at which the running call must be over; none while nothing runs or the clock is
    /// stopped.
    until: Option<Duration>,
    limit: Duration,
    grace: Duration,
    file: String,
    slot: Option<Slot>,
    /// How often the hook has looked.
    beat: u64,
    /// Time left when the clock was stopped, and the watchdog's entry.
    stopped: Option<(Duration, Option<Alarm>)>,
}

/// File and line of what is running, if it is a script's.
fn place(running: &Debug<'_>) -> Option<(String, usize)> {
    let file = running.source().source?.strip_prefix('@')?.to_owned();
    Some((file, running.current_line()?))
}

/// Processor time that this thread has used.
fn used() -> Duration {
    ThreadTime::now().as_duration()
}

/// Processor time that the process has used.
fn used_by_all() -> Duration {
    ProcessTime::now().as_duration()
}

/// The clock of one virtual machine.
#[derive(Clone, Default)]
pub struct Clock {
    state: Arc<Mutex<State>>,
}

impl Clock {
    /// Installs the hook in `lua`.
    pub(crate) fn install(&self, lua: &Lua) -> mlua::Result<()> {
        let clock = self.clone();
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(STRIDE), move |lua, running| {
            let Some(error) = clock.expired() else { return Ok(VmState::Continue) };
            let error = error.found_at(place(running).or_else(|| here(lua)));
            let again = error.clone();
            lua.set_global_hook(HookTriggers::new().every_nth_instruction(1), move |_, _| {
                Err(mlua::Error::external(again.clone()))
            })?;
            Err(mlua::Error::external(error))
        })
    }

    /// What is wrong once the time is up or the run is to end.
    fn expired(&self) -> Option<ScriptError> {
        let mut state = lock(&self.state);
        state.beat += 1;
        if cancel::requested() {
            return Some(ScriptError::new(state.file.clone(), "interrupted"));
        }
        state.until.is_some_and(|until| used() > until).then(|| {
            ScriptError::new(
                state.file.clone(),
                format!("the script ran for more than {}", seconds(state.limit)),
            )
            .hint("look for an endless loop")
        })
    }

    /// Gives the machine `limit` of this thread's processor time from now on, until the guard is dropped; the watchdog
    /// acts when `grace` more has passed without a sign of life. `file` is named in messages. A call inside of
    /// a call keeps the outer limit.
    pub fn start(&self, limit: Duration, grace: Duration, file: &str, on_stuck: OnStuck) -> Deadline {
        let mut state = lock(&self.state);
        if state.until.is_some() || state.stopped.is_some() {
            return Deadline { clock: None };
        }
        state.until = Some(used() + limit);
        state.limit = limit;
        state.grace = grace;
        state.file = file.into();
        let message = format!(
            "{file}: the script called a library function that did not return within {}; \
             look for a string pattern that never comes to an end, or a huge repeat count",
            seconds(limit)
        );
        let clock = Arc::downgrade(&self.state);
        let alarm = Alarm { clock, beat: state.beat, not_before: Duration::ZERO, message, on_stuck };
        let (at, alarm) = alarm.set(state.beat, limit + grace);
        state.slot = Some(watchdog().add(at, alarm));
        Deadline { clock: Some(self.clone()) }
    }

    /// Stops the clock while a binding does honest work in Rust (physics), until the guard is dropped.
    pub fn pause(&self) -> Pause {
        let mut state = lock(&self.state);
        if let Some(until) = state.until.take() {
            let entry = state.slot.take().and_then(|slot| watchdog().remove(slot));
            state.stopped = Some((until.saturating_sub(used()), entry));
            return Pause { clock: Some(self.clone()) };
        }
        Pause { clock: None }
    }
}

fn seconds(limit: Duration) -> String {
    format!("{} s", limit.as_secs_f64())
}

/// A running time limit; see [`Clock::start`].
#[must_use]
pub struct Deadline {
    clock: Option<Clock>,
}

impl Drop for Deadline {
    fn drop(&mut self) {
        let Some(clock) = &self.clock else { return };
        let mut state = lock(&clock.state);
        state.until = None;
        state.stopped = None;
        if let Some(slot) = state.slot.take() {
            watchdog().remove(slot);
        }
    }
}

/// A stopped clock; see [`Clock::pause`].
#[must_use]
pub struct Pause {
    clock: Option<Clock>,
}

impl Drop for Pause {
    fn drop(&mut self) {
        let Some(clock) = &self.clock else { return };
        let mut state = lock(&clock.state);
        let Some((left, entry)) = state.stopped.take() else { return };
        state.until = Some(used() + left);
        let (beat, wait) = (state.beat, left + state.grace);
        state.slot = entry.map(|alarm| {
            let (at, alarm) = alarm.set(beat, wait);
            watchdog().add(at, alarm)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(60);

    /// Keeps this thread's processor busy for so long.
    fn toil(time: Duration) {
        let start = used();
        while used() - start < time {
            std::hint::spin_loop();
        }
    }

    /// Runs a Lua loop after `work`, inside of a deadline.
    fn outcome(work: impl Fn(&Clock)) -> mlua::Result<()> {
        let (lua, clock) = (Lua::new(), Clock::default());
        clock.install(&lua)?;
        let _deadline = clock.start(LIMIT, LIMIT, "x.lua", Arc::new(|_| {}));
        work(&clock);
        lua.load("for i = 1, 2 * 20000 do end").exec()
    }

    #[test]
    fn only_the_scripts_own_processor_time_counts() {
        assert!(outcome(|_| toil(2 * LIMIT)).is_err());
        let paused = |clock: &Clock| {
            let _pause = clock.pause();
            toil(2 * LIMIT);
        };
        assert!(outcome(paused).is_ok(), "a binding's work with the clock stopped");
        assert!(outcome(|_| thread::sleep(2 * LIMIT)).is_ok(), "others had the processor");
    }

    #[test]
    fn the_watchdog_spares_who_shows_life_and_barks_at_who_does_not() {
        let stuck = Arc::new(Mutex::new(false));
        let (clock, seen) = (Clock::default(), stuck.clone());
        let _deadline = clock.start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true));
        // What the hook of a slow script does on a busy machine, for five times as long as the watchdog waits.
        for _ in 0..100 {
            let _ = clock.expired();
            toil(LIMIT / 10);
        }
        assert!(!*lock(&stuck));
        toil(4 * LIMIT);
        // It may have to wait for the processor itself.
        let patience = Instant::now() + 100 * LIMIT;
        while !*lock(&stuck) && Instant::now() < patience {
            toil(LIMIT);
        }
        assert!(*lock(&stuck));
    }

    #[test]
    fn the_watchdog_waits_while_others_have_the_processor() {
        // Other tests of this process use the processor too: an hour is more than they do.
        let hour = Duration::from_secs(3600);
        let (clock, woken) = (Clock::default(), Arc::new(Mutex::new(false)));
        let seen = woken.clone();
        let _deadline = clock.start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true));
        let slot = lock(&clock.state).slot.expect("an alarm");
        let alarm = watchdog().remove(slot).expect("not rung yet");
        Alarm { not_before: used_by_all() + hour, ..alarm }.ring();
        assert!(!*lock(&woken) && lock(&clock.state).slot.is_some_and(|slot| slot.0 > Instant::now()));
    }

    #[test]
    fn a_deadline_that_was_met_never_wakes_the_watchdog() {
        let woken = Arc::new(Mutex::new(false));
        let seen = woken.clone();
        drop(Clock::default().start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true)));
        thread::sleep(3 * LIMIT);
        assert!(!*lock(&woken));
    }
}
