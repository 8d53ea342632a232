//! What a run leaves behind: its folder, the results tables, envelope plots, films, and SoftVTBench's files.

pub mod conditions;
pub mod envelope;
pub mod film;
pub mod interchange;
pub mod run_folder;
pub mod terminal;
