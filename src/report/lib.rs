//! Run folders and everything derived from them: result tables, HTML report, videos, and files in SoftVTBench's format.
//!
//! [`stored_run`] reads run folders, [`run_summary`] summarises them, and the other modules write what is made of them.
#![warn(missing_docs, unreachable_pub)]

pub mod actions;
#[cfg(test)]
mod agreement;
pub mod commands;
pub mod comparison;
pub mod condition_effects;
pub mod condition_table;
mod d_axis;
pub mod episode_page;
pub mod leaderboard;
pub mod mcap;
pub mod page;
pub mod policy_ranking;
pub mod report_files;
pub mod run_check;
pub mod run_folder;
pub mod run_summary;
pub mod shard_merge;
pub mod softvtbench_files;
pub mod stored_run;
pub mod styled_text;
pub mod tables;
mod task_names;
pub mod terminal;
mod terminal_details;
pub mod video;

/// A successful, safe soft episode.
#[cfg(test)]
pub(crate) fn sample_record() -> softvt_runs::record::EpisodeRecord {
    serde_json::from_str(include_str!("../../tests/data/episode_record.json")).expect("a valid record")
}
