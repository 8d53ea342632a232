//! `softvt record`: demonstrations of the tasks of a suite that are safe and reach the goal.

use serde_json::json;

use crate::{
    cli::{
        args::RecordArgs,
        error::CliError,
        run::{
            grip_recorder::record_grips,
            policy::PolicyConfig,
            recording::{self, AttemptPlan, RecordingConfig, SuiteRecording},
            selection::{select_suites, select_tasks},
        },
    },
    script,
};

/// Attempts per demonstration, unless `--attempts` is given.
const ATTEMPTS_PER_DEMO: u32 = 4;
/// Minimum number of attempts per task, unless `--attempts` is given.
const MIN_ATTEMPTS: u32 = 20;

/// Records the demonstrations that the arguments ask for.
///
/// # Errors
/// The script has no suite, the folder contains something else, an attempt or a file fails, or too
/// few attempts are good.
pub(crate) fn run(args: &RecordArgs) -> Result<(), CliError> {
    let config = RecordingConfig::new(&args.script, &args.recording, &args.tasks)?
        .with_policy(PolicyConfig::load(&args.policy)?);
    let default_attempts = args.demos.saturating_mul(ATTEMPTS_PER_DEMO).max(MIN_ATTEMPTS);
    let plan =
        AttemptPlan::First { demos: args.demos, max_attempts: args.attempts.unwrap_or(default_attempts) };
    let run = &config.run;
    let loaded = script::load(&run.file, &run.script_options).map_err(CliError::input)?;
    let suites = select_suites("record", run, &loaded.plan)?;
    let names: Vec<String> = suites.iter().map(|suite| run.suite_name(suite)).collect();
    let request = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "demos": args.demos,
        "pictures": config.images_in_hdf5,
        "privileged": config.with_privileged,
        "suites": names,
    });
    recording::record_all(&config, &request, || {
        let prepare = |suite| {
            let tasks = select_tasks(run, suite)?;
            SuiteRecording::new(&config, &loaded, suite, tasks, plan.clone(), |suite_run, log| {
                record_grips(run, suite_run, log);
                Ok(())
            })
        };
        suites.iter().copied().map(prepare).collect()
    })
}
