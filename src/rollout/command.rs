//! What can be said of a command before it is carried out.

use crate::{
    geometry::Pose,
    policy::Action,
    robot::{
        ik::{LINEARISATION_RANGE, PoseError},
        rotation,
    },
};

/// Whether a command is farther from the tool than a step of the inverse kinematics looks; both in the base frame.
pub(super) fn is_far(tool_b: &Pose, action: &Action) -> bool {
    let turn = rotation::error(
        &rotation::from_axis_angle(&rotation::axis_angle(&tool_b.rotation)),
        &rotation::from_axis_angle(&action.axis_angle_b),
    );
    let error = PoseError { translation: action.position_b - tool_b.translation.vector, rotation: turn };
    !LINEARISATION_RANGE.contains(&error)
}

/// Numbers of a command are at most this large, m and rad: what is larger is no pose, and its squares are no numbers.
const LARGEST: f64 = 1e6;

/// Refuses a command that cannot be carried out.
///
/// # Errors
/// A number that is not finite, or is no part of a pose; a fragment for people.
pub(super) fn check_action(action: &Action) -> Result<(), String> {
    let numbers = action.position_b.iter().chain(action.axis_angle_b.iter()).chain([&action.closure]);
    let all: Vec<f64> = numbers.copied().collect();
    if !all.iter().all(|x| x.is_finite()) {
        return Err(format!("the action {all:?} holds a number that is not finite"));
    }
    match all.iter().find(|x| x.abs() > LARGEST) {
        Some(x) => Err(format!("the action {all:?} holds {x:e}, which is no pose in m and rad")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn what_is_far_is_carried_out_and_what_is_no_pose_is_not() {
        let action =
            |x| Action { position_b: Vec3::new(x, 0.0, 0.0), axis_angle_b: Vec3::zeros(), closure: 0.0 };
        assert!(check_action(&action(-1e5)).is_ok());
        assert!(check_action(&action(1e308)).is_err_and(|message| message.contains("no pose")));
        assert!(check_action(&action(f64::NAN)).is_err_and(|message| message.contains("not finite")));
    }
}
