//! Lua: the only room that knows it. Sandbox, bindings, options, plans, experts, stubs.

mod catalogue;
mod catalogue_shapes;
mod deadline;
mod error;
mod experiment;
mod options;
mod plan;
mod pose;
mod position;
mod random;
mod sandbox;
pub mod schema;
mod shapes;
mod sources;

pub use deadline::{Clock, Deadline, OnStuck, Pause, end_process};
pub use error::ScriptError;
pub use experiment::{Experiment, Finish, Row};
pub use options::{OptionSpec, OptionValue};
pub use plan::{Loaded, declared_options, load, load_with};
pub use sandbox::{Limits, Print};
pub use sources::{Bundle, Source, embedded, embedded_scripts};

#[cfg(test)]
mod tests;
