//! Errors that end a command, with their exit codes.

use std::error::Error;

use crate::parse::clap_command;
use softvt_common::cancel;
use softvt_runner::{RunError, RunErrorCause};

/// Exit codes, the same for every command. `docs/cli.md` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Exit {
    Success = 0,
    /// A bug of softvt, or a machine that computes other results than the published ones.
    Internal = 1,
    /// Invalid input: usage, script, asset or file.
    Input = 2,
    /// The policy or its connection failed.
    Policy = 3,
    /// A `--require` condition does not hold.
    RequirementNotMet = 99,
    /// Ctrl-C. Finished episodes are on disk.
    Interrupted = 130,
}

/// An error that ends a command: an exit code and a message for standard error.
///
/// It does not implement [`std::error::Error`]. So `?` turns every error that does into a [`CliError`]: an error of the
/// input, or of the policy or an interrupt if a [`RunError`] says so.
#[derive(Debug)]
pub(crate) struct CliError {
    pub exit: Exit,
    /// Without the program's name. Nothing is printed if it is empty.
    pub message: String,
}

impl<E: Error + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        let of_run = (&error as &dyn Error).downcast_ref::<RunError>();
        let Some(of_run) = of_run else { return Self::input(error) };
        let mut message = of_run.text(&flag_of);
        if let Some(out) = &of_run.resumable {
            message += &format!("; continue with --resume --out {}", out.display());
        }
        match of_run.cause {
            // Of a run that failed before an interrupt.
            RunErrorCause::Input => Self::new(Exit::Input, message),
            RunErrorCause::Policy => Self::new(Exit::Policy, message),
            RunErrorCause::Interrupt => Self::interrupted(message),
        }
    }
}

/// The flag that sets a field of the configuration of a run or of its policy: the arguments have the same names.
fn flag_of(field: &str) -> String {
    let root = clap_command();
    let commands = std::iter::once(&root).chain(root.get_subcommands());
    let mut args = commands.flat_map(clap::Command::get_arguments);
    let long = args.find(|arg| arg.get_id() == field).and_then(clap::Arg::get_long);
    format!("--{}", long.unwrap_or(field))
}

impl CliError {
    pub(crate) fn new(exit: Exit, message: impl ToString) -> Self {
        Self { exit, message: message.to_string() }
    }

    /// Invalid input. After Ctrl-C the exit code is that of an interrupt, since the interrupt may be the cause.
    pub(crate) fn input(message: impl ToString) -> Self {
        let exit = if cancel::requested() { Exit::Interrupted } else { Exit::Input };
        Self::new(exit, message)
    }

    /// A result that is not the recorded one.
    pub(crate) fn other_result(message: impl std::fmt::Display) -> Self {
        let cause = "the files were changed after the run, or this machine computes other results, which softvt doctor checks";
        Self::new(Exit::Internal, format!("{message}; {cause}"))
    }

    pub(crate) fn interrupted(message: impl ToString) -> Self {
        Self::new(Exit::Interrupted, message)
    }

    pub(crate) fn prefixed(self, prefix: impl std::fmt::Display) -> Self {
        Self { message: format!("{prefix}: {}", self.message), ..self }
    }
}
