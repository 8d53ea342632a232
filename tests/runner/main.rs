//! Tests of runs by the library: how episodes are judged, what policies and experts do, datasets, reports and servers,
//! with typed results. `tests/messages.rs` has the messages for invalid input.

mod benchmark_validity;
mod calibration;
mod conditions;
mod controllers;
mod dataset_import;
mod dataset_recording;
mod determinism;
mod experiments;
mod expert_failure;
mod external_scorer;
mod goals;
mod grasps;
mod joint_control;
mod judged_runs;
mod judging;
mod lerobot_export;
mod metrics;
mod observations;
mod policies;
mod policy_check;
mod policy_servers;
mod reports;
mod rlds_export;
mod serve;
mod served_runs;
mod support;
mod varied_suites;
