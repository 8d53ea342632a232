//! `softvt dataset import`: demonstrations of other simulators, re-executed in a suite.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::{
    args::{RecordingArgs, ScriptArgs},
    error::CliError,
    output::print_recording,
};
use softvt_runner::import::{self, ImportOptions};

/// Re-execute demonstrations of robomimic, LIBERO, SoftVTBench or softvt in a suite, and record the good ones
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt dataset import [OPTIONS] --out <DIR> <FILE.lua> <FILE.hdf5>...")]
pub(crate) struct ImportArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    /// Files of demonstrations
    #[arg(value_name = "FILE.hdf5", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
    /// The task of all demonstrations, if the files do not name it: its index or part of its prompt
    #[arg(long = "task", value_name = "TASK")]
    tasks: Vec<String>,
    /// Maximum demonstrations per task to re-execute, in order [default: all]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    attempts: Option<u32>,
    /// Start objects where the layouts of the suite put them, not where the files do
    #[arg(long)]
    ignore_recorded_poses: bool,
}

/// Imports the demonstrations that the arguments name.
pub(super) fn run(args: ImportArgs) -> Result<(), CliError> {
    let recording = &args.recording.options(None);
    let run = args.recording.config(args.script, args.tasks)?.load()?;
    let options =
        ImportOptions { attempts: args.attempts, ignore_recorded_poses: args.ignore_recorded_poses };
    print_recording(&recording.out, import::import(&run, &args.files, options, recording)?)
}
