//! Commands about finished runs: `softvt report`, `softvt compare` and `softvt merge`.

use std::{path::PathBuf, sync::Arc};

use clap::Args;

use crate::{
    args::parse_folder,
    error::CliError,
    output::{Console, eprint_notice, print, print_json, print_table, terminal_format},
};
use softvt_report::{
    comparison, comparison_table,
    policy_ranking::PolicyRanking,
    report_files,
    run_summary::{caveats, summarize_runs},
    terminal,
};
use softvt_runner::{Observer, thumbnails};
use softvt_runs::{shard_merge, stored_run};

/// Write an HTML page about runs, its tables as Markdown and LaTeX, and a JSON row per run
#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Run folders, or folders that contain run folders
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// Output folder
    #[arg(long, value_name = "DIR", default_value = "report", value_parser = parse_folder)]
    out: PathBuf,
}

/// Compare runs of the same episodes, episode by episode
#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// Run folders, or folders that contain run folders: two in detail, more in one table
    #[arg(value_name = "RUN", required = true, num_args = 2..)]
    runs: Vec<PathBuf>,
    /// All measures and tasks, not only those that changed
    #[arg(long, conflicts_with = "json")]
    details: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Merge the shards of a run into the folder that a single run would have written
#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// New folder
    #[arg(value_parser = parse_folder)]
    out: PathBuf,
    /// Folders of all shards
    #[arg(value_name = "SHARD", required = true)]
    shards: Vec<PathBuf>,
    /// Print all tasks and figures, not only tasks that failed
    #[arg(long)]
    details: bool,
}

/// Writes `report.html`, `report.md`, `report.tex` and `report.jsonl`.
pub(super) fn report(args: &ReportArgs) -> Result<(), CliError> {
    if let Some(found) = report_files::foreign_file(&args.out) {
        bail!("--out: {} exists and is not of an earlier report; give another folder", found.display());
    }
    let mut stored = Vec::new();
    for dir in &args.runs {
        stored.extend(stored_run::load(dir)?);
    }
    let summaries = summarize_runs(stored);
    for warning in caveats(&summaries) {
        eprint_notice(warning);
    }
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    observer.work("drawing the objects");
    let thumbnails = thumbnails(summaries.iter().map(|summary| &summary.run), &observer);
    observer.end();
    report_files::write(&summaries, &thumbnails, &args.out)?;
    eprint_notice(args.out.join(report_files::PAGE).display());
    Ok(())
}

/// Prints the paired differences of the runs in the second folder from those in the first, or the
/// ranking of more folders.
pub(super) fn compare(args: &CompareArgs) -> Result<(), CliError> {
    for (at, run) in args.runs.iter().enumerate() {
        let folder = |path: &PathBuf| path.canonicalize().ok();
        if let Some(same) =
            args.runs[..at].iter().find(|other| folder(other).is_some_and(|f| folder(run) == Some(f)))
        {
            bail!("{} and {} are the same folder; give different runs", same.display(), run.display());
        }
    }
    let folders = args.runs.iter().map(|dir| stored_run::load(dir)).collect::<Result<Vec<_>, _>>()?;
    if let [first, second] = &folders[..] {
        let compared = comparison::compare(first, second)?;
        return if args.json {
            print_json(&compared)
        } else {
            print_table(&comparison_table::table(&compared, terminal_format(args.details)))
        };
    }
    let ranking = PolicyRanking::new(&folders)?;
    if args.json { print_json(&ranking) } else { print(ranking.table()) }
}

/// Merges shards into a new folder and prints the tables of the merged runs.
pub(super) fn merge(args: &MergeArgs) -> Result<(), CliError> {
    let summaries = shard_merge::merge(&args.out, &args.shards)?;
    let format = terminal_format(args.details);
    summaries.iter().try_for_each(|summary| print_table(&terminal::table(summary, format)))?;
    eprint_notice(args.out.display());
    Ok(())
}
