//! What can be said of a command before it is carried out.

use crate::{
    geometry::Pose,
    policy::Action,
    robot::{ik::REACH, rotation},
};

/// Whether a command is farther from the tool than a step of the inverse kinematics looks; both in the base frame.
pub(super) fn is_far(tool_b: &Pose, action: &Action) -> bool {
    let turn = rotation::error(
        &rotation::from_axis_angle(&rotation::axis_angle(&tool_b.rotation)),
        &rotation::from_axis_angle(&action.axis_angle_b),
    );
    (action.position_b - tool_b.translation.vector).norm() > REACH.0 || turn.norm() > REACH.1
}

/// Refuses a command that cannot be carried out.
///
/// # Errors
/// A number that is not finite; a fragment for people.
pub(super) fn check_action(action: &Action) -> Result<(), String> {
    let numbers = action.position_b.iter().chain(action.axis_angle_b.iter()).chain([&action.closure]);
    let all: Vec<f64> = numbers.copied().collect();
    if all.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(format!("the action {all:?} holds a number that is not finite"))
}
