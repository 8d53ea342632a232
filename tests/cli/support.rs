//! The binary, as it runs in a project folder.

use std::time::Duration;

use assert_cmd::{Command, cargo::cargo_bin_cmd};

#[path = "../project/mod.rs"]
mod project;

pub use project::{Project, SOLIDS, SPATIAL_SOFT, Small, client, files, fixtures};

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

    /// The message for results with a problem. Standard output must have them.
    pub fn problem(&self, words: &str) -> String {
        let output = self.softvt(words);
        assert_ne!(output.out, "", "softvt {words}\n{}", output.err);
        refusal(CliOutput { out: String::new(), ..output }, words)
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
