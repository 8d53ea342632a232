//! `softvt dataset export`: recorded demonstrations in the layouts that policies are trained from.

use std::path::PathBuf;

use clap::{Arg, ArgMatches, value_parser};

use crate::{
    cli::{
        args::{
            flags::{flag, list},
            many, text, threads,
        },
        commands::dataset,
        error::CliError,
        output::{Progress, print},
    },
    dataset::{
        DatasetError,
        lerobot::{self, ExportConfig, GripperCoding, LeRobotVersion},
    },
    rollout::cancel,
};

/// Words of the formats.
const FORMATS: [&str; 2] = ["lerobot-v2.1", "lerobot-v3.0"];

/// Its words; `path` is that of the data set.
pub(crate) fn command(path: Arg) -> clap::Command {
    clap::Command::new("export")
        .about("Writes a recording as a LeRobot data set, for training: docs/train-openpi.md")
        .arg(path.help("The folder of a finished recording"))
        .arg(
            flag("format", "Layout: v2.1 for openpi, v3.0 for LeRobot itself")
                .value_name("FORMAT")
                .required(true)
                .value_parser(FORMATS),
        )
        .arg(flag("out", "Where to write: a new folder").value_name("DIR").required(true))
        .arg(
            flag("gripper", "Code of the actions' seventh number: closure, or 1 to hold and 0 else")
                .value_name("CODE")
                .default_value("continuous")
                .value_parser(["binary", "continuous"]),
        )
        .arg(
            list("task", "Only these tasks: indices or parts of prompts, joined by commas")
                .value_name("TASK"),
        )
        .arg(
            flag("threads", "Threads; the files do not depend on it")
                .value_name("N")
                .value_parser(value_parser!(u16).range(1..=1024)),
        )
}

/// What was typed.
pub(crate) fn typed(matches: &ArgMatches) -> ExportConfig {
    ExportConfig {
        data: PathBuf::from(text(matches, "path")),
        out: PathBuf::from(text(matches, "out")),
        version: if text(matches, "format") == FORMATS[0] {
            LeRobotVersion::V21
        } else {
            LeRobotVersion::V30
        },
        gripper: if text(matches, "gripper") == "binary" {
            GripperCoding::Binary
        } else {
            GripperCoding::Continuous
        },
        tasks: many(matches, "task"),
        threads: threads(matches),
    }
}

/// Exports.
///
/// # Errors
/// See [`lerobot::export`]; nothing is left then.
pub(crate) fn run(export: &ExportConfig) -> Result<(), CliError> {
    if export.out.to_string_lossy().trim().is_empty() {
        return Err(CliError::input("--out: expected a new folder, got \"\""));
    }
    dataset::finished(&export.data)?;
    let mut progress: Option<Progress> = None;
    let done = lerobot::export(export, cancel::requested, |total, episode| {
        progress.get_or_insert_with(|| Progress::new(total, "export")).tick(episode);
    });
    if let Some(progress) = &progress {
        progress.finish();
    }
    let done = done.map_err(|error| match error {
        DatasetError::Interrupted => CliError::interrupted("interrupted; nothing was written"),
        other => CliError::input(other),
    })?;
    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    print(&format!(
        "{}, {}, {}: {}\n",
        counted(done.episodes, "episode"),
        counted(done.frames, "frame"),
        counted(done.tasks, "prompt"),
        export.out.display()
    ));
    Ok(())
}
