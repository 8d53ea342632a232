//! Lua: the only module that knows it.
//!
//! Layers, each of which uses those before it: `vm` (the sandboxed virtual machine), `schema` (declarations of records,
//! classes and functions, and checks by them), `api` (everything a script can reach as `softvt.…`), `plan` (loading a
//! file), `run` (episodes, experts, experiments). [`stubs`] writes the declarations for language servers and readers.
#![warn(unreachable_pub)]

#[macro_use]
mod vm;
#[macro_use]
mod schema;
mod api;
mod plan;
mod run;
pub mod stubs;

pub use api::envelope_plot::envelope_plot;
pub use api::experiment_input::{ExperimentInput, ExperimentInputError};
pub use plan::{
    LoadedScript, ScriptSources, declared_options, load, load_files, load_with,
    options::{OptionSpec, ScriptOptionValue},
    policy_file::{LuaPolicy, PolicyFile},
    profile_file::load_profile,
    variation_file::{STANDARD_VARIATION, load_variation},
};
pub use run::{
    episode::{EpisodeSetup, SceneBuilder, SceneChanges, check_shift},
    experiment::{Experiment, ExperimentRow, ExperimentSummary},
    expert::{BlindGrip, ExpertController, ExpertGrip},
};
pub use vm::{
    PrintSink, VmLimits,
    error::ScriptError,
    library::{ScriptFiles, embedded, embedded_scripts},
    watchdog::StuckHandler,
};

#[cfg(test)]
mod tests;
