//! The binary as people use it: what it says of bad input, what it writes, that results repeat, and that the benchmark
//! measures what it says.

mod alike;
mod bad_runs;
mod bad_scripts;
mod check;
mod conditions;
mod determinism;
mod documents;
mod endless;
mod files;
mod given_up;
mod importing;
mod interrupt;
mod joints;
mod killed;
mod lerobot;
mod measures;
mod observe;
mod policies;
mod recording;
mod reports;
mod scorer;
mod serve;
mod servers;
mod spread;
mod support;
mod touch;
mod usage;
mod view;
