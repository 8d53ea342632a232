//! Which task a foreign demonstration is of: by `--task`, by its instruction, or by the index that it gives itself.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    benchmark::{Suite, Task},
    cli::{error::CliError, run::config::RunConfig, run::selection::select_tasks},
    dataset::import::{ForeignDemo, ForeignFile, ForeignLayout, ForeignTask, InitialCondition},
};

/// A demonstration with the task and attempt that it becomes.
pub(crate) struct MatchedDemo<'a> {
    /// Its file.
    pub file: &'a ForeignFile,
    /// The demonstration.
    pub demo: &'a ForeignDemo,
    /// Place of the suite in the list.
    pub suite: usize,
    /// Index of the task.
    pub task: usize,
    /// Number of the attempt.
    pub attempt: u32,
}

/// Finds the tasks of all demonstrations, at most `most` of each task, and numbers their attempts: those of softvt keep their
/// numbers, the others take those that are free, in order.
///
/// # Errors
/// One is of no task, of several, or of another seed; or two are of one attempt.
pub(crate) fn match_all<'a>(
    run: &RunConfig,
    suites: &[&Suite],
    files: &'a [ForeignFile],
    most: u32,
) -> Result<Vec<MatchedDemo<'a>>, CliError> {
    let forced = named(run, suites)?;
    let mut found: Vec<(MatchedDemo, Option<u32>)> = Vec::new();
    let mut count: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    for file in files {
        for demo in &file.demos {
            let (suite, task) = match forced {
                // Episodes of softvt's own are of their very task.
                Some(forced) if file.layout != ForeignLayout::Softvt => forced,
                Some(forced) if task_of(run, suites, file, demo)? == forced => forced,
                Some(_) => return Err(of_another(run, file, demo)),
                None => task_of(run, suites, file, demo)?,
            };
            let count = count.entry((suite, task)).or_default();
            *count += 1;
            if *count <= most {
                let own = own_attempt(run, file, demo)?;
                found.push((MatchedDemo { file, demo, suite, task, attempt: 0 }, own));
            }
        }
    }
    number(&mut found)?;
    Ok(found.into_iter().map(|(matched, _)| matched).collect())
}

/// The one task that `--task` names, if it is given: its suite's place in the list, and its index.
///
/// # Errors
/// It names none or several.
fn named(run: &RunConfig, suites: &[&Suite]) -> Result<Option<(usize, usize)>, CliError> {
    if run.tasks.is_empty() {
        return Ok(None);
    }
    let mut found = Vec::new();
    let mut refused = None;
    for (index, suite) in suites.iter().enumerate() {
        match select_tasks(run, suite) {
            Ok(tasks) => found.extend(tasks.iter().map(|task| (index, task.id))),
            Err(failure) => refused = Some(failure),
        }
    }
    match (&found[..], refused) {
        ([one], _) => Ok(Some(*one)),
        ([], Some(failure)) => Err(failure),
        _ => Err(CliError::input(format!(
            "{}: --task {}: that is {} tasks; name the one that the demonstrations are of, or leave --task out and go by their \
             instructions",
            run.file.display(),
            run.tasks.join(","),
            found.len()
        ))),
    }
}

fn number(found: &mut [(MatchedDemo, Option<u32>)]) -> Result<(), CliError> {
    let mut taken: BTreeSet<(usize, usize, u32)> = BTreeSet::new();
    for (one, own) in found.iter_mut() {
        let Some(attempt) = own else { continue };
        one.attempt = *attempt;
        if !taken.insert((one.suite, one.task, *attempt)) {
            return Err(CliError::input(format!(
                "{}: {}: another demonstration is of the same task and attempt {attempt}; import them apart",
                one.file.path.display(),
                one.demo.name
            )));
        }
    }
    for (one, _) in found.iter_mut().filter(|(_, own)| own.is_none()) {
        while !taken.insert((one.suite, one.task, one.attempt)) {
            one.attempt += 1;
        }
    }
    Ok(())
}

/// The attempt that a demonstration of softvt's was.
fn own_attempt(run: &RunConfig, file: &ForeignFile, demo: &ForeignDemo) -> Result<Option<u32>, CliError> {
    match &demo.initial_condition {
        InitialCondition::OtherSimulator { .. } => Ok(None),
        InitialCondition::SoftvtEpisode { seed, attempt, .. } if *seed == run.seed => Ok(Some(*attempt)),
        InitialCondition::SoftvtEpisode { seed, .. } => Err(CliError::input(format!(
            "{}: {}: it was recorded with the seed {seed}, and this import is of the seed {}; give --seed {seed}",
            file.path.display(),
            demo.name,
            run.seed
        ))),
    }
}

/// Letters in their plainest form: case, blanks and a full stop do not count.
fn plainly(text: &str) -> String {
    let words = text.to_lowercase().replace('_', " ");
    words.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}

fn task_of(
    run: &RunConfig,
    suites: &[&Suite],
    file: &ForeignFile,
    demo: &ForeignDemo,
) -> Result<(usize, usize), CliError> {
    let ForeignTask { suite, id, prompts } = &demo.task;
    let all =
        || suites.iter().enumerate().flat_map(|(i, suite)| suite.tasks.iter().map(move |task| (i, task)));
    let named = |index: usize| {
        suite
            .as_ref()
            .is_some_and(|name| plainly(&name.replace('-', "_")) == plainly(&run.name_of(suites[index])))
    };
    let is_ours = (0..suites.len()).any(named);
    if file.layout == ForeignLayout::Softvt && !is_ours {
        return Err(no_task(run, suites, file, demo));
    }
    let of_suite = |index: usize| !is_ours || named(index);
    for prompt in prompts {
        let says =
            |(index, task): &(usize, &Task)| of_suite(*index) && plainly(&task.prompt) == plainly(prompt);
        let fits: Vec<(usize, &Task)> = all().filter(says).collect();
        let by_index = fits.iter().find(|(_, task)| Some(task.id) == *id);
        match (&fits[..], by_index) {
            ([], _) => {}
            ([(index, task)], _) | (_, Some((index, task))) => return Ok((*index, task.id)),
            _ => {
                let ids: Vec<String> =
                    fits.iter().map(|(i, task)| format!("{} task {}", suites[*i].name, task.id)).collect();
                return Err(CliError::input(format!(
                    "{}: {}: its instruction, {prompt:?}, is that of {}; name one with --task",
                    file.path.display(),
                    demo.name,
                    ids.join(", ")
                )));
            }
        }
    }
    let by_index: Vec<(usize, usize)> = all()
        .filter(|(index, task)| of_suite(*index) && Some(task.id) == *id)
        .map(|(i, task)| (i, task.id))
        .collect();
    let may_go_by_index = prompts.is_empty() && (is_ours || suite.is_none());
    match by_index[..] {
        [one] if may_go_by_index => Ok(one),
        _ => Err(no_task(run, suites, file, demo)),
    }
}

fn of_another(run: &RunConfig, file: &ForeignFile, demo: &ForeignDemo) -> CliError {
    let id = demo.task.id.map_or(String::new(), |id| format!(" {id}"));
    CliError::input(format!(
        "{}: {}: --task {}: it was recorded by softvt and is of task{id}; leave --task out",
        file.path.display(),
        demo.name,
        run.tasks.join(",")
    ))
}

fn no_task(run: &RunConfig, suites: &[&Suite], file: &ForeignFile, demo: &ForeignDemo) -> CliError {
    let ForeignTask { suite, id, prompts } = &demo.task;
    let task = match (prompts.first(), id) {
        (Some(prompt), _) => Some(format!("{prompt:?}")),
        (None, Some(id)) => Some(format!("task {id}")),
        (None, None) => None,
    };
    let script = run.file.display();
    let said = match (task, suite) {
        (Some(task), Some(suite)) => {
            format!("it is of {task} of the suite {suite}, and {script} has no such task")
        }
        (Some(task), None) => format!("it is of {task}, and {script} has no such task"),
        (None, Some(suite)) => format!("it is of the suite {suite}, but does not say of which task"),
        (None, None) => "it does not say of which task it is, by an instruction or an index".to_owned(),
    };
    let list = |suite: &&Suite| {
        let tasks = suite.tasks.iter().map(|task| format!("\n  {} {}: {}", suite.name, task.id, task.prompt));
        tasks.collect::<String>()
    };
    let listed: String = suites.iter().map(list).collect();
    CliError::input(format!(
        "{}: {}: {said}; name one with --task if one is meant:{listed}",
        file.path.display(),
        demo.name
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_blanks_and_full_stops_do_not_count() {
        assert_eq!(plainly(" Lift  The_Cup. "), "lift the cup");
    }
}
