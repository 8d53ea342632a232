//! `softvt replay RUN EPISODE`: simulates a recorded episode again and asks whether every byte comes out the same.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::{
    benchmark::{Plan, Suite, seed::Split},
    cli::{
        commands::dataset,
        error::CliError,
        output::print,
        run::config::RunConfig,
        run::selection::select_tasks,
        run::{policy::PolicyConfig, resimulate, suite_run::SuiteRun},
    },
    evaluation::record::EpisodeRecord,
    policy::Action,
    report::{
        actions,
        stored_run::{self, StoredRun},
    },
    script,
};

/// Which episode of a run: `TASK/EPISODE`, or the number of its line from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EpisodeSelector {
    /// A line.
    Line(usize),
    /// A task's episode.
    Of(usize, u32),
}

/// Reads which episode is meant.
///
/// # Errors
/// A fragment for people.
pub(crate) fn which(word: &str) -> Result<EpisodeSelector, String> {
    let pair = word
        .split_once('/')
        .and_then(|(task, e)| Some(EpisodeSelector::Of(task.parse().ok()?, e.parse().ok()?)));
    let found = pair.or_else(|| word.parse().ok().map(EpisodeSelector::Line));
    found.ok_or_else(|| {
        "expected TASK/EPISODE such as 3/0, or the number of a line of episodes.jsonl from 0".to_owned()
    })
}

/// Simulates the episode again by its recorded actions.
///
/// # Errors
/// The run cannot be read, its scripts have changed since, or (exit code 1) something comes out different.
pub(crate) fn run(dir: &Path, which: EpisodeSelector) -> Result<(), CliError> {
    if dataset::is_dataset(dir) {
        return dataset::replay(dir, which);
    }
    let stored = stored_run::load(dir).map_err(CliError::input)?;
    let [stored] = &stored[..] else {
        let names: Vec<String> = stored.iter().map(|run| run.dir.display().to_string()).collect();
        return Err(CliError::input(format!(
            "{} holds several runs; name one of {}",
            dir.display(),
            names.join(", ")
        )));
    };
    let record = find(stored, which)?;
    let path = actions::path(&stored.dir, record.identity.task, record.identity.episode);
    let recorded = actions::read(&path).map_err(CliError::input)?;
    let state = again(stored, record, recorded)?;
    let (task, episode) = (record.identity.task, record.identity.episode);
    print(&format!("task {task} episode {episode}: the same to the byte, final state {state}\n"));
    Ok(())
}

/// Simulates an episode of a run again by its actions, and returns the hash of its final state.
///
/// # Errors
/// The scripts have changed since, or (exit code 1) something comes out different.
pub(crate) fn again(
    stored: &StoredRun,
    record: &EpisodeRecord,
    recorded: Vec<Action>,
) -> Result<String, CliError> {
    let simulated = simulate(stored, record, recorded)?;
    let (task, episode) = (record.identity.task, record.identity.episode);
    let Some(what) = resimulate::difference(record, &simulated)? else {
        return Ok(simulated.stats.state_hash);
    };
    Err(CliError::internal(format!(
        "task {task} episode {episode} does not come out the same: {what}; softvt doctor says whether this machine computes as published"
    )))
}

/// An episode of a run once more by its actions, with what is not simulated again.
///
/// # Errors
/// The scripts have changed since, or the episode cannot be run.
pub(crate) fn simulate(
    stored: &StoredRun,
    record: &EpisodeRecord,
    recorded: Vec<Action>,
) -> Result<EpisodeRecord, CliError> {
    let run = run_of(stored)?;
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let suite = suite_of(&loaded.plan, &run, stored)?;
    let (task, episode) = (record.identity.task, record.identity.episode);
    let run = RunConfig { tasks: vec![task.to_string()], ..run };
    let tasks = select_tasks(&run, suite)?;
    let mut batch = SuiteRun::new(&run, &loaded, suite, (vec![(tasks[0], episode)], PathBuf::new()))?;
    batch.split = split_of(stored)?;
    batch.drive = resimulate::drive(recorded, record);
    batch.origins.extend(record.identity.origin.iter().map(|origin| ((task, episode), (**origin).clone())));
    batch.prepare(&tasks)?;
    same_sources(stored, &batch)?;
    Ok(resimulate::known(batch.episode(0, false, &batch.drive)?.record, record))
}

fn find(stored: &StoredRun, which: EpisodeSelector) -> Result<&EpisodeRecord, CliError> {
    let found = match which {
        EpisodeSelector::Line(line) => stored.records.get(line),
        EpisodeSelector::Of(task, episode) => {
            stored.records.iter().find(|r| (r.identity.task, r.identity.episode) == (task, episode))
        }
    };
    found.ok_or_else(|| {
        CliError::input(format!(
            "{} has no such episode; it has {}",
            stored.dir.display(),
            stored.records.len()
        ))
    })
}

/// Which list the episodes of a run are of.
fn split_of(stored: &StoredRun) -> Result<Split, CliError> {
    let named = |split: &Split| split.name() == stored.text("split");
    let found = [Split::Validation, Split::Demonstration, Split::Experiment].into_iter().find(named);
    found.ok_or_else(|| {
        let dir = stored.dir.display();
        CliError::input(format!("{dir}: there is no list of episodes {:?}", stored.text("split")))
    })
}

/// The command that made a run.
fn run_of(stored: &StoredRun) -> Result<RunConfig, CliError> {
    let info = &stored.info;
    let wrong = |field: &str| {
        CliError::input(format!(
            "{}/run.json: it has no {field}, as runs of this version have",
            stored.dir.display()
        ))
    };
    let texts = |value: &Value| -> Option<Vec<String>> {
        value.as_array()?.iter().map(|text| text.as_str().map(str::to_owned)).collect()
    };
    let set = info["set"].as_array().and_then(|all| {
        all.iter().map(|pair| texts(pair)?.try_into().ok().map(|[a, b]: [String; 2]| (a, b))).collect()
    });
    let shifts = info["shifts"].as_array().and_then(|all| {
        all.iter().map(|pair| Some((pair[0].as_str()?.to_owned(), pair[1].as_f64()?))).collect()
    });
    Ok(RunConfig {
        script_words: texts(&info["arguments"]).ok_or_else(|| wrong("arguments"))?,
        seed: info["seed"].as_u64().ok_or_else(|| wrong("seed"))?,
        twin: info["twin"].is_string(),
        set: set.ok_or_else(|| wrong("set"))?,
        shifts: shifts.ok_or_else(|| wrong("shifts"))?,
        ..RunConfig::of(PathBuf::from(stored.text("script")), PolicyConfig::replay())
    })
}

fn suite_of<'a>(plan: &'a Plan, run: &RunConfig, stored: &StoredRun) -> Result<&'a Suite, CliError> {
    let suites: Vec<&Suite> = match plan {
        Plan::Suite(suite) => vec![suite],
        Plan::Suites { suites } => suites.iter().collect(),
        _ => Vec::new(),
    };
    let found = suites.into_iter().find(|suite| suite.name == stored.text("suite"));
    found.ok_or_else(|| {
        CliError::input(format!("{} has no suite {:?} any more", run.file.display(), stored.text("suite")))
    })
}

/// Refuses scripts and thresholds that are not what the run was made with.
fn same_sources(stored: &StoredRun, batch: &SuiteRun) -> Result<(), CliError> {
    let now = json!(batch.sources);
    let known = stored.info["sources"].as_object().into_iter().flatten();
    let changed: Vec<&str> = known
        .filter(|(name, hash)| now.get(name.as_str()).is_some_and(|own| own != *hash))
        .map(|(n, _)| n.as_str())
        .collect();
    if changed.is_empty() {
        return Ok(());
    }
    Err(CliError::input(format!(
        "{}: {} changed since the run was made; go back to what it was, or run anew",
        stored.dir.display(),
        changed.join(", ")
    )))
}
