//! Carrying out a plan: a policy on suites, or an experiment.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use super::{
    Failure,
    args::{Run, Video},
    batch::{Batch, Done},
    conditions, experiment,
    info::{self, RunInfo},
    print,
    recorded::recorded,
    require,
};
use crate::{
    benchmark::{Plan, Suite, Task},
    evaluation::{record::EpisodeRecord, summary::SuiteSummary},
    report::{
        run_folder::{RUN, RunFolder, SUMMARY},
        terminal,
    },
    script::{self, Loaded},
};

/// Carries out the plan of a script.
///
/// # Errors
/// Anything that is wrong with the script, the flags, the folder or the policy.
pub(super) fn run(run: &Run) -> Result<(), Failure> {
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    check_video(run, &loaded.plan)?;
    check_recorded(run, &loaded.plan)?;
    match &loaded.plan {
        Plan::Suite(suite) => {
            let summary = evaluate(run, &loaded, suite, out_dir(run, &run.name_of(suite), None))?;
            let summaries = [summary];
            show(run, &summaries, false);
            require::check(&run.require, &summaries)
        }
        Plan::Suites { suites } => {
            own_folders(run, suites)?;
            let mut summaries = Vec::new();
            for suite in suites {
                let name = run.name_of(suite);
                summaries.push(evaluate(run, &loaded, suite, out_dir(run, &name, Some(&name)))?);
            }
            show(run, &summaries, true);
            require::check(&run.require, &summaries)
        }
        Plan::Conditions { name, suites, conditions } => {
            if !run.require.is_empty() {
                let message =
                    "--require: it is about suites, and this file compares conditions; read conditions.json";
                return Err(Failure::input(format!("{}: {message}", run.file.display())));
            }
            own_folders(run, suites)?;
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
                return Err(Failure::input(message));
            }
            experiment::run(run, &loaded, name, *points, columns)
        }
    }
}

/// Every suite must have a folder of its own.
///
/// # Errors
/// Two names that become one as part of a path.
pub(super) fn own_folders(run: &Run, suites: &[Suite]) -> Result<(), Failure> {
    let mut names = BTreeSet::new();
    let Some(twice) = suites.iter().find(|suite| !names.insert(plain(&suite.name))) else { return Ok(()) };
    let message = format!(
        "{}: suite {:?} would share its folder {:?} with another; rename one",
        run.file.display(),
        twice.name,
        plain(&twice.name)
    );
    Err(Failure::input(message))
}

/// Every episode that `--video` names must be one of every suite's: before any of them runs.
fn check_video(run: &Run, plan: &Plan) -> Result<(), Failure> {
    let Some(Video::Episodes(chosen)) = &run.video else { return Ok(()) };
    for suite in plan.suites() {
        let episodes = run.episodes.unwrap_or(suite.episodes);
        if let Some(beyond) = chosen.iter().find(|episode| **episode >= episodes) {
            let last = episodes.saturating_sub(1);
            let message = format!(
                "{}: --video={beyond}: suite {} runs the episodes 0 to {last} of each task; name one of them, or raise --episodes",
                run.file.display(),
                suite.name
            );
            return Err(Failure::input(message));
        }
    }
    Ok(())
}

/// What was recorded must hold every episode of every suite: before any of them runs.
fn check_recorded(run: &Run, plan: &Plan) -> Result<(), Failure> {
    if run.policy.recorded().is_none() {
        return Ok(());
    }
    for suite in plan.suites() {
        recorded(run, suite, &jobs(run, suite, &chosen(run, suite)?))?;
    }
    Ok(())
}

/// Tables, or one JSON document: an object for a suite, an array for a list of suites.
fn show(run: &Run, summaries: &[SuiteSummary], list: bool) {
    match summaries {
        _ if !run.json => summaries.iter().for_each(|summary| print(&terminal::table(summary))),
        [summary] if !list => print(&format!("{:#}\n", serde_json::json!(summary))),
        _ => print(&format!("{:#}\n", serde_json::json!(summaries))),
    }
}

/// A name as part of a path: it is the script's, and must not lead out of the folder.
pub(super) fn plain(name: &str) -> String {
    name.replace(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'), "_")
}

/// The folder that was asked for (with one more level for one of several suites), or the next free one under `runs/`.
fn out_dir(run: &Run, suite: &str, level: Option<&str>) -> PathBuf {
    let suite = plain(suite);
    let level = level.map(plain);
    match &run.out {
        Some(dir) => level.map_or(dir.clone(), |level| dir.join(level)),
        None => (1..)
            .map(|n| PathBuf::from(format!("runs/{suite}-{}-{n:03}", plain(run.policy.name()))))
            .find(|dir| !dir.exists())
            .unwrap_or_default(),
    }
}

/// Runs the first episode of one task of a suite and writes nothing.
///
/// # Errors
/// The script is no suite, or the episode cannot be run.
pub(super) fn single(run: &Run, task: usize) -> Result<EpisodeRecord, Failure> {
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        return Err(Failure::input(format!("{} is not a suite", run.file.display())));
    };
    let tasks = suite.tasks.iter().filter(|t| t.id == task);
    let jobs = tasks.map(|task| (task, 0)).collect();
    let batch = Batch::new(run, &loaded, suite, (jobs, PathBuf::new()))?;
    batch.episode(0, false, &batch.drive).map(|finished| finished.record)
}

/// The episodes of the tasks that `--task` names, or a shard's part of them.
pub(super) fn jobs<'a>(run: &Run, suite: &Suite, tasks: &[&'a Task]) -> Vec<(&'a Task, u32)> {
    let episodes = run.episodes.unwrap_or(suite.episodes);
    let all = tasks.iter().flat_map(|task| (0..episodes).map(move |e| (*task, e)));
    let own = all.enumerate().filter(|(job, _)| run.shard.is_none_or(|shard| shard.has(*job)));
    own.map(|(_, job)| job).collect()
}

fn evaluate(run: &Run, loaded: &Loaded, suite: &Suite, out: PathBuf) -> Result<SuiteSummary, Failure> {
    let tasks = chosen(run, suite)?;
    let mut batch = Batch::new(run, loaded, suite, (jobs(run, suite, &tasks), out))?;
    batch.prepare(&tasks)?;
    Ok(carry_out(&batch, &tasks)?.summary)
}

/// Runs the jobs of a batch that is prepared, into its folder; those that are done there stay.
///
/// # Errors
/// The folder holds another run, or one that is not to be resumed; an episode fails.
pub(super) fn carry_out(batch: &Batch, tasks: &[&Task]) -> Result<Done, Failure> {
    let run = batch.run;
    // The same command again on a finished folder changes nothing.
    let episodes = run.episodes.unwrap_or(batch.suite.episodes);
    let info = RunInfo::of(batch, tasks, episodes);
    let finished = is_finished(&batch.out) && info::is_of(&batch.out, &info)?;
    let opened = match run.resume || finished {
        true => RunFolder::resume(&batch.out),
        false => RunFolder::create(&batch.out).map(|folder| (folder, Vec::new())),
    };
    let (folder, done) = opened.map_err(|e| Failure::input(format!("{}: {e}", run.file.display())))?;
    batch.check_done(&folder, &done)?;
    info::write(&folder, &info)?;
    if finished && batch.is_whole(&done) {
        crate::text::eprint_line(&format!("softvt: {} is finished already", batch.out.display()));
        return Ok(batch.summed_up(done));
    }
    batch.go(folder, done)
}

/// Whether a folder holds a run that came to its end.
pub(super) fn is_finished(dir: &Path) -> bool {
    dir.join(SUMMARY).is_file() && dir.join(RUN).is_file()
}

/// The tasks that `--task` names.
///
/// # Errors
/// A word that names none, or a task without the expert that is to drive it.
pub(super) fn chosen<'a>(run: &Run, suite: &'a Suite) -> Result<Vec<&'a Task>, Failure> {
    let mut found: Vec<&Task> = Vec::new();
    for word in &run.tasks {
        if word.trim().is_empty() {
            let message = format!(
                "{}: --task: expected an index or part of a prompt, got {word:?}",
                run.file.display()
            );
            return Err(Failure::input(message));
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
            return Err(Failure::input(message));
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
        return Err(Failure::input(message));
    }
    Ok(found)
}
