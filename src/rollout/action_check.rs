//! Checks of actions: which are refused, and which are commands out of reach.

use softvt_geometry::Pose;
use softvt_policy::Action;
use softvt_robot::{
    ik::{ArmAngles, LINEARISATION_RANGE, PoseDifference},
    panda, rotation,
};
use softvt_runs::record::{JointOutsideLimits, UnreachableCommand};

/// The command, if it is farther from the tool than one step of the inverse kinematics reaches, both in the base frame,
/// or outside of the joints' limits.
pub(super) fn far_command(tool_b: &Pose, action: &Action) -> Option<UnreachableCommand> {
    let turn = rotation::error(
        &rotation::from_axis_angle(&rotation::axis_angle(&tool_b.rotation)),
        &rotation::from_axis_angle(&action.axis_angle_b),
    );
    let error = PoseDifference { translation: action.position_b - tool_b.translation.vector, rotation: turn };
    let joint = action.joints.and_then(joint_outside_limits);
    (joint.is_some() || !LINEARISATION_RANGE.contains(&error)).then(|| UnreachableCommand {
        position_m: action.position_b.into(),
        distance_m: error.translation.norm(),
        angle_rad: error.rotation.norm(),
        joint,
    })
}

/// The first joint position outside of its limits.
fn joint_outside_limits(joints: ArmAngles) -> Option<JointOutsideLimits> {
    let all = (1..).zip(joints).zip(panda::joint_ranges());
    let mut outside = all.filter(|((_, position), range)| !range.contains(*position));
    outside.next().map(|((number, position_rad), range)| JointOutsideLimits {
        number,
        position_rad,
        lower_rad: range.lower,
        upper_rad: range.upper,
    })
}

/// Largest magnitude of the numbers of an action, m and rad. The squares of larger ones may overflow.
const MAX_ACTION: f64 = 1e6;

/// Checks that the numbers of an action are finite and plausible, and a grip force within the effort of the gripper.
pub(super) fn check_action(action: &Action, effort_n: f64) -> Result<(), String> {
    if let Some(force_n) = action.force_n().filter(|force| !(0.0..=effort_n).contains(force)) {
        return Err(format!(
            "the action asks for a grip force of {force_n} N; expected 0 to {effort_n} N (robot.gripper.effort), or less \
             than 0 to open"
        ));
    }
    // The pose of joint positions follows from them.
    let numbers = || match action.joints {
        Some(joints) => joints.into_iter().chain([action.closure()]).collect::<Vec<f64>>(),
        None => action.to_array().to_vec(),
    };
    if !action.numbers().all(f64::is_finite) {
        return Err(format!("the action {:?} holds a number that is not finite", numbers()));
    }
    match action.numbers().find(|x| x.abs() > MAX_ACTION) {
        Some(number) => {
            let expected = match action.joints {
                Some(_) => "a joint position in rad",
                None => "a pose in m and rad",
            };
            Err(format!("the action {:?} holds {number:e}, which is not {expected}", numbers()))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::Vec3;
    use softvt_robot::GripTarget;

    #[test]
    fn far_commands_are_accepted_and_implausible_ones_are_refused() {
        let action = |x| Action::new(Vec3::new(x, 0.0, 0.0), Vec3::zeros(), 0.0);
        let refusal = |action: Action| check_action(&action, 70.0);
        assert_eq!(refusal(action(-1e5)), Ok(()));
        assert!(refusal(action(1e308)).is_err_and(|error| error.contains("not a pose")));
        assert!(refusal(action(f64::NAN)).is_err_and(|error| error.contains("not finite")));
        let force = |force_n| refusal(Action { grip: GripTarget::Force(force_n), ..action(0.5) });
        assert_eq!(force(70.0), Ok(()));
        assert!(
            force(70.1)
                .is_err_and(|error| error.contains("70.1 N; expected 0 to 70 N (robot.gripper.effort)"))
        );
        assert!(force(f64::NAN).is_err());
    }

    #[test]
    fn joint_positions_outside_of_their_limits_are_far_commands() {
        let start = [0.0, -0.2, 0.0, -2.4, 0.0, 2.2, 0.8];
        let tool_b = panda::tool_pose(&start);
        let action = |change: [f64; 7]| {
            let joints = std::array::from_fn(|i| start[i] + change[i]);
            Action::of_joints(joints, GripTarget::Closure(0.0))
        };
        let far = |change| far_command(&tool_b, &action(change)).map(|far| far.to_string());
        assert_eq!(far([0.05; 7]), None);
        // Degrees.
        let joint = far([0.0, 0.0, 0.0, -135.0, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(joint, "joint 4 at -137.4 rad, whose limits are -3.072 to -0.07 rad");
        assert!(far([1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap().contains("rad from the tool"));
        let refusal = |x| check_action(&action([x; 7]), 70.0);
        assert_eq!(refusal(500.0), Ok(()));
        assert!(refusal(1e9).is_err_and(|error| error.contains("1e9, which is not a joint position in rad")));
        assert!(refusal(f64::NAN).is_err_and(|error| error.contains("not finite")));
    }
}
