//! `softvt report RUN…`: one page about one or several runs, and its tables as markdown and LaTeX.

use std::path::{Path, PathBuf};

use crate::{
    cli::{error::CliError, run::calibration::make_folder},
    report::{
        page,
        run_summary::summarize_runs,
        stored_run,
        tables::{Table, all_tables},
    },
};

/// What the LaTeX file needs.
const LATEX_HEAD: &str =
    "% Needs \\usepackage{booktabs}; of names in other alphabets, LuaLaTeX or XeLaTeX.\n";

/// Writes `report.html`, `report.md` and `report.tex` into `out`.
///
/// # Errors
/// A folder holds no run, or a file cannot be written.
pub(crate) fn run(dirs: &[PathBuf], out: &Path) -> Result<(), CliError> {
    let mut stored = Vec::new();
    for dir in dirs {
        stored.extend(stored_run::load(dir).map_err(CliError::input)?);
    }
    let judged = summarize_runs(stored);
    for remark in judged.iter().flat_map(|judged| judged.run.remarks()) {
        crate::text::eprint_line(&format!("softvt: {remark}"));
    }
    let all = all_tables(&judged);
    let joined = |text: fn(&Table) -> String| all.iter().map(text).collect::<Vec<_>>().join("\n");
    make_folder(out)?;
    for (name, text) in [
        ("report.html", page::page(&judged, out)),
        ("report.md", joined(Table::markdown)),
        ("report.tex", LATEX_HEAD.to_owned() + &joined(Table::latex)),
    ] {
        crate::files::replace(&out.join(name), text).map_err(CliError::input)?;
    }
    crate::text::eprint_line(&format!("softvt: {}", out.join("report.html").display()));
    Ok(())
}
