//! A scripted expert as whoever drives a rollout: the one place where hidden state goes to Lua.

use crate::script::{Expert, ExpertCommand, ExpertView, ObjectView, ScriptError, run::reachability::Lag};
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::Vec3,
    policy::{Action, Observation, SensorStreams},
    robot::rotation,
    rollout::{ControlError, Controller, ObjectInstance, Simulation},
};

/// Drives by a Lua expert; once it is done, the last command stays.
pub struct ExpertController {
    expert: Expert,
    binary: bool,
    servo: bool,
    gripping: bool,
    lag: Lag,
}

impl ExpertController {
    /// `binary` replaces the expert's closure by fully open or fully shut, as a binary gripper action would.
    pub fn new(expert: Expert, binary: bool) -> Self {
        Self { expert, binary, servo: false, gripping: false, lag: Lag::default() }
    }

    /// Closes, wherever the expert grasps, until the fingers feel that they hold something, whatever the expert says.
    pub fn servo(expert: Expert) -> Self {
        Self { expert: expert.into_servo(), binary: false, servo: true, gripping: false, lag: Lag::default() }
    }

    /// Whether the gripper is meant to hold something, as last commanded.
    pub fn gripping(&self) -> bool {
        self.gripping
    }
}

impl Controller for ExpertController {
    fn streams(&self) -> SensorStreams {
        SensorStreams { touch: self.servo, ..SensorStreams::default() }
    }

    fn wants_observation(&self) -> bool {
        self.expert.feels()
    }

    fn gave_up(&self) -> Option<&str> {
        self.expert.gave_up()
    }

    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        let touch = observation.touch.as_ref().and_then(|touch| touch.frames.last());
        self.expert.feel(touch.cloned());
        let glance = Glance::new(sim, observation.time_s, &mut self.lag);
        let command = next(&mut self.expert, glance, &mut self.lag);
        let command = command.map_err(|error| ControlError::Script(error.to_string()))?;
        Ok(command.map(|command| {
            self.gripping = command.gripping;
            let shut = if command.gripping { 1.0 } else { 0.0 };
            Action {
                position_b: command.pose_b.translation.vector,
                axis_angle_b: rotation::axis_angle(&command.pose_b.rotation),
                closure: if self.binary { shut } else { command.closure },
            }
        }))
    }
}

/// A planner that gives one command a control step.
pub(crate) trait Planner {
    /// What goes wrong with it.
    type Error;
    /// Its next command, or none once it is done.
    fn step(&mut self, view: &ExpertView) -> Result<Option<ExpertCommand>, Self::Error>;
    /// Ends it with an error that says `complaint`.
    fn refuse(&mut self, complaint: &str) -> Self::Error;
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

/// What a planner is shown at a control step, and what there is to say of its last command.
pub(crate) struct Glance {
    view: ExpertView,
    complaint: Option<String>,
}

impl Glance {
    /// Looks at the true state.
    pub(crate) fn new(sim: &Simulation, time_s: f64, lag: &mut Lag) -> Self {
        Self { view: view(sim, time_s), complaint: lag.complaint(sim) }
    }
}

/// The next command of a planner; an error if the arm could not follow the last one.
pub(crate) fn next<P: Planner>(
    planner: &mut P,
    glance: Glance,
    lag: &mut Lag,
) -> Result<Option<ExpertCommand>, P::Error> {
    if let Some(complaint) = glance.complaint {
        return Err(planner.refuse(&complaint));
    }
    let command = planner.step(&glance.view)?;
    if let Some(command) = &command {
        lag.sent(&command.pose_b);
    }
    Ok(command)
}

/// What an expert may know now.
fn view(sim: &Simulation, time_s: f64) -> ExpertView {
    ExpertView {
        time_s,
        dt_s: CONTROL_DT,
        base_w: sim.robot.base_w,
        tcp_b: sim.robot.tool_b(&sim.world),
        width_m: sim.robot.width(&sim.world),
        closure: sim.robot.closure(),
        pad_force_n: sim
            .objects
            .iter()
            .map(|object| sim.pad_contacts(object))
            .fold([0.0; 2], |sum, touch| [sum[0] + touch[0].normal_force, sum[1] + touch[1].normal_force]),
        objects: (0..sim.objects.len())
            .filter(|&index| sim.objects[index].part.is_none())
            .map(|index| ObjectView {
                parts: sim.parts(index).map(|(handle, part)| seen(sim, handle, &part.name)).collect(),
                ..seen(sim, &sim.objects[index], &sim.objects[index].name)
            })
            .collect(),
    }
}

fn seen(sim: &Simulation, object: &ObjectInstance, name: &str) -> ObjectView {
    let pose = sim.pose(object);
    let bounds = object.bounds;
    let centre_w = (pose * nalgebra::Point3::from(bounds.centre())).coords;
    let x = pose.rotation * Vec3::x();
    ObjectView {
        name: name.to_owned(),
        asset: object.asset.clone(),
        pose_w: pose,
        bounds,
        centre_w,
        yaw: x.y.atan2(x.x),
        joint: sim.joint(object),
        parts: Vec::new(),
    }
}
