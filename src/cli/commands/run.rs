//! `softvt FILE.lua`: the plan of a script.

use std::path::PathBuf;

use crate::{
    benchmark::{Plan, Suite},
    cli::{
        args::{RunArgs, VideoSelection},
        error::CliError,
        output::{print, print_json},
        run::{
            conditions,
            config::RunConfig,
            experiment,
            recorded_policy::find_replay_source,
            requirements,
            selection::{check_distinct_out_dirs, path_component, select_episodes, select_tasks},
            suite_run::{SuiteRun, run_suite},
        },
    },
    evaluation::summary::SuiteSummary,
    report::terminal,
    script::{self, LoadedScript},
};

/// Runs the plan of a script: suites, conditions or an experiment.
///
/// # Errors
/// The script, a flag, the folder or the policy is not valid, or an episode fails.
pub(crate) fn run(args: &RunArgs) -> Result<(), CliError> {
    let config = &RunConfig::of_run(args)?;
    let refuse = |message: String| Err(CliError::input(message).prefixed(config.file.display()));
    let loaded = script::load(&config.file, &config.script_options).map_err(CliError::input)?;
    check_video_episodes(config, &loaded.plan)?;
    check_recorded_episodes(config, &loaded.plan)?;
    match &loaded.plan {
        Plan::Suite(suite) => {
            let out = config.out.clone().unwrap_or_else(|| next_run_dir(config, &config.suite_name(suite)));
            let summary = evaluate(config, &loaded, suite, out)?;
            match config.json {
                true => print_json(&summary),
                false => print(&terminal::table(&summary)),
            }
            requirements::check(&config.requirements, &[summary])
        }
        Plan::Suites { suites } => {
            check_distinct_out_dirs(config, suites)?;
            let mut summaries = Vec::new();
            for suite in suites {
                let name = config.suite_name(suite);
                let out = match &config.out {
                    Some(dir) => dir.join(path_component(&name)),
                    None => next_run_dir(config, &name),
                };
                summaries.push(evaluate(config, &loaded, suite, out)?);
            }
            match config.json {
                true => print_json(&summaries),
                false => summaries.iter().for_each(|summary| print(&terminal::table(summary))),
            }
            requirements::check(&config.requirements, &summaries)
        }
        Plan::Conditions { name, suites, conditions } => {
            if !config.requirements.is_empty() {
                return refuse(
                    "--require: applies to suites, and this file compares conditions; read conditions.json"
                        .to_owned(),
                );
            }
            check_distinct_out_dirs(config, suites)?;
            let out = config.out.clone().unwrap_or_else(|| next_run_dir(config, name));
            conditions::run(config, &loaded, suites, conditions, &out)
        }
        Plan::Experiment { name, points, columns } => {
            let suite_flags = [
                ("--require", !config.requirements.is_empty()),
                ("--shard", config.shard.is_some()),
                ("--resume", config.resume),
            ];
            if let Some((flag, _)) = suite_flags.iter().find(|(_, is_given)| *is_given) {
                return refuse(format!("{flag}: applies to suites, and this file is an experiment"));
            }
            experiment::run(config, &loaded, name, *points, columns)
        }
    }
}

/// Checks that every suite has the episodes that `--video` selects.
fn check_video_episodes(config: &RunConfig, plan: &Plan) -> Result<(), CliError> {
    let Some(VideoSelection::Episodes(selected)) = &config.video else { return Ok(()) };
    for suite in plan.suites() {
        let episodes = config.episodes.unwrap_or(suite.episodes);
        if let Some(beyond) = selected.iter().find(|episode| **episode >= episodes) {
            let available = match episodes {
                1 => "only episode 0".to_owned(),
                count => format!("episodes 0 to {}", count.saturating_sub(1)),
            };
            return Err(CliError::input(format!(
                "{}: --video={beyond}: suite {} runs {available} of each task; select one of them, or raise --episodes",
                config.file.display(),
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
    let (name, policy) = (path_component(name), path_component(config.policy.name()));
    (1..)
        .map(|number| PathBuf::from(format!("runs/{name}-{policy}-{number:03}")))
        .find(|dir| !dir.exists())
        .unwrap_or_default()
}

fn evaluate(
    config: &RunConfig,
    loaded: &LoadedScript,
    suite: &Suite,
    out: PathBuf,
) -> Result<SuiteSummary, CliError> {
    let tasks = select_tasks(config, suite)?;
    let jobs = select_episodes(config, suite, &tasks);
    let mut run = SuiteRun::new(config, loaded, suite, jobs, out)?;
    run.prepare(&tasks)?;
    Ok(run_suite(&run, &tasks)?.summary)
}
