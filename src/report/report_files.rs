//! The files that `softvt report` writes: the page, its tables as Markdown and LaTeX, and a JSON row per run.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    leaderboard,
    page::{self, Thumbnails},
    run_summary::{RunSummary, caveats},
    tables::{
        all_tables,
        formats::{escape_markdown, latex, markdown},
    },
};
use softvt_common::{
    files::{self, FileError},
    table::Table,
};

/// Name of the page in the folder of a report.
pub const PAGE: &str = "report.html";
pub const MARKDOWN: &str = "report.md";

const FILES: [&str; 4] = [PAGE, MARKDOWN, "report.tex", "report.jsonl"];

/// Comment at the top of the LaTeX file: the packages and engines it needs.
const LATEX_HEADER: &str =
    "% Needs \\usepackage{booktabs}; of names in other alphabets, LuaLaTeX or XeLaTeX.\n";

/// The first file in the folder `out` that a report would replace, where [`write()`] has not written [`PAGE`].
pub fn foreign_file(out: &Path) -> Option<PathBuf> {
    let page = fs::read_to_string(out.join(PAGE)).unwrap_or_default();
    // A page names the suites of its runs at its top.
    if page.starts_with("<!DOCTYPE html>") && page.contains("<title>softvt: ") {
        return None;
    }
    FILES.iter().map(|name| out.join(name)).find(|path| path.exists())
}

/// Writes [`PAGE`], [`MARKDOWN`], `report.tex` and `report.jsonl` about some runs into the folder `out`. The page shows
/// the objects that have a picture in `thumbnails`.
pub fn write(runs: &[RunSummary], thumbnails: &Thumbnails, out: &Path) -> Result<(), FileError> {
    // Links of the page lead from this folder.
    fs::create_dir_all(out).map_err(FileError::io("create", out))?;
    let tables = all_tables(runs);
    let joined = |format: fn(&Table) -> String| tables.iter().map(format).collect::<Vec<_>>().join("\n");
    let texts = [
        page::page(runs, thumbnails, out),
        caveats(runs).iter().map(|warning| escape_markdown(warning) + "\n\n").collect::<String>()
            + &joined(markdown),
        LATEX_HEADER.to_owned() + &joined(latex),
        leaderboard::rows(runs),
    ];
    for (name, text) in FILES.into_iter().zip(texts) {
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
    fn runs_of_other_scripts_are_named_in_every_file() {
        let run = |dir: &str, hash: &str| {
            let mut run = stored(dir, "pi", vec![sample_record()]);
            run.manifest.sources.insert("../scripts/floor.lua".to_owned(), hash.to_owned());
            run
        };
        let root = tempfile::tempdir().unwrap();
        let runs = summarize_runs(vec![run("a", "2"), run("b", "3"), run("c", "2")]);
        write(&runs, &Thumbnails::new(), root.path()).unwrap();
        let text = |name: &str| fs::read_to_string(root.path().join(name)).unwrap();
        let warning = "a and b have different sources (scripts/floor.lua)";
        for name in [PAGE, MARKDOWN] {
            assert!(text(name).contains(warning) && !text(name).contains("a and c"), "{}", text(name));
        }
        let hashes: Vec<String> = text("report.jsonl")
            .lines()
            .map(|row| serde_json::from_str::<serde_json::Value>(row).unwrap()["sources_sha256"].to_string())
            .collect();
        assert!(hashes[0] != hashes[1] && hashes[0] == hashes[2], "{hashes:?}");
    }

    #[test]
    fn the_page_of_a_new_folder_links_to_videos() {
        let root = tempfile::tempdir().unwrap();
        let dir = root.path().join("run");
        fs::create_dir_all(dir.join("video/task_000")).unwrap();
        fs::write(dir.join("video/task_000/episode_00000.mp4"), b"a video").unwrap();
        let mut record = sample_record();
        (
            record.verdict.safety,
            record.verdict.object_mut().d_peak,
            record.verdict.object_mut().deformation_ok,
        ) = (false, Some(1.5), Some(false));
        let runs = summarize_runs(vec![stored(&dir.display().to_string(), "noop", vec![record])]);
        let out = root.path().join("new/folder");
        write(&runs, &Thumbnails::new(), &out).unwrap();
        let page = fs::read_to_string(out.join(PAGE)).unwrap();
        assert!(page.contains("href=\"../../run/video/task_000/episode_00000.mp4\""), "{page}");
    }
}
