//! Experts as controllers of a rollout.

use mlua::Function;

use crate::{
    policy::{Action, Observation, SensorStreams},
    robot::rotation,
    rollout::{ControlError, Controller, Simulation},
    script::{
        api::{
            expert::{Coroutine, FingerAccess},
            expert_input::{
                ExpertCommand, ExpertInput, ExpertView, Planner, TrackingErrorMonitor, next_command,
            },
            touch::FingerReadings,
        },
        plan::ScriptInstance,
        vm::error::ScriptError,
    },
};

/// A running expert with a virtual machine of its own.
pub struct Expert {
    instance: ScriptInstance,
    run: Coroutine,
}

impl Expert {
    pub(crate) fn start(instance: ScriptInstance, function: &Function) -> Self {
        Self { instance, run: Coroutine::new(function.clone(), FingerAccess::None) }
    }

    /// True if the expert needs finger readings at the next control step.
    pub fn wants_readings(&self) -> bool {
        self.run.wants_readings
    }

    /// Sets the finger readings of the next control step.
    pub fn set_readings(&mut self, readings: Option<FingerReadings>) {
        self.run.set_readings(readings);
    }

    /// Resumes the expert with `view` and returns its next command; `None` at its end.
    ///
    /// # Errors
    /// If the expert fails, takes too long, or yields something other than a command.
    pub fn step(&mut self, view: &ExpertView) -> Result<Option<ExpertCommand>, ScriptError> {
        let vm = &self.instance.vm;
        let _deadline = vm.call_deadline();
        self.run.step(&vm.lua, view).map_err(|e| vm.explain(&e))
    }

    /// Reason of the expert for giving up.
    pub fn gave_up(&self) -> Option<&str> {
        self.run.gave_up.as_deref()
    }

    /// Ends the expert with an error that says `complaint` at the line of its last command.
    pub fn refuse(&mut self, complaint: &str) -> ScriptError {
        let vm = &self.instance.vm;
        let _deadline = vm.call_deadline();
        vm.explain(&self.run.refuse(&vm.lua, complaint))
    }
}

impl Planner for Expert {
    type Error = ScriptError;

    fn step(&mut self, view: &ExpertView) -> Result<Option<ExpertCommand>, ScriptError> {
        Self::step(self, view)
    }

    fn refuse(&mut self, complaint: &str) -> ScriptError {
        Self::refuse(self, complaint)
    }
}

/// Gripper of an [`ExpertController`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Gripper {
    /// Follows the closure of the expert.
    Continuous,
    /// Open or closed, as of a binary gripper action.
    Binary,
    /// Closes until the finger readings show a firm grasp, wherever the expert grasps.
    TactileServo,
}

/// Drives a rollout by a Lua expert; after its end the last command stays.
///
/// This is the only place where a rollout passes its true state to Lua.
pub struct ExpertController {
    expert: Expert,
    gripper: Gripper,
    is_gripping: bool,
    monitor: TrackingErrorMonitor,
}

impl ExpertController {
    /// A controller that follows the closure of the expert, or, with `binary`, opens and closes completely.
    pub fn new(expert: Expert, binary: bool) -> Self {
        Self::with_gripper(expert, if binary { Gripper::Binary } else { Gripper::Continuous })
    }

    /// A controller that closes until the finger readings show a firm grasp, whatever closure the expert gives.
    pub fn servo(mut expert: Expert) -> Self {
        expert.run.set_servo();
        Self::with_gripper(expert, Gripper::TactileServo)
    }

    fn with_gripper(expert: Expert, gripper: Gripper) -> Self {
        Self { expert, gripper, is_gripping: false, monitor: TrackingErrorMonitor::default() }
    }

    /// True while the gripper should hold an object, as last commanded.
    pub fn gripping(&self) -> bool {
        self.is_gripping
    }
}

impl Controller for ExpertController {
    fn streams(&self) -> SensorStreams {
        SensorStreams { touch: self.gripper == Gripper::TactileServo, ..SensorStreams::default() }
    }

    fn wants_observation(&self) -> bool {
        self.expert.wants_readings()
    }

    fn gave_up(&self) -> Option<&str> {
        self.expert.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        let touch = observation.touch.as_ref().and_then(|touch| touch.frames.last());
        self.expert.set_readings(touch.cloned());
        let input = ExpertInput::new(sim, observation.time_s, &mut self.monitor);
        let command = next_command(&mut self.expert, input, &mut self.monitor);
        let command = command.map_err(|error| ControlError::Script(error.to_string()))?;
        Ok(command.map(|command| {
            self.is_gripping = command.gripping;
            let closure = match self.gripper {
                Gripper::Binary => f64::from(u8::from(command.gripping)),
                Gripper::Continuous | Gripper::TactileServo => command.closure,
            };
            Action {
                position_b: command.pose_b.translation.vector,
                axis_angle_b: rotation::axis_angle(&command.pose_b.rotation),
                closure,
            }
        }))
    }
}
