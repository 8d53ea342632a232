//! `softvt record`: demonstrations of the tasks of a suite that are safe and reach the goal.

use std::collections::BTreeMap;

use clap::{Args, value_parser};
use serde_json::json;

use crate::{
    args::{PolicyArgs, RecordingArgs, ScriptArgs},
    error::CliError,
    output::print_recording,
};
use softvt_benchmark::Suite;
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::parallel;
use softvt_policy::{Action, Observation, PolicyError, SensorStreams};
use softvt_rollout::{Controller, Simulation};
use softvt_runner::{
    EpisodeList, LoadedRun, PolicyConfig, RunConfig, SuiteRun, expert_controller,
    recording::{GripLog, SuiteRecording, record_all},
    selection::{select_suites, select_tasks},
};
use softvt_script::ExpertController;

/// Attempts per demonstration, unless `--attempts` is given.
const ATTEMPTS_PER_DEMO: u32 = 4;
/// Minimum number of attempts per task, unless `--attempts` is given.
const MIN_ATTEMPTS: u32 = 20;

/// Record demonstrations: HDF5 files, videos and a manifest
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt record [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    recording: RecordingArgs,
    /// Demonstrations per task
    #[arg(long, value_name = "N", default_value = "50", value_parser = value_parser!(u32).range(1..=100_000))]
    demos: u32,
    /// Record only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    tasks: Vec<String>,
    /// Maximum attempts per task, kept or not [default: 4 per demonstration, at least 20]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    attempts: Option<u32>,
}

/// Records the demonstrations that the arguments ask for.
///
/// # Errors
/// The script has no suite, the folder contains something else, an attempt or a file fails, or too
/// few attempts are good.
pub(super) fn run(args: RecordArgs) -> Result<(), CliError> {
    let (mut policy, demos) = (args.policy, args.demos);
    let recording = &args.recording.options(policy.take_export_code());
    let request = args.recording.request(args.script, args.tasks)?;
    let default_attempts = demos.saturating_mul(ATTEMPTS_PER_DEMO).max(MIN_ATTEMPTS);
    let max_attempts = args.attempts.unwrap_or(default_attempts);
    let LoadedRun { config, script: loaded } = request.load_plan("record", &policy)?;
    let suites = select_suites("record", &config, &loaded.plan)?;
    let names: Vec<String> = suites.iter().map(|suite| config.suite_name(suite)).collect();
    let mut request = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "demos": demos,
        "pictures": recording.has_images,
        "privileged": recording.has_privileged,
        "suites": names,
    });
    if let Some(code) = recording.gripper {
        request["gripper"] = json!(code);
    }
    let taught = |suite: &Suite| {
        let policy = PolicyConfig::load(&policy.taught_by(suite.teacher))?;
        Ok::<_, CliError>(config.clone().with_policy(policy))
    };
    let configs: Vec<RunConfig> = suites.iter().map(taught).collect::<Result<_, _>>()?;
    let recorded = record_all(recording, &request, || {
        let prepare = |(suite, config)| {
            let tasks = select_tasks(config, suite)?;
            let jobs = EpisodeList::of_tasks(&tasks, max_attempts, None);
            SuiteRecording::new(config, recording, &loaded, suite, tasks, jobs, Some(demos), |run, log| {
                record_grips(run, log);
                Ok(())
            })
        };
        suites.iter().zip(&configs).map(prepare).collect()
    })?;
    print_recording(&recording.out, recorded)
}

/// Makes the experts of a run record their intent into `log`. Other policies are left unchanged.
fn record_grips(run: &mut SuiteRun, log: &GripLog) {
    let Some(policy) = run.config.policy.expert() else { return };
    let log = log.clone();
    run.controllers = Box::new(move |opened, brief| {
        Ok(Box::new(GripRecorder {
            expert: expert_controller(opened, policy)?,
            is_holding: Vec::new(),
            index: brief.index(),
            log: log.clone(),
        }))
    });
}

/// An expert whose intent to hold is recorded.
///
/// The binary gripper code of a dataset needs this intent. The commanded closure does not show it: a hand around a wide
/// object is nearly open while it holds.
struct GripRecorder {
    expert: ExpertController,
    is_holding: Vec<bool>,
    index: EpisodeIndex,
    log: GripLog,
}

impl Controller for GripRecorder {
    fn streams(&self) -> SensorStreams {
        self.expert.streams()
    }

    fn gave_up(&self) -> Option<&str> {
        self.expert.gave_up()
    }

    fn notes(&self) -> BTreeMap<String, f64> {
        self.expert.notes()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let action = self.expert.act(sim, observation)?;
        self.is_holding.push(self.expert.is_gripping);
        Ok(action)
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        parallel::lock(&self.log).insert(self.index, std::mem::take(&mut self.is_holding));
        Ok(())
    }
}
