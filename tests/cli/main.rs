//! Black-box tests of the binary: flags, exit codes, printed output, files, signals and processes.

mod crash_recovery;
mod documentation;
mod interrupt;
mod runs;
mod serve;
mod served_runs;
mod support;
mod view;
mod watch;
