//! [`RunError`]: why a run did not come to its end.

use softvt_common::{cancel, files::FileError};

/// Causes of a [`RunError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A script, an argument or a file that is not valid.
    Input,
    /// The policy, or the connection to it.
    Policy,
    /// A request to stop ([`softvt_common::cancel`]). Finished episodes are on disk.
    Interrupt,
}

/// An error that ends a run. Its message is for a user: it names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct RunError {
    /// Its cause, which decides the exit code of a command.
    pub cause: Cause,
    /// Text for a user.
    pub message: String,
}

impl RunError {
    /// An error with this cause.
    pub fn new(cause: Cause, message: impl ToString) -> Self {
        Self { cause, message: message.to_string() }
    }

    /// Invalid input. Once a stop is requested, that is the cause, since the error may be its consequence.
    pub fn input(message: impl ToString) -> Self {
        let cause = if cancel::requested() { Cause::Interrupt } else { Cause::Input };
        Self::new(cause, message)
    }

    /// A run that ended by a request to stop.
    pub fn interrupted(message: impl ToString) -> Self {
        Self::new(Cause::Interrupt, message)
    }

    /// Puts `prefix` and a colon before the message.
    pub fn prefixed(self, prefix: impl std::fmt::Display) -> Self {
        Self { message: format!("{prefix}: {}", self.message), ..self }
    }

    /// Names the part of the request that failed, in parentheses after the message.
    pub(crate) fn within(self, part: &str) -> Self {
        Self { message: format!("{} ({part})", self.message), ..self }
    }

    /// Adds a line to the message.
    pub(crate) fn with_line(self, line: &str) -> Self {
        Self { message: format!("{}\n{line}", self.message), ..self }
    }
}

/// Errors of these types are errors of the input.
macro_rules! input_errors {
    ($($error:ty),* $(,)?) => {
        $(impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                Self::input(error)
            }
        })*
    };
}

input_errors!(
    FileError,
    serde_json::Error,
    softvt_dataset::DatasetError,
    softvt_evaluation::thresholds::ThresholdError,
    softvt_report::actions::ActionsError,
    softvt_report::run_folder::RunFolderError,
    softvt_report::stored_run::StoredRunError,
    softvt_report::video::EpisodeVideoError,
    softvt_script::ScriptError,
);
