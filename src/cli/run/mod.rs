//! Runs of suites and experiments: the engine that the commands share.

pub(crate) mod calibration;
pub(crate) mod conditions;
pub(crate) mod config;
pub(crate) mod demo_replay;
pub(crate) mod demo_selection;
pub(crate) mod episode_artifacts;
pub(crate) mod experiment;
pub(crate) mod grip_recorder;
pub(crate) mod policy;
pub(crate) mod preflight;
pub(crate) mod recorded_policy;
pub(crate) mod recording;
pub(crate) mod requirements;
pub(crate) mod resimulate;
pub(crate) mod run_manifest;
pub(crate) mod selection;
pub(crate) mod stored_episode;
pub(crate) mod suite_run;
