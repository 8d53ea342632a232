//! Arguments of the commands as plain data.
//!
//! The doc comments of the structs and fields are the help text that `--help` prints. Structs that are flattened into
//! several commands carry ordinary comments, since a doc comment would replace the description of the command.

mod dataset;
mod policy;
mod run;
mod values;

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

pub(crate) use dataset::{
    DatasetCheckArgs, DatasetCommand, DatasetStatsArgs, ExportArgs, ExportFormat, ImageStorage, ImportArgs,
    RecordArgs, RecordingArgs,
};
pub(crate) use policy::{
    DEFAULT_PROFILE, GripMode, GripperArg, POLICIES, PolicyArg, PolicyArgs, ProtocolArg,
};
pub(crate) use run::{CheckArgs, RunArgs, ScriptArgs, ServeArgs, ViewArgs};
use values::parse_folder;
pub(crate) use values::{
    EpisodeSelector, RequiredMetric, Requirement, RequirementOperator, Shard, TraceDetail, VideoSelection,
};

// A doc comment would replace the description of the program.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Without the name of a command: `softvt FILE.lua`.
    #[command(skip)]
    Run(Box<RunArgs>),
    Check(Box<CheckArgs>),
    View(Box<ViewArgs>),
    Record(Box<RecordArgs>),
    Replay(ReplayArgs),
    Report(ReportArgs),
    Compare(CompareArgs),
    Merge(MergeArgs),
    Serve(Box<ServeArgs>),
    /// Inspect, export and import demonstrations
    #[command(subcommand, arg_required_else_help = true)]
    Dataset(DatasetCommand),
    List(ListArgs),
    Init(InitArgs),
    /// Check the installation and run a golden episode
    Doctor,
}

/// List suites, tasks, assets, policies or profiles
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    /// Kind of items to list
    #[arg(value_name = "suites|tasks|assets|policies|profiles")]
    pub what: ListKind,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ListKind {
    Suites,
    Tasks,
    Assets,
    Policies,
    Profiles,
}

/// Simulate a recorded episode again; exit code 0 if the result is byte-identical
#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Run folder, or a dataset
    pub run: PathBuf,
    /// TASK/EPISODE, or the line number in episodes.jsonl, from 0
    pub episode: EpisodeSelector,
}

/// Write an HTML page about runs, and its tables as Markdown and LaTeX
#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Run folders, or folders that contain run folders
    #[arg(value_name = "RUN", required = true)]
    pub runs: Vec<PathBuf>,
    /// Output folder
    #[arg(long, value_name = "DIR", default_value = "report", value_parser = parse_folder)]
    pub out: PathBuf,
}

/// Merge the shards of a run into the folder that a single run would have written
#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// New folder
    #[arg(value_parser = parse_folder)]
    pub out: PathBuf,
    /// Folders of all shards
    #[arg(value_name = "SHARD", required = true)]
    pub shards: Vec<PathBuf>,
}

/// Compare two runs of the same episodes, episode by episode
#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// Run folder, or a folder that contains run folders
    #[arg(value_name = "A")]
    pub first: PathBuf,
    /// The other run folder
    #[arg(value_name = "B")]
    pub second: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Write editor stubs for Lua scripts; `init task` creates a project skeleton
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct InitArgs {
    /// Folder to write to
    #[arg(default_value = ".")]
    pub dir: PathBuf,
    #[command(subcommand)]
    pub command: Option<InitCommand>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum InitCommand {
    /// Create a project skeleton: a commented suite, its object and the editor stubs
    Task {
        /// Folder to write to
        #[arg(default_value = ".")]
        dir: PathBuf,
    },
}

impl Command {
    /// Arguments about the script, for commands that load one.
    pub(crate) fn script_mut(&mut self) -> Option<&mut ScriptArgs> {
        match self {
            Self::Run(args) => Some(&mut args.script),
            Self::Check(args) => Some(&mut args.script),
            Self::View(args) => Some(&mut args.script),
            Self::Record(args) => Some(&mut args.script),
            Self::Serve(args) => Some(&mut args.script),
            Self::Dataset(DatasetCommand::Import(args)) => Some(&mut args.script),
            _ => None,
        }
    }
}
