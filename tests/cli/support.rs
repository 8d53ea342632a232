//! The binary, as it runs in a project folder.

use std::{
    io::{BufRead, BufReader, Read},
    process::{self, Child, ChildStderr, ChildStdout, Stdio},
    thread,
    time::{Duration, Instant},
};

use assert_cmd::{
    Command,
    cargo::{cargo_bin, cargo_bin_cmd},
};

#[path = "../project/mod.rs"]
mod project;

pub use project::{Project, Small, client, files};

/// Exit code and output of a command.
pub struct CliOutput {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Project {
    pub fn softvt(&self, words: &str) -> CliOutput {
        run_command(self.command(words))
    }

    pub fn command(&self, words: &str) -> Command {
        let mut command: Command = cargo_bin_cmd!("softvt");
        command.current_dir(self.path("")).args(words.split_whitespace()).timeout(Duration::from_secs(110));
        command
    }

    /// Runs a command that must succeed.
    pub fn succeeds(&self, words: &str) -> CliOutput {
        let output = self.softvt(words);
        assert_eq!(output.code, 0, "softvt {words}\n{}", output.err);
        output
    }

    /// The message for invalid input, without the name of the program. Standard output must be empty.
    pub fn refusal(&self, words: &str) -> String {
        refusal(self.softvt(words), words)
    }

    /// Starts a command in the folder of the project.
    pub fn start(&self, words: &str) -> Process {
        Process::start(process::Command::new(cargo_bin!("softvt")), self, words)
    }
}

pub fn run_command(mut command: Command) -> CliOutput {
    let result = command.output().expect("started");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    CliOutput { code: result.status.code().unwrap_or(-1), out: text(result.stdout), err: text(result.stderr) }
}

/// The message of a command that must fail because of its input: the text after the last `softvt: `.
pub fn refusal(output: CliOutput, words: &str) -> String {
    let CliOutput { code, out, err } = output;
    assert_eq!((code, out.as_str()), (2, ""), "softvt {words}\n{err}");
    assert!(!err.contains("panicked") && !err.contains("internal error"), "{err}");
    let (_, message) = err.rsplit_once("softvt: ").unwrap_or_else(|| panic!("no message: {err:?}"));
    message.trim_end().to_owned()
}

/// A running command, which ends with the test.
pub struct Process {
    child: Child,
    out: BufReader<ChildStdout>,
    err: BufReader<ChildStderr>,
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Process {
    /// Starts a command of the binary with further words.
    pub fn start(mut command: process::Command, project: &Project, words: &str) -> Self {
        let mut child = command
            .current_dir(project.path(""))
            .args(words.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let out = BufReader::new(child.stdout.take().expect("output"));
        let err = BufReader::new(child.stderr.take().expect("messages"));
        Self { child, out, err }
    }

    /// The next line of standard output.
    pub fn line(&mut self) -> String {
        let mut line = String::new();
        self.out.read_line(&mut line).expect("a line");
        line.trim_end().to_owned()
    }

    /// Reads messages until `count` of them contain `part`.
    pub fn await_message(&mut self, part: &str, count: usize) {
        let mut before = String::new();
        while before.matches(part).count() < count {
            assert_ne!(self.err.read_line(&mut before).expect("text"), 0, "it ended: {before}");
        }
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    pub fn is_over(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_some()
    }

    /// Sends a signal, unless the process is over.
    #[cfg(unix)]
    pub fn signal(&mut self, signal: &str) {
        let sent = process::Command::new("kill").args([signal, &self.id().to_string()]).status();
        assert!(sent.expect("kill runs").success() || self.is_over());
    }

    pub fn close_stdin(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Waits for the end. Returns what was not read before.
    pub fn wait(mut self) -> CliOutput {
        let (mut out, mut err) = (String::new(), String::new());
        thread::scope(|scope| {
            scope.spawn(|| self.err.read_to_string(&mut err).expect("text"));
            self.out.read_to_string(&mut out).expect("text");
        });
        let code = self.child.wait().expect("ended").code().unwrap_or(-1);
        CliOutput { code, out, err }
    }
}

/// Waits until a condition holds, for a minute at most.
pub fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what}: not within a minute");
        thread::sleep(Duration::from_millis(2));
    }
}
