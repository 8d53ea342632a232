//! The `softvt` command.
//!
//! `args` defines the arguments as plain data, `parse` fills them in, `commands` has one file per command, and `run` is
//! the engine that the commands share.

mod args;
mod commands;
mod error;
mod output;
mod parse;
#[cfg(test)]
mod reference_page;
mod run;

use std::{panic, process::ExitCode, sync::Arc, thread, time::Duration};

use args::Command;
use error::{CliError, Exit};
use output::notice;

use crate::{rollout::cancel, text};

/// Time after Ctrl-C in which a command must finish its current step. A C function of Lua may never return.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(3);

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|info| {
        notice(format!(
            "internal error: {info}\nThis is a bug of softvt; please report it with the command that caused it."
        ));
    }));
    let exit = match panic::catch_unwind(run_process) {
        Ok(Ok(())) => Exit::Success,
        Ok(Err(error)) => {
            if !error.message.is_empty() {
                notice(text::escape_control(&error.message));
            }
            error.exit
        }
        Err(_) => Exit::Internal,
    };
    exit.into()
}

fn run_process() -> Result<(), CliError> {
    // Finished episodes are already on disk, and nothing can interrupt a C function of Lua that does not return.
    crate::script::set_stuck_handler(Arc::new(|message| {
        text::eprint_line(&format!("softvt: {message}"));
        std::process::exit(2);
    }));
    handle_interrupts();
    let words: Vec<String> = std::env::args_os()
        .map(|word| {
            word.into_string().map_err(|w| CliError::input(format!("argument {w:?} is not valid UTF-8")))
        })
        .collect::<Result<_, _>>()?;
    match parse::parse(&words)? {
        Some(command) => dispatch(&command),
        None => Ok(()),
    }
}

fn dispatch(command: &Command) -> Result<(), CliError> {
    match command {
        Command::Run(args) => commands::run::run(args),
        Command::Check(args) => commands::check::run(args),
        Command::View(args) => commands::view::run(args),
        Command::Record(args) => commands::record::run(args),
        Command::Replay(args) => commands::replay::run(args),
        Command::Report(args) => commands::report::run(args),
        Command::Compare(args) => commands::compare::run(args),
        Command::Merge(args) => commands::merge::run(args),
        Command::Serve(args) => commands::serve::run(args),
        Command::Dataset(command) => commands::dataset::run(command),
        Command::List(args) => commands::list::run(args),
        Command::Init(args) => commands::init::run(args),
        Command::Doctor => commands::doctor::run(),
    }
}

/// Makes the first Ctrl-C finish the current step and keep its results, and the second end the process at once.
fn handle_interrupts() {
    let exit = || std::process::exit(Exit::Interrupted as i32);
    let handler = move || {
        if cancel::request() {
            exit();
        }
        notice("finishing the current step; press Ctrl-C again to quit");
        thread::spawn(move || {
            thread::sleep(SHUTDOWN_TIMEOUT);
            notice(format!("interrupted; a step did not finish within {} s", SHUTDOWN_TIMEOUT.as_secs()));
            exit();
        });
    };
    // Without a handler Ctrl-C still ends the process. Finished episodes are on disk either way.
    let _ = ctrlc::set_handler(handler);
}
