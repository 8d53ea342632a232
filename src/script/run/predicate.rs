//! Functions of the script of the true state: predicates of goals, and metrics of suites.

use std::{fmt, sync::Arc};

use mlua::{Function, IntoLuaMulti, Lua, LuaSerdeExt, Table, Value, serde::SerializeOptions};

use crate::{
    api::{
        expert::{SceneState, defined_at},
        expert_input::expert_view,
    },
    plan::ScriptInstance,
    schema::strict_table,
    vm::value::{describe, number},
};
use softvt_benchmark::seed::keyed_rng;
use softvt_rollout::{Simulation, StateFunction, StatePredicate, StepTrace};

/// A function of the script, given to `softvt.predicate` or `softvt.metric`.
pub(crate) struct SceneFunction {
    pub(crate) instance: Arc<ScriptInstance>,
    pub(crate) name: String,
    pub(crate) function: Function,
}

impl fmt::Debug for SceneFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SceneFunction").field("name", &self.name).finish_non_exhaustive()
    }
}

impl SceneFunction {
    /// Calls the function with the time limit of one call. Random numbers, which would make its value one of the state
    /// and of chance, are an error; those of the expert go on as if it had not been called.
    fn call(&self, arguments: impl IntoLuaMulti) -> Result<Value, String> {
        let vm = &self.instance.vm;
        let before = vm.random.replace(keyed_rng(&["softvt goal"]));
        let result = vm.call::<Value>(&self.function, arguments);
        let has_drawn = vm.random.has_drawn();
        vm.random.reseed(before);
        if has_drawn {
            let place = defined_at(&self.function);
            return Err(format!(
                "{place}: math.random in a function of the state; its value must follow from its arguments"
            ));
        }
        result.map_err(|error| error.to_string())
    }
}

impl StatePredicate for SceneFunction {
    fn holds(&self, sim: &Simulation, time_s: f64) -> Result<bool, String> {
        match self.call(SceneState::new(expert_view(sim, time_s)))? {
            Value::Boolean(holds) => Ok(holds),
            other => {
                let (place, got) = (defined_at(&self.function), describe(&other));
                Err(format!("{place}: the predicate {:?} returned {got}; return true or false", self.name))
            }
        }
    }
}

impl StateFunction for SceneFunction {
    fn value(&self, sim: &Simulation, step: &StepTrace) -> Result<Option<f64>, String> {
        let row = step_table(&self.instance.vm.lua, step).map_err(|error| error.to_string())?;
        let value = self.call((SceneState::new(expert_view(sim, step.time_s)), row))?;
        match (&value, number(&value).filter(|number| number.is_finite())) {
            (Value::Nil, _) => Ok(None),
            (_, Some(number)) => Ok(Some(number)),
            _ => {
                let (place, got) = (defined_at(&self.function), describe(&value));
                Err(format!("{place}: the metric {:?} returned {got}; return a number or nil", self.name))
            }
        }
    }
}

/// A row of the trace as a table, of which unknown keys cannot be read; what is null is nil.
fn step_table(lua: &Lua, step: &StepTrace) -> mlua::Result<Table> {
    let options = SerializeOptions::new().serialize_none_to_null(false).set_array_metatable(false);
    let table: Table = lua.unpack(lua.to_value_with(step, options)?)?;
    for object in table.get::<Table>("objects")?.sequence_values::<Table>() {
        strict_table(lua, "step.objects", object?, OBJECT_KEYS.map(str::to_owned).to_vec())?;
    }
    let keys = table.pairs::<String, Value>().map(|pair| pair.map(|(key, _)| key));
    let keys = keys.collect::<mlua::Result<_>>()?;
    strict_table(lua, "step", table, keys)
}

const OBJECT_KEYS: [&str; 9] =
    ["name", "position_w", "quaternion_w", "d_pct", "min_det_f", "asleep", "pad_force_n", "touches", "nodes"];
