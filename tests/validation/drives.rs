//! Motion of the hand along a planned path, and the verdicts of episodes: neither depends on the physics step.

use softvt::{
    geometry::{Pose, Vec3},
    physics::{PhysicsParams, World},
    robot::{RobotSpec, gripper::GripTarget, tactile::GelSpec},
    rollout::{ArmCommand, RobotInstance},
};

use crate::{bodies::GRAVITY, support::quintic};

/// Physics steps per second.
pub const RATES: [f64; 4] = [60.0, 120.0, 240.0, 480.0];

/// Rate of commands, Hz.
const CONTROL_RATE: f64 = 20.0;

/// Joint angles of the arm at the start, rad: the hand points down.
const START: [f64; 7] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// Height (m) and duration (s) of the lift.
const LIFT: (f64, f64) = (0.1, 1.2);

/// Peak acceleration of the path, m/s²: that of the quintic, 10/√3 times height over duration squared.
pub fn path_acceleration() -> f64 {
    10.0 / 3f64.sqrt() * LIFT.0 / (LIFT.1 * LIFT.1)
}

/// Peak acceleration of the tool, m/s², by second differences over the physics step: a lift along the quintic that is
/// commanded at 20 Hz.
pub fn hand_acceleration(rate: f64) -> f64 {
    let params = PhysicsParams { dt: 1.0 / rate, ..PhysicsParams::default() };
    let mut world = World::new(params, GRAVITY * Vec3::new(0.0, 0.0, -1.0));
    let spec = RobotSpec::default();
    let mut robot = RobotInstance::new(
        &mut world,
        &spec,
        &GelSpec::default(),
        &Pose::identity(),
        &START,
        1.0 / CONTROL_RATE,
    );
    let start_b = robot.tool_b(&world);
    let mut path = Vec::new();
    for command in 1..=((LIFT.1 + 0.5) * CONTROL_RATE).round() as usize {
        let height = LIFT.0 * quintic(command as f64 / CONTROL_RATE / LIFT.1);
        let pose_b = Pose::translation(0.0, 0.0, height) * start_b;
        robot.command(&mut world, ArmCommand::pose(pose_b), GripTarget::Closure(0.0));
        for _ in 0..(rate / CONTROL_RATE).round() as usize {
            robot.advance(&mut world);
            world.step().expect("a step that converges");
            path.push(robot.tool_b(&world).translation.vector);
        }
    }
    path.windows(3).map(|p| (p[2] - 2.0 * p[1] + p[0]).norm() * rate * rate).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_acceleration_of_the_hand_along_a_path_does_not_depend_on_the_physics_step() {
        let found = RATES.map(hand_acceleration);
        let (least, most) =
            (found.iter().fold(f64::MAX, |a, &b| a.min(b)), found.iter().fold(0.0, |a: f64, &b| a.max(b)));
        assert!(most <= 1.2 * least, "{found:?} m/s² at {RATES:?} Hz");
        assert!(most <= 2.0 * path_acceleration(), "{found:?} m/s², the path {}", path_acceleration());
    }
}
