//! Runs: their folders and what is in them, and what follows from many episodes.
//!
//! [`manifest::RunManifest`] is `run.json`. A [`run_folder::RunFolder`] is written while a run is in progress, and
//! [`stored_run::StoredRun`] reads it. [`record::EpisodeRecord`] is one line of `episodes.jsonl`, with the verdict of
//! the judge; [`record_line`] adds its digest. [`actions`] are the recorded actions of an episode.
//! [`summary::SuiteSummary`] has the rates of a run, [`paired_stats`] compares two runs episode by episode, and a
//! [`requirement::Requirement`] is a condition on the rates.
#![warn(unreachable_pub)]

pub mod actions;
pub mod attempts;
pub mod experiment_folder;
pub mod json_difference;
pub mod manifest;
pub mod measures;
pub mod paired_stats;
pub mod paired_tests;
pub mod record;
pub mod record_line;
pub mod requirement;
pub mod run_folder;
pub mod shard;
pub mod shard_merge;
pub mod softvtbench_files;
pub mod stored_run;
pub mod summary;

#[cfg(test)]
pub(crate) use record::tests::sample as sample_record;

/// The manifest of a run of one episode, that of [`sample_record`].
#[cfg(test)]
pub(crate) fn sample_manifest() -> manifest::RunManifest {
    let manifest = serde_json::from_str(include_str!("../../tests/data/run.json")).expect("a valid manifest");
    manifest::RunManifest { softvt: manifest::VERSION.to_owned(), ..manifest }
}
