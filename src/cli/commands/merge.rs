//! `softvt merge`: the shards of a run become one run folder.

use crate::{
    cli::{
        args::MergeArgs,
        error::CliError,
        output::{notice, print},
    },
    report::{shard_merge, terminal},
};

/// Merges shards into a new folder and prints the tables of the merged runs.
///
/// # Errors
/// The shards do not belong to one run, or a file cannot be read or written.
pub(crate) fn run(args: &MergeArgs) -> Result<(), CliError> {
    let summaries = shard_merge::merge(&args.out, &args.shards).map_err(CliError::input)?;
    summaries.iter().for_each(|summary| print(&terminal::table(summary)));
    notice(args.out.display());
    Ok(())
}
