//! What a run leaves behind: its folder, the results tables, envelope plots, films, and SoftVTBench's files.

pub mod actions;
pub mod comparison;
pub mod conditions;
mod differences;
pub mod envelope;
pub mod interchange;
pub mod judged;
pub mod merge;
pub mod page;
pub mod run_folder;
pub mod runs;
mod table_text;
pub mod tables;
pub mod terminal;
pub mod video;
