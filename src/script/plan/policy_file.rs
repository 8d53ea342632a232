//! Policies in Lua: a file that returns `softvt.policy{…}`, and the policy of an episode that it gives.

use std::path::Path;

use mlua::{Function, Table, Value};

use super::{ScriptInstance, ScriptSources};
use crate::{
    api::{
        observation::{LuaObservation, task_brief},
        policy::{ActionSpec, PolicySpec},
        pose::rotation_from_wxyz,
    },
    schema::{Constructed, LuaType, RecordType, ValidationError, check::Checker},
    vm::{
        VmLimits,
        error::ScriptError,
        list::plain,
        source_map::origin_of_key,
        value::{describe, literal, number},
    },
};
use softvt_benchmark::seed::{EpisodeSeed, RandomStream};
use softvt_geometry::Vec3;
use softvt_policy::{
    ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, SensorStreams, ToolCommand, ToolMotion,
    decode::MAX_CHUNK_LEN,
    profile::{GripCode, GripperValues},
};
use softvt_robot::rotation;

#[derive(Clone, Debug)]
pub struct PolicyFile {
    pub name: String,
    /// Number of actions of a list that are executed, if the file sets it.
    pub replan: Option<usize>,
    pub gripper: Option<GripCode>,
    pub streams: SensorStreams,
    /// True if the policy observes the finger drives: the exact width and the commanded closure.
    pub drives: bool,
    /// True if the policy has access to limits and materials of objects.
    pub privileged: bool,
    /// File and line of the declaration of its cameras.
    pub observes_at: String,
    /// The files; episodes run on these.
    pub sources: ScriptSources,
}

impl PolicyFile {
    /// # Errors
    /// If the file cannot be read or does not return a valid policy; the message names file and line.
    pub fn load(path: &Path) -> Result<Self, ScriptError> {
        Self::load_with(path, &VmLimits::default())
    }

    /// [`PolicyFile::load`] within other limits.
    pub fn load_with(path: &Path, limits: &VmLimits) -> Result<Self, ScriptError> {
        let (sources, (spec, observes_at)) = ScriptSources::read(true, path, &[], limits, |instance| {
            let policy = instance.policy()?;
            let observes_at = origin_of_key(&instance.vm.lua, &policy.table, &["observes", "cameras"]);
            Ok((policy.spec, observes_at))
        })?;
        let PolicySpec { name, observes, replan, gripper, privileged, .. } = spec;
        let observes_at = observes_at.map_or_else(|| sources.main.clone(), |line| line.to_string());
        let (streams, drives) = (observes.streams(), observes.drives);
        Ok(Self { name, replan, gripper, streams, drives, privileged, observes_at, sources })
    }

    /// Starts the policy of an episode in a virtual machine of its own. Its actions are read in the grip code
    /// `gripper`, or in that of the file.
    ///
    /// # Errors
    /// If the file fails, or declares something else than when it was loaded.
    pub fn start(&self, seed: &EpisodeSeed, gripper: Option<GripCode>) -> Result<LuaPolicy, ScriptError> {
        let instance = self.sources.instance()?;
        let policy = instance.policy().and_then(|policy| self.check_declaration(&instance, policy));
        let PolicySpec { act, reset, .. } = policy.map_err(|e| instance.vm.explain(&e))?;
        instance.vm.random.reseed(seed.stream(RandomStream::Policy));
        let gripper = gripper.or(self.gripper);
        Ok(LuaPolicy { file: self.clone(), instance, act, reset, gripper })
    }

    /// Checks that the file declares in an episode what it declared when it was loaded, which its results state.
    fn check_declaration(
        &self,
        instance: &ScriptInstance,
        again: Constructed<PolicySpec>,
    ) -> mlua::Result<PolicySpec> {
        let changed = [
            ("name", again.name != self.name),
            ("privileged", again.privileged != self.privileged),
            ("observes", again.observes.streams() != self.streams || again.observes.drives != self.drives),
            ("replan", again.replan != self.replan),
            ("gripper", again.gripper != self.gripper),
        ];
        let Some((key, _)) = changed.into_iter().find(|(_, is_changed)| *is_changed) else {
            return Ok(again.spec);
        };
        let what =
            "the file gave another value when it was loaded; declare the same each time that the file runs";
        Err(again.invalid(&instance.vm.lua, key, what))
    }
}

impl ScriptInstance {
    fn policy(&self) -> mlua::Result<Constructed<PolicySpec>> {
        let policy = self.expected_result::<PolicySpec>("a policy's file")?;
        self.vm.privilege.declare(policy.privileged)?;
        Ok(policy)
    }
}

pub struct LuaPolicy {
    file: PolicyFile,
    instance: ScriptInstance,
    act: Function,
    reset: Option<Function>,
    /// Grip code of the actions; any that an action shows by its fields if `None`.
    gripper: Option<GripCode>,
}

impl Policy for LuaPolicy {
    fn name(&self) -> &str {
        &self.file.name
    }

    fn streams(&self) -> SensorStreams {
        self.file.streams.clone()
    }

    fn reset(&mut self, brief: &EpisodeBrief) -> Result<(), PolicyError> {
        let Some(reset) = &self.reset else { return Ok(()) };
        let vm = &self.instance.vm;
        let brief = task_brief(&vm.lua, brief).map_err(|e| script_error(vm.explain(&e)))?;
        vm.call(reset, brief).map_err(script_error)
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let response = self.instance.vm.call(&self.act, LuaObservation::new(observation, self.file.drives));
        self.chunk(&response.map_err(script_error)?)
    }
}

fn script_error(error: ScriptError) -> PolicyError {
    PolicyError::Script(error.to_string())
}

impl LuaPolicy {
    /// An error in the result of `act`, at the line where that function begins, since its call is over. `label` names
    /// the value in the message.
    fn malformed(&self, label: &str, error: impl Into<ValidationError>) -> PolicyError {
        let info = self.act.info();
        let file = info.source.as_deref().and_then(|source| source.strip_prefix('@'));
        let file = file.unwrap_or(self.instance.vm.main());
        let error = ScriptError::new(file, error.into().describe(label));
        script_error(ScriptError { line: info.line_defined, ..error })
    }

    /// The commands of a response: an action, or a list of them.
    fn chunk(&self, response: &Value) -> Result<ActionChunk, PolicyError> {
        let label = "policy.act";
        let wrong = |message: String| Err(self.malformed(label, ValidationError::new(message)));
        let response = plain(&self.instance.vm.lua, response).map_err(|e| self.malformed(label, e))?;
        let Value::Table(table) = &response else {
            return wrong(format!("expected an action or a list of actions, got {}", describe(&response)));
        };
        let count = table.raw_len();
        if count == 0 && !table.is_empty() {
            return Ok(vec![self.action(label, table)?].into());
        }
        if count == 0 {
            return wrong(
                "expected an action or a list of actions, got an empty table; an action has position, axis_angle or \
                 quaternion, and closure"
                    .to_owned(),
            );
        }
        if !(1..MAX_CHUNK_LEN).contains(&count) {
            return wrong(format!("expected 1 to {MAX_CHUNK_LEN} actions, got {count}"));
        }
        let mut chunk = ActionChunk::default();
        for index in 1..=count {
            let label = format!("{label}[{index}]");
            let action = match table.raw_get(index).map_err(|e| self.malformed(&label, e))? {
                Value::Table(entry) => self.action(&label, &entry)?,
                other => {
                    return Err(
                        self.malformed(&label, mismatch!("expected an action, got {}", describe(&other)))
                    );
                }
            };
            chunk.commands.push(action);
        }
        Ok(chunk)
    }

    fn action(&self, label: &str, table: &Table) -> Result<ToolCommand, PolicyError> {
        if self.has_non_finite(table).map_err(|e| self.malformed(label, e))? {
            let text = literal(&Value::Table(table.clone()), 0);
            let message = format!("the action {text} holds a number that is not finite");
            return Err(PolicyError::Action(message));
        }
        self.checked_action(table).map_err(|error| self.malformed(label, error))
    }

    fn checked_action(&self, table: &Table) -> Result<ToolCommand, ValidationError> {
        let lua = &self.instance.vm.lua;
        let spec = ActionSpec::from_checked(
            Value::Table(Checker::new(lua).record(ActionSpec::RECORD, table)?),
            lua,
        )?;
        let pose = |position: [f64; 3], axis_angle_b| ToolMotion::Pose {
            position_b: Vec3::from(position),
            axis_angle_b,
        };
        let motion = match (spec.joints, spec.position, spec.axis_angle, spec.quaternion) {
            (Some(joints), None, None, None) => ToolMotion::Joints(joints),
            (None, Some(position), Some(axis_angle), None) => pose(position, Vec3::from(axis_angle)),
            (None, Some(position), None, Some(wxyz)) => {
                pose(position, rotation::axis_angle(&rotation_from_wxyz(wxyz).unwrap_or_default()))
            }
            (None, Some(_), ..) => return Err(mismatch!("give either axis_angle or quaternion")),
            (Some(_), ..) => {
                return Err(mismatch!("give either joints or a pose"));
            }
            (None, None, ..) => {
                return Err(mismatch!("give either joints or position"));
            }
        };
        let (code, value) = match (self.gripper, spec.closure, spec.force) {
            (None, Some(closure), None) => (GripCode::Continuous, closure),
            (None | Some(GripCode::Force), None, Some(force)) => (GripCode::Force, force),
            (Some(code), Some(closure), None) if code != GripCode::Force => (code, closure),
            (None, ..) => return Err(mismatch!("give either closure or force")),
            (Some(code), ..) => {
                let field = if code == GripCode::Force { "force" } else { "closure" };
                return Err(mismatch!(
                    "the grip code of the policy is {:?}; give {field} alone",
                    code.name()
                ));
            }
        };
        let values = GripperValues { code, ..GripperValues::new(0.0, 1.0) };
        Ok(ToolCommand { motion, grip: values.command(value) })
    }

    /// True if a field of an action is NaN or infinite: that fails the episode and not the run.
    fn has_non_finite(&self, action: &Table) -> mlua::Result<bool> {
        let is_non_finite = |value: &Value| number(value).is_some_and(|number| !number.is_finite());
        for field in ActionSpec::RECORD.fields {
            let value = plain(&self.instance.vm.lua, &action.raw_get(field.name)?)?;
            let mut entries = value.as_table().into_iter().flat_map(|list| list.sequence_values()).flatten();
            if is_non_finite(&value) || entries.any(|entry| is_non_finite(&entry)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
