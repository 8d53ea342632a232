//! Matching of foreign demonstrations to tasks: by `--task`, by their instructions, or by their task indices.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Display,
};

use crate::{config::RunConfig, error::RunError, suite_selection::select_tasks};
use softvt_benchmark::{Suite, Task};
use softvt_dataset::import::{ForeignDemo, ForeignFile, ForeignFormat, ForeignTask, InitialCondition};

#[derive(Clone, Copy, Debug)]
pub(super) struct SuiteTask<'a> {
    /// Position of the suite in the list of suites.
    pub suite: usize,
    pub task: &'a Task,
}

/// Position of the suite, and index of the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TaskKey {
    suite: usize,
    task: usize,
}

impl SuiteTask<'_> {
    fn key(&self) -> TaskKey {
        TaskKey { suite: self.suite, task: self.task.id }
    }
}

/// A demonstration with the task and attempt that it becomes.
pub(super) struct MatchedDemo<'a> {
    pub file: &'a ForeignFile,
    pub demo: &'a ForeignDemo,
    pub task: SuiteTask<'a>,
    pub attempt: u32,
}

/// Finds the tasks of all demonstrations, at most `max` of each task, and numbers the attempts. Demonstrations of
/// softvt keep their attempt numbers; the others get the free ones in order.
pub(super) fn match_demos<'a>(
    config: &RunConfig,
    suites: &'a [Suite],
    files: &'a [ForeignFile],
    max: u32,
) -> Result<Vec<MatchedDemo<'a>>, RunError> {
    let forced = forced_task(config, suites)?;
    let mut found: Vec<MatchedDemo> = Vec::new();
    let mut counts: BTreeMap<TaskKey, u32> = BTreeMap::new();
    for (file, demo) in files.iter().flat_map(|file| file.demos.iter().map(move |demo| (file, demo))) {
        let task = match forced {
            // A demonstration of softvt can only be of its own task.
            Some(forced) if file.format != ForeignFormat::Softvt => forced,
            Some(forced) if task_of(config, suites, file, demo)?.key() == forced.key() => forced,
            Some(_) => {
                let id = demo.task.id.map_or(String::new(), |id| format!(" {id}"));
                let selected = config.tasks.join(",");
                let what = format!(
                    "it was recorded by softvt and is of task{id}, not of the selected {selected}; select none"
                );
                return Err(refuse(file, demo, what));
            }
            None => task_of(config, suites, file, demo)?,
        };
        let count = counts.entry(task.key()).or_default();
        *count += 1;
        if *count <= max {
            found.push(MatchedDemo {
                file,
                demo,
                task,
                attempt: own_attempt(config, file, demo)?.unwrap_or(0),
            });
        }
    }
    let mut taken: BTreeSet<(TaskKey, u32)> = BTreeSet::new();
    let is_foreign = |matched: &MatchedDemo| {
        matches!(matched.demo.initial_condition, InitialCondition::OtherSimulator { .. })
    };
    for &MatchedDemo { file, demo, task, attempt } in found.iter().filter(|matched| !is_foreign(matched)) {
        if !taken.insert((task.key(), attempt)) {
            let what =
                "another demonstration is of the same task and attempt; import them into separate folders";
            return Err(refuse(file, demo, what));
        }
    }
    for matched in found.iter_mut().filter(|matched| is_foreign(matched)) {
        while !taken.insert((matched.task.key(), matched.attempt)) {
            matched.attempt += 1;
        }
    }
    Ok(found)
}

fn refuse(file: &ForeignFile, demo: &ForeignDemo, message: impl Display) -> RunError {
    RunError::input(format_args!("{}: {}: {message}", file.path.display(), demo.name))
}

/// The task that `--task` selects, if it is given.
fn forced_task<'a>(config: &RunConfig, suites: &'a [Suite]) -> Result<Option<SuiteTask<'a>>, RunError> {
    if config.tasks.is_empty() {
        return Ok(None);
    }
    let mut found = Vec::new();
    let mut error = None;
    for (suite, tasks) in suites.iter().map(|suite| select_tasks(config, suite)).enumerate() {
        match tasks {
            Ok(tasks) => found.extend(tasks.into_iter().map(|task| SuiteTask { suite, task })),
            Err(failure) => error = Some(failure),
        }
    }
    match (&found[..], error) {
        ([task], _) => Ok(Some(*task)),
        ([], Some(error)) if suites.len() == 1 => Err(error),
        ([], Some(_)) => {
            let names: Vec<&str> = suites.iter().map(|suite| suite.name.as_str()).collect();
            let message = format!("none of the suites {} has such a task", names.join(", "));
            Err(config.error_of("tasks", config.tasks.join(","), message))
        }
        _ => {
            let message = format!(
                "matches {} tasks; select the one of the demonstrations, or none to match their instructions",
                found.len()
            );
            Err(config.error_of("tasks", config.tasks.join(","), message))
        }
    }
}

/// The attempt number of a demonstration of softvt.
fn own_attempt(config: &RunConfig, file: &ForeignFile, demo: &ForeignDemo) -> Result<Option<u32>, RunError> {
    let own = config.base_seed();
    match &demo.initial_condition {
        InitialCondition::OtherSimulator { .. } => Ok(None),
        InitialCondition::SoftvtEpisode { seed, attempt, .. } if *seed == own => Ok(Some(*attempt)),
        InitialCondition::SoftvtEpisode { seed, .. } => {
            let what = format!("it was recorded with the seed {seed}; import it with that seed, not {own}");
            Err(refuse(file, demo, what))
        }
    }
}

/// Normalizes an instruction or name: case, whitespace, underscores and final full stops are ignored.
fn normalized(text: &str) -> String {
    let words = text.to_lowercase().replace('_', " ");
    words.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}

/// Finds the task of a demonstration: by its instructions, or by its index where it has no instruction.
fn task_of<'a>(
    config: &RunConfig,
    suites: &'a [Suite],
    file: &ForeignFile,
    demo: &ForeignDemo,
) -> Result<SuiteTask<'a>, RunError> {
    let ForeignTask { suite: named, id, prompts } = &demo.task;
    let name = named.as_ref().map(|name| normalized(&name.replace('-', "_")));
    let is_named = |suite: &Suite| name.as_ref() == Some(&normalized(&config.suite_name(suite)));
    let names_a_suite = suites.iter().any(is_named);
    if file.format == ForeignFormat::Softvt && !names_a_suite {
        return Err(no_task(config, suites, file, demo));
    }
    let candidates: Vec<SuiteTask> = suites
        .iter()
        .enumerate()
        .filter(|(_, suite)| !names_a_suite || is_named(suite))
        .flat_map(|(suite, of)| of.tasks.iter().map(move |task| SuiteTask { suite, task }))
        .collect();
    let select = |is_match: &dyn Fn(&Task) -> bool| -> Vec<SuiteTask> {
        candidates.iter().copied().filter(|candidate| is_match(candidate.task)).collect()
    };
    for prompt in prompts {
        let matching = select(&|task| normalized(&task.prompt) == normalized(prompt));
        let by_index = matching.iter().find(|candidate| Some(candidate.task.id) == *id);
        match (&matching[..], by_index) {
            ([], _) => {}
            ([only], _) | (_, Some(only)) => return Ok(*only),
            _ => {
                let name = |found: &SuiteTask| format!("{} task {}", suites[found.suite].name, found.task.id);
                let tasks: Vec<String> = matching.iter().map(name).collect();
                let what =
                    format!("its instruction, {prompt:?}, is that of {}; select one", tasks.join(", "));
                return Err(refuse(file, demo, what));
            }
        }
    }
    // An index alone identifies a task only within a suite that is known.
    let index_is_enough = prompts.is_empty() && (names_a_suite || named.is_none());
    match select(&|task| Some(task.id) == *id)[..] {
        [only] if index_is_enough || names_a_suite && only.task.prompt_varies => Ok(only),
        _ => Err(no_task(config, suites, file, demo)),
    }
}

fn no_task(config: &RunConfig, suites: &[Suite], file: &ForeignFile, demo: &ForeignDemo) -> RunError {
    let ForeignTask { suite, id, prompts } = &demo.task;
    let named = prompts.first().map(|prompt| format!("{prompt:?}"));
    let task = named.or_else(|| id.map(|id| format!("task {id}"))).unwrap_or("an unnamed task".to_owned());
    let of_suite = suite.as_ref().map_or(String::new(), |suite| format!(" of the suite {suite}"));
    let problem = format!("it is of {task}{of_suite}, and {} has no such task", config.file.display());
    if file.format == ForeignFormat::Softvt {
        let fix = "softvt imports its own recordings into their own task, whatever task is selected; name the file of their suite";
        return refuse(file, demo, format!("{problem}; {fix}"));
    }
    let list = |suite: &Suite| {
        let tasks = suite.tasks.iter().map(|task| format!("\n  {} {}: {}", suite.name, task.id, task.prompt));
        tasks.collect::<String>()
    };
    let tasks: String = suites.iter().map(list).collect();
    refuse(file, demo, format!("{problem}; if one fits, select it:{tasks}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_whitespace_and_full_stops_are_ignored() {
        assert_eq!(normalized(" Lift  The_Cup. "), "lift the cup");
    }
}
