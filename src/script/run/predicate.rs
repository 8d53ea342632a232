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
    vm::value::describe,
};
use softvt_benchmark::seed::keyed_rng;
use softvt_rollout::{Simulation, StateFunction, StatePredicate, StepTrace};

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
    fn holds(&self, sim: &Simulation, time_s: f64) -> Result<bool, String> {
        let scene = SceneState::new(expert_view(sim, time_s));
        match call(&self.instance, &self.function, scene)? {
            Value::Boolean(holds) => Ok(holds),
            other => {
                let (place, got) = (defined_at(&self.function), describe(&other));
                Err(format!("{place}: the predicate {:?} returned {got}; return true or false", self.name))
            }
        }
    }
}

/// Calls a function with the time limit of one call. Random numbers, which would make its value one of the state and of
/// chance, are an error; those of the expert go on as if it had not been called.
fn call(
    instance: &ScriptInstance,
    function: &Function,
    arguments: impl IntoLuaMulti,
) -> Result<Value, String> {
    let vm = &instance.vm;
    let before = vm.random.replace(keyed_rng(&["softvt goal"]));
    let result = vm.call::<Value>(function, arguments);
    let has_drawn = vm.random.has_drawn();
    vm.random.reseed(before);
    if has_drawn {
        let place = defined_at(function);
        return Err(format!(
            "{place}: math.random in a function of the state; its value must follow from its arguments"
        ));
    }
    result.map_err(|error| error.to_string())
}

/// A function of the script, given to `softvt.metric`.
pub(crate) struct ScriptMetric {
    pub(crate) instance: Arc<ScriptInstance>,
    pub(crate) name: String,
    pub(crate) function: Function,
}

impl fmt::Debug for ScriptMetric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ScriptMetric").field("name", &self.name).finish_non_exhaustive()
    }
}

impl StateFunction for ScriptMetric {
    fn value(&self, sim: &Simulation, step: &StepTrace) -> Result<Option<f64>, String> {
        let vm = &self.instance.vm;
        let row = step_table(&vm.lua, step).map_err(|error| error.to_string())?;
        let scene = SceneState::new(expert_view(sim, step.time_s));
        let value = call(&self.instance, &self.function, (scene, row))?;
        let got = match value {
            Value::Nil => return Ok(None),
            Value::Integer(value) => return Ok(Some(value as f64)),
            Value::Number(value) if value.is_finite() => return Ok(Some(value)),
            Value::Number(value) => value.to_string(),
            other => describe(&other),
        };
        let place = defined_at(&self.function);
        Err(format!(
            "{place}: the metric {:?} returned {got}; return a finite number, or nil where it has none",
            self.name
        ))
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

/// Keys of an object in a row of the trace.
const OBJECT_KEYS: [&str; 9] =
    ["name", "position_w", "quaternion_w", "d_pct", "min_det_f", "asleep", "pad_force_n", "touches", "nodes"];
