//! A controller that a person drives from a page, in real time.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use serde::Deserialize;

use softvt_benchmark::CONTROL_HZ;
use softvt_common::range::Range;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_policy::{Action, Observation, PolicyError};
use softvt_robot::rotation;
use softvt_rollout::{Controller, Simulation};

pub(crate) const TELEOP: &str = "teleop";

/// Speed of the tool, m/s; its rate of turn, rad/s; and that of the closure, 1/s, at full deflection.
const SPEED: f64 = 0.15;
const TURN_RATE: f64 = 1.0;
const CLOSING_RATE: f64 = 0.12;
/// Largest distance of the commanded position from the tool, m: the command waits for a tool that is held up.
const MAX_LEAD: f64 = 0.05;
/// Time after which the last input counts as none, s: a page that has closed lets the tool stand.
const HOLD: Duration = Duration::from_millis(300);

/// Input from a page: shares of the largest rates, −1 to 1.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub(crate) struct Drive {
    /// Motion of the tool along the axes of the robot's base.
    pub(crate) translate: [f64; 3],
    pub(crate) turn: f64,
    pub(crate) close: f64,
}

impl Drive {
    pub(crate) fn check(&self) -> Result<(), String> {
        let range = Range::closed(-1.0, 1.0);
        let numbers = self.translate.iter().chain([&self.turn, &self.close]);
        match numbers.clone().find(|number| !range.contains(**number)) {
            Some(number) => Err(format!("expected numbers in -1..1, got {number}")),
            None => Ok(()),
        }
    }
}

/// The last input of any page.
#[derive(Debug, Default)]
pub(crate) struct DriveInput(Mutex<Option<(Instant, Drive)>>);

impl DriveInput {
    pub(crate) fn set(&self, drive: Drive) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((Instant::now(), drive));
    }

    fn now(&self) -> Drive {
        let last = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        last.filter(|(at, _)| at.elapsed() < HOLD).map_or(Drive::default(), |(_, drive)| drive)
    }
}

/// Moves the commanded pose by the input, one control step in real time.
pub(crate) struct TeleopController {
    input: Arc<DriveInput>,
    /// Commanded pose, base frame; `None` before the first step.
    target_b: Option<Pose>,
    closure: f64,
    /// When the next control step is due.
    due: Instant,
}

impl TeleopController {
    pub(crate) fn new(input: Arc<DriveInput>) -> Self {
        Self { input, target_b: None, closure: 0.0, due: Instant::now() }
    }
}

impl Controller for TeleopController {
    fn act(&mut self, sim: &Simulation, _: &Observation) -> Result<Option<Action>, PolicyError> {
        thread::sleep(self.due.saturating_duration_since(Instant::now()));
        let dt = 1.0 / f64::from(CONTROL_HZ);
        // After a delay, time goes on from now.
        self.due = self.due.max(Instant::now() - Duration::from_secs_f64(dt)) + Duration::from_secs_f64(dt);
        let tool_b = sim.robot.tool_b(&sim.world);
        let target_b = self.target_b.get_or_insert(tool_b);
        (*target_b, self.closure) = advance(target_b, self.closure, &tool_b, &self.input.now(), dt);
        let position_b = target_b.translation.vector;
        Ok(Some(Action::new(position_b, rotation::axis_angle(&target_b.rotation), self.closure)))
    }
}

/// The commanded pose and closure after `dt` seconds of an input.
fn advance(target_b: &Pose, closure: f64, tool_b: &Pose, drive: &Drive, dt: f64) -> (Pose, f64) {
    let moved = target_b.translation.vector + Vec3::from(drive.translate) * (SPEED * dt);
    let lead = moved - tool_b.translation.vector;
    let position = tool_b.translation.vector + lead * (MAX_LEAD / lead.norm().max(MAX_LEAD));
    let turn = Quat::from_axis_angle(&Vec3::z_axis(), drive.turn * TURN_RATE * dt);
    let closure = (closure + drive.close * CLOSING_RATE * dt).clamp(0.0, 1.0);
    (Pose::from_parts(position.into(), turn * target_b.rotation), closure)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_follows_the_input_and_waits_for_the_tool() {
        let tool = Pose::identity();
        let drive = Drive { translate: [1.0, 0.0, 0.0], turn: 1.0, close: 1.0 };
        let (pose, closure) = advance(&tool, 0.5, &tool, &drive, 0.05);
        assert!(
            (pose.translation.x - SPEED * 0.05).abs() < 1e-12 && (pose.rotation.angle() - 0.05).abs() < 1e-12
        );
        assert!((closure - 0.5 - CLOSING_RATE * 0.05).abs() < 1e-12);
        let far = (0..100).fold(tool, |pose, _| advance(&pose, 0.0, &tool, &drive, 0.05).0);
        assert!((far.translation.vector.norm() - MAX_LEAD).abs() < 1e-12, "{far}");
        assert!(Drive { close: 1.5, ..drive }.check().is_err() && drive.check().is_ok());
        assert!(Drive { turn: f64::NAN, ..drive }.check().is_err());
    }
}
