//! `softvt dataset stats`: distributions of a dataset as a table and a plot.

use std::path::PathBuf;

use crate::{
    cli::{
        args::DatasetStatsArgs,
        error::CliError,
        output::{notice, print, print_json},
        run::demo_replay::{check_complete, demos_of},
    },
    dataset::stats,
    files,
};

/// Prints and plots the distributions.
///
/// # Errors
/// The dataset cannot be read, or the plot cannot be written.
pub(super) fn run(args: &DatasetStatsArgs) -> Result<(), CliError> {
    let path = &args.path;
    check_complete(path)?;
    let mut paths: Vec<PathBuf> = demos_of(path)?.into_iter().map(|demo| demo.file).collect();
    paths.dedup();
    let distributions = stats::column_statistics(&paths).map_err(CliError::input)?;
    match args.json {
        true => print_json(&distributions),
        false => print(&stats::table(&distributions)),
    }
    let default = if path.is_dir() { path.join("stats.svg") } else { path.with_extension("stats.svg") };
    let out = args.out.clone().unwrap_or(default);
    files::replace(&out, stats::svg(&distributions).as_bytes()).map_err(CliError::input)?;
    notice(out.display());
    Ok(())
}
