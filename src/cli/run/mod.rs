//! Runs of suites and experiments: the engine that the commands share.

pub(crate) mod conditions;
pub(crate) mod config;
pub(crate) mod episode_artifacts;
pub(crate) mod episode_list;
pub(crate) mod evaluate;
pub(crate) mod experiment;
pub(crate) mod limits;
pub(crate) mod plan_flags;
pub(crate) mod policy;
pub(crate) mod recorded_runs;
pub(crate) mod recording;
pub(crate) mod replay;
pub(crate) mod requirement;
pub(crate) mod run_manifest;
pub(crate) mod selection;
pub(crate) mod served_runs;
pub(crate) mod stored_folder;
pub(crate) mod suite_run;
