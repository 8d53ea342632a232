//! Policies in Lua: a file that returns `softvt.policy{…}`, and the policy that it makes of an episode.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use mlua::{Function, Lua, MultiValue, Table, Value};

use crate::script::{
    Bundle, ScriptError,
    api::catalogue_policy::{ACTION, POLICY},
    api::observation::{LuaObservation, brief},
    api::orientation as turn,
    plan::{Machine, open},
    schema::{self, Fault},
    vm::library::Library,
    vm::list as lists,
    vm::origin,
    vm::{Limits, describe, fail, locked},
};
use crate::{
    benchmark::seed::{EpisodeSeed, RandomStream},
    geometry::Vec3,
    policy::{
        Action, ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, ToolCommand,
        decode::MAX_CHUNK_LEN,
    },
    robot::rotation,
};

/// A policy's file that was read and understood; episodes run on what was read then.
#[derive(Clone)]
pub struct PolicyFile {
    /// Its name in results.
    pub name: String,
    /// How many actions of a list are carried out, if it says.
    pub replan: Option<usize>,
    /// What it looks at.
    pub streams: SensorStreams,
    /// File and line that say which cameras it looks at.
    pub looks_at: String,
    /// The file, as messages name it.
    pub main: String,
    bundle: Arc<Bundle>,
    limits: Limits,
}

impl std::fmt::Debug for PolicyFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PolicyFile")
            .field("main", &self.main)
            .field("streams", &self.streams)
            .finish_non_exhaustive()
    }
}

impl PolicyFile {
    /// Reads the policy at `path`.
    ///
    /// # Errors
    /// Anything that is wrong with the file; the message names file and line.
    pub fn load(path: &Path) -> Result<Self, ScriptError> {
        Self::load_with(path, &Limits::default())
    }

    /// [`PolicyFile::load`] within other limits.
    ///
    /// # Errors
    /// As [`PolicyFile::load`].
    pub fn load_with(path: &Path, limits: &Limits) -> Result<Self, ScriptError> {
        let (library, main) = Library::open(path)?;
        let (machine, values) = open(&main, library, &[], limits)?;
        let read = || -> mlua::Result<Self> {
            let table = made(&machine.vm.lua, &values)?;
            let looks: Table = table.get("looks")?;
            let streams = SensorStreams {
                cameras: looks.get::<Option<_>>("cameras")?.unwrap_or_default(),
                touch: looks.get("touch")?,
                force: looks.get("force")?,
            };
            let looks_at = origin::place(&machine.vm.lua, &table, &["looks", "cameras"]);
            Ok(Self {
                name: table.get("name")?,
                replan: table.get("replan")?,
                streams,
                looks_at: looks_at.unwrap_or_else(|| main.clone()),
                main: main.clone(),
                bundle: Arc::new(locked(&machine.vm.shared.library).bundle().clone()),
                limits: limits.clone(),
            })
        };
        read().map_err(|e| machine.vm.explain(&e))
    }

    /// SHA-256 of every file that it is made of, by name.
    pub fn hashes(&self) -> BTreeMap<String, String> {
        self.bundle.hashes()
    }

    /// The policy in a machine of its own, for one episode.
    ///
    /// # Errors
    /// If the file fails.
    pub fn start(&self, seed: &EpisodeSeed) -> Result<LuaPolicy, ScriptError> {
        let library = Library::frozen((*self.bundle).clone());
        let (machine, values) = open(&self.main, library, &[], &self.limits)?;
        let functions = || -> mlua::Result<(Function, Option<Function>)> {
            let table = made(&machine.vm.lua, &values)?;
            Ok((table.get("act")?, table.get("reset")?))
        };
        let (act, reset) = functions().map_err(|e| machine.vm.explain(&e))?;
        machine.vm.random.reseed(seed.stream(RandomStream::Policy));
        Ok(LuaPolicy { name: self.name.clone(), streams: self.streams.clone(), machine, act, reset })
    }
}

/// The table that a policy's file returned.
fn made(lua: &Lua, values: &MultiValue) -> mlua::Result<Table> {
    match values.front() {
        Some(Value::Table(table)) if schema::is_made(lua, &POLICY, table) => {
            schema::still_sound(lua, &POLICY, table)?;
            Ok(table.clone())
        }
        other => {
            let got = other.map_or("nothing".to_owned(), schema::got_made);
            Err(fail(lua, format!("a policy's file returns softvt.policy{{…}}, got {got}")))
        }
    }
}

/// A policy in Lua, in one episode.
pub struct LuaPolicy {
    name: String,
    streams: SensorStreams,
    machine: Machine,
    act: Function,
    reset: Option<Function>,
}

impl Policy for LuaPolicy {
    fn name(&self) -> &str {
        &self.name
    }

    fn streams(&self) -> SensorStreams {
        self.streams.clone()
    }

    fn reset(&mut self, told: &TaskBrief) -> Result<(), PolicyError> {
        let Some(reset) = &self.reset else { return Ok(()) };
        let vm = &self.machine.vm;
        let told = brief(&vm.lua, told).map_err(|e| script(vm.explain(&e)))?;
        vm.call(reset, told).map_err(script)
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let vm = &self.machine.vm;
        let answer: Value = vm.call(&self.act, LuaObservation::new(observation)).map_err(script)?;
        commands(&vm.lua, &answer).map_err(|wrong| match wrong {
            Wrong::NotFinite(text) => {
                PolicyError::Action(format!("the action {text} holds a number that is not finite"))
            }
            Wrong::Fault(fault) => script(self.at_act(&fault.words("policy.act"))),
        })
    }
}

impl LuaPolicy {
    /// An error about what `act` returned, on the line where that function begins: it is over by then.
    fn at_act(&self, message: &str) -> ScriptError {
        let info = self.act.info();
        let file = info.source.as_deref().and_then(|source| source.strip_prefix('@'));
        let file = file.unwrap_or(&self.machine.vm.shared.main);
        ScriptError::new(file, message).at(info.line_defined)
    }
}

fn script(error: ScriptError) -> PolicyError {
    PolicyError::Script(error.to_string())
}

/// What is wrong with an answer.
enum Wrong {
    /// It is no action.
    Fault(Fault),
    /// It is one that cannot be carried out.
    NotFinite(String),
}

impl From<Fault> for Wrong {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<mlua::Error> for Wrong {
    fn from(error: mlua::Error) -> Self {
        Self::Fault(Fault::new(error.to_string()))
    }
}

/// The commands of an answer: an action, or a list of them.
fn commands(lua: &Lua, answer: &Value) -> Result<ActionChunk, Wrong> {
    let answer = lists::plain(lua, answer)?;
    let Value::Table(table) = &answer else {
        let got = schema::got(&answer);
        return Err(Fault::new(format!("expected an action or a list of actions, got {got}")).into());
    };
    let count = table.raw_len();
    if count == 0 && !table.is_empty() {
        return Ok(action(lua, table)?.into());
    }
    if !(1..MAX_CHUNK_LEN).contains(&count) {
        return Err(Fault::new(format!("expected 1 to {MAX_CHUNK_LEN} actions, got {count}")).into());
    }
    let mut chunk = ActionChunk::default();
    for index in 1..=count {
        let place = |fault: Fault| fault.inside(format!("[{index}]"));
        let Value::Table(entry) = table.raw_get(index)? else {
            let got = schema::got(&table.raw_get(index)?);
            return Err(place(Fault::new(format!("expected an action, got {got}"))).into());
        };
        let action = action(lua, &entry).map_err(|wrong| match wrong {
            Wrong::Fault(fault) => Wrong::Fault(place(fault)),
            other => other,
        })?;
        chunk.commands.push(ToolCommand::Pose(action));
    }
    Ok(chunk)
}

fn action(lua: &Lua, table: &Table) -> Result<Action, Wrong> {
    if has_no_number(lua, table)? {
        return Err(Wrong::NotFinite(describe(&Value::Table(table.clone()), 0)));
    }
    let checked = schema::check(lua, &ACTION, table)?;
    let turns: (Option<[f64; 3]>, Option<[f64; 4]>) = (checked.get("axis_angle")?, checked.get("rotation")?);
    let axis_angle_b = match turns {
        (Some(axis_angle), None) => Vec3::from(axis_angle),
        (None, Some(quat)) => turn::turn(quat)
            .map(|turn| rotation::axis_angle(&turn))
            .ok_or_else(|| Fault::new("expected a quaternion other than 0".to_owned()).inside("rotation"))?,
        _ => return Err(Fault::new("give either axis_angle or rotation".to_owned()).into()),
    };
    let position_b = Vec3::from(checked.get::<[f64; 3]>("position")?);
    Ok(Action { position_b, axis_angle_b, closure: checked.get("closure")? })
}

/// Whether a field of an action holds NaN or an infinity, which is no mistake of form.
fn has_no_number(lua: &Lua, action: &Table) -> mlua::Result<bool> {
    let none = |value: &Value| matches!(value, Value::Number(number) if !number.is_finite());
    for field in ACTION.fields {
        let value = lists::plain(lua, &action.raw_get(field.name)?)?;
        let inside = match &value {
            Value::Table(list) => list.sequence_values::<Value>().flatten().any(|value| none(&value)),
            other => none(other),
        };
        if inside {
            return Ok(true);
        }
    }
    Ok(false)
}
