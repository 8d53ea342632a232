//! The `softvt` command.
//!
//! `commands` has one file per command; `args` are the arguments that several of them take; `parse` fills them in from
//! the command line. Runs are in the crate `softvt-runner`; this one is internal to the binary.
#![warn(unreachable_pub)]

/// Ends a function with an error of the input, which is formatted.
macro_rules! bail {
    ($($message:tt)*) => {
        return Err($crate::error::CliError::input(format_args!($($message)*)))
    };
}

/// Prints a formatted text to standard output, as [`output::print`] does.
macro_rules! out {
    ($($text:tt)*) => {
        $crate::output::print(format_args!($($text)*))
    };
}

/// Prints a formatted message to standard error, as [`output::eprint_notice`] does.
macro_rules! notice {
    ($($message:tt)*) => {
        $crate::output::eprint_notice(format_args!($($message)*))
    };
}

mod args;
mod cache;
mod commands;
mod error;
mod output;
mod parse;
#[cfg(test)]
mod tests;

use std::{
    panic,
    process::ExitCode,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use error::{CliError, Exit};
use output::eprint_notice;

use softvt_common::cancel;

/// Time after Ctrl-C in which a command must finish its current step. A C function of Lua may never return.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(3);

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|info| {
        notice!(
            "internal error: {info}\nThis is a bug of softvt; please report it with the command that caused it."
        );
    }));
    let exit = match panic::catch_unwind(run_process) {
        Ok(Ok(())) => Exit::Success,
        Ok(Err(error)) => {
            if !error.message.is_empty() {
                eprint_notice(&error.message);
            }
            error.exit
        }
        Err(_) => Exit::Internal,
    };
    ExitCode::from(exit as u8)
}

fn run_process() -> Result<(), CliError> {
    handle_interrupts();
    cache::share();
    let words: Vec<String> = std::env::args_os()
        .map(|word| {
            word.into_string().map_err(|w| CliError::input(format_args!("argument {w:?} is not valid UTF-8")))
        })
        .collect::<Result<_, _>>()?;
    match parse::parse(&words)? {
        Some(command) => command.run(),
        None => Ok(()),
    }
}

/// Set by a command that has nothing to tell when it is interrupted: a server that its client ends.
pub(crate) static QUIET_INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Makes the first Ctrl-C finish the current step and keep its results, and the second end the process at once.
fn handle_interrupts() {
    let exit = || std::process::exit(Exit::Interrupted as i32);
    let handler = move || {
        if cancel::request() {
            exit();
        }
        if !QUIET_INTERRUPT.load(Ordering::Relaxed) {
            eprint_notice("finishing the current step; press Ctrl-C again to quit");
        }
        thread::spawn(move || {
            thread::sleep(SHUTDOWN_TIMEOUT);
            notice!("interrupted; a step did not finish within {} s", SHUTDOWN_TIMEOUT.as_secs());
            exit();
        });
    };
    // Without a handler Ctrl-C still ends the process. Finished episodes are on disk either way.
    let _ = ctrlc::set_handler(handler);
}
