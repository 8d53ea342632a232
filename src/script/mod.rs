//! Lua: the only room that knows it. Sandbox, bindings, options, plans, experts, stubs.

mod articulated;
mod budget;
mod catalogue;
mod catalogue_classes;
mod catalogue_conditions;
mod catalogue_joints;
mod catalogue_shapes;
mod catalogue_visuals;
mod catalogue_world;
mod classes_world;
mod conditions;
mod controller;
mod data;
mod deadline;
mod envelope_api;
mod episode;
mod error;
mod experiment;
mod expert;
mod host;
mod image_api;
mod lists;
mod options;
mod plan;
mod pose;
mod position;
mod random;
mod range;
mod reach;
mod sandbox;
mod scene_api;
pub mod schema;
mod shapes;
mod sim_api;
mod sources;
pub mod stubs;
mod timing;
mod turn;
mod view_api;
mod visuals;
mod world_api;

pub use controller::ExpertController;
pub use deadline::{Clock, Deadline, OnStuck, Pause, end_process};
pub use episode::{Episode, EpisodeRequest, check_shift};
pub use error::ScriptError;
pub use experiment::{Experiment, Finish, Row};
pub use expert::{Expert, ExpertCommand, ExpertView, ObjectView};
pub use options::{OptionSpec, OptionValue};
pub use plan::{Loaded, declared_options, load, load_with};
pub use sandbox::{Limits, Print};
pub use sources::{Bundle, Source, embedded, embedded_scripts, sha256};

#[cfg(test)]
mod tests;
