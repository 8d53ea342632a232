//! The files that `softvt report` writes: the page, its tables as Markdown and LaTeX, and a JSON row per run.

use std::{fs, path::Path};

use super::{
    leaderboard,
    page::{self, Thumbnails},
    run_summary::RunSummary,
    tables::{ResultTable, all_tables},
};
use softvt_common::files::{self, FileError};

/// Name of the page in the folder of a report.
pub const PAGE: &str = "report.html";
/// Name of the tables as Markdown.
pub const MARKDOWN: &str = "report.md";

/// Comment at the top of the LaTeX file: the packages and engines it needs.
const LATEX_HEADER: &str =
    "% Needs \\usepackage{booktabs}; of names in other alphabets, LuaLaTeX or XeLaTeX.\n";

/// Writes [`PAGE`], [`MARKDOWN`], `report.tex` and `report.jsonl` about some runs into the folder `out`. The page shows
/// the objects that have a picture in `thumbnails`.
///
/// # Errors
/// A file cannot be written.
pub fn write(runs: &[RunSummary], thumbnails: &Thumbnails, out: &Path) -> Result<(), FileError> {
    // Links of the page lead from this folder.
    fs::create_dir_all(out).map_err(FileError::io("create", out))?;
    let tables = all_tables(runs);
    let joined =
        |format: fn(&ResultTable) -> String| tables.iter().map(format).collect::<Vec<_>>().join("\n");
    for (name, text) in [
        (PAGE, page::page(runs, thumbnails, out)),
        (MARKDOWN, joined(ResultTable::markdown)),
        ("report.tex", LATEX_HEADER.to_owned() + &joined(ResultTable::latex)),
        ("report.jsonl", leaderboard::rows(runs)),
    ] {
        files::replace(&out.join(name), text)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        run_summary::{summarize_runs, tests::stored},
        sample_record,
    };

    #[test]
    fn the_page_of_a_new_folder_links_to_videos() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path().join("run");
        fs::create_dir_all(dir.join("video/task_000")).unwrap();
        fs::write(dir.join("video/task_000/episode_00000.mp4"), b"a video").unwrap();
        let mut record = sample_record();
        (record.verdict.safety, record.verdict.d_peak, record.verdict.deformation_ok) =
            (false, Some(1.5), Some(false));
        let runs = summarize_runs(vec![stored(&dir.display().to_string(), "noop", vec![record])]);
        let out = root.path().join("new/folder");
        write(&runs, &Thumbnails::new(), &out).unwrap();
        let page = fs::read_to_string(out.join(PAGE)).unwrap();
        assert!(page.contains("href=\"../../run/video/task_000/episode_00000.mp4\""), "{page}");
    }
}
