//! What a run gives to the simulations of an experiment: settings and a seed.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

use mlua::Lua;

use softvt_benchmark::settings::{Settings, SettingsError};
use softvt_physics::PhysicsParams;

/// Settings and seed of a run for an experiment, shared by all its virtual machines. It also records what
/// the points have used, since a setting of a part that no point simulates would change nothing.
#[derive(Debug, Default)]
pub struct ExperimentInput {
    set: Vec<(String, String)>,
    seed: u64,
    has_simulation: AtomicBool,
    has_world: AtomicBool,
    has_random: AtomicBool,
    /// Text of all rows so far, bytes.
    row_text: AtomicUsize,
}

/// An input that is not valid, or that would change nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct ExperimentInputError {
    /// "settings" or "seed".
    pub input: &'static str,
    /// Path of a setting; empty where the message names it.
    pub path: String,
    message: String,
}

impl ExperimentInputError {
    fn unused(input: &'static str, path: &str, reason: &str) -> Self {
        Self { input, path: path.to_owned(), message: format!("{reason}; leave it out") }
    }
}

fn group(path: &str) -> &str {
    path.split('.').next().unwrap_or(path)
}

impl ExperimentInput {
    /// Checks settings by path and value against the defaults.
    ///
    /// # Errors
    /// A setting does not exist, has a value out of its range, or concerns the judge.
    pub fn new(set: Vec<(String, String)>, seed: u64) -> Result<Self, ExperimentInputError> {
        Settings::default().with_all(&set).map_err(|error| ExperimentInputError {
            input: "settings",
            path: String::new(),
            message: error.to_string(),
        })?;
        match set.iter().find(|(path, _)| group(path) == "criteria") {
            Some((path, _)) => {
                Err(ExperimentInputError::unused("settings", path, "an experiment judges no episodes"))
            }
            None => Ok(Self { set, seed, ..Self::default() }),
        }
    }

    /// Checks that the points have used every setting and the seed, once all have run.
    ///
    /// # Errors
    /// A setting or seed that changed nothing.
    pub fn check_used(&self) -> Result<(), ExperimentInputError> {
        let has = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        let unused = |path: &str| match group(path) {
            "physics" if has(&self.has_world) => None,
            "physics" => Some("the experiment simulates nothing, so this changes nothing"),
            _ => Some("the experiment simulates no robot (softvt.simulate), so this changes nothing"),
        };
        for (path, _) in self.set.iter().filter(|_| !has(&self.has_simulation)) {
            if let Some(reason) = unused(path) {
                return Err(ExperimentInputError::unused("settings", path, reason));
            }
        }
        if self.seed != 0 && !has(&self.has_random) {
            let reason = "the experiment draws no random numbers, so this changes nothing";
            return Err(ExperimentInputError::unused("seed", "", reason));
        }
        Ok(())
    }

    pub(crate) fn point_key(&self, index: usize) -> [String; 2] {
        [index.to_string(), self.seed.to_string()]
    }

    /// Adds the text of a row; returns that of all rows, bytes.
    pub(crate) fn count_row_text(&self, bytes: usize) -> usize {
        self.row_text.fetch_add(bytes, Ordering::Relaxed) + bytes
    }

    pub(crate) fn record_random(&self) {
        self.has_random.store(true, Ordering::Relaxed);
    }
}

/// The input of the experiment that runs in a virtual machine; the default elsewhere.
fn input(lua: &Lua) -> Arc<ExperimentInput> {
    lua.app_data_ref::<Arc<ExperimentInput>>().map_or_else(Arc::default, |input| Arc::clone(&input))
}

pub(crate) fn simulation_settings(lua: &Lua, settings: &Settings) -> Result<Settings, SettingsError> {
    let input = input(lua);
    input.has_simulation.store(true, Ordering::Relaxed);
    settings.with_all(&input.set)
}

/// The parameters of a world of bare bodies with those of the run.
pub(crate) fn world_params(lua: &Lua, params: PhysicsParams) -> Result<PhysicsParams, SettingsError> {
    let input = input(lua);
    input.has_world.store(true, Ordering::Relaxed);
    let fields: Vec<_> = input.set.iter().filter(|(path, _)| group(path) == "physics").cloned().collect();
    Settings { physics: params, ..Settings::default() }.physics_with(&fields)
}

/// The base seed of a simulation that states none of its own.
pub(crate) fn base_seed(lua: &Lua) -> u64 {
    let input = input(lua);
    input.record_random();
    input.seed
}
