//! One file per command. Commands do not use each other.
//!
//! The doc comments of the structs and fields of arguments are the help text that `--help` prints.

mod bench;
mod cache;
mod check;
mod dataset;
mod doctor;
mod init;
mod list;
mod record;
mod replay;
mod report;
pub(super) mod run;
mod serve;
mod view;
mod watch;

use clap::Subcommand;

use super::error::CliError;

// A doc comment would replace the description of the program.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Without the name of a command: `softvt FILE.lua`.
    #[command(skip)]
    Run(Box<run::RunArgs>),
    Check(Box<check::CheckArgs>),
    View(Box<view::ViewArgs>),
    Watch(Box<watch::WatchArgs>),
    Record(Box<record::RecordArgs>),
    Replay(replay::ReplayArgs),
    Report(report::ReportArgs),
    Compare(report::CompareArgs),
    Merge(report::MergeArgs),
    Serve(Box<serve::ServeArgs>),
    /// Inspect, export and import demonstrations
    #[command(subcommand, arg_required_else_help = true)]
    Dataset(dataset::DatasetCommand),
    List(list::ListArgs),
    Init(init::InitArgs),
    Bench(bench::BenchArgs),
    Cache(cache::CacheArgs),
    Doctor(Box<doctor::DoctorArgs>),
}

impl Command {
    pub(crate) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Run(args) => run::run(*args),
            Self::Check(args) => check::run(*args),
            Self::View(args) => view::run(*args),
            Self::Watch(args) => watch::run(*args),
            Self::Record(args) => record::run(*args),
            Self::Replay(args) => replay::run(&args),
            Self::Report(args) => report::report(&args),
            Self::Compare(args) => report::compare(&args),
            Self::Merge(args) => report::merge(&args),
            Self::Serve(args) => serve::run(*args),
            Self::Dataset(command) => dataset::run(command),
            Self::List(args) => list::run(&args),
            Self::Init(args) => init::run(&args),
            Self::Bench(args) => bench::run(&args),
            Self::Cache(args) => cache::run(&args),
            Self::Doctor(args) => doctor::run(&args),
        }
    }
}
