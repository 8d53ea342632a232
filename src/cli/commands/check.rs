//! `softvt check`: validation of a script without running its plan.

use std::{collections::BTreeSet, path::PathBuf, sync::Mutex};

use clap::Args;

use crate::{
    args::{PolicyArgs, Request, ScriptArgs},
    error::CliError,
    output::{eprint_notice, print},
};
use softvt_benchmark::{Goal, GoalKind, Plan, REFERENCE, Task};
use softvt_common::cancel;
use softvt_common::{
    parallel,
    text::{self, counted},
};
use softvt_rollout::{AssetCache, SensorAssets, scene_warnings};
use softvt_runner::{
    EpisodeList, LoadedRun, SuiteRun, conditions,
    selection::{check_distinct_out_dirs, select_episodes},
};
use softvt_script::{ExperimentInput, SceneBuilder};

/// Check a script without running it
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt check [OPTIONS] <FILE.lua>")]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
}

/// Loads a script and builds the first scene of every task. Nothing is run or rendered; a scene settles only if its goal may
/// hold at the start.
///
/// # Errors
/// The first thing that is not valid.
pub(super) fn run(args: CheckArgs) -> Result<(), CliError> {
    let LoadedRun { config, script: loaded } =
        &Request::new(args.script)?.load_plan("check", &args.policy)?;
    let plan = &loaded.plan;
    check_distinct_out_dirs(config, plan.suites())?;
    let (assets, sensor_assets) = (AssetCache::approximate(), SensorAssets::default());
    for suite in plan.suites() {
        let mut run = SuiteRun::new(config, loaded, suite, EpisodeList::listed(Vec::new()), PathBuf::new())?;
        (run.assets, run.sensor_assets) = (assets.clone(), sensor_assets.clone());
        check_suite(run)?;
    }
    match plan {
        Plan::Suite(_) | Plan::Suites { .. } => {}
        Plan::Conditions { suites, conditions, .. } => {
            conditions::check(config, loaded, suites, conditions)?;
            let names: Vec<&str> = conditions.iter().map(|condition| condition.name.as_str()).collect();
            print(&format!("conditions: {REFERENCE}, {}\n", text::escape_control(&names.join(", "))))?;
        }
        Plan::Experiment { name, points, .. } => {
            ExperimentInput::new(config.settings.clone(), config.seed)
                .map_err(|error| config.error(error))?;
            print(&format!("experiment {name}: {}, not run by this check\n", counted(*points, "point")))?;
        }
    }
    print(&format!("{}: OK\n", config.file.display()))
}

fn check_suite(mut run: SuiteRun) -> Result<(), CliError> {
    let suite = run.suite;
    let tasks: Vec<_> = suite.tasks.iter().collect();
    for warning in check_first_scenes(&run, &tasks)? {
        eprint_notice(format!("warning: {warning}"));
    }
    run.jobs = select_episodes(run.config, suite, &tasks);
    run.scan_limits(&tasks)?;
    print(&format!(
        "suite {}: {}, {} each\n",
        suite.name,
        counted(tasks.len(), "task"),
        counted(suite.episodes as usize, "episode")
    ))?;
    for task in tasks {
        let expert = if task.expert { "" } else { ", no expert" };
        let Goal { kind, object, target, .. } = &task.goal;
        let relation = match kind {
            GoalKind::On => "on",
            GoalKind::Inside => "in",
        };
        let (id, prompt) = (task.id, text::escape_control(&task.prompt));
        print(&format!("{id:>4} {prompt}: {object} {relation} {target}{expert}\n"))?;
    }
    Ok(())
}

/// Builds and checks the first scene of every task on all processors. Returns warnings about their objects.
fn check_first_scenes(run: &SuiteRun, tasks: &[&Task]) -> Result<BTreeSet<String>, CliError> {
    // Opening the scenes runs the whole script, so each thread takes idle ones before it opens others.
    let idle: Mutex<Vec<SceneBuilder>> = Mutex::default();
    let mut warnings = BTreeSet::new();
    let check = |job: usize| -> Result<BTreeSet<String>, CliError> {
        let task = tasks[job];
        let taken = parallel::lock(&idle).pop();
        let builder = taken.map_or_else(|| SceneBuilder::open(run.loaded), Ok)?;
        let setup = builder.build(&run.episode_id(task, 0), &run.changes())?;
        parallel::lock(&idle).push(builder);
        let mut warnings = scene_warnings(task, &setup.scene, &run.assets);
        let of_task = |warning: String| format!("task {}: {warning}", task.id);
        warnings.extend(run.check_scene(task, setup.scene)?.map(of_task));
        Ok(warnings)
    };
    parallel::run(tasks.len(), run.config.thread_count(), cancel::requested, check, |_, found| {
        warnings.extend(found);
        Ok(())
    })?;
    if cancel::requested() { Err(CliError::interrupted("interrupted")) } else { Ok(warnings) }
}
