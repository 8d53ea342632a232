//! `softvt dataset`: inspection, export and import of demonstrations.

mod import;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::{Args, Subcommand, value_parser};

use crate::{
    args::parse_folder,
    error::CliError,
    output::{
        Console, OutputFormat, Progress, check_output_file, eprint_notice, print, print_json, report_replays,
    },
};
use softvt_common::cancel;
use softvt_common::{files, text::counted};
use softvt_dataset::{
    DatasetError, check,
    export::{self, ArmControl, ExportConfig, ExportFormat},
    stats,
};
use softvt_policy::profile::GripCode;
use softvt_runner::{
    Observer,
    replay::{DemoRef, demos_of, simulate_demos},
    stored_folder::enter_for_dataset,
    thread_count,
};

#[derive(Debug, Subcommand)]
pub(crate) enum DatasetCommand {
    Check(DatasetCheckArgs),
    Export(ExportArgs),
    Import(Box<import::ImportArgs>),
    Stats(DatasetStatsArgs),
}

/// Check a dataset: counts, shapes, rates, numbers, videos, and that demonstrations can be reproduced
#[derive(Args, Debug)]
pub(crate) struct DatasetCheckArgs {
    /// Dataset folder, or one of its HDF5 files
    #[arg(value_name = "DATASET")]
    path: PathBuf,
    /// Demonstrations to simulate again, spread over the tasks: a number, or all
    #[arg(long = "replay", value_name = "N", default_value = "1", value_parser = parse_replays)]
    replays: usize,
}

/// Write a recording as a LeRobot or RLDS dataset, for training: docs/data.md, docs/train-openpi.md
#[derive(Args, Clone, Debug)]
pub(crate) struct ExportArgs {
    /// Folder of a finished recording
    #[arg(value_name = "DATASET")]
    path: PathBuf,
    /// Format: LeRobot v2.1 for openpi, v3.0 for LeRobot itself, RLDS for OpenVLA and Octo
    #[arg(long, value_name = "FORMAT")]
    format: ExportFormat,
    /// Output folder; must be new
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    out: PathBuf,
    /// Motion of the actions, and state of the arm: tool poses or joint positions
    #[arg(long, value_name = "CONTROL", default_value = "pose")]
    control: ArmControl,
    /// Grip code of the actions: docs/policies.md [default: that of the recording, or continuous]
    #[arg(long, value_name = "CODE")]
    gripper: Option<GripCode>,
    /// Export only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    tasks: Vec<String>,
    /// Number of threads; the files do not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// Print and plot the distributions of actions, lengths and deformations
#[derive(Args, Debug)]
pub(crate) struct DatasetStatsArgs {
    /// Dataset folder, or one of its HDF5 files
    #[arg(value_name = "DATASET")]
    path: PathBuf,
    /// File of the plot [default: stats.svg in the dataset folder]
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(command: DatasetCommand) -> Result<(), CliError> {
    match command {
        DatasetCommand::Check(args) => run_check(&args),
        DatasetCommand::Export(args) => run_export(args),
        DatasetCommand::Import(args) => import::run(*args),
        DatasetCommand::Stats(args) => run_stats(&args),
    }
}

fn parse_replays(word: &str) -> Result<usize, String> {
    match word {
        "all" => Ok(usize::MAX),
        number => number.parse().map_err(|_| "expected a number, or all".to_owned()),
    }
}

/// Validates a dataset folder or one HDF5 file.
///
/// # Errors
/// Any problem of the dataset, or (exit code 1) a demonstration that is not reproduced.
fn run_check(args: &DatasetCheckArgs) -> Result<(), CliError> {
    let path = &args.path;
    let report = if path.is_dir() { check::folder(path) } else { check::file(path) }?;
    if !report.problems.is_empty() {
        bail!(
            "{}\n{}: {}",
            report.problems.join("\n"),
            path.display(),
            counted(report.problems.len(), "problem")
        );
    }
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    let demos = match args.replays {
        0 => Vec::new(),
        count => sample(&demos_of(&enter_for_dataset(path, &*observer)?)?, count),
    };
    let replays = simulate_demos(&demos, &observer)?;
    let is_ok = replays.iter().all(|replay| replay.difference.is_none());
    out!(
        "{}, {}, {}{}\n",
        counted(report.demos, "demonstration"),
        counted(report.steps, "step"),
        counted(report.videos, "video"),
        if is_ok { ": OK" } else { "" }
    )?;
    report_replays(&demos, &replays)
}

/// Selects `count` demonstrations, evenly spaced from the first.
fn sample(demos: &[DemoRef], count: usize) -> Vec<DemoRef> {
    let count = count.min(demos.len());
    (0..count).map(|i| demos[i * demos.len() / count].clone()).collect()
}

fn run_export(args: ExportArgs) -> Result<(), CliError> {
    let config = ExportConfig {
        data: args.path,
        out: args.out,
        format: args.format,
        control: args.control,
        gripper: args.gripper,
        tasks: args.tasks,
        threads: thread_count(args.threads),
    };
    let mut progress: Option<Progress> = None;
    let exported = export::export(&config, cancel::requested, |total, episode| {
        progress.get_or_insert_with(|| Progress::new(total, "export")).tick(episode);
    });
    drop(progress);
    let exported = exported.map_err(|error| match error {
        DatasetError::Interrupted => CliError::interrupted("interrupted; nothing was written"),
        other => CliError::input(other),
    })?;
    notice_missing_digests(&config.data, &files_of(&config.data)?)?;
    out!(
        "{}, {}, {}: {}\n",
        counted(exported.episodes, "episode"),
        counted(exported.frames, "frame"),
        counted(exported.tasks, "prompt"),
        config.out.display()
    )
}

/// The HDF5 files of a dataset.
fn files_of(path: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut paths: Vec<PathBuf> = demos_of(path)?.into_iter().map(|demo| demo.file).collect();
    paths.dedup();
    Ok(paths)
}

fn notice_missing_digests(data: &Path, files: &[PathBuf]) -> Result<(), CliError> {
    if let Some(first) = check::without_digest(files)? {
        eprint_notice(format_args!("{first}; softvt dataset check {} lists them", data.display()));
    }
    Ok(())
}

/// Prints and plots the distributions.
fn run_stats(args: &DatasetStatsArgs) -> Result<(), CliError> {
    let path = &args.path;
    let default = if path.is_dir() { path.join("stats.svg") } else { path.with_extension("stats.svg") };
    let out = args.out.clone().unwrap_or(default);
    check_output_file("--out", &out, OutputFormat::SVG)?;
    let paths = files_of(path)?;
    let distributions = stats::column_statistics(&paths)?;
    match args.json {
        true => print_json(&distributions),
        false => print(stats::table(&distributions)),
    }?;
    files::replace(&out, stats::svg(&distributions).as_bytes())?;
    eprint_notice(out.display());
    notice_missing_digests(path, &paths)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_evenly_spaced() {
        let demos: Vec<DemoRef> = (0..10).map(|demo| DemoRef { file: "x".into(), demo }).collect();
        let sampled = |count| sample(&demos, count).into_iter().map(|demo| demo.demo).collect::<Vec<_>>();
        assert_eq!(sampled(1), [0]);
        assert_eq!(sampled(2), [0, 5]);
        assert_eq!(sampled(20).len(), 10);
        assert_eq!(sampled(0), [0; 0]);
    }
}
