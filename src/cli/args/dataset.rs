//! Arguments of `softvt record` and `softvt dataset`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum, value_parser};

use super::{
    policy::{GripperArg, PolicyArgs},
    run::ScriptArgs,
    values::parse_folder,
};

// Flags of all commands that create datasets.
#[derive(Args, Clone, Debug)]
pub(crate) struct RecordingArgs {
    /// Output folder: a new one, or with --resume that of an interrupted recording
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: PathBuf,
    /// Storage of images: in the HDF5 files and as videos, or only as videos
    #[arg(long, value_name = "WHERE", default_value = "hdf5")]
    pub images: ImageStorage,
    /// Leave out the true state: node positions, deformation, contacts, forces
    #[arg(long)]
    pub no_privileged: bool,
    /// Number of threads; the dataset does not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Continue the interrupted recording in --out, if there is one
    #[arg(long)]
    pub resume: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImageStorage {
    Hdf5,
    Video,
}

/// Record demonstrations: HDF5 files, videos and a manifest
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt record [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    pub policy: PolicyArgs,
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Demonstrations per task
    #[arg(long, value_name = "N", default_value = "50", value_parser = value_parser!(u32).range(1..=100_000))]
    pub demos: u32,
    /// Record only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    pub tasks: Vec<String>,
    /// Maximum attempts per task, kept or not [default: 4 per demonstration, at least 20]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pub attempts: Option<u32>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum DatasetCommand {
    Check(DatasetCheckArgs),
    Export(ExportArgs),
    Import(Box<ImportArgs>),
    Stats(DatasetStatsArgs),
}

/// Check a dataset: counts, shapes, rates, numbers, videos, and that demonstrations can be reproduced
#[derive(Args, Debug)]
pub(crate) struct DatasetCheckArgs {
    /// Dataset folder, or one of its HDF5 files
    #[arg(value_name = "DATASET")]
    pub path: PathBuf,
    /// Demonstrations to simulate again, spread over the tasks: a number, or all
    #[arg(long = "replay", value_name = "N", default_value = "1", value_parser = parse_replays)]
    pub replays: usize,
}

/// Write a recording as a LeRobot dataset, for training: docs/train-openpi.md
#[derive(Args, Clone, Debug)]
pub(crate) struct ExportArgs {
    /// Folder of a finished recording
    #[arg(value_name = "DATASET")]
    pub path: PathBuf,
    /// Version of the layout: v2.1 for openpi, v3.0 for LeRobot itself
    #[arg(long, value_name = "FORMAT")]
    pub format: ExportFormat,
    /// Output folder; must be new
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: PathBuf,
    /// Seventh number of an action: continuous closure, or binary: 1 to hold, 0 otherwise
    #[arg(long, value_name = "MODE", default_value = "continuous")]
    pub gripper: GripperArg,
    /// Export only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    pub tasks: Vec<String>,
    /// Number of threads; the files do not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    #[value(name = "lerobot-v2.1")]
    LerobotV21,
    #[value(name = "lerobot-v3.0")]
    LerobotV30,
}

/// Re-execute demonstrations of robomimic, LIBERO, SoftVTBench or softvt in a suite, and record the safe ones that reach the goal
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt dataset import [OPTIONS] --out <DIR> <FILE.lua> <FILE.hdf5>...")]
pub(crate) struct ImportArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    /// Files of demonstrations
    #[arg(value_name = "FILE.hdf5", required = true)]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// The task of all demonstrations, if the files do not name it: its index or part of its prompt
    #[arg(long = "task", value_name = "TASK")]
    pub tasks: Vec<String>,
    /// Maximum demonstrations per task to re-execute, in order [default: all]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pub attempts: Option<u32>,
    /// Start objects where the layouts of the suite put them, not where the files do
    #[arg(long)]
    pub layout: bool,
}

/// Print and plot the distributions of actions, lengths and deformations
#[derive(Args, Debug)]
pub(crate) struct DatasetStatsArgs {
    /// Dataset folder, or one of its HDF5 files
    #[arg(value_name = "DATASET")]
    pub path: PathBuf,
    /// File of the plot [default: stats.svg in the dataset folder]
    #[arg(long, value_name = "FILE.svg")]
    pub out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

fn parse_replays(word: &str) -> Result<usize, String> {
    match word {
        "all" => Ok(usize::MAX),
        number => number.parse().map_err(|_| "expected a number, or all".to_owned()),
    }
}
