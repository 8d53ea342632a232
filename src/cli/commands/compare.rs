//! `softvt compare A B`: what two runs of the same episodes differ in.

use std::path::Path;

use crate::{
    cli::{error::CliError, output::print},
    report::{comparison, stored_run},
};

/// Prints the paired differences of the run or runs in `second` from those in `first`.
///
/// # Errors
/// A folder holds no run or two of one suite, or they share no episode.
pub(crate) fn run(first: &Path, second: &Path, json: bool) -> Result<(), CliError> {
    let [a, b] = [first, second].map(stored_run::load);
    let (a, b) = (a.map_err(CliError::input)?, b.map_err(CliError::input)?);
    let compared = comparison::compare(&a, &b).map_err(CliError::input)?;
    print(&match json {
        true => format!("{:#}\n", serde_json::json!(compared)),
        false => comparison::table(&compared),
    });
    Ok(())
}
