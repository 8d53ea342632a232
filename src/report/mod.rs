//! What a run leaves behind: its folder, the results table, envelope plots, and SoftVTBench's files.

pub mod envelope;
pub mod interchange;
pub mod run_folder;
pub mod terminal;
