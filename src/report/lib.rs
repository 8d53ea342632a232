//! Presentation of runs: result tables, comparison, HTML report, videos and MCAP files.
//!
//! [`run_summary`] summarises stored runs, and the other modules show them.
#![warn(unreachable_pub)]

#[cfg(test)]
mod agreement;
mod cells;
pub mod commands;
pub mod comparison;
pub mod comparison_table;
pub mod condition_effects;
pub mod condition_table;
pub mod episode_page;
pub mod leaderboard;
pub mod mcap;
pub mod page;
pub mod policy_ranking;
pub mod report_files;
pub mod run_summary;
pub mod styled_text;
#[cfg(test)]
mod table_snapshots;
pub mod tables;
mod task_names;
pub mod terminal;
mod terminal_details;
pub mod video;

/// The manifest of a run of one episode, [`sample_record`].
#[cfg(test)]
pub(crate) fn sample_manifest() -> softvt_runs::manifest::RunManifest {
    let manifest = serde_json::from_str(include_str!("../../tests/data/run.json")).expect("a valid manifest");
    softvt_runs::manifest::RunManifest { softvt: env!("CARGO_PKG_VERSION").to_owned(), ..manifest }
}

/// A successful, safe soft episode.
#[cfg(test)]
pub(crate) fn sample_record() -> softvt_runs::record::EpisodeRecord {
    serde_json::from_str(include_str!("../../tests/data/episode_record.json")).expect("a valid record")
}
