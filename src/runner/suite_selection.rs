//! Selection of suites, tasks and episodes by a [`RunConfig`], and the folders of their results.

use std::{collections::BTreeSet, path::PathBuf};

use crate::{
    config::RunConfig,
    episode_artifacts::EpisodeFilter,
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    suite_run::find_replay_source,
};
use softvt_benchmark::{Plan, Suite, Task};
use softvt_common::episode_id::EpisodeSplit;
use softvt_runs::run_folder::RunFolder;

/// The suites of a plan that is a suite or a list of suites; empty for other plans.
pub fn suites_of(plan: &Plan) -> &[Suite] {
    match plan {
        Plan::Suite(_) | Plan::Suites { .. } => plan.suites(),
        Plan::Conditions { .. } | Plan::Experiment { .. } => &[],
    }
}

/// An error about a plan that is neither a suite nor a list of suites.
pub(crate) fn no_suites(config: &RunConfig) -> RunError {
    config.error("expected a suite or a list of suites; name a file that returns softvt.suite")
}

/// The suites of a plan that is a suite or a list of suites, each with a folder of its own.
///
/// # Errors
/// The plan is neither a suite nor a list of suites with distinct folders.
pub fn select_suites<'a>(config: &RunConfig, plan: &'a Plan) -> Result<&'a [Suite], RunError> {
    if !matches!(plan, Plan::Suite(_) | Plan::Suites { .. }) {
        return Err(no_suites(config));
    }
    check_folders(config, plan)?;
    Ok(plan.suites())
}

/// The tasks that [`RunConfig::tasks`] selects, in the order of their indices.
///
/// # Errors
/// A word that matches no task, or a task without an expert where the expert is the policy.
pub fn select_tasks<'a>(config: &RunConfig, suite: &'a Suite) -> Result<Vec<&'a Task>, RunError> {
    let mut selected: Vec<&Task> = Vec::new();
    for word in &config.tasks {
        if word.trim().is_empty() {
            let message = format!("expected an index or part of a prompt, got {word:?}");
            return Err(config.error_of("tasks", "", message));
        }
        let index = word.parse::<usize>().ok();
        let matches = |task: &&Task| match index {
            Some(index) => task.id == index,
            None => task.prompt.to_lowercase().contains(&word.to_lowercase()),
        };
        let before = selected.len();
        selected.extend(suite.tasks.iter().filter(matches));
        if selected.len() == before {
            let message = format!(
                "suite {} has no such task; give an index below {}, or a part of a prompt such as {:?}",
                suite.name,
                suite.tasks.len(),
                suite.tasks[0].prompt
            );
            return Err(config.error_of("tasks", word, message));
        }
    }
    if config.tasks.is_empty() {
        selected.extend(&suite.tasks);
    }
    selected.sort_by_key(|task| task.id);
    selected.dedup_by_key(|task| task.id);
    if let Some(task) = selected.iter().find(|task| !task.expert && config.policy.expert().is_some()) {
        let message = format!("task {} has no expert; add one, or select another policy", task.id);
        return Err(config.error(message));
    }
    Ok(selected)
}

/// All episodes of the tasks, or those that are selected, or those of the shard.
pub fn select_episodes<'a>(config: &RunConfig, suite: &Suite, tasks: &[&'a Task]) -> EpisodeList<'a> {
    let selected: BTreeSet<u32> = config.selected_episodes.iter().copied().collect();
    if selected.is_empty() {
        return EpisodeList::of_tasks(tasks, config.episodes_of(suite), config.shard);
    }
    let jobs = |task: &&'a Task| {
        selected.iter().map(move |episode| EpisodeJob { task, episode: *episode }).collect::<Vec<_>>()
    };
    EpisodeList::listed(tasks.iter().flat_map(jobs))
}

/// Checks that every suite of a plan gets a folder of its own, below [`RunConfig::out`] unless it is the only one.
pub fn check_folders(config: &RunConfig, plan: &Plan) -> Result<(), RunError> {
    let mut folders = BTreeSet::new();
    if let Some(suite) = plan.suites().iter().find(|suite| !folders.insert(path_component(&suite.name))) {
        return Err(config.error(format_args!(
            "suite {:?} and another suite share the folder {:?}; rename one",
            suite.name,
            path_component(&suite.name)
        )));
    }
    let parent = config.out.as_ref().filter(|_| !matches!(plan, Plan::Suite(_)));
    parent.map_or(Ok(()), |dir| RunFolder::check_parent(dir).map_err(|error| config.error(error)))
}

/// Folder of a suite's run in [`RunConfig::out`]: that folder itself, or one inside of it for a list of suites.
pub(crate) fn run_dir(config: &RunConfig, suite: &Suite, is_list: bool) -> Option<PathBuf> {
    let dir = config.out.as_ref()?;
    Some(if is_list { dir.join(path_component(&config.suite_name(suite))) } else { dir.clone() })
}

/// Replaces characters of a name that a script could use to leave the output folder.
pub fn path_component(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'), "_")
}

/// The first folder `runs/<name>-<policy>-NNN` that does not exist.
pub fn next_run_dir(config: &RunConfig, name: &str) -> PathBuf {
    let (name, policy) = (path_component(name), path_component(&config.policy.name));
    (1..)
        .map(|number| PathBuf::from(format!("runs/{name}-{policy}-{number:03}")))
        .find(|dir| !dir.exists())
        .unwrap_or_default()
}

/// Checks that every suite has the episodes that are to become videos, and that recorded actions cover
/// all of its episodes.
pub(crate) fn check_episodes(config: &RunConfig, suites: &[Suite]) -> Result<(), RunError> {
    for suite in suites {
        for (setting, filter) in [("video", &config.video), ("mcap", &config.mcap)] {
            let Some(EpisodeFilter::Episodes(selected)) = filter else { continue };
            let is_beyond = |episode: &&u32| !config.runs_episode(suite, **episode);
            let Some(beyond) = selected.iter().find(is_beyond) else { continue };
            let available = match &config.selected_episodes[..] {
                [] => format!("the episodes below {}", config.episodes_of(suite)),
                selected => format!("only the episodes {selected:?}"),
            };
            let message = format!(
                "suite {} runs {available} of each task; select one of them, or run others",
                suite.name
            );
            return Err(config.error_of(setting, beyond, message));
        }
    }
    for suite in suites.iter().filter(|_| config.policy.recorded().is_some()) {
        let jobs = select_episodes(config, suite, &select_tasks(config, suite)?);
        find_replay_source(config, suite, &jobs, EpisodeSplit::Validation)?;
    }
    Ok(())
}
