//! Data sets in the making: attempts at demonstrations, of which the good ones are kept, whoever drives.
//!
//! Attempts are numbered; what becomes a demonstration depends on nothing but their numbers and what becomes of them, whoever
//! finished first. An attempt's files are whole before its line stands in `attempts/<suite>/episodes.jsonl`, and a task's file is
//! put together from them, so that a recording that was broken off goes on where it was.

mod finish;
mod folder;
mod session;

use serde_json::Value;

use crate::{
    benchmark::{Plan, Suite},
    cli::{error::CliError, run::config::RunConfig, run::selection::check_distinct_out_dirs},
    dataset::{DatasetError, layout::RECORDING},
};

pub(crate) use session::{AttemptPlan, SuiteRecording};

/// What is made, and where.
#[derive(Clone, Debug)]
pub(crate) struct RecordingConfig {
    /// Script, tasks, seed, threads, settings and folder.
    pub run: RunConfig,
    /// Whether pictures go into the HDF5 files.
    pub pictures: bool,
    /// Whether the true state is kept.
    pub privileged: bool,
}

/// Makes a data set; `recording` is what was asked for, `sessions` makes its suites ready.
///
/// # Errors
/// The folder holds something else, an attempt or a file fails, too few attempts are good.
pub(crate) fn record_all<'a>(
    output: &'a RecordingConfig,
    recording: &Value,
    sessions: impl FnOnce() -> Result<Vec<SuiteRecording<'a>>, CliError>,
) -> Result<(), CliError> {
    let root = output.run.out.clone().unwrap_or_default();
    if folder::check(&root, output.run.resume, recording)? {
        crate::text::eprint_line(&format!("softvt: {} is finished already", root.display()));
        return Ok(());
    }
    let missing = crate::files::missing_folders(&root);
    // Before anything that takes long: a folder that cannot be written to is told at once.
    let ready = crate::files::create_writable_folder(&root).map_err(failure).and_then(|()| sessions());
    let mut sessions = ready.inspect_err(|_| crate::files::remove_empty_folders(&missing))?;
    let text = format!("{recording:#}\n");
    crate::files::replace(&root.join(RECORDING), text.as_bytes()).map_err(failure)?;
    for session in &mut sessions {
        session.go().inspect_err(|_| folder::take_back(&root, &missing))?;
    }
    finish::finish(output, &sessions, &root)
}

/// The suites of a script.
///
/// # Errors
/// It has none, or two that would share a folder.
pub(crate) fn suites_of<'a>(
    command: &str,
    run: &RunConfig,
    plan: &'a Plan,
) -> Result<Vec<&'a Suite>, CliError> {
    match plan {
        Plan::Suite(suite) => Ok(vec![suite]),
        Plan::Suites { suites } => {
            check_distinct_out_dirs(run, suites)?;
            Ok(suites.iter().collect())
        }
        _ => Err(CliError::input(format!(
            "{}: softvt {command} needs a suite, or a list of suites; name a file that returns softvt.suite",
            run.file.display()
        ))),
    }
}

fn failure(error: impl Into<DatasetError>) -> CliError {
    match error.into() {
        DatasetError::Interrupted => CliError::interrupted("interrupted"),
        other => CliError::input(other),
    }
}
