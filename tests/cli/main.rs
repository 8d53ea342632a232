//! Black-box tests of the binary: flags, exit codes, printed output, files, signals and processes.

mod cache;
mod conditions;
mod crash_recovery;
mod dataset_export;
mod dataset_import;
mod dataset_recording;
mod documentation;
mod flags;
mod interrupt;
mod output_files;
mod policies;
mod policy_servers;
mod reports;
mod serve;
mod served_runs;
mod support;
mod view;
mod watch;
