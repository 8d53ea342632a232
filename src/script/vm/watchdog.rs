//! Time limits: a hook that `pcall` cannot swallow, and a watchdog for C functions that never return.
//!
//! Limits count the processor time of the script's own thread, so that a busy machine does not time out a harmless script.
//! The hook runs every few thousand Lua instructions. Once the time is up it runs at *every* instruction and raises an error
//! each time, so that a `pcall` that catches the error gains only one instruction.
//!
//! A C function (`string.find` with a hostile pattern) never reaches the hook, and nothing can interrupt it. The
//! [`Watchdog`] then calls [`OnStuck`], which ends the process. It does so only if the hook has not run since the last
//! check, and if the process has had at least as much processor time as the script may take.

use std::{
    collections::BTreeMap,
    sync::{Arc, Condvar, Mutex, OnceLock, PoisonError, Weak},
    thread,
    time::{Duration, Instant},
};

use cpu_time::{ProcessTime, ThreadTime};
use mlua::{HookTriggers, Lua, VmState, debug::Debug};

use super::error::{ScriptError, here};
use crate::{parallel::lock, rollout::cancel};

/// Instructions between two checks of the clock; about 0.3 ms.
const HOOK_INTERVAL: u32 = 20_000;

/// Called with a message when a library function does not return.
pub type OnStuck = Arc<dyn Fn(&str) + Send + Sync>;

type Slot = (Instant, u64);

/// A check that the watchdog makes at a set time.
#[derive(Clone)]
struct Alarm {
    clock: Weak<Mutex<HookState>>,
    /// The clock's beat when the alarm was set.
    beat: u64,
    /// Processor time of the process before which the script cannot have used up its own.
    not_before: Duration,
    message: String,
    on_stuck: OnStuck,
}

impl Alarm {
    /// The same alarm, `wait` later.
    fn set(self, beat: u64, wait: Duration) -> (Instant, Self) {
        (Instant::now() + wait, Self { beat, not_before: process_time() + wait, ..self })
    }

    /// Calls `on_stuck`, unless the hook has run since or other threads had the processor; then sets the alarm again.
    fn ring(self) {
        let Some(clock) = self.clock.upgrade() else { return };
        let mut state = lock(&clock);
        if state.until.is_none() {
            return;
        }
        let owed = self.not_before.saturating_sub(process_time());
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
struct AlarmQueue {
    waiting: BTreeMap<Slot, Alarm>,
    next: u64,
}

/// A thread that watches every running deadline of the process.
struct Watchdog {
    queue: Mutex<AlarmQueue>,
    changed: Condvar,
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
        // Only a new earliest deadline has to wake the thread; the others are found when it wakes anyway.
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
struct HookState {
    /// Processor time of the thread at which the running call must be over; `None` while nothing runs or the clock is
    /// paused.
    until: Option<Duration>,
    limit: Duration,
    grace: Duration,
    file: String,
    slot: Option<Slot>,
    /// Number of calls of the hook.
    beat: u64,
    /// Time left when the clock was paused, and the watchdog's alarm.
    paused: Option<(Duration, Option<Alarm>)>,
}

/// File and line of the running function, if it is a script's.
fn place(running: &Debug<'_>) -> Option<(String, usize)> {
    let file = running.source().source?.strip_prefix('@')?.to_owned();
    Some((file, running.current_line()?))
}

/// Processor time of this thread.
fn thread_time() -> Duration {
    ThreadTime::now().as_duration()
}

/// Processor time of the process.
fn process_time() -> Duration {
    ProcessTime::now().as_duration()
}

/// The clock of one virtual machine.
#[derive(Clone, Default)]
pub struct Clock {
    state: Arc<Mutex<HookState>>,
}

impl Clock {
    /// Installs the hook in `lua`.
    pub(crate) fn install(&self, lua: &Lua) -> mlua::Result<()> {
        let clock = self.clone();
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(HOOK_INTERVAL), move |lua, running| {
            let Some(error) = clock.expired() else { return Ok(VmState::Continue) };
            let error = error.found_at(place(running).or_else(|| here(lua)));
            let again = error.clone();
            lua.set_global_hook(HookTriggers::new().every_nth_instruction(1), move |_, _| {
                Err(mlua::Error::external(again.clone()))
            })?;
            Err(mlua::Error::external(error))
        })
    }

    /// The error to raise if the time is up or the run is cancelled.
    fn expired(&self) -> Option<ScriptError> {
        let mut state = lock(&self.state);
        state.beat += 1;
        if cancel::requested() {
            return Some(ScriptError::new(state.file.clone(), "interrupted"));
        }
        state.until.is_some_and(|until| thread_time() > until).then(|| {
            ScriptError::new(
                state.file.clone(),
                format!("the script ran for more than {}", seconds(state.limit)),
            )
            .hint("look for an endless loop")
        })
    }

    /// Limits the virtual machine to `limit` of this thread's processor time until the guard is dropped. The watchdog acts
    /// when the hook has not run for `grace` beyond that. Messages name `file`. A nested call keeps the outer limit.
    pub fn start(&self, limit: Duration, grace: Duration, file: &str, on_stuck: OnStuck) -> Deadline {
        let mut state = lock(&self.state);
        if state.until.is_some() || state.paused.is_some() {
            return Deadline { clock: None };
        }
        state.until = Some(thread_time() + limit);
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

    /// Pauses the clock while a binding works in Rust (physics), until the guard is dropped.
    pub fn pause(&self) -> Pause {
        let mut state = lock(&self.state);
        if let Some(until) = state.until.take() {
            let entry = state.slot.take().and_then(|slot| watchdog().remove(slot));
            state.paused = Some((until.saturating_sub(thread_time()), entry));
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
        state.paused = None;
        if let Some(slot) = state.slot.take() {
            watchdog().remove(slot);
        }
    }
}

/// A paused clock; see [`Clock::pause`].
#[must_use]
pub struct Pause {
    clock: Option<Clock>,
}

impl Drop for Pause {
    fn drop(&mut self) {
        let Some(clock) = &self.clock else { return };
        let mut state = lock(&clock.state);
        let Some((left, entry)) = state.paused.take() else { return };
        state.until = Some(thread_time() + left);
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

    /// Keeps this thread's processor busy for a time.
    fn busy(time: Duration) {
        let start = thread_time();
        while thread_time() - start < time {
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
    fn only_processor_time_of_the_script_counts() {
        assert!(outcome(|_| busy(2 * LIMIT)).is_err());
        let paused = |clock: &Clock| {
            let _pause = clock.pause();
            busy(2 * LIMIT);
        };
        assert!(outcome(paused).is_ok(), "a binding's work with the clock paused");
        assert!(outcome(|_| thread::sleep(2 * LIMIT)).is_ok(), "others had the processor");
    }

    #[test]
    fn the_watchdog_acts_only_if_the_hook_does_not_run() {
        let stuck = Arc::new(Mutex::new(false));
        let (clock, seen) = (Clock::default(), stuck.clone());
        let _deadline = clock.start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true));
        // As the hook of a slow script does on a busy machine, for five times as long as the watchdog waits.
        for _ in 0..100 {
            let _ = clock.expired();
            busy(LIMIT / 10);
        }
        assert!(!*lock(&stuck));
        busy(4 * LIMIT);
        // It may have to wait for the processor itself.
        let timeout = Instant::now() + 100 * LIMIT;
        while !*lock(&stuck) && Instant::now() < timeout {
            busy(LIMIT);
        }
        assert!(*lock(&stuck));
    }

    #[test]
    fn the_watchdog_waits_while_other_threads_have_the_processor() {
        // Other tests of this process use the processor too: an hour is more than they do.
        let hour = Duration::from_secs(3600);
        let (clock, woken) = (Clock::default(), Arc::new(Mutex::new(false)));
        let seen = woken.clone();
        let _deadline = clock.start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true));
        let slot = lock(&clock.state).slot.expect("an alarm");
        let alarm = watchdog().remove(slot).expect("not rung yet");
        Alarm { not_before: process_time() + hour, ..alarm }.ring();
        assert!(!*lock(&woken) && lock(&clock.state).slot.is_some_and(|slot| slot.0 > Instant::now()));
    }

    #[test]
    fn met_deadlines_never_trigger_the_watchdog() {
        let woken = Arc::new(Mutex::new(false));
        let seen = woken.clone();
        drop(Clock::default().start(LIMIT, LIMIT, "x.lua", Arc::new(move |_| *lock(&seen) = true)));
        thread::sleep(3 * LIMIT);
        assert!(!*lock(&woken));
    }
}
