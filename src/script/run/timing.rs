//! CPU time by phase, for people to read on the standard error; never part of a result.

use std::{fmt, time::Duration};

use cpu_time::ThreadTime;

/// CPU and simulated time of named phases.
#[derive(Debug, Default)]
pub(crate) struct Timing {
    phases: Vec<(String, Duration, f64)>,
}

impl Timing {
    /// Starts a phase.
    pub(crate) fn phase(&mut self, name: &str) {
        self.phases.push((name.to_owned(), Duration::ZERO, 0.0));
    }

    /// Runs a step of `dt` (s) on the account of the present phase.
    pub(crate) fn measure<R>(&mut self, dt: f64, work: impl FnOnce() -> R) -> R {
        let start = ThreadTime::now();
        let result = work();
        if self.phases.is_empty() {
            self.phase("run");
        }
        if let Some(phase) = self.phases.last_mut() {
            phase.1 += start.elapsed();
            phase.2 += dt;
        }
        result
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rate = |cpu: Duration, simulated: f64| cpu.as_secs_f64() / simulated.max(f64::MIN_POSITIVE);
        let cpu = self.phases.iter().map(|p| p.1).sum();
        let simulated = self.phases.iter().map(|p| p.2).sum();
        write!(f, "cpu_s_per_sim_s: {:.3}", rate(cpu, simulated))?;
        let parts: Vec<String> = self
            .phases
            .iter()
            .map(|(name, cpu, simulated)| format!("{name} {:.3}", rate(*cpu, *simulated)))
            .collect();
        write!(f, " ({})", parts.join(", "))
    }
}
