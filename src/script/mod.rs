//! Lua: the only module that knows it.
//!
//! Layers, each of which uses those before it: `vm` (the sandboxed virtual machine), `schema` (checked tables and objects),
//! `api` (everything a script reaches as `softvt.…`), `plan` (loading a file), `run` (episodes, experts, experiments).

mod api;
mod plan;
mod run;
pub mod schema;
pub mod stubs;
mod vm;

pub use plan::{
    Loaded, declared_options, load, load_with,
    options::{OptionSpec, OptionValue},
    policy_file::{LuaPolicy, PolicyFile},
    profile_file::load_profile,
};
pub use run::{
    controller::ExpertController,
    episode::{Episode, EpisodeRequest, Scenes, check_shift},
    experiment::{Experiment, Finish, Row},
    expert::{Expert, ExpertCommand, ExpertView, Felt, Grip, ObjectView},
};
pub use vm::{
    Limits, Print,
    error::ScriptError,
    library::{Bundle, Source, embedded, embedded_scripts, sha256},
    watchdog::{Clock, Deadline, OnStuck, Pause, end_process},
};

#[cfg(test)]
mod tests;
