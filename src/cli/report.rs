//! `softvt report RUN…`: one page about one or several runs, and its tables as markdown and LaTeX.

use std::path::{Path, PathBuf};

use super::{Failure, files::make_folder};
use crate::report::{
    page,
    run_folder::replace,
    runs,
    tables::{self, Judged},
};

/// Writes `report.html`, `report.md` and `report.tex` into `out`.
///
/// # Errors
/// A folder holds no run, or a file cannot be written.
pub fn run(dirs: &[PathBuf], out: &Path) -> Result<(), Failure> {
    let mut judged = Vec::new();
    for dir in dirs {
        judged.extend(runs::load(dir).map_err(Failure::input)?.into_iter().map(Judged::new));
    }
    judged.sort_by(|a, b| a.summary.suite.cmp(&b.summary.suite));
    let mut all = vec![tables::main_table(&judged)];
    all.extend(tables::deformation_table(&judged));
    all.extend(judged.iter().map(tables::task_table));
    let joined = |text: fn(&tables::Table) -> String| all.iter().map(text).collect::<Vec<_>>().join("\n");
    make_folder(out)?;
    for (name, text) in [
        ("report.html", page::page(&judged)),
        ("report.md", joined(tables::Table::markdown)),
        ("report.tex", joined(tables::Table::latex)),
    ] {
        replace(&out.join(name), text).map_err(Failure::input)?;
    }
    crate::message::tell(&format!("softvt: {}", out.join("report.html").display()));
    Ok(())
}
