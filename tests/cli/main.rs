//! Black-box tests of the binary: flags, exit codes, printed output, files, signals and processes.

mod cache;
mod check;
mod conditions;
mod crash_recovery;
mod dataset_export;
mod dataset_import;
mod dataset_recording;
mod documentation;
mod flags;
mod interrupt;
mod invalid_scripts;
mod judged_runs;
mod output_files;
mod policies;
mod policy_servers;
mod reports;
mod script_timeouts;
mod serve;
mod served_runs;
mod support;
mod usage;
mod view;
mod watch;
