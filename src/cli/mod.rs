//! The command line: flags, exit codes, progress.

mod again;
mod args;
mod attempts;
mod batch;
mod check;
mod compare;
mod conditions;
mod dataset;
mod doctor;
mod drivers;
mod evaluate;
mod experiment;
mod export;
mod files;
mod first_look;
mod flags;
mod grips;
mod import;
mod import_task;
mod info;
mod init;
mod list;
mod progress;
mod record;
mod recorded;
mod recording;
mod replay;
mod report;
mod require;
mod serve;
mod shard;
mod side_files;
mod view;
mod who;

use std::{panic, process::ExitCode, thread, time::Duration};

use args::Command;

use crate::{rollout::cancel, text};

/// Exit codes, the same for every command.
pub mod code {
    /// All went well.
    pub const OK: u8 = 0;
    /// Our own fault, or the machine's: `softvt doctor` found other results than the published ones.
    pub const INTERNAL: u8 = 1;
    /// The user's input: usage, script, asset, file.
    pub const INPUT: u8 = 2;
    /// Policy or transport.
    pub const POLICY: u8 = 3;
    /// `--require` is not met.
    pub const UNMET: u8 = 99;
    /// Interrupted.
    pub const INTERRUPTED: u8 = 130;
}

/// What ends a command early.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    /// The user's input is wrong; unless the end was asked for before: what fails from then on may fail because of that.
    fn input(message: impl ToString) -> Self {
        let code = if cancel::requested() { code::INTERRUPTED } else { code::INPUT };
        Self { code, message: message.to_string() }
    }

    /// The run went well and its results do not suffice.
    fn unmet(message: String) -> Self {
        Self { code: code::UNMET, message }
    }

    /// What was tested is not as it should be, and no input of the user's is to blame.
    fn wrong_here(message: impl ToString) -> Self {
        Self { code: code::INTERNAL, message: message.to_string() }
    }

    /// The same, said of a part of what was asked for.
    fn within(self, part: &str) -> Self {
        Self { message: format!("{} ({part})", self.message), ..self }
    }

    /// Interrupted; what is finished has been kept.
    fn interrupted(message: impl ToString) -> Self {
        Self { code: code::INTERRUPTED, message: message.to_string() }
    }
}

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|info| {
        text::eprint_line(&format!(
            "softvt: internal error: {info}\nThis is a defect of softvt; please report it with the command that led here."
        ));
    }));
    let outcome = panic::catch_unwind(run);
    let code = match outcome {
        Ok(Ok(())) => code::OK,
        Ok(Err(failure)) => {
            if !failure.message.is_empty() {
                text::eprint_line(&format!("softvt: {}", text::escape_control(&failure.message)));
            }
            failure.code
        }
        Err(_) => code::INTERNAL,
    };
    ExitCode::from(code)
}

fn run() -> Result<(), Failure> {
    watch_interrupts();
    let words: Vec<String> = std::env::args_os()
        .map(|word| {
            word.into_string().map_err(|w| Failure::input(format!("argument {w:?} is not valid UTF-8")))
        })
        .collect::<Result<_, _>>()?;
    carry_out(&words)
}

fn carry_out(words: &[String]) -> Result<(), Failure> {
    match args::parse(words)? {
        Command::Run(run) => evaluate::run(&run),
        Command::List { what, json } => list::run(&what, json),
        Command::Init { dir, task: false } => init::run(&dir),
        Command::Init { dir, task: true } => init::task(&dir),
        Command::Check(run) => check::run(&run),
        Command::Compare { first, second, json } => compare::run(&first, &second, json),
        Command::Merge { out, shards } => shard::merge(&out, &shards),
        Command::Replay { dir, which } => replay::run(&dir, which),
        Command::Report { runs, out } => report::run(&runs, &out),
        Command::View(view) => view::run(&view),
        Command::Serve(serve) => serve::run(&serve),
        Command::Record(record) => record::run(&record),
        Command::DatasetCheck { path, replays } => dataset::check(&path, replays),
        Command::DatasetImport(import) => import::run(&import),
        Command::DatasetStats { path, out, json } => dataset::stats(&path, out.as_deref(), json),
        Command::DatasetExport(export) => export::run(&export),
        Command::Doctor => doctor::run(),
        Command::Shown => Ok(()),
    }
}

/// How long what runs may take to end in order; a library function of Lua that never returns would take for ever.
const PATIENCE: Duration = Duration::from_secs(3);

/// The first Ctrl-C ends the run in order, the second at once.
fn watch_interrupts() {
    let end = || std::process::exit(i32::from(code::INTERRUPTED));
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

/// Prints to the standard output, control characters shown; a closed pipe is not an error of ours.
fn print(text: &str) {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text::escape_control(text).as_bytes()).and_then(|()| out.flush());
}
