//! Consistency of recorded tool poses with joint angles, whose forward kinematics need no agreed frame.

use super::{super::DatasetError, demo_reader::DemoReader};
use softvt_benchmark::CONTROL_DT;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_robot::{
    IkSpec,
    ik::{ArmAngles, DiffIk},
    panda,
};

/// Tolerance of the joint limits, rad: simulators exceed them slightly.
const LIMIT_TOLERANCE: f64 = 0.05;
/// Largest deviation of two records of the tool after their constant offset is removed, m and rad.
const MAX_SPREAD_M: f64 = 0.02;
const MAX_SPREAD_RAD: f64 = 0.1;
/// Largest angle between the pointing directions of the recorded tool and of ours, rad.
const MAX_TILT: f64 = 0.2;
/// Largest rotation about the pointing direction, rad. Hand frames differ by a quarter turn; a quaternion in the
/// wrong order is half a turn off where the hand points down.
const MAX_SPIN: f64 = 2.5;
/// Initial joint angles of robosuite's Panda, rad (robots/panda_robot.py), and the largest tilt of a
/// first pose from there.
const HOME: ArmAngles = [0.0, 0.196, 0.0, -2.618, 0.0, 2.942, 0.785];
const MAX_TILT_FROM_HOME: f64 = 1.0;

/// Poses recorded under a key, which error messages name.
pub(super) struct RecordedPoses {
    pub name: &'static str,
    pub poses: Vec<Pose>,
}

/// Joint angles of the arm per step, rad.
pub(super) fn joint_angles(
    reader: DemoReader,
    name: &str,
    steps: usize,
) -> Result<Vec<ArmAngles>, DatasetError> {
    match reader.shape(name)?[..] {
        [_, joints] if joints != 7 => {
            let what = format!("{joints} joints per step; a Panda has 7: is it another robot?");
            Err(reader.error(name, what))
        }
        _ => reader.rows::<7>(name, Some(steps)),
    }
}

/// Tool poses in the base frame for joint angles recorded under `name`.
pub(super) fn forward_kinematics(
    reader: DemoReader,
    name: &str,
    joints: &[ArmAngles],
) -> Result<Vec<Pose>, DatasetError> {
    let links = panda::arm_chain().links;
    for (step, q) in joints.iter().enumerate() {
        let is_outside = |(i, q): (usize, &f64)| {
            *q < links[i].lower - LIMIT_TOLERANCE || *q > links[i].upper + LIMIT_TOLERANCE
        };
        if let Some(i) = q.iter().enumerate().position(is_outside) {
            let what = format!(
                "step {step}: joint {} is at {} rad, outside of a Panda's {}..{}; is it another robot?",
                i + 1,
                q[i],
                links[i].lower,
                links[i].upper
            );
            return Err(reader.error(name, what));
        }
    }
    let start = joints.first().copied().unwrap_or_default();
    let arm = DiffIk::new(&IkSpec::default(), start, CONTROL_DT);
    Ok(joints.iter().map(|q| arm.tool_pose(q)).collect())
}

pub(super) fn clamp_to_limits(mut q: ArmAngles) -> ArmAngles {
    for (q, link) in q.iter_mut().zip(panda::arm_chain().links) {
        *q = q.clamp(link.lower, link.upper);
    }
    q
}

/// Compares recorded poses with those of the joint angles, up to a constant offset of base and tool.
///
/// Returns the mean position of the recorded point in our tool frame, m.
pub(super) fn tool_offset(
    reader: DemoReader,
    recorded: &RecordedPoses,
    from_joints: &[Pose],
) -> Result<Vec3, DatasetError> {
    let pairs = || recorded.poses.iter().zip(from_joints);
    let count = recorded.poses.len() as f64;
    let mean = |of: &dyn Fn(&Pose, &Pose) -> Vec3| pairs().map(|(r, j)| of(r, j)).sum::<Vec3>() / count;
    let shift = |r: &Pose, j: &Pose| r.translation.vector - j.translation.vector;
    let rotation = |r: &Pose, j: &Pose| j.rotation.inverse() * r.rotation;
    let mean_shift = mean(&shift);
    let first_rotation = rotation(&recorded.poses[0], &from_joints[0]);
    if let Some(what) =
        wrong_hand_orientation(&first_rotation, MAX_TILT, "where the joint angles have the tool")
    {
        return Err(reader.error(recorded.name, what));
    }
    for (step, (r, j)) in pairs().enumerate() {
        let distance = (shift(r, j) - mean_shift).norm();
        let angle = rotation(r, j).angle_to(&first_rotation);
        if distance > MAX_SPREAD_M || angle > MAX_SPREAD_RAD {
            let what = format!(
                "step {step}: not where the joint angles put the tool: the offset differs from that of the other steps by {:.0} mm \
                 and {:.0}°: another robot, or another order of the quaternion's numbers?",
                1e3 * distance,
                angle.to_degrees()
            );
            return Err(reader.error(recorded.name, what));
        }
    }
    Ok(mean(&|r, j| j.rotation.inverse() * shift(r, j)))
}

/// Message about a hand that is rotated by `rotation` from `expected`, if that is more than two frames of one hand
/// can differ: they differ by a rotation about the pointing direction, but not by half a turn.
fn wrong_hand_orientation(rotation: &Quat, max_tilt: f64, expected: &str) -> Option<String> {
    let tilt = (rotation * Vec3::z()).angle(&Vec3::z());
    let spin = 2.0 * rotation.k.atan2(rotation.w).rem_euclid(std::f64::consts::PI);
    let spin = spin.min(2.0 * std::f64::consts::PI - spin);
    (tilt > max_tilt || spin > MAX_SPIN).then(|| {
        format!(
            "step 0: the hand points {:.0}° away from {expected} and is rotated by {:.0}° about that direction: another order of \
             the quaternion's numbers, or another robot?",
            tilt.to_degrees(),
            spin.to_degrees()
        )
    })
}

/// Compares the first recorded pose with a usual initial pose; used where there are no joint angles.
pub(super) fn check_first_pose(reader: DemoReader, recorded: &RecordedPoses) -> Result<(), DatasetError> {
    let home = DiffIk::new(&IkSpec::default(), HOME, CONTROL_DT).tool_pose(&HOME);
    let rotation = home.rotation.inverse() * recorded.poses[0].rotation;
    wrong_hand_orientation(&rotation, MAX_TILT_FROM_HOME, "the usual initial pose")
        .map_or(Ok(()), |what| Err(reader.error(recorded.name, what)))
}
