//! [`RunError`]: why a run did not come to its end.

use std::path::PathBuf;

use softvt_common::{cancel, files::FileError};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunErrorCause {
    /// A script, an argument or a file that is not valid.
    Input,
    /// The policy, or the connection to it.
    Policy,
    /// A request to stop ([`softvt_common::cancel`]). Finished episodes are on disk.
    Interrupt,
}

/// A setting of a run, by its field of [`RunConfig`](crate::RunConfig) or [`PolicyOptions`](crate::PolicyOptions).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultySetting {
    pub field: &'static str,
    /// The value that is not valid; empty if the message says it.
    pub value: String,
}

/// An error that ends a run. Its text is for a user: it names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{}{}", self.text(&|field| field.to_owned()), if self.resumable.is_some() { "; resume it to continue" } else { "" })]
pub struct RunError {
    /// Its cause, which decides the exit code of a command.
    pub cause: RunErrorCause,
    /// Place of the error, such as a file; empty if the message says it.
    pub place: String,
    /// The setting at fault, if it is one.
    pub setting: Option<FaultySetting>,
    pub message: String,
    /// Folder of the run, if it was interrupted and can be resumed.
    pub resumable: Option<PathBuf>,
}

impl RunError {
    pub fn new(cause: RunErrorCause, message: impl ToString) -> Self {
        Self { cause, place: String::new(), setting: None, message: message.to_string(), resumable: None }
    }

    /// Invalid input in a setting with this value; empty if the message says it.
    pub(crate) fn of_setting(field: &'static str, value: impl ToString, message: impl ToString) -> Self {
        Self::input(message).in_setting(field, value)
    }

    /// The same error, with the setting at fault.
    pub(crate) fn in_setting(self, field: &'static str, value: impl ToString) -> Self {
        Self { setting: Some(FaultySetting { field, value: value.to_string() }), ..self }
    }

    /// The text without how to resume, with settings as the caller names them: a command line has a flag for each.
    pub fn text(&self, name_of: &dyn Fn(&str) -> String) -> String {
        let setting = self.setting.iter().map(|FaultySetting { field, value }| match value.as_str() {
            "" => name_of(field),
            value => format!("{} {value}", name_of(field)),
        });
        let place = std::iter::once(self.place.clone()).filter(|place| !place.is_empty());
        let parts: Vec<String> = place.chain(setting).chain([self.message.clone()]).collect();
        parts.join(": ")
    }

    /// Invalid input. Once a stop is requested, that is the cause, since the error may be its consequence.
    pub fn input(message: impl ToString) -> Self {
        let cause = if cancel::requested() { RunErrorCause::Interrupt } else { RunErrorCause::Input };
        Self::new(cause, message)
    }

    /// A run that ended by a request to stop.
    pub fn interrupted(message: impl ToString) -> Self {
        Self::new(RunErrorCause::Interrupt, message)
    }

    pub fn at(self, place: impl std::fmt::Display) -> Self {
        let separator = if self.place.is_empty() { "" } else { ": " };
        Self { place: format!("{place}{separator}{}", self.place), ..self }
    }

    /// Names the part of the request that failed, in parentheses after the message.
    pub(crate) fn within(self, part: &str) -> Self {
        Self { message: format!("{} ({part})", self.message), ..self }
    }

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
    softvt_report::mcap::EpisodeMcapError,
    softvt_report::video::EpisodeVideoError,
    softvt_runs::run_folder::RunFolderError,
    softvt_script::ScriptError,
);
