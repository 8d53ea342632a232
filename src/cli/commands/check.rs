//! `softvt check`: validation of a script without running its plan.

use std::collections::BTreeSet;

use clap::Args;

use crate::{
    args::{PolicyArgs, ScriptArgs, parse_count},
    error::CliError,
};
use softvt_benchmark::{Plan, REFERENCE, Suite};
use softvt_common::text::{self, counted};
use softvt_runner::{
    ConfiguredScript, RunConfig, SuiteChecker, conditions, experiment, suite_selection::check_folders,
};

/// Check a script without running it
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt check [OPTIONS] <FILE.lua>")]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    /// Episodes per task whose scenes are checked [default: 1]
    #[arg(long, value_name = "N", value_parser = parse_count::<u32>)]
    episodes: Option<u32>,
}

/// Loads a script, builds the scenes of the first episodes of every task and lets their objects settle. Nothing
/// is run or rendered.
pub(super) fn run(args: CheckArgs) -> Result<(), CliError> {
    let config = RunConfig { episodes: args.episodes, ..args.script.config()? };
    let ConfiguredScript { config, script } = args.policy.checked(config.load()?)?;
    // Limits are looked up for all episodes.
    let run = ConfiguredScript { config: RunConfig { episodes: None, ..config }, script };
    let ConfiguredScript { config, script: loaded } = &run;
    let plan = &loaded.plan;
    check_folders(config, plan)?;
    let mut told = BTreeSet::new();
    let mut warn = |warning: String| {
        if told.insert(warning.clone()) {
            notice!("warning: {warning}");
        }
    };
    loaded.warnings()?.into_iter().for_each(&mut warn);
    let checker = SuiteChecker::new(&run);
    for suite in plan.suites() {
        checker.check(suite, args.episodes.unwrap_or(1), &mut warn)?;
        print_tasks(suite)?;
    }
    match plan {
        Plan::Suite(_) | Plan::Suites { .. } => {}
        Plan::Conditions { conditions, .. } => {
            conditions::check(&run)?;
            let names: Vec<&str> = conditions.iter().map(|condition| condition.name.as_str()).collect();
            out!("conditions: {REFERENCE}, {}\n", text::escape_control(&names.join(", ")))?;
        }
        Plan::Experiment { name, points, .. } => {
            experiment::check(config)?;
            out!("experiment {name}: {}, not run by this check\n", counted(*points, "point"))?;
        }
    }
    out!("{}: OK\n", config.file.display())
}

fn print_tasks(suite: &Suite) -> Result<(), CliError> {
    out!(
        "suite {}: {}, {} each\n",
        suite.name,
        counted(suite.tasks.len(), "task"),
        counted(suite.episodes as usize, "episode")
    )?;
    for task in &suite.tasks {
        let expert = if task.expert { "" } else { ", no expert" };
        let (id, prompt, goal) = (task.id, text::escape_control(&task.prompt), task.goal.describe());
        out!("{id:>4} {prompt}: {}{expert}\n", text::escape_control(&goal))?;
    }
    Ok(())
}
