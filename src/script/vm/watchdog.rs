//! Time limits: a hook that `pcall` cannot swallow, and a watchdog for C functions that never return.
//!
//! Limits count the processor time of the script's own thread, so that a busy machine does not time out a harmless
//! script. The hook runs every few thousand Lua instructions. Once the time is up it runs at *every* instruction and
//! raises an error each time, so that a `pcall` that catches the error gains only one instruction.
//!
//! A C function (`string.find` with a hostile pattern) never reaches the hook, and nothing can interrupt it. The
//! watchdog is a thread that calls [`StuckHandler`], which ends the process, if a running call has not reached the hook
//! for longer than it may take. The process must have had that much processor time for each virtual machine: threads
//! that share too few processors each get a part of it.

use std::{
    sync::{Arc, Mutex, Once, Weak},
    thread,
    time::{Duration, Instant},
};

use cpu_time::{ProcessTime, ThreadTime};
use mlua::{HookTriggers, Lua, VmState};

use super::error::{ScriptError, SourceLine, current_line};
use softvt_common::cancel;
use softvt_common::parallel::lock;

/// Instructions between two checks of the clock; about 0.3 ms.
const HOOK_INTERVAL: u32 = 20_000;
/// Time between two checks of the watchdog.
const WATCHDOG_INTERVAL: Duration = Duration::from_millis(20);

/// Called with a message when a library function does not return.
pub type StuckHandler = Arc<dyn Fn(&str) + Send + Sync>;

static CLOCKS: Mutex<Vec<Weak<Mutex<ClockState>>>> = Mutex::new(Vec::new());

fn watch(clock: &Arc<Mutex<ClockState>>) {
    static THREAD: Once = Once::new();
    lock(&CLOCKS).push(Arc::downgrade(clock));
    THREAD.call_once(|| {
        let check_all = || loop {
            thread::sleep(WATCHDOG_INTERVAL);
            lock(&CLOCKS).retain(|clock| clock.strong_count() > 0);
            let clocks = lock(&CLOCKS).clone();
            let machines = clocks.len() as u32;
            clocks.iter().filter_map(Weak::upgrade).for_each(|clock| check(&clock, machines));
        };
        // Without this thread a hostile C call would hang the run; everything else still works.
        let _ = thread::Builder::new().name("script-watchdog".into()).spawn(check_all);
    });
}

/// Calls `on_stuck` once if a running call is stuck. `machines` is the number of virtual machines, of which each may
/// have a thread of its own.
fn check(clock: &Mutex<ClockState>, machines: u32) {
    let mut state = lock(clock);
    let ClockState { file, grace, on_stuck, call } = &mut *state;
    let Some(LimitedCall { limit, remaining: Remaining::RunningUntil(_), last_seen }) = call else { return };
    let wait = *limit + *grace;
    if last_seen.take_if(|seen| seen.is_longer_ago_than(wait, machines)).is_some() {
        let message = format!(
            "{file}: the script called a library function that did not return within {}; \
             look for a string pattern that never comes to an end, or a huge repeat count",
            seconds(*limit)
        );
        let on_stuck = on_stuck.clone();
        drop(state);
        on_stuck(&message);
    }
}

struct ClockState {
    /// Main file of the script, for messages.
    file: String,
    /// Time beyond a limit before the watchdog acts.
    grace: Duration,
    on_stuck: StuckHandler,
    call: Option<LimitedCall>,
}

struct LimitedCall {
    limit: Duration,
    remaining: Remaining,
    /// Start of the call, or when the hook last ran; `None` once the watchdog has acted.
    last_seen: Option<Moment>,
}

/// Time that a call may still take.
enum Remaining {
    /// Processor time of the thread at which the call must be over.
    RunningUntil(Duration),
    /// Processor time left while the clock is paused.
    Paused(Duration),
}

/// A moment by the clock of the wall and by the processor time of the process.
struct Moment {
    wall: Instant,
    process: Duration,
}

impl Moment {
    fn now() -> Self {
        Self { wall: Instant::now(), process: ProcessTime::now().as_duration() }
    }

    /// True if a time has passed since, and for each of so many virtual machines in processor time.
    fn is_longer_ago_than(&self, time: Duration, machines: u32) -> bool {
        let now = Self::now();
        now.wall - self.wall >= time && now.process - self.process >= time * machines
    }
}

fn thread_time() -> Duration {
    ThreadTime::now().as_duration()
}

#[derive(Clone)]
pub(crate) struct Clock(Arc<Mutex<ClockState>>);

impl Clock {
    /// A clock without a running call. The watchdog calls `on_stuck` if a script exceeds a limit by `grace` without a
    /// call of the hook. Messages name `file`.
    pub(crate) fn new(file: &str, grace: Duration, on_stuck: StuckHandler) -> Self {
        let clock = Self(Arc::new(Mutex::new(ClockState { file: file.into(), grace, on_stuck, call: None })));
        watch(&clock.0);
        clock
    }

    pub(crate) fn install(&self, lua: &Lua) -> mlua::Result<()> {
        let clock = self.clone();
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(HOOK_INTERVAL), move |lua, running| {
            let Some(error) = clock.expired() else { return Ok(VmState::Continue) };
            let error = error.at(SourceLine::running(running).or_else(|| current_line(lua)));
            let again = error.clone();
            lua.set_global_hook(HookTriggers::new().every_nth_instruction(1), move |_, _| {
                Err(mlua::Error::external(again.clone()))
            })?;
            Err(mlua::Error::external(error))
        })
    }

    /// The error to raise if the time is up or the run is cancelled.
    fn expired(&self) -> Option<ScriptError> {
        let ClockState { file, call, .. } = &mut *lock(&self.0);
        if cancel::requested() {
            return Some(ScriptError::new(file.as_str(), "interrupted"));
        }
        let call = call.as_mut()?;
        call.last_seen = Some(Moment::now());
        match call.remaining {
            Remaining::RunningUntil(end) if thread_time() > end => {
                let message = format!("the script ran for more than {}", seconds(call.limit));
                Some(ScriptError::new(file.as_str(), message).hint("look for an endless loop"))
            }
            _ => None,
        }
    }

    /// Limits the virtual machine to `limit` of this thread's processor time until the guard is dropped. A nested call
    /// keeps the outer limit.
    pub(crate) fn start(&self, limit: Duration) -> ClockGuard {
        let mut state = lock(&self.0);
        if state.call.is_some() {
            return ClockGuard::None;
        }
        let remaining = Remaining::RunningUntil(thread_time() + limit);
        state.call = Some(LimitedCall { limit, remaining, last_seen: Some(Moment::now()) });
        ClockGuard::Deadline(self.clone())
    }

    /// Pauses the clock while a binding works in Rust (physics), until the guard is dropped.
    pub(crate) fn pause(&self) -> ClockGuard {
        if let Some(LimitedCall { remaining, .. }) = &mut lock(&self.0).call
            && let Remaining::RunningUntil(end) = *remaining
        {
            *remaining = Remaining::Paused(end.saturating_sub(thread_time()));
            return ClockGuard::Pause(self.clone());
        }
        ClockGuard::None
    }
}

fn seconds(limit: Duration) -> String {
    format!("{} s", limit.as_secs_f64())
}

/// Ends a time limit or a pause on drop; see [`Clock::start`] and [`Clock::pause`].
#[must_use]
pub(crate) enum ClockGuard {
    /// Of a nested call or pause, which changes nothing.
    None,
    Deadline(Clock),
    Pause(Clock),
}

impl Drop for ClockGuard {
    fn drop(&mut self) {
        match self {
            Self::None => {}
            Self::Deadline(clock) => lock(&clock.0).call = None,
            Self::Pause(clock) => {
                if let Some(call) = &mut lock(&clock.0).call
                    && let Remaining::Paused(left) = call.remaining
                {
                    call.remaining = Remaining::RunningUntil(thread_time() + left);
                    call.last_seen = Some(Moment::now());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(60);

    fn busy(time: Duration) {
        let start = thread_time();
        while thread_time() - start < time {
            std::hint::spin_loop();
        }
    }

    /// Runs a Lua loop after `work`, inside of a deadline.
    fn outcome(work: impl Fn(&Clock)) -> mlua::Result<()> {
        let (lua, clock) = (Lua::new(), Clock::new("x.lua", LIMIT, Arc::new(|_| {})));
        clock.install(&lua)?;
        let _deadline = clock.start(LIMIT);
        work(&clock);
        lua.load("for i = 1, 2 * 20000 do end").exec()
    }

    /// A clock, and a flag that is set once its watchdog acts.
    fn watched_clock() -> (Clock, Arc<Mutex<bool>>) {
        let is_stuck = Arc::new(Mutex::new(false));
        let flag = is_stuck.clone();
        (Clock::new("x.lua", LIMIT, Arc::new(move |_| *lock(&flag) = true)), is_stuck)
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
        let (clock, is_stuck) = watched_clock();
        let _deadline = clock.start(LIMIT);
        // As the hook of a slow script does on a busy machine, for five times as long as the watchdog waits.
        for _ in 0..100 {
            let _ = clock.expired();
            busy(LIMIT / 10);
        }
        assert!(!*lock(&is_stuck));
        busy(4 * LIMIT);
        // It may have to wait for the processor itself.
        let timeout = Instant::now() + 100 * LIMIT;
        while !*lock(&is_stuck) && Instant::now() < timeout {
            busy(LIMIT);
        }
        assert!(*lock(&is_stuck));
    }

    #[test]
    fn the_watchdog_waits_while_other_threads_have_the_processor() {
        // Other tests of this process use the processor too: an hour for each machine is more than they do.
        let (clock, is_stuck) = watched_clock();
        let _deadline = clock.start(LIMIT);
        let long_ago = Instant::now().checked_sub(10 * LIMIT).expect("the process runs for longer");
        let seen = Moment { wall: long_ago, ..Moment::now() };
        lock(&clock.0).call.as_mut().expect("a running call").last_seen = Some(seen);
        check(&clock.0, (3600.0 / LIMIT.as_secs_f64()) as u32);
        assert!(!*lock(&is_stuck));
    }

    #[test]
    fn deadlines_that_are_met_never_trigger_the_watchdog() {
        let (clock, is_stuck) = watched_clock();
        drop(clock.start(LIMIT));
        thread::sleep(3 * LIMIT);
        assert!(!*lock(&is_stuck));
    }
}
