//! The command line: flags, exit codes, progress.

mod args;
mod commands;
mod error;
mod output;
mod run;

use std::{panic, process::ExitCode, thread, time::Duration};

use args::Command;
use error::{CliError, Exit};

use crate::{rollout::cancel, text};

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|info| {
        text::eprint_line(&format!(
            "softvt: internal error: {info}\nThis is a defect of softvt; please report it with the command that led here."
        ));
    }));
    let outcome = panic::catch_unwind(run);
    let code = match outcome {
        Ok(Ok(())) => Exit::Success,
        Ok(Err(failure)) => {
            if !failure.message.is_empty() {
                text::eprint_line(&format!("softvt: {}", text::escape_control(&failure.message)));
            }
            failure.exit
        }
        Err(_) => Exit::Internal,
    };
    code.into()
}

fn run() -> Result<(), CliError> {
    watch_interrupts();
    let words: Vec<String> = std::env::args_os()
        .map(|word| {
            word.into_string().map_err(|w| CliError::input(format!("argument {w:?} is not valid UTF-8")))
        })
        .collect::<Result<_, _>>()?;
    dispatch(&words)
}

fn dispatch(words: &[String]) -> Result<(), CliError> {
    match args::parse(words)? {
        Command::Run(run) => commands::run::run(&run),
        Command::List { what, json } => commands::list::run(&what, json),
        Command::Init { dir, task: false } => commands::init::run(&dir),
        Command::Init { dir, task: true } => commands::init::task(&dir),
        Command::Check(run) => commands::check::run(&run),
        Command::Compare { first, second, json } => commands::compare::run(&first, &second, json),
        Command::Merge { out, shards } => commands::merge::run(&out, &shards),
        Command::Replay { dir, which } => commands::replay::run(&dir, which),
        Command::Report { runs, out } => commands::report::run(&runs, &out),
        Command::View(view) => commands::view::run(&view),
        Command::Serve(serve) => commands::serve::run(&serve),
        Command::Record(record) => commands::record::run(&record),
        Command::DatasetCheck { path, replays } => commands::dataset::check(&path, replays),
        Command::DatasetImport(import) => commands::dataset::import::run(&import),
        Command::DatasetStats { path, out, json } => commands::dataset::stats(&path, out.as_deref(), json),
        Command::DatasetExport(export) => commands::dataset::export::run(&export),
        Command::Doctor => commands::doctor::run(),
        Command::Shown => Ok(()),
    }
}

/// How long what runs may take to end in order; a library function of Lua that never returns would take for ever.
const PATIENCE: Duration = Duration::from_secs(3);

/// The first Ctrl-C ends the run in order, the second at once.
fn watch_interrupts() {
    let end = || std::process::exit(Exit::Interrupted as i32);
    let handler = move || {
        if cancel::request() {
            end();
        }
        text::eprint_line("softvt: stopping; press again to stop at once");
        thread::spawn(move || {
            thread::sleep(PATIENCE);
            text::eprint_line(&format!(
                "softvt: interrupted; something did not end within {} s",
                PATIENCE.as_secs()
            ));
            end();
        });
    };
    // Without a handler Ctrl-C still ends the process; finished episodes are on disk either way.
    let _ = ctrlc::set_handler(handler);
}
