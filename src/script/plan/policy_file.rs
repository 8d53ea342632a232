//! Policies in Lua: a file that returns `softvt.policy{…}`, and the policy of an episode that it gives.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use mlua::{FromLua, Function, Lua, Table, Value};

use super::{ScriptInstance, made, open};
use crate::{
    benchmark::seed::{EpisodeSeed, RandomStream},
    geometry::Vec3,
    parallel::lock,
    policy::{
        Action, ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, ToolCommand,
        decode::MAX_CHUNK_LEN,
    },
    robot::rotation,
    script::{
        api::{
            observation::{LuaObservation, task_brief},
            policy::{ActionSpec, PolicySpec},
            pose::rotation_from_wxyz,
        },
        schema::{Constructed, RecordType, ValidationError, check::check},
        vm::{
            Limits,
            error::ScriptError,
            library::{Bundle, Library},
            list::plain,
            source_map::place_of_key,
            value::{describe, literal},
        },
    },
};

/// A loaded policy file; episodes run on the sources read then.
#[derive(Clone)]
pub struct PolicyFile {
    pub name: String,
    /// Number of actions of a list that are executed, if the file sets it.
    pub replan: Option<usize>,
    /// Observations of the policy.
    pub streams: SensorStreams,
    /// File and line of the declaration of its cameras.
    pub observes_at: String,
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
    /// If the file cannot be read or does not return a valid policy; the message names file and line.
    pub fn load(path: &Path) -> Result<Self, ScriptError> {
        Self::load_with(path, &Limits::default())
    }

    /// [`PolicyFile::load`] within other limits.
    ///
    /// # Errors
    /// As [`PolicyFile::load`].
    pub fn load_with(path: &Path, limits: &Limits) -> Result<Self, ScriptError> {
        let (library, main) = Library::open(path)?;
        let (instance, values) = open(&main, library, &[], limits)?;
        let read = || -> mlua::Result<Self> {
            let policy: Constructed<PolicySpec> = made(&instance.vm.lua, &values, "a policy's file")?;
            let streams = SensorStreams {
                cameras: policy.observes.cameras.clone().unwrap_or_default(),
                touch: policy.observes.touch,
                force: policy.observes.force,
            };
            let observes_at = place_of_key(&instance.vm.lua, &policy.table, &["observes", "cameras"]);
            Ok(Self {
                name: policy.name.clone(),
                replan: policy.replan,
                streams,
                observes_at: observes_at.unwrap_or_else(|| main.clone()),
                main: main.clone(),
                bundle: Arc::new(lock(instance.vm.library()).bundle().clone()),
                limits: limits.clone(),
            })
        };
        read().map_err(|e| instance.vm.explain(&e))
    }

    /// SHA-256 of every file that it is made of, by name.
    pub fn hashes(&self) -> BTreeMap<String, String> {
        self.bundle.hashes()
    }

    /// Starts the policy of an episode in a virtual machine of its own.
    ///
    /// # Errors
    /// If the file fails.
    pub fn start(&self, seed: &EpisodeSeed) -> Result<LuaPolicy, ScriptError> {
        let library = Library::frozen((*self.bundle).clone());
        let (instance, values) = open(&self.main, library, &[], &self.limits)?;
        let policy: Constructed<PolicySpec> =
            made(&instance.vm.lua, &values, "a policy's file").map_err(|e| instance.vm.explain(&e))?;
        let PolicySpec { act, reset, .. } = policy.spec;
        instance.vm.random.reseed(seed.stream(RandomStream::Policy));
        Ok(LuaPolicy { name: self.name.clone(), streams: self.streams.clone(), instance, act, reset })
    }
}

/// A policy in Lua, in one episode.
pub struct LuaPolicy {
    name: String,
    streams: SensorStreams,
    instance: ScriptInstance,
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

    fn reset(&mut self, brief: &TaskBrief) -> Result<(), PolicyError> {
        let Some(reset) = &self.reset else { return Ok(()) };
        let vm = &self.instance.vm;
        let brief = task_brief(&vm.lua, brief).map_err(|e| script(vm.explain(&e)))?;
        vm.call(reset, brief).map_err(script)
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let vm = &self.instance.vm;
        let response: Value = vm.call(&self.act, LuaObservation::new(observation)).map_err(script)?;
        commands(&vm.lua, &response).map_err(|error| match error {
            InvalidResponse::NotFinite(text) => {
                PolicyError::Action(format!("the action {text} holds a number that is not finite"))
            }
            InvalidResponse::Malformed(error) => script(self.at_act(&error.describe("policy.act"))),
        })
    }
}

impl LuaPolicy {
    /// An error about the result of `act`, at the line where that function begins, since its call is over.
    fn at_act(&self, message: &str) -> ScriptError {
        let info = self.act.info();
        let file = info.source.as_deref().and_then(|source| source.strip_prefix('@'));
        let file = file.unwrap_or(self.instance.vm.main());
        ScriptError::new(file, message).at(info.line_defined)
    }
}

fn script(error: ScriptError) -> PolicyError {
    PolicyError::Script(error.to_string())
}

/// Error in the result of `act`.
enum InvalidResponse {
    /// It is not an action.
    Malformed(ValidationError),
    /// It is an action that cannot be executed.
    NotFinite(String),
}

impl From<ValidationError> for InvalidResponse {
    fn from(error: ValidationError) -> Self {
        Self::Malformed(error)
    }
}

impl From<mlua::Error> for InvalidResponse {
    fn from(error: mlua::Error) -> Self {
        Self::Malformed(error.into())
    }
}

/// The commands of a response: an action, or a list of them.
fn commands(lua: &Lua, response: &Value) -> Result<ActionChunk, InvalidResponse> {
    let response = plain(lua, response)?;
    let Value::Table(table) = &response else {
        let got = describe(&response);
        return Err(
            ValidationError::new(format!("expected an action or a list of actions, got {got}")).into()
        );
    };
    let count = table.raw_len();
    if count == 0 && !table.is_empty() {
        return Ok(action(lua, table)?.into());
    }
    if !(1..MAX_CHUNK_LEN).contains(&count) {
        return Err(
            ValidationError::new(format!("expected 1 to {MAX_CHUNK_LEN} actions, got {count}")).into()
        );
    }
    let mut chunk = ActionChunk::default();
    for index in 1..=count {
        let place = |error: ValidationError| error.inside(format!("[{index}]"));
        let Value::Table(entry) = table.raw_get(index)? else {
            let got = describe(&table.raw_get(index)?);
            return Err(place(ValidationError::new(format!("expected an action, got {got}"))).into());
        };
        let action = action(lua, &entry).map_err(|error| match error {
            InvalidResponse::Malformed(error) => InvalidResponse::Malformed(place(error)),
            other => other,
        })?;
        chunk.commands.push(ToolCommand::Pose(action));
    }
    Ok(chunk)
}

fn action(lua: &Lua, table: &Table) -> Result<Action, InvalidResponse> {
    if has_non_finite(lua, table)? {
        return Err(InvalidResponse::NotFinite(literal(&Value::Table(table.clone()), 0)));
    }
    let spec = ActionSpec::from_lua(Value::Table(check(lua, ActionSpec::RECORD, table)?), lua)?;
    let axis_angle_b = match (spec.axis_angle, spec.rotation) {
        (Some(axis_angle), None) => Vec3::from(axis_angle),
        (None, Some(quat)) => {
            rotation_from_wxyz(quat).map(|quat| rotation::axis_angle(&quat)).ok_or_else(|| {
                ValidationError::new("expected a quaternion other than 0".to_owned()).inside("rotation")
            })?
        }
        _ => return Err(ValidationError::new("give either axis_angle or rotation".to_owned()).into()),
    };
    Ok(Action { position_b: Vec3::from(spec.position), axis_angle_b, closure: spec.closure })
}

/// True if a field of an action is NaN or infinite: that fails the episode and not the run.
fn has_non_finite(lua: &Lua, action: &Table) -> mlua::Result<bool> {
    let is_non_finite = |value: &Value| matches!(value, Value::Number(number) if !number.is_finite());
    for field in ActionSpec::RECORD.fields {
        let value = plain(lua, &action.raw_get(field.name)?)?;
        let inside = match &value {
            Value::Table(list) => {
                list.sequence_values::<Value>().flatten().any(|value| is_non_finite(&value))
            }
            other => is_non_finite(other),
        };
        if inside {
            return Ok(true);
        }
    }
    Ok(false)
}
