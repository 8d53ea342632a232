//! Experts as controllers of a rollout.

use std::{collections::BTreeMap, sync::Arc};

use crate::{
    api::{
        expert::{Coroutine, FingerAccess},
        expert_input::{SuiteInstances, TrackingErrorMonitor, expert_view},
    },
    plan::ScriptInstance,
    vm::error::ScriptError,
};
use softvt_policy::{Action, Observation, PolicyError, SensorStreams};
use softvt_robot::rotation;
use softvt_rollout::{Controller, Simulation};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpertGrip {
    Commanded,
    Binary,
    /// The grip of a controller that does not know the instance, if the expert has one of its name.
    Blind(BlindGrip),
    /// Feels with the tactile sensors how firmly the object must be held, wherever the expert grasps.
    TactileServo,
}

/// Controllers of the gripper that know what shows of an object and the instances that the suite draws, in place of the
/// instance itself. Experts implement them in Lua.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlindGrip {
    FixedClosure,
    SizeSeen,
    /// An indentation after first contact.
    ContactDepth,
    OneForce,
    OneForceForAll,
    /// The width and the force that the drives of the fingers measure.
    Drives,
    /// Grasps that are repeated until the object follows the hand.
    LookRetry,
    /// Grasps that are repeated until the arm carries the weight of the object.
    Weigh,
}

impl BlindGrip {
    pub fn name(self) -> &'static str {
        match self {
            Self::FixedClosure => "fixed-closure",
            Self::SizeSeen => "size-seen",
            Self::ContactDepth => "contact-depth",
            Self::OneForce => "one-force",
            Self::OneForceForAll => "one-force-for-all",
            Self::Drives => "drives",
            Self::LookRetry => "look-retry",
            Self::Weigh => "weigh",
        }
    }

    /// True for a controller that keeps one number constant; the others find the grip of the instance by trial.
    pub fn is_constant_number(self) -> bool {
        !matches!(self, Self::LookRetry | Self::Weigh)
    }
}

/// Drives a rollout by a Lua expert in a virtual machine of its own; after its end the last command stays.
///
/// This is the only place where a rollout passes its true state to Lua.
pub struct ExpertController {
    pub(crate) instance: Arc<ScriptInstance>,
    pub(crate) coroutine: Coroutine,
    mode: ExpertGrip,
    /// True while the gripper should hold an object, as last commanded.
    pub is_gripping: bool,
    monitor: TrackingErrorMonitor,
    instances: Arc<SuiteInstances>,
}

impl ExpertController {
    pub(crate) fn new(
        instance: Arc<ScriptInstance>,
        function: mlua::Function,
        mode: ExpertGrip,
        instances: Arc<SuiteInstances>,
    ) -> Self {
        let access = if mode == ExpertGrip::TactileServo { FingerAccess::Servo } else { FingerAccess::None };
        let (coroutine, monitor) = (Coroutine::new(function, access), TrackingErrorMonitor::default());
        Self { instance, coroutine, mode, is_gripping: false, monitor, instances }
    }
}

impl Controller for ExpertController {
    fn streams(&self) -> SensorStreams {
        SensorStreams { tactile: self.mode == ExpertGrip::TactileServo, ..SensorStreams::default() }
    }

    fn wants_observation(&self) -> bool {
        self.coroutine.wants_readings
    }

    fn gave_up(&self) -> Option<&str> {
        self.coroutine.gave_up.as_deref()
    }

    fn notes(&self) -> BTreeMap<String, f64> {
        self.coroutine.notes()
    }

    fn unended(&mut self) -> Option<String> {
        let vm = &self.instance.vm;
        let _deadline = vm.call_deadline();
        // An error is the way to learn the line. A script that catches errors does not tell it.
        let stopped = self.coroutine.raise("the episode has ended")?;
        let place = stopped.err().map(|error| vm.explain(&error));
        Some(match place {
            Some(ScriptError { file, line: Some(line), .. }) => {
                format!("the expert had not ended: it was at {file}:{line}")
            }
            _ => "the expert had not ended".to_owned(),
        })
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, PolicyError> {
        let tactile = observation.tactile.as_ref().and_then(|tactile| tactile.frames.last());
        self.coroutine.set_readings(tactile.cloned());
        let (mut view, complaint) = (expert_view(sim, observation.time_s), self.monitor.complaint(sim));
        if let ExpertGrip::Blind(controller) = self.mode {
            view.grip_controller = Some(controller.name());
            view.instances = Some(self.instances.clone());
        }
        let vm = &self.instance.vm;
        let _deadline = vm.call_deadline();
        let command = self.coroutine.next_command(&vm.lua, &view, complaint, &mut self.monitor);
        let command = command.map_err(|error| PolicyError::Script(vm.explain(&error).to_string()))?;
        Ok(command.map(|command| {
            self.is_gripping = command.gripping;
            let closure = match self.mode {
                ExpertGrip::Binary => f64::from(u8::from(command.gripping)),
                ExpertGrip::Commanded | ExpertGrip::Blind(_) | ExpertGrip::TactileServo => command.closure,
            };
            let orientation = rotation::axis_angle(&command.pose_b.rotation);
            Action::new(command.pose_b.translation.vector, orientation, closure)
        }))
    }
}
