//! `softvt record`: demonstrations of the tasks of a suite that are safe and reach the goal.

use clap::{Args, value_parser};

use crate::{
    args::{PolicyArgs, RecordingArgs, ScriptArgs},
    error::CliError,
    output::print_recording,
};
use softvt_runner::{DemoCount, record};

/// Record demonstrations: HDF5 files, videos and a manifest
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt record [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    recording: RecordingArgs,
    /// Demonstrations per task
    #[arg(long, value_name = "N", default_value = "50", value_parser = value_parser!(u32).range(1..=100_000))]
    demos: u32,
    /// Record only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    tasks: Vec<String>,
    /// Maximum attempts per task, kept or not [default: 4 per demonstration, at least 20]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    attempts: Option<u32>,
}

/// Records the demonstrations that the arguments ask for.
pub(super) fn run(args: RecordArgs) -> Result<(), CliError> {
    let mut policy = args.policy;
    let recording = &args.recording.options(policy.take_export_code());
    let loaded = args.recording.config(args.script, args.tasks)?.load()?.with_policy(&policy.options())?;
    let count = DemoCount { demos: args.demos, attempts: args.attempts };
    let recorded = record(&loaded, |teacher| policy.taught_by(teacher), count, recording)?;
    print_recording(&recording.out, recorded)
}
