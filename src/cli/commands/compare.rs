//! `softvt compare A B`: differences of two runs of the same episodes.

use crate::{
    cli::{
        args::CompareArgs,
        error::CliError,
        output::{print, print_json},
    },
    report::{comparison, stored_run},
};

/// Prints the paired differences of the runs in the second folder from those in the first.
///
/// # Errors
/// A folder without a run or with two of one suite, or no common episode.
pub(crate) fn run(args: &CompareArgs) -> Result<(), CliError> {
    let first = stored_run::load(&args.first).map_err(CliError::input)?;
    let second = stored_run::load(&args.second).map_err(CliError::input)?;
    let compared = comparison::compare(&first, &second).map_err(CliError::input)?;
    match args.json {
        true => print_json(&compared),
        false => print(&comparison::table(&compared)),
    }
    Ok(())
}
