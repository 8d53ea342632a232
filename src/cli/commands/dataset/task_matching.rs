//! Matching of foreign demonstrations to tasks: by `--task`, by their instructions, or by their task indices.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    benchmark::{Suite, Task},
    cli::{
        error::CliError,
        run::{config::RunConfig, selection::select_tasks},
    },
    dataset::import::{ForeignDemo, ForeignFile, ForeignLayout, ForeignTask, InitialCondition},
};

/// A demonstration with the task and attempt that it becomes.
pub(super) struct MatchedDemo<'a> {
    pub file: &'a ForeignFile,
    pub demo: &'a ForeignDemo,
    /// Position of the suite in the list of suites.
    pub suite: usize,
    /// Index of the task.
    pub task: usize,
    /// Number of the attempt.
    pub attempt: u32,
}

/// A task of one of several suites.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TaskRef {
    /// Position of the suite in the list of suites.
    suite: usize,
    /// Index of the task.
    task: usize,
}

impl MatchedDemo<'_> {
    fn task_ref(&self) -> TaskRef {
        TaskRef { suite: self.suite, task: self.task }
    }

    /// An error about this demonstration.
    fn refuse(&self, message: String) -> CliError {
        refuse(self.file, self.demo, message)
    }
}

/// Finds the tasks of all demonstrations, at most `max` of each task, and numbers the attempts. Demonstrations of
/// softvt keep their attempt numbers; the others get the free ones in order.
///
/// # Errors
/// A demonstration matches no task or several, or has another seed; or two are the same attempt.
pub(super) fn match_demos<'a>(
    config: &RunConfig,
    suites: &[Suite],
    files: &'a [ForeignFile],
    max: u32,
) -> Result<Vec<MatchedDemo<'a>>, CliError> {
    let forced = forced_task(config, suites)?;
    let mut found: Vec<MatchedDemo> = Vec::new();
    // Attempt numbers of the demonstrations that have one.
    let mut own_attempts: Vec<Option<u32>> = Vec::new();
    let mut counts: BTreeMap<TaskRef, u32> = BTreeMap::new();
    for file in files {
        for demo in &file.demos {
            let TaskRef { suite, task } = match forced {
                // A demonstration of softvt can only be of its own task.
                Some(forced) if file.layout != ForeignLayout::Softvt => forced,
                Some(forced) if task_of(config, suites, file, demo)? == forced => forced,
                Some(_) => {
                    let id = demo.task.id.map_or(String::new(), |id| format!(" {id}"));
                    return Err(refuse(
                        file,
                        demo,
                        format!(
                            "--task {}: it was recorded by softvt and is of task{id}; leave --task out",
                            config.flags.tasks.join(",")
                        ),
                    ));
                }
                None => task_of(config, suites, file, demo)?,
            };
            let count = counts.entry(TaskRef { suite, task }).or_default();
            *count += 1;
            if *count <= max {
                let matched = MatchedDemo { file, demo, suite, task, attempt: 0 };
                own_attempts.push(own_attempt(config, &matched)?);
                found.push(matched);
            }
        }
    }
    number_attempts(&mut found, &own_attempts)?;
    Ok(found)
}

fn refuse(file: &ForeignFile, demo: &ForeignDemo, message: String) -> CliError {
    CliError::input(format!("{}: {}: {message}", file.path.display(), demo.name))
}

/// The task that `--task` selects, if it is given.
///
/// # Errors
/// It selects none or several.
fn forced_task(config: &RunConfig, suites: &[Suite]) -> Result<Option<TaskRef>, CliError> {
    if config.flags.tasks.is_empty() {
        return Ok(None);
    }
    let mut found = Vec::new();
    let mut error = None;
    for (suite, tasks) in suites.iter().map(|suite| select_tasks(config, suite)).enumerate() {
        match tasks {
            Ok(tasks) => found.extend(tasks.iter().map(|task| TaskRef { suite, task: task.id })),
            Err(failure) => error = Some(failure),
        }
    }
    match (&found[..], error) {
        ([task], _) => Ok(Some(*task)),
        ([], Some(error)) => Err(error),
        _ => Err(config.error(format!(
            "--task {}: matches {} tasks; select the one of the demonstrations, or leave --task out to match their \
             instructions",
            config.flags.tasks.join(","),
            found.len()
        ))),
    }
}

fn number_attempts(found: &mut [MatchedDemo], own_attempts: &[Option<u32>]) -> Result<(), CliError> {
    let mut taken: BTreeSet<(TaskRef, u32)> = BTreeSet::new();
    for (demo, own) in found.iter_mut().zip(own_attempts) {
        let Some(attempt) = own else { continue };
        demo.attempt = *attempt;
        if !taken.insert((demo.task_ref(), *attempt)) {
            return Err(demo.refuse(format!(
                "another demonstration is of the same task and attempt {attempt}; import them into separate folders"
            )));
        }
    }
    for (demo, _) in found.iter_mut().zip(own_attempts).filter(|(_, own)| own.is_none()) {
        while !taken.insert((demo.task_ref(), demo.attempt)) {
            demo.attempt += 1;
        }
    }
    Ok(())
}

/// The attempt number of a demonstration of softvt.
fn own_attempt(config: &RunConfig, matched: &MatchedDemo) -> Result<Option<u32>, CliError> {
    match &matched.demo.initial_condition {
        InitialCondition::OtherSimulator { .. } => Ok(None),
        InitialCondition::SoftvtEpisode { seed, attempt, .. } if *seed == config.script.seed => {
            Ok(Some(*attempt))
        }
        InitialCondition::SoftvtEpisode { seed, .. } => Err(matched.refuse(format!(
            "it was recorded with the seed {seed}, and this import uses the seed {}; add --seed {seed}",
            config.script.seed
        ))),
    }
}

/// Normalizes an instruction or name: case, whitespace, underscores and final full stops are ignored.
fn normalized(text: &str) -> String {
    let words = text.to_lowercase().replace('_', " ");
    words.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}

/// Finds the task of a demonstration: by its instructions, or by its index where it has no instruction.
fn task_of(
    config: &RunConfig,
    suites: &[Suite],
    file: &ForeignFile,
    demo: &ForeignDemo,
) -> Result<TaskRef, CliError> {
    let ForeignTask { suite: named, id, prompts } = &demo.task;
    let is_named = |suite: usize| {
        named.as_ref().is_some_and(|name| {
            normalized(&name.replace('-', "_")) == normalized(&config.suite_name(&suites[suite]))
        })
    };
    let names_a_suite = (0..suites.len()).any(is_named);
    if file.layout == ForeignLayout::Softvt && !names_a_suite {
        return Err(no_task(config, suites, file, demo));
    }
    let candidates: Vec<(TaskRef, &Task)> = suites
        .iter()
        .enumerate()
        .filter(|(suite, _)| !names_a_suite || is_named(*suite))
        .flat_map(|(suite, tasks)| {
            tasks.tasks.iter().map(move |task| (TaskRef { suite, task: task.id }, task))
        })
        .collect();
    for prompt in prompts {
        let matching: Vec<TaskRef> = candidates
            .iter()
            .filter(|(_, task)| normalized(&task.prompt) == normalized(prompt))
            .map(|(task_ref, _)| *task_ref)
            .collect();
        let by_index = matching.iter().find(|task_ref| Some(task_ref.task) == *id);
        match (&matching[..], by_index) {
            ([], _) => {}
            ([task_ref], _) | (_, Some(task_ref)) => return Ok(*task_ref),
            _ => {
                let tasks: Vec<String> = matching
                    .iter()
                    .map(|task_ref| format!("{} task {}", suites[task_ref.suite].name, task_ref.task))
                    .collect();
                return Err(refuse(
                    file,
                    demo,
                    format!(
                        "its instruction, {prompt:?}, is that of {}; select one with --task",
                        tasks.join(", ")
                    ),
                ));
            }
        }
    }
    let by_index: Vec<TaskRef> = candidates
        .iter()
        .filter(|(task_ref, _)| Some(task_ref.task) == *id)
        .map(|(task_ref, _)| *task_ref)
        .collect();
    // An index alone identifies a task only within a suite that is known.
    let index_is_enough = prompts.is_empty() && (names_a_suite || named.is_none());
    match by_index[..] {
        [task_ref] if index_is_enough => Ok(task_ref),
        _ => Err(no_task(config, suites, file, demo)),
    }
}

fn no_task(config: &RunConfig, suites: &[Suite], file: &ForeignFile, demo: &ForeignDemo) -> CliError {
    let ForeignTask { suite, id, prompts } = &demo.task;
    let task = match (prompts.first(), id) {
        (Some(prompt), _) => Some(format!("{prompt:?}")),
        (None, Some(id)) => Some(format!("task {id}")),
        (None, None) => None,
    };
    let script = config.script.file.display();
    let problem = match (task, suite) {
        (Some(task), Some(suite)) => {
            format!("it is of {task} of the suite {suite}, and {script} has no such task")
        }
        (Some(task), None) => format!("it is of {task}, and {script} has no such task"),
        (None, Some(suite)) => format!("it is of the suite {suite}, but does not name its task"),
        (None, None) => "it does not name its task, by an instruction or an index".to_owned(),
    };
    let list = |suite: &Suite| {
        let tasks = suite.tasks.iter().map(|task| format!("\n  {} {}: {}", suite.name, task.id, task.prompt));
        tasks.collect::<String>()
    };
    let tasks: String = suites.iter().map(list).collect();
    refuse(file, demo, format!("{problem}; if one fits, select it with --task:{tasks}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_whitespace_and_full_stops_are_ignored() {
        assert_eq!(normalized(" Lift  The_Cup. "), "lift the cup");
    }
}
