//! Records of episodes: what a run leaves of each, checks of what it says, and what follows from many.
//!
//! [`record::EpisodeRecord`] is one line of `episodes.jsonl`, with the verdict of the judge. [`record_check`] refuses a
//! line that contradicts itself. [`summary::SuiteSummary`] has the rates of a run, [`paired_stats`] compares two runs
//! episode by episode, and a [`requirement::Requirement`] is a condition on the rates.
#![warn(missing_docs, unreachable_pub)]

pub mod paired_stats;
pub mod paired_tests;
pub mod record;
pub mod record_check;
pub mod requirement;
pub mod summary;
