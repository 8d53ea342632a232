//! Functions of goals as predicates of the true state.

use std::{fmt, sync::Arc};

use mlua::{Function, Value};

use crate::{
    api::{
        expert::{SceneState, defined_at},
        expert_input::expert_view,
    },
    plan::ScriptInstance,
    vm::value::describe,
};
use softvt_benchmark::seed::keyed_rng;
use softvt_rollout::{Simulation, StatePredicate};

/// A function of the script, given to `softvt.predicate`.
pub(crate) struct ScriptPredicate {
    pub(crate) instance: Arc<ScriptInstance>,
    /// What holds, in words.
    pub(crate) name: String,
    pub(crate) function: Function,
}

impl fmt::Debug for ScriptPredicate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ScriptPredicate").field("name", &self.name).finish_non_exhaustive()
    }
}

impl StatePredicate for ScriptPredicate {
    /// Calls the function with the time limit of one call. Random numbers are the same at every call, and those of the
    /// expert go on as if it had not been called.
    fn holds(&self, sim: &Simulation, time_s: f64) -> Result<bool, String> {
        let vm = &self.instance.vm;
        let before = vm.random.replace(keyed_rng(&["softvt goal"]));
        let result = vm.call::<Value>(&self.function, SceneState::new(expert_view(sim, time_s)));
        vm.random.reseed(before);
        match result.map_err(|error| error.to_string())? {
            Value::Boolean(holds) => Ok(holds),
            other => {
                let (place, got) = (defined_at(&self.function), describe(&other));
                Err(format!("{place}: the predicate {:?} returned {got}; return true or false", self.name))
            }
        }
    }
}
