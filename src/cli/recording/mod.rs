//! Data sets in the making: attempts at demonstrations, of which the good ones are kept, whoever drives.
//!
//! Attempts are numbered; what becomes a demonstration depends on nothing but their numbers and what becomes of them, whoever
//! finished first. An attempt's files are whole before its line stands in `attempts/<suite>/episodes.jsonl`, and a task's file is
//! put together from them, so that a recording that was broken off goes on where it was.

mod finish;
mod folder;
mod session;

use serde_json::Value;

use super::{Failure, args::Run, evaluate::own_folders};
use crate::{
    benchmark::{Plan, Suite},
    dataset::{DatasetError, layout::RECORDING},
    files,
};

pub(super) use session::{Session, Wanted};

/// What is made, and where.
#[derive(Clone, Debug)]
pub(super) struct Output {
    /// Script, tasks, seed, threads, settings and folder.
    pub run: Run,
    /// Whether pictures go into the HDF5 files.
    pub pictures: bool,
    /// Whether the true state is kept.
    pub privileged: bool,
}

/// Makes a data set; `recording` is what was asked for, `sessions` makes its suites ready.
///
/// # Errors
/// The folder holds something else, an attempt or a file fails, too few attempts are good.
pub(super) fn carry_out<'a>(
    output: &'a Output,
    recording: &Value,
    sessions: impl FnOnce() -> Result<Vec<Session<'a>>, Failure>,
) -> Result<(), Failure> {
    let root = output.run.out.clone().unwrap_or_default();
    if folder::check(&root, output.run.resume, recording)? {
        crate::text::eprint_line(&format!("softvt: {} is finished already", root.display()));
        return Ok(());
    }
    let missing = files::missing_folders(&root);
    // Before anything that takes long: a folder that cannot be written to is told at once.
    let ready = files::create_writable_folder(&root).map_err(failure).and_then(|()| sessions());
    let mut sessions = ready.inspect_err(|_| files::remove_empty_folders(&missing))?;
    let text = format!("{recording:#}\n");
    files::replace(&root.join(RECORDING), text.as_bytes()).map_err(failure)?;
    for session in &mut sessions {
        session.go().inspect_err(|_| folder::take_back(&root, &missing))?;
    }
    finish::finish(output, &sessions, &root)
}

/// The suites of a script.
///
/// # Errors
/// It has none, or two that would share a folder.
pub(super) fn suites_of<'a>(command: &str, run: &Run, plan: &'a Plan) -> Result<Vec<&'a Suite>, Failure> {
    match plan {
        Plan::Suite(suite) => Ok(vec![suite]),
        Plan::Suites { suites } => {
            own_folders(run, suites)?;
            Ok(suites.iter().collect())
        }
        _ => Err(Failure::input(format!(
            "{}: softvt {command} needs a suite, or a list of suites; name a file that returns softvt.suite",
            run.file.display()
        ))),
    }
}

fn failure(error: impl Into<DatasetError>) -> Failure {
    match error.into() {
        DatasetError::Interrupted => Failure::interrupted("interrupted"),
        other => Failure::input(other),
    }
}
