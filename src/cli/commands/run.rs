//! `softvt FILE.lua`: the plan of a script.

use std::path::PathBuf;

use clap::Parser;

use crate::{
    error::{CliError, Exit},
    output::{eprint_notice, print, print_json},
    run::{
        conditions,
        config::{RunConfig, RunFlags, ScriptArgs},
        episode_artifacts::VideoSelection,
        evaluate::run_suite,
        experiment, plan_flags,
        policy::PolicyArgs,
        requirement,
        selection::{
            check_distinct_out_dirs, check_parent_folder, path_component, run_dir, select_episodes,
            select_tasks,
        },
        suite_run::{SuiteRun, find_replay_source},
    },
};
use softvt_benchmark::Plan;
use softvt_common::text::counted;
use softvt_evaluation::record::{EpisodeRecord, Outcome};
use softvt_policy::profile::Profile;
use softvt_report::terminal;

/// A safety-aware visuo-tactile manipulation benchmark for soft objects, on an ordinary CPU
#[derive(Clone, Debug, Parser)]
#[command(
    name = "softvt",
    version,
    override_usage = "softvt [OPTIONS] <FILE.lua>\n       softvt <COMMAND>",
    subcommand_negates_reqs = true,
    args_conflicts_with_subcommands = true,
    after_help = "softvt FILE.lua --help also lists the options of that script. docs/cli.md is the reference.\n\
                  Exit codes: 0 success, 1 internal error (bug), 2 invalid input, 3 policy or connection failed, \
                  99 --require not met, 130 interrupted."
)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    flags: RunFlags,
}

/// Runs the plan of a script: suites, conditions or an experiment.
///
/// # Errors
/// The script, a flag, the folder or the policy is not valid, or an episode fails.
pub(super) fn run(args: RunArgs) -> Result<(), CliError> {
    let (config, loaded) =
        RunConfig::new(args.script, args.flags)?.load_plan(plan_flags::RUN, &args.policy)?;
    let (config, flags) = (&config, &config.flags);
    if let Some(code) = config.policy.gripper {
        let profile = config.policy.profile().map(|Profile { name, .. }| format!(" (profile {name})"));
        eprint_notice(format!("gripper: {}{}", code.name(), profile.unwrap_or_default()));
    }
    check_video_episodes(config, &loaded.plan)?;
    check_recorded_episodes(config, &loaded.plan)?;
    match &loaded.plan {
        plan @ (Plan::Suite(_) | Plan::Suites { .. }) => {
            let is_list = matches!(plan, Plan::Suites { .. });
            check_distinct_out_dirs(config, plan.suites())?;
            if is_list {
                check_parent_folder(config)?;
            }
            let (mut summaries, mut failed) = (Vec::new(), None);
            for suite in plan.suites() {
                let out = run_dir(config, suite, is_list)
                    .unwrap_or_else(|| next_run_dir(config, &config.suite_name(suite)));
                let tasks = select_tasks(config, suite)?;
                let jobs = select_episodes(config, suite, &tasks);
                let mut run = SuiteRun::new(config, &loaded, suite, jobs, out)?;
                run.prepare(&tasks)?;
                let result = run_suite(&run, &tasks)?;
                failed = failed.or_else(|| all_actions_refused(&result.records));
                summaries.push(result.summary);
            }
            match &summaries[..] {
                [summary] if flags.json && !is_list => print_json(summary),
                summaries if flags.json => print_json(&summaries),
                summaries => summaries.iter().try_for_each(|summary| print(&terminal::table(summary))),
            }?;
            match failed {
                Some(error) => Err(error),
                None => requirement::check(&flags.requirements, &summaries),
            }
        }
        Plan::Conditions { name, suites, conditions } => {
            check_distinct_out_dirs(config, suites)?;
            check_parent_folder(config)?;
            let out = flags.out.clone().unwrap_or_else(|| next_run_dir(config, name));
            conditions::run(config, &loaded, suites, conditions, &out)
        }
        Plan::Experiment { .. } => experiment::run(config, &loaded),
    }
}

/// The error of a policy whose actions could be executed in no episode, such as one that answers NaN.
fn all_actions_refused(records: &[EpisodeRecord]) -> Option<CliError> {
    let message = |record: &EpisodeRecord| match &record.outcome {
        Outcome::Error { message } => Some(message.clone()),
        _ => None,
    };
    let first = message(records.first()?)?;
    records.iter().all(|record| message(record).is_some()).then(|| {
        let count = counted(records.len(), "episode");
        CliError::new(
            Exit::Policy,
            format!("no episode is valid: the policy's actions were refused in {count}, first: {first}"),
        )
    })
}

/// Checks that every suite has the episodes that `--video` selects.
fn check_video_episodes(config: &RunConfig, plan: &Plan) -> Result<(), CliError> {
    let Some(VideoSelection::Episodes(selected)) = &config.flags.video else { return Ok(()) };
    for suite in plan.suites() {
        let episodes = config.flags.episodes.unwrap_or(suite.episodes);
        if let Some(beyond) = selected.iter().find(|episode| **episode >= episodes) {
            let available = match episodes {
                1 => "only episode 0".to_owned(),
                count => format!("episodes 0 to {}", count.saturating_sub(1)),
            };
            return Err(config.error(format!(
                "--video={beyond}: suite {} runs {available} of each task; select one of them, or raise --episodes",
                suite.name
            )));
        }
    }
    Ok(())
}

/// Checks that the recorded actions cover every episode of every suite.
fn check_recorded_episodes(config: &RunConfig, plan: &Plan) -> Result<(), CliError> {
    if config.policy.recorded().is_none() {
        return Ok(());
    }
    for suite in plan.suites() {
        let jobs = select_episodes(config, suite, &select_tasks(config, suite)?);
        find_replay_source(config, suite, &jobs)?;
    }
    Ok(())
}

/// The first folder `runs/<name>-<policy>-NNN` that does not exist.
fn next_run_dir(config: &RunConfig, name: &str) -> PathBuf {
    let (name, policy) = (path_component(name), path_component(&config.policy.name));
    (1..)
        .map(|number| PathBuf::from(format!("runs/{name}-{policy}-{number:03}")))
        .find(|dir| !dir.exists())
        .unwrap_or_default()
}
