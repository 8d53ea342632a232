//! What a run leaves behind: its folder, the results tables, envelope plots, films, and SoftVTBench's files.

pub mod actions;
pub mod comparison;
pub mod conditions;
pub mod envelope;
pub mod film;
pub mod interchange;
pub mod merge;
pub mod page;
pub mod run_folder;
pub mod runs;
pub mod tables;
pub mod terminal;
