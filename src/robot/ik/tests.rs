use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::geometry::Quat;

const START: ArmAngles = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];
const DT: f64 = 0.05;

fn ik() -> DiffIk {
    DiffIk::new(&IkSpec::default(), START, DT)
}

fn down(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    let turn = Quat::from_axis_angle(&Vec3::z_axis(), yaw)
        * Quat::new_unchecked(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0));
    Pose::from_parts(Vec3::new(x, y, z).into(), turn)
}

/// Follows `target` with joints that go a share `follow` of the way to their target each control step.
fn follow(ik: &mut DiffIk, mut q: ArmAngles, target: &Pose, steps: usize, follow: f64) -> ArmAngles {
    for _ in 0..steps {
        let command = ik.step(&q, target);
        q = std::array::from_fn(|i| q[i] + follow * (command[i] - q[i]));
    }
    q
}

#[test]
fn the_tool_reaches_a_pose_and_stays_there_even_with_lagging_joints() {
    for lag in [1.0, 0.4] {
        let target = down(0.55, 0.2, 0.05, 0.6);
        let mut ik = ik();
        let q = follow(&mut ik, START, &target, 60, lag);
        let (linear, angular) = pose_error(&ik.tool_pose(&q), &target);
        assert!(linear.norm() < 1e-5 && angular.norm() < 1e-5, "{} m {} rad", linear.norm(), angular.norm());
    }
}

#[test]
fn the_command_never_moves_faster_than_a_joint_may() {
    let mut ik = ik();
    let target = down(0.4, -0.45, 0.3, -1.0);
    let (mut q, mut last, mut fastest) = (START, START, 0.0_f64);
    for _ in 0..40 {
        let command = ik.step(&q, &target);
        for (i, link) in ik.chain.links.iter().enumerate() {
            let share = (command[i] - last[i]).abs() / (link.velocity_limit * DT);
            assert!(share <= 1.0 + 1e-12);
            fastest = fastest.max(share);
        }
        (q, last) = (command, command);
    }
    assert!(fastest > 0.999, "a far target is approached at the limit: {fastest}");
}

#[test]
fn a_joint_at_its_limit_is_held_and_the_others_reach_the_pose() {
    let mut stopped = ik();
    // The first joint stands on its stop, and the target asks it to turn farther.
    stopped.chain.links[0].upper = START[0];
    let target = down(0.45, 0.12, 0.25, 0.0);
    let free = ik().solve(&START, &target).expect("reachable");
    assert!(free[0] > START[0] + 0.1, "without the stop the joint would pass it: {}", free[0]);
    let mut q = START;
    for _ in 0..100 {
        q = stopped.step(&q, &target);
        assert!(q[0] <= START[0]);
    }
    let (linear, angular) = pose_error(&stopped.tool_pose(&q), &target);
    assert!(linear.norm() < 1e-5 && angular.norm() < 1e-5, "{} m {} rad", linear.norm(), angular.norm());
}

#[test]
fn the_null_space_drifts_to_the_posture_without_moving_the_tool() {
    let spec = IkSpec { posture_gain: 0.2, ..IkSpec::default() };
    let mut bent = START;
    bent[2] += 0.5;
    let target = ik().tool_pose(&START);
    let away = ik().solve(&bent, &target).expect("reachable");
    let distance = |q: &ArmAngles| (Joints::from(*q) - Joints::from(START)).norm();
    assert!(distance(&away) > 0.2, "the search must end in another posture: {}", distance(&away));
    let mut drifting = DiffIk::new(&spec, START, DT);
    let back = follow(&mut drifting, away, &target, 100, 1.0);
    assert!(distance(&back) < 0.01 * distance(&away), "{}", distance(&back));
    let (linear, angular) = pose_error(&drifting.tool_pose(&back), &target);
    assert!(linear.norm() < 1e-5 && angular.norm() < 1e-4);
}

#[test]
fn poses_out_of_reach_are_refused_with_the_miss() {
    let far = ik().solve(&START, &down(1.4, 0.0, 0.2, 0.0)).expect_err("too far");
    assert!(far.distance > 0.4, "{far}");
    assert!(
        far.to_string().starts_with("unreachable pose: the tool gets no nearer to (1.400, 0.000, 0.200) m")
    );
    let inside = ik().solve(&START, &down(0.0, 0.0, 0.1, 0.0)).expect_err("inside the base");
    assert!(inside.distance > 0.01 || inside.angle > 0.1, "{inside}");
}

#[test]
fn the_whole_table_in_front_of_the_arm_is_reachable() {
    let ik = ik();
    for ix in 0..5 {
        for iy in 0..7 {
            for (height, yaw) in [(0.02, 0.0), (0.02, 0.5), (0.25, -0.5)] {
                let (x, y) = (0.35 + 0.1 * f64::from(ix), -0.35 + 0.35 * f64::from(iy) / 3.0);
                let found = ik.solve(&START, &down(x, y, height, yaw));
                assert!(found.is_ok() || x.hypot(y) > 0.72, "({x}, {y}, {height}): {}", found.unwrap_err());
            }
        }
    }
}

#[test]
fn poses_that_joints_within_limits_give_are_found() {
    let ik = ik();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..2000 {
        let q: ArmAngles = std::array::from_fn(|i| {
            let link = &ik.chain.links[i];
            rng.random_range(link.lower..link.upper)
        });
        let target = ik.tool_pose(&q);
        let found = ik.solve(&START, &target).unwrap_or_else(|missed| panic!("{q:?}: {missed}"));
        assert!(ik.residual(&found.into(), &target).is_reached());
        assert!(found.iter().zip(&ik.chain.links).all(|(q, link)| (link.lower..=link.upper).contains(q)));
    }
}
