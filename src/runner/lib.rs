//! Runs: the episodes of suites under a policy, into folders that can be continued, merged, replayed and reported.
//!
//! [`run_suites`] runs the suites of a script, [`conditions`] runs them under changes, [`recording`] makes datasets of
//! them, and [`replay`] simulates recorded episodes again. [`SuiteRun`] is below all of them: a suite with everything
//! that its episodes need; [`PreparedRun`] is one whose scenes are valid, with the limits of their objects. Nothing
//! here prints: progress and messages go to an [`Observer`].
#![warn(unreachable_pub)]

pub mod bench_growth;
pub mod bench_rates;
mod check;
pub mod conditions;
mod config;
mod effect;
mod episode_artifacts;
mod episode_list;
pub mod episode_selector;
mod error;
mod evaluate;
pub mod experiment;
mod golden_episode;
#[cfg(feature = "import")]
pub mod import;
mod limits;
mod observer;
mod policy;
pub mod policy_check;
mod record;
mod recorded_runs;
pub mod recording;
pub mod replay;
mod run_manifest;
mod runner;
pub mod script_catalog;
#[cfg(feature = "serve")]
mod served_runs;
#[cfg(feature = "serve")]
mod serving;
pub mod stored_folder;
mod stored_scripts;
mod suite_run;
pub mod suite_selection;
mod thumbnails;

pub use check::SuiteChecker;
pub use config::{ConfiguredScript, RunConfig, TraceDetail, plan_noun, read_secret, thread_count};
pub use episode_artifacts::EpisodeFilter;
pub use episode_list::{EpisodeJob, EpisodeList};
pub use error::{FaultySetting, RunError, RunErrorCause};
pub use evaluate::SuiteResult;
pub use golden_episode::GoldenEpisode;
pub use observer::{Observer, SilentObserver};
pub use policy::{
    BuiltinPolicy, ControllerFactory, DeclaredStreams, PolicyConfig, PolicyOptions, PolicySource,
    expert_controller, parse_profile,
};
pub use record::{DemoCount, record};
pub use runner::run_suites;
#[cfg(feature = "serve")]
pub use served_runs::ServedRuns;
#[cfg(feature = "serve")]
pub use serving::SuiteServer;
pub use softvt_runs::shard::Shard;
pub use stored_scripts::StoredScripts;
pub use suite_run::{PreparedRun, SuiteRun};
pub use thumbnails::thumbnails;
