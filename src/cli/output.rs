//! Standard output and progress.

use std::{
    collections::BTreeMap,
    fmt,
    fs::File,
    io::{self, IsTerminal, Read, Write},
    path::Path,
    sync::{
        Mutex,
        mpsc::{self, RecvTimeoutError, Sender},
    },
    thread,
    time::Duration,
};

use console::Term;
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};

use crate::error::CliError;
use softvt_common::{
    files::{FileError, check_creatable},
    parallel::lock,
    text::{self, counted},
};
use softvt_evaluation::category::EpisodeCategory;
use softvt_report::styled_text::TerminalFormat;
use softvt_runner::{
    Observer,
    recording::RecordingSummary,
    replay::{DemoRef, DemoReplay},
};

/// Prints to standard output with control characters escaped.
pub(crate) fn print(text: impl fmt::Display) -> Result<(), CliError> {
    print_table(&text::escape_control(&text.to_string()))
}

/// Prints a table whose names have been escaped already, and which may have colours. A closed pipe (`| head -1`) is
/// accepted: the reader has what it wants.
pub(crate) fn print_table(table: &str) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    match out.write_all(table.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            bail!("cannot write to standard output: {error}")
        }
        _ => Ok(()),
    }
}

/// The layout of tables for standard output: as wide as the terminal, coloured unless `NO_COLOR` is set; 80 columns and
/// no colours where it is no terminal.
pub(crate) fn terminal_format(has_details: bool) -> TerminalFormat {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let terminal = io::stdout().is_terminal();
    let width = Term::stdout().size_checked().filter(|_| terminal).map(|(_, columns)| usize::from(columns));
    TerminalFormat {
        width: width.unwrap_or(TerminalFormat::DEFAULT_WIDTH).max(TerminalFormat::DEFAULT_WIDTH),
        is_coloured: terminal && !is_set("NO_COLOR") && std::env::var("TERM").as_deref() != Ok("dumb"),
        has_details,
    }
}

/// Prints a value as indented JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CliError> {
    out!("{:#}\n", serde_json::json!(value))
}

/// Prints for each demonstration whether its re-simulation is byte-identical, and how many reach the goal.
///
/// # Errors
/// A result differs (exit code 1).
pub(crate) fn report_replays(demos: &[DemoRef], replays: &[DemoReplay]) -> Result<(), CliError> {
    for (DemoRef { file, demo }, replay) in demos.iter().zip(replays) {
        let file = file.display();
        match &replay.difference {
            None => out!("{file} demo_{demo}: byte-identical, final state {}\n", replay.state_hash),
            Some(difference) => out!("{file} demo_{demo}: differs: {difference}\n"),
        }?;
    }
    let all = demos.len();
    let identical = replays.iter().filter(|replay| replay.difference.is_none()).count();
    let reached = replays.iter().filter(|replay| replay.goal_reached).count();
    if all > 1 {
        out!(
            "replayed by their actions alone: {identical} of {all} byte-identical, {reached} of {all} reach the goal\n"
        )?;
    }
    if identical == all {
        return Ok(());
    }
    let differing = counted(all - identical, "demonstration");
    Err(CliError::other_result(format_args!("replaying {differing} gave another result")))
}

/// Prints what a recording in the folder `out` contains. `None` is a recording that was complete before.
pub(crate) fn print_recording(out: &Path, summary: Option<RecordingSummary>) -> Result<(), CliError> {
    let Some(summary) = summary else {
        notice!("{} is already complete", out.display());
        return Ok(());
    };
    out!("{}{}\n", summary.text(), summary.manifest.display())
}

/// The format of a file that a flag names as output.
pub(crate) struct OutputFormat {
    name: &'static str,
    /// The ending that names must have, if any.
    extension: Option<&'static str>,
    /// First bytes of files of the format, after white space.
    begins: &'static [&'static [u8]],
}

impl OutputFormat {
    pub(crate) const SVG: Self = Self { name: "SVG", extension: Some("svg"), begins: &[b"<svg", b"<?xml"] };
    pub(crate) const MCAP: Self = Self { name: "MCAP", extension: None, begins: &[b"\x89MCAP0\r\n"] };
    pub(crate) const JSON: Self = Self { name: "JSON", extension: None, begins: &[b"{"] };
}

/// Checks before the work that the file of `flag` can be written and replaces nothing but a file of its format.
pub(crate) fn check_output_file(flag: &str, path: &Path, format: OutputFormat) -> Result<(), CliError> {
    let (file, OutputFormat { name, extension, begins }) = (path.display(), format);
    if let Some(extension) = extension
        && path.extension().is_none_or(|found| found != extension)
    {
        bail!("{flag} {file}: give a file that ends in .{extension}");
    }
    let mut first = Vec::new();
    if path.is_file() {
        let opened = File::open(path).and_then(|file| file.take(64).read_to_end(&mut first));
        opened.map_err(FileError::io("read", path))?;
    }
    // Empty files, such as those of mktemp, hold nothing to lose.
    let begins_so = || begins.iter().any(|begin| first.trim_ascii_start().starts_with(begin));
    if path.exists() && !(path.is_file() && (first.is_empty() || begins_so())) {
        bail!("{flag} {file}: it exists and is no {name} file; give another name");
    }
    Ok(check_creatable(path)?)
}

/// Prints a message of the program to standard error, after `softvt: `, with control characters escaped.
pub(crate) fn eprint_notice(message: impl std::fmt::Display) {
    text::eprint_line(&text::escape_control(&format!("softvt: {message}")));
}

/// Delay before a notice says what is being done, where there is no terminal.
const PATIENCE: Duration = Duration::from_secs(1);
/// Interval at which a terminal redraws the elapsed time.
const TICK: Duration = Duration::from_millis(200);

/// Says on standard error what is being done: at once on a terminal, where the line disappears when this is dropped,
/// and after [`PATIENCE`] elsewhere.
enum Activity {
    Spinner(ProgressBar),
    /// Its thread ends when this is dropped.
    Delayed {
        _end: Sender<()>,
    },
}

impl Activity {
    fn new(what: &str) -> Self {
        if io::stderr().is_terminal() {
            let spinner = ProgressBar::new_spinner().with_message(text::escape_control(what).into_owned());
            if let Ok(style) = ProgressStyle::with_template("{msg}  {elapsed} elapsed") {
                spinner.set_style(style);
            }
            spinner.enable_steady_tick(TICK);
            return Self::Spinner(spinner);
        }
        let (end, ended) = mpsc::channel();
        let what = what.to_owned();
        thread::spawn(move || {
            if ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                eprint_notice(what);
            }
        });
        Self::Delayed { _end: end }
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        if let Self::Spinner(spinner) = self {
            spinner.finish_and_clear();
        }
    }
}

/// Sets what a bar shows: nothing about jobs before their number is known, and no time left before the first has ended.
fn set_bar_style(bar: &ProgressBar) {
    let template = match bar.length() {
        None | Some(0) => "{prefix}  {elapsed} elapsed  {wide_msg}",
        Some(_) => "{prefix} {bar:10} {pos}/{len}  {elapsed} elapsed{left}  {wide_msg}",
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("left", write_time_left));
    }
}

fn write_time_left(state: &ProgressState, out: &mut dyn fmt::Write) {
    if state.pos() > 0 {
        // Writing to memory does not fail.
        let _ = write!(out, ", {:#} left", HumanDuration(state.eta()));
    }
}

/// Progress of a list of jobs on standard error: a bar on a terminal, which disappears
/// when this is dropped, and one line per job elsewhere.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    /// Until the first job ends, where there is no bar.
    first: Option<Activity>,
    total: usize,
    done: usize,
    tally: BTreeMap<EpisodeCategory, usize>,
}

impl Progress {
    pub(crate) fn new(total: usize, what: &str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total as u64).with_prefix(what.to_owned());
            set_bar_style(&bar);
            bar.enable_steady_tick(TICK);
            bar
        });
        let first = bar.is_none().then(|| Activity::new(what));
        Self { bar, first, total, done: 0, tally: BTreeMap::new() }
    }

    pub(crate) fn expect(&mut self, count: usize) {
        self.total += count;
        if let Some(bar) = &self.bar {
            bar.inc_length(count as u64);
            set_bar_style(bar);
        }
    }

    pub(crate) fn judged(&mut self, category: EpisodeCategory) {
        *self.tally.entry(category).or_insert(0) += 1;
    }

    /// The numbers of episodes by category, by their marks.
    fn tally(&self) -> String {
        let count = |(category, count): (&EpisodeCategory, &usize)| format!("{} {count}", category.glyph());
        self.tally.iter().map(count).collect::<Vec<_>>().join(" ")
    }

    pub(crate) fn tick(&mut self, message: &str) {
        self.done += 1;
        self.first = None;
        let message = text::escape_control(message);
        match &self.bar {
            Some(bar) => {
                let tally = self.tally();
                bar.set_message(if tally.is_empty() { message.into_owned() } else { tally });
                bar.inc(1);
            }
            None => text::eprint_line(&format!("[{}/{}] {message}", self.done, self.total)),
        }
    }

    /// Reports the end of a small job, which gets no line of its own.
    pub(crate) fn step(&self) {
        self.bar.iter().for_each(|bar| bar.inc(1));
    }
}

/// Shows the progress and the messages of runs on standard error.
#[derive(Default)]
pub(crate) struct Console {
    activity: Mutex<Option<Activity>>,
    progress: Mutex<Option<Progress>>,
}

impl Observer for Console {
    fn notice(&self, message: &str) {
        let (activity, progress) = (lock(&self.activity), lock(&self.progress));
        let bar = match &*activity {
            Some(Activity::Spinner(spinner)) => Some(spinner),
            _ => progress.as_ref().and_then(|progress| progress.bar.as_ref()),
        };
        match bar {
            Some(bar) => bar.suspend(|| eprint_notice(message)),
            None => eprint_notice(message),
        }
    }

    fn work(&self, what: &str) {
        // The former one leaves the terminal first.
        *lock(&self.activity) = None;
        *lock(&self.activity) = Some(Activity::new(what));
    }

    fn begin(&self, what: &str) {
        *lock(&self.activity) = None;
        *lock(&self.progress) = Some(Progress::new(0, what));
    }

    fn expect(&self, count: usize) {
        lock(&self.progress).iter_mut().for_each(|progress| progress.expect(count));
    }

    fn advance(&self, line: &str) {
        lock(&self.progress).iter_mut().for_each(|progress| progress.tick(line));
    }

    fn judged(&self, category: EpisodeCategory) {
        lock(&self.progress).iter_mut().for_each(|progress| progress.judged(category));
    }

    fn end(&self) {
        *lock(&self.activity) = None;
        *lock(&self.progress) = None;
    }
}
