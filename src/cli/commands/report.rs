//! `softvt report RUN…`: an HTML page about runs, and its tables as Markdown and LaTeX.

use crate::{
    cli::{args::ReportArgs, error::CliError, output::notice},
    files,
    report::{
        page,
        run_summary::summarize_runs,
        stored_run,
        tables::{ResultTable, all_tables},
    },
};

/// Comment at the top of the LaTeX file: the packages and engines it needs.
const LATEX_HEADER: &str =
    "% Needs \\usepackage{booktabs}; of names in other alphabets, LuaLaTeX or XeLaTeX.\n";

/// Writes `report.html`, `report.md` and `report.tex`.
///
/// # Errors
/// A folder without a run, or a file that cannot be written.
pub(crate) fn run(args: &ReportArgs) -> Result<(), CliError> {
    let mut stored = Vec::new();
    for dir in &args.runs {
        stored.extend(stored_run::load(dir).map_err(CliError::input)?);
    }
    let summaries = summarize_runs(stored);
    for warning in summaries.iter().flat_map(|summary| summary.run.warnings()) {
        notice(warning);
    }
    let tables = all_tables(&summaries);
    let joined =
        |format: fn(&ResultTable) -> String| tables.iter().map(format).collect::<Vec<_>>().join("\n");
    for (name, text) in [
        ("report.html", page::page(&summaries, &args.out)),
        ("report.md", joined(ResultTable::markdown)),
        ("report.tex", LATEX_HEADER.to_owned() + &joined(ResultTable::latex)),
    ] {
        files::replace(&args.out.join(name), text).map_err(CliError::input)?;
    }
    notice(args.out.join("report.html").display());
    Ok(())
}
