//! `softvt check`: whether a script is right, without running what it plans.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex},
};

use crate::{
    benchmark::{Goal, Plan, Suite, Task},
    cli::{
        error::CliError,
        output::print,
        run::config::RunConfig,
        run::selection::check_distinct_out_dirs,
        run::{conditions, suite_run::SuiteRun},
    },
    parallel,
    rollout::{AssetCache, SensorAssets, cancel, target_asset},
    scene::Asset,
    script::{self, Loaded, Scenes},
    text,
};

/// Reads a script, makes its plan, and builds the first scene of every task; nothing is settled, run or drawn.
///
/// # Errors
/// The first thing that is wrong.
pub(crate) fn run(run: &RunConfig) -> Result<(), CliError> {
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let file = run.file.display();
    // Suites have assets in common.
    let made = (AssetCache::rough(), SensorAssets::default());
    match &loaded.plan {
        Plan::Suite(suite) => suite_is_right(run, &loaded, suite, &made)?,
        Plan::Suites { suites } => {
            check_distinct_out_dirs(run, suites)?;
            suites.iter().try_for_each(|suite| suite_is_right(run, &loaded, suite, &made))?;
        }
        Plan::Conditions { suites, conditions: list, .. } => {
            check_distinct_out_dirs(run, suites)?;
            suites.iter().try_for_each(|suite| suite_is_right(run, &loaded, suite, &made))?;
            conditions::check(run, &loaded, (suites, list))?;
        }
        Plan::Experiment { name, points, .. } => {
            print(&format!("experiment {name}: {points} points; they are not run here\n"));
        }
    }
    print(&format!("{file}: nothing is wrong with it\n"));
    Ok(())
}

fn suite_is_right(
    run: &RunConfig,
    loaded: &Loaded,
    suite: &Suite,
    (cache, looks): &(AssetCache, SensorAssets),
) -> Result<(), CliError> {
    let tasks: Vec<_> = suite.tasks.iter().collect();
    let mut batch = SuiteRun::new(run, loaded, suite, (Vec::new(), PathBuf::new()))?.sharing(cache, looks);
    let targets = first_targets(loaded, &batch, &tasks)?;
    targets.into_iter().try_for_each(|target| batch.learn_limit(target))?;
    let episodes = suite.episodes;
    print(&format!("suite {}: {} tasks, {episodes} episodes each\n", suite.name, tasks.len()));
    for task in tasks {
        let expert = if task.expert { "" } else { ", no expert" };
        let (way, object, target) = match &task.goal {
            Goal::On { object, target, .. } => ("on", object, target),
            Goal::In { object, target, .. } => ("in", object, target),
        };
        let id = task.id;
        print(&format!("{id:>4} {}: {object} {way} {target}{expert}\n", text::escape_control(&task.prompt)));
    }
    Ok(())
}

/// Builds and examines the first scene of every task, on all processors; the assets of their targets.
fn first_targets(
    loaded: &Loaded,
    batch: &SuiteRun,
    tasks: &[&Task],
) -> Result<Vec<Option<Arc<Asset>>>, CliError> {
    // Opening a machine runs the whole script, so it is used for more than one task.
    let idle: Mutex<Vec<Scenes>> = Mutex::default();
    let idle = || idle.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let mut targets = vec![None; tasks.len()];
    let examine = |job: usize| {
        let task = tasks[job];
        let free = idle().pop();
        let scenes = free.map_or_else(|| Scenes::open(loaded), Ok).map_err(CliError::input)?;
        let (nominal, scene) = scenes.of(&batch.request(task, 0)).map_err(CliError::input)?;
        idle().push(scenes);
        batch.examine(task, scene)?;
        Ok(target_asset(&nominal, task).cloned())
    };
    parallel::run(tasks.len(), threads, cancel::requested, examine, |job, target| {
        targets[job] = target;
        Ok(())
    })?;
    if cancel::requested() { Err(CliError::interrupted("interrupted")) } else { Ok(targets) }
}
