//! Run folders and everything derived from them: result tables, HTML report, videos, and files in SoftVTBench's format.

pub mod actions;
pub mod comparison;
pub mod condition_table;
pub mod page;
pub mod run_folder;
pub mod run_summary;
pub mod shard_merge;
pub mod softvtbench_files;
pub mod stored_run;
pub mod tables;
pub mod terminal;
pub mod video;
