//! Tests of runs by the library: how episodes are judged, what policies and experts do, messages for invalid input,
//! datasets, reports and servers, with typed results.

mod articulated_objects;
mod benchmark_validity;
mod calibration;
mod cheats;
mod check;
mod conditions;
mod controllers;
mod dataset_import;
mod dataset_recording;
mod determinism;
mod expert_failure;
mod external_scorer;
mod goals;
mod grip_codes;
mod grip_force;
mod initial_state_coverage;
mod invalid_scenes;
mod invalid_scripts;
mod joint_control;
mod judged_runs;
mod judging;
mod lerobot_export;
mod observations;
mod policies;
mod policy_check;
mod policy_servers;
mod reports;
mod serve;
mod served_runs;
mod shut_hand;
mod stacking;
mod support;
mod tactile_forces;
mod turned_grasp;
mod varied_suites;
