//! `softvt dataset`: inspection, export and import of demonstrations.

mod check;
mod export;
mod import;
mod stats;
mod task_matching;

use crate::cli::{args::DatasetCommand, error::CliError};

pub(crate) fn run(command: &DatasetCommand) -> Result<(), CliError> {
    match command {
        DatasetCommand::Check(args) => check::run(args),
        DatasetCommand::Export(args) => export::run(args),
        DatasetCommand::Import(args) => import::run(args),
        DatasetCommand::Stats(args) => stats::run(args),
    }
}
