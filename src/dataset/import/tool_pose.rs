//! Where the tool was: from joint angles by the arm's own kinematics, which need no frame of anybody's, and from recorded poses.

use super::{
    super::{DatasetError, TaskFile},
    rows::{rows, wrong},
};
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::{Pose, Quat, Vec3},
    robot::{
        IkSpec,
        ik::{ArmAngles, DiffIk},
        panda,
    },
};

/// How far a joint may be beyond its limit, rad: simulators let them.
const BEYOND: f64 = 0.05;
/// How far the spread of two records of the tool may be, m and rad, once what is constant between them is taken off.
const APART: (f64, f64) = (0.02, 0.1);

/// How far a recorded tool may point away from ours, rad.
const ASIDE: f64 = 0.2;
/// How far it may be turned about the line along which it points, rad: hands are drawn in frames a quarter turn apart, and a
/// quaternion in another order is half a turn away where the hand points down.
const SPUN: f64 = 2.5;
/// Where an arm begins, rad: robosuite's Panda (robots/panda_robot.py), and how far its tool may point away from there, rad.
const HOME: ArmAngles = [0.0, 0.196, 0.0, -2.618, 0.0, 2.942, 0.785];
const FROM_HOME: f64 = 1.0;

/// Joint angles of an arm in each of so many steps, rad.
///
/// # Errors
/// They are not there, or not seven a step.
pub(super) fn joints(
    file: &TaskFile,
    demo: usize,
    name: &str,
    steps: usize,
) -> Result<Vec<ArmAngles>, DatasetError> {
    match file.shape(demo, name)?[..] {
        [_, joints] if joints != 7 => {
            let what = format!("{joints} joints a step; a Panda has 7: is it another robot?");
            Err(wrong(file, demo, name, what))
        }
        _ => rows::<7>(file, demo, name, Some(steps)),
    }
}

/// Tool poses in the base frame by joint angles.
///
/// # Errors
/// Angles that no Panda can have.
pub(super) fn by_joints(
    file: &TaskFile,
    demo: usize,
    name: &str,
    joints: &[ArmAngles],
) -> Result<Vec<Pose>, DatasetError> {
    let links = panda::arm_chain().links;
    for (step, q) in joints.iter().enumerate() {
        let beyond = |(i, q): (usize, &f64)| *q < links[i].lower - BEYOND || *q > links[i].upper + BEYOND;
        if let Some(i) = q.iter().enumerate().position(beyond) {
            let what = format!(
                "step {step}: joint {} is at {} rad, outside of a Panda's {}..{}; is it another robot?",
                i + 1,
                q[i],
                links[i].lower,
                links[i].upper
            );
            return Err(wrong(file, demo, name, what));
        }
    }
    let start = joints.first().copied().unwrap_or_default();
    let arm = DiffIk::new(&IkSpec::default(), start, CONTROL_DT);
    Ok(joints.iter().map(|q| arm.tool_pose(q)).collect())
}

/// Joint angles moved into the limits that they may be a little beyond of.
pub(super) fn within_limits(mut q: ArmAngles) -> ArmAngles {
    for (q, link) in q.iter_mut().zip(panda::arm_chain().links) {
        *q = q.clamp(link.lower, link.upper);
    }
    q
}

/// Compares recorded poses with those of the joints, which may differ by a constant place of the base and of the tool; the place
/// of what was recorded in the tool's frame, m, in the middle over all steps.
///
/// # Errors
/// They differ by more: another robot, another order of the quaternion's numbers, or steps that do not belong together.
pub(super) fn compare(
    file: &TaskFile,
    demo: usize,
    (name, recorded): (&str, &[Pose]),
    by_joints: &[Pose],
) -> Result<Vec3, DatasetError> {
    let pairs = || recorded.iter().zip(by_joints);
    let count = recorded.len() as f64;
    let mean = |of: &dyn Fn(&Pose, &Pose) -> Vec3| pairs().map(|(r, j)| of(r, j)).sum::<Vec3>() / count;
    let shift = |r: &Pose, j: &Pose| r.translation.vector - j.translation.vector;
    let turn = |r: &Pose, j: &Pose| j.rotation.inverse() * r.rotation;
    let (middle, first) = (mean(&shift), turn(&recorded[0], &by_joints[0]));
    if let Some(what) = of_another_hand(&first, ASIDE, "where the joint angles have the tool") {
        return Err(wrong(file, demo, name, what));
    }
    let worst = pairs().enumerate().find_map(|(step, (r, j))| {
        let away = (shift(r, j) - middle).norm();
        let turned = turn(r, j).angle_to(&first);
        (away > APART.0 || turned > APART.1).then_some((step, away, turned))
    });
    if let Some((step, away, turned)) = worst {
        let what = format!(
            "step {step}: not where the joint angles put the tool, by {:.0} mm and {:.0}° beyond what is the same in all steps: \
             another robot, or another order of the quaternion's numbers?",
            1e3 * away,
            turned.to_degrees()
        );
        return Err(wrong(file, demo, name, what));
    }
    Ok(mean(&|r, j| j.rotation.inverse() * shift(r, j)))
}

/// What is wrong with a hand that is turned by `turn` from where it should be. Frames of one hand differ by a turn about the
/// line along which it points, but not by half a turn.
fn of_another_hand(turn: &Quat, aside: f64, from: &str) -> Option<String> {
    let away = (turn * Vec3::z()).angle(&Vec3::z());
    let spun = 2.0 * turn.k.atan2(turn.w).rem_euclid(std::f64::consts::PI);
    let spun = spun.min(2.0 * std::f64::consts::PI - spun);
    (away > aside || spun > SPUN).then(|| {
        format!(
            "step 0: it points {:.0}° away from {from} and is turned by {:.0}° about that line: another order of the quaternion's \
             numbers, or another robot?",
            away.to_degrees(),
            spun.to_degrees()
        )
    })
}

/// Compares the first recorded pose with where arms begin, for want of joint angles.
///
/// # Errors
/// The hand points elsewhere, or is turned by half a turn: another order of the quaternion's numbers.
pub(super) fn check_start(
    file: &TaskFile,
    demo: usize,
    (name, recorded): (&str, &Pose),
) -> Result<(), DatasetError> {
    let home = DiffIk::new(&IkSpec::default(), HOME, CONTROL_DT).tool_pose(&HOME);
    let turn = home.rotation.inverse() * recorded.rotation;
    of_another_hand(&turn, FROM_HOME, "where arms begin")
        .map_or(Ok(()), |what| Err(wrong(file, demo, name, what)))
}

/// How far apart two rotations are, rad, in the middle over all steps.
pub(super) fn mean_angle(a: &[Quat], b: &[Quat]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.angle_to(b)).sum::<f64>() / a.len().max(1) as f64
}
