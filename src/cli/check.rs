//! `softvt check`: whether a script is right, without running what it plans.

use std::path::PathBuf;

use super::{Failure, args::Run, batch::Batch, conditions, print};
use crate::{
    benchmark::{Goal, Plan, Suite},
    message,
    script::{self, Loaded},
};

/// Reads a script, makes its plan, and builds and looks at the first scene of every task.
///
/// # Errors
/// The first thing that is wrong.
pub fn run(run: &Run) -> Result<(), Failure> {
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    let file = run.file.display();
    match &loaded.plan {
        Plan::Suite(suite) => suite_is_right(run, &loaded, suite)?,
        Plan::Suites { suites } => suites.iter().try_for_each(|suite| suite_is_right(run, &loaded, suite))?,
        Plan::Conditions { suites, conditions: list, .. } => {
            suites.iter().try_for_each(|suite| suite_is_right(run, &loaded, suite))?;
            conditions::check(run, &loaded, (suites, list))?;
        }
        Plan::Experiment { name, points, .. } => {
            print(&format!("experiment {name}: {points} points; they are not run here\n"));
        }
    }
    print(&format!("{file}: nothing is wrong with it\n"));
    Ok(())
}

fn suite_is_right(run: &Run, loaded: &Loaded, suite: &Suite) -> Result<(), Failure> {
    let tasks: Vec<_> = suite.tasks.iter().collect();
    let jobs = tasks.iter().map(|task| (*task, 0)).collect();
    let mut batch = Batch::new(run, loaded, suite, (jobs, PathBuf::new()))?;
    // As if all were to be drawn: whatever can be wrong with a camera is found too.
    batch.films = true;
    batch.prepare(&tasks)?;
    let episodes = suite.episodes;
    print(&format!("suite {}: {} tasks, {episodes} episodes each\n", suite.name, tasks.len()));
    for task in tasks {
        let expert = if task.expert { "" } else { ", no expert" };
        let (way, object, target) = match &task.goal {
            Goal::On { object, target, .. } => ("on", object, target),
            Goal::In { object, target, .. } => ("in", object, target),
        };
        let id = task.id;
        print(&format!("{id:>4} {}: {object} {way} {target}{expert}\n", message::plain(&task.prompt)));
    }
    Ok(())
}
