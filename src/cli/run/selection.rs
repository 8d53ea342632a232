//! Selection of suites, tasks and episodes by the command line.

use std::collections::BTreeSet;

use crate::{
    benchmark::{Suite, Task},
    cli::{error::CliError, run::config::RunConfig},
};

/// The tasks that `--task` names.
///
/// # Errors
/// A word that names none, or a task without the expert that is to drive it.
pub(crate) fn select_tasks<'a>(run: &RunConfig, suite: &'a Suite) -> Result<Vec<&'a Task>, CliError> {
    let mut found: Vec<&Task> = Vec::new();
    for word in &run.tasks {
        if word.trim().is_empty() {
            let message = format!(
                "{}: --task: expected an index or part of a prompt, got {word:?}",
                run.file.display()
            );
            return Err(CliError::input(message));
        }
        let index = word.parse::<usize>().ok();
        let fits = |task: &&Task| match index {
            Some(index) => task.id == index,
            None => task.prompt.contains(word.as_str()),
        };
        let before = found.len();
        found.extend(suite.tasks.iter().filter(fits));
        if found.len() == before {
            let message = format!(
                "{}: --task {word}: suite {} has no such task; it has 0 to {}: see softvt list tasks",
                run.file.display(),
                suite.name,
                suite.tasks.len().saturating_sub(1)
            );
            return Err(CliError::input(message));
        }
    }
    if run.tasks.is_empty() {
        found.extend(&suite.tasks);
    }
    found.sort_by_key(|task| task.id);
    found.dedup_by_key(|task| task.id);
    if let Some(task) = found.iter().find(|t| !t.expert && run.policy.is_privileged()) {
        let message =
            format!("{}: task {} has no expert; give one, or another --policy", run.file.display(), task.id);
        return Err(CliError::input(message));
    }
    Ok(found)
}

/// The episodes of the tasks that `--task` names, or a shard's part of them.
pub(crate) fn select_episodes<'a>(
    run: &RunConfig,
    suite: &Suite,
    tasks: &[&'a Task],
) -> Vec<(&'a Task, u32)> {
    let episodes = run.episodes.unwrap_or(suite.episodes);
    let all = tasks.iter().flat_map(|task| (0..episodes).map(move |e| (*task, e)));
    let own = all.enumerate().filter(|(job, _)| run.shard.is_none_or(|shard| shard.has(*job)));
    own.map(|(_, job)| job).collect()
}

/// Every suite must have a folder of its own.
///
/// # Errors
/// Two names that become one as part of a path.
pub(crate) fn check_distinct_out_dirs(run: &RunConfig, suites: &[Suite]) -> Result<(), CliError> {
    let mut names = BTreeSet::new();
    let Some(twice) = suites.iter().find(|suite| !names.insert(path_component(&suite.name))) else {
        return Ok(());
    };
    let message = format!(
        "{}: suite {:?} would share its folder {:?} with another; rename one",
        run.file.display(),
        twice.name,
        path_component(&twice.name)
    );
    Err(CliError::input(message))
}

/// A name as part of a path: it is the script's, and must not lead out of the folder.
pub(crate) fn path_component(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'), "_")
}
