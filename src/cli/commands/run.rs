//! Carrying out a plan: a policy on suites, or an experiment.

use crate::cli::run::config::RunConfig;
use crate::cli::run::selection::check_distinct_out_dirs;
use crate::cli::run::selection::path_component;
use crate::cli::run::selection::select_episodes;
use crate::cli::run::selection::select_tasks;
use crate::cli::run::suite_run::run_suite;
use std::path::PathBuf;

use crate::{
    benchmark::{Plan, Suite},
    cli::{
        args::VideoSelection,
        error::CliError,
        output::print,
        run::{conditions, experiment, recorded_policy::recorded, requirements, suite_run::SuiteRun},
    },
    evaluation::summary::SuiteSummary,
    report::terminal,
    script::{self, Loaded},
};

/// Carries out the plan of a script.
///
/// # Errors
/// Anything that is wrong with the script, the flags, the folder or the policy.
pub(crate) fn run(run: &RunConfig) -> Result<(), CliError> {
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    check_video(run, &loaded.plan)?;
    check_recorded(run, &loaded.plan)?;
    match &loaded.plan {
        Plan::Suite(suite) => {
            let summary = evaluate(run, &loaded, suite, out_dir(run, &run.name_of(suite), None))?;
            let summaries = [summary];
            show(run, &summaries, false);
            requirements::check(&run.require, &summaries)
        }
        Plan::Suites { suites } => {
            check_distinct_out_dirs(run, suites)?;
            let mut summaries = Vec::new();
            for suite in suites {
                let name = run.name_of(suite);
                summaries.push(evaluate(run, &loaded, suite, out_dir(run, &name, Some(&name)))?);
            }
            show(run, &summaries, true);
            requirements::check(&run.require, &summaries)
        }
        Plan::Conditions { name, suites, conditions } => {
            if !run.require.is_empty() {
                let message =
                    "--require: it is about suites, and this file compares conditions; read conditions.json";
                return Err(CliError::input(format!("{}: {message}", run.file.display())));
            }
            check_distinct_out_dirs(run, suites)?;
            conditions::run(run, &loaded, (suites, conditions), &out_dir(run, name, None))
        }
        Plan::Experiment { name, points, columns } => {
            let about_suites = [
                ("--require", !run.require.is_empty()),
                ("--shard", run.shard.is_some()),
                ("--resume", run.resume),
            ];
            if let Some((flag, _)) = about_suites.iter().find(|(_, given)| *given) {
                let message =
                    format!("{}: {flag}: it is about suites, and this is an experiment", run.file.display());
                return Err(CliError::input(message));
            }
            experiment::run(run, &loaded, name, *points, columns)
        }
    }
}

/// Every episode that `--video` names must be one of every suite's: before any of them runs.
fn check_video(run: &RunConfig, plan: &Plan) -> Result<(), CliError> {
    let Some(VideoSelection::Episodes(chosen)) = &run.video else { return Ok(()) };
    for suite in plan.suites() {
        let episodes = run.episodes.unwrap_or(suite.episodes);
        if let Some(beyond) = chosen.iter().find(|episode| **episode >= episodes) {
            let last = episodes.saturating_sub(1);
            let message = format!(
                "{}: --video={beyond}: suite {} runs the episodes 0 to {last} of each task; name one of them, or raise --episodes",
                run.file.display(),
                suite.name
            );
            return Err(CliError::input(message));
        }
    }
    Ok(())
}

/// What was recorded must hold every episode of every suite: before any of them runs.
fn check_recorded(run: &RunConfig, plan: &Plan) -> Result<(), CliError> {
    if run.policy.recorded().is_none() {
        return Ok(());
    }
    for suite in plan.suites() {
        recorded(run, suite, &select_episodes(run, suite, &select_tasks(run, suite)?))?;
    }
    Ok(())
}

/// Tables, or one JSON document: an object for a suite, an array for a list of suites.
fn show(run: &RunConfig, summaries: &[SuiteSummary], list: bool) {
    match summaries {
        _ if !run.json => summaries.iter().for_each(|summary| print(&terminal::table(summary))),
        [summary] if !list => print(&format!("{:#}\n", serde_json::json!(summary))),
        _ => print(&format!("{:#}\n", serde_json::json!(summaries))),
    }
}

/// The folder that was asked for (with one more level for one of several suites), or the next free one under `runs/`.
fn out_dir(run: &RunConfig, suite: &str, level: Option<&str>) -> PathBuf {
    let suite = path_component(suite);
    let level = level.map(path_component);
    match &run.out {
        Some(dir) => level.map_or(dir.clone(), |level| dir.join(level)),
        None => (1..)
            .map(|n| PathBuf::from(format!("runs/{suite}-{}-{n:03}", path_component(run.policy.name()))))
            .find(|dir| !dir.exists())
            .unwrap_or_default(),
    }
}

fn evaluate(run: &RunConfig, loaded: &Loaded, suite: &Suite, out: PathBuf) -> Result<SuiteSummary, CliError> {
    let tasks = select_tasks(run, suite)?;
    let mut batch = SuiteRun::new(run, loaded, suite, (select_episodes(run, suite, &tasks), out))?;
    batch.prepare(&tasks)?;
    Ok(run_suite(&batch, &tasks)?.summary)
}
