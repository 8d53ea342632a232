//! SoftVTBench's files: absolute poses in the frame of the robot's base.
//!
//! Its actions are the pose *measured* when the action was taken, the finger's position and, in the longer form, the forces on
//! both fingers (core/recorders/recorders.py); quaternions are w x y z.

use super::{
    super::{DatasetError, TaskFile},
    ForeignDemo, ForeignObjectPose, InitialCondition,
    header::Header,
    pose_of,
    rows::{if_there, numbers, rows, wrong},
    tool_pose,
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    policy::{Action, ToolCommand, profile::GripperEncoding},
    robot::rotation,
};

/// The key of the recorded poses.
const POSES: &str = "obs/eef_pose";
const JOINTS: &str = "obs/arm_joint_pos";
/// How far the recorded tool may be from ours, m: its frame may lie a little further out.
const NEAR: f64 = 0.03;
/// The gap in the middle between two orders of a quaternion's numbers that tells them apart, rad.
const TOLD_APART: f64 = 0.3;
/// How far actions may be from the recorded poses in the middle over all steps: m, and rad.
const LEADING: (f64, f64) = (0.1, 0.6);
/// A robot that is turned by more than this does not look at its table, rad.
const BACKWARDS: f64 = 2.8;
/// A finger that is pressed by more than this holds something, N.
const PRESSED: f64 = 0.1;
/// Fingers count as measured, not commanded, if they are as near as this to the observed ones in every step, m.
const MEASURED: f64 = 1e-4;
/// Positions of a finger, m, with some slack, and its two codes.
const FINGER: [f64; 2] = [-0.001, 0.045];
const FINGERS: GripperEncoding = GripperEncoding { open: 0.04, shut: 0.0, binary: false };
const SIGN: GripperEncoding = GripperEncoding { open: 1.0, shut: -1.0, binary: true };

/// An action: seven numbers, and whether both fingers are pressed, if that is there.
struct Row {
    numbers: [f64; 7],
    pressed: bool,
}

/// A demonstration of such a file.
///
/// # Errors
/// Something is missing, or is not as expected.
pub(super) fn demo(file: &TaskFile, header: &Header, demo: usize) -> Result<ForeignDemo, DatasetError> {
    let actions = actions(file, demo)?;
    let poses = poses(file, demo, &actions)?;
    let joints =
        file.has(demo, JOINTS).then(|| tool_pose::joints(file, demo, JOINTS, actions.len())).transpose()?;
    let at_t = joints.as_ref().map_or(Ok(Vec3::zeros()), |joints| offset(file, demo, &poses, joints))?;
    check_lead(file, demo, &actions, &poses)?;
    let grip = gripper(file, demo, &actions)?;
    let measured = are_measured(file, demo, &actions)?;
    let command = |row: &Row| {
        let [x, y, z, a, b, c, finger] = row.numbers;
        let axis_angle_b = Vec3::new(a, b, c);
        let position_b = Vec3::new(x, y, z) - rotation::from_axis_angle(&axis_angle_b) * at_t;
        ToolCommand::Pose(Action { position_b, axis_angle_b, closure: grip.closure(finger) })
    };
    let start = start(file, demo)?;
    Ok(ForeignDemo {
        name: format!("demo_{demo}"),
        task: header.task(file, demo),
        shut: actions.iter().map(|row| row.pressed || grip.closure(row.numbers[6]) > 0.5).collect(),
        held: actions.iter().map(|row| measured && row.pressed).collect(),
        commands: actions.iter().map(command).collect(),
        begins: InitialCondition::OtherSimulator {
            joints: start.or(joints.map(|all| all[0])).map(tool_pose::within_limits),
            things: things(file, demo)?,
        },
        said: "absolute poses and the fingers' positions",
    })
}

/// Joint angles of the arm at the start, if the file has them.
///
/// # Errors
/// They are none of a Panda: seven, with or without both fingers.
fn start(file: &TaskFile, demo: usize) -> Result<Option<[f64; 7]>, DatasetError> {
    const KEY: &str = "initial_state/articulation/robot/joint_position";
    if !file.has(demo, KEY) {
        return Ok(None);
    }
    let (all, shape) = numbers(file, demo, KEY)?;
    let arm: Option<[f64; 7]> = all.get(..7).and_then(|seven| seven.try_into().ok());
    match (arm, shape.last()) {
        (Some(arm), Some(7 | 9)) => {
            tool_pose::by_joints(file, demo, KEY, &[arm])?;
            Ok(Some(arm))
        }
        _ => {
            let what = format!(
                "expected 7 joint angles of a Panda, or 9 with both fingers, got the shape {shape:?}: is it another robot?"
            );
            Err(wrong(file, demo, KEY, what))
        }
    }
}

fn actions(file: &TaskFile, demo: usize) -> Result<Vec<Row>, DatasetError> {
    const KEY: &str = "actions";
    if file.shape(demo, KEY)?.get(1) == Some(&7) {
        let all = rows::<7>(file, demo, KEY, None)?;
        return Ok(all.into_iter().map(|numbers| Row { numbers, pressed: false }).collect());
    }
    let all = rows::<13>(file, demo, KEY, None)?;
    let pressed = |force: &[f64]| Vec3::from_column_slice(force).norm() > PRESSED;
    let row = |row: &[f64; 13]| Row {
        numbers: std::array::from_fn(|i| row[i]),
        pressed: pressed(&row[7..10]) && pressed(&row[10..]),
    };
    Ok(all.iter().map(row).collect())
}

/// The recorded poses of the tool.
///
/// # Errors
/// The quaternions are none, or of another order.
fn poses(file: &TaskFile, demo: usize, actions: &[Row]) -> Result<Vec<Pose>, DatasetError> {
    let all = rows::<7>(file, demo, POSES, Some(actions.len()))?;
    let length = |row: &[f64; 7]| row[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
    if let Some(step) = all.iter().position(|row| (length(row) - 1.0).abs() > 1e-2) {
        let what = format!("step {step}: no quaternion w x y z of length 1: {:?}", &all[step][3..]);
        return Err(wrong(file, demo, POSES, what));
    }
    let order = |[w, x, y, z]: [usize; 4]| -> Vec<Quat> {
        let q = |row: &[f64; 7]| nalgebra::Quaternion::new(row[3 + w], row[3 + x], row[3 + y], row[3 + z]);
        all.iter().map(|row| Quat::new_normalize(q(row))).collect()
    };
    let commanded = |row: &Row| {
        let [_, _, _, a, b, c, _] = row.numbers;
        rotation::from_axis_angle(&Vec3::new(a, b, c))
    };
    let commanded: Vec<Quat> = actions.iter().map(commanded).collect();
    let apart = [[0, 1, 2, 3], [3, 0, 1, 2]].map(|places| tool_pose::mean_angle(&order(places), &commanded));
    if apart[1] + TOLD_APART < apart[0] {
        let what = format!(
            "its quaternions are of the order x y z w: {:.0}° from the actions' rotations as w x y z, {:.0}° as x y z w; expected w x \
             y z",
            apart[0].to_degrees(),
            apart[1].to_degrees()
        );
        return Err(wrong(file, demo, POSES, what));
    }
    let pose = |(row, rotation): (&[f64; 7], Quat)| {
        Pose::from_parts(Vec3::new(row[0], row[1], row[2]).into(), rotation)
    };
    Ok(all.iter().zip(order([0, 1, 2, 3])).map(pose).collect())
}

/// Actions lead the tool, but not far.
///
/// # Errors
/// They are of another frame or unit, or no poses.
fn check_lead(file: &TaskFile, demo: usize, actions: &[Row], poses: &[Pose]) -> Result<(), DatasetError> {
    let apart = |(row, pose): (&Row, &Pose)| {
        let [x, y, z, a, b, c, _] = row.numbers;
        let turn = rotation::from_axis_angle(&Vec3::new(a, b, c));
        [(Vec3::new(x, y, z) - pose.translation.vector).norm(), turn.angle_to(&pose.rotation)]
    };
    let sums =
        actions.iter().zip(poses).map(apart).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    let [away, turned] = sums.map(|sum| sum / poses.len() as f64);
    if away <= LEADING.0 && turned <= LEADING.1 {
        return Ok(());
    }
    let what = format!(
        "{:.0} mm and {:.0}° from {POSES} in the middle over all steps: expected absolute poses in the frame of the robot's base, m and \
         rad (axis-angle)",
        1e3 * away,
        turned.to_degrees()
    );
    Err(wrong(file, demo, "actions", what))
}

/// Where the recorded tool is in ours, m.
///
/// # Errors
/// Too far off, or not always the same: another robot or frame.
fn offset(file: &TaskFile, demo: usize, poses: &[Pose], joints: &[[f64; 7]]) -> Result<Vec3, DatasetError> {
    let by_joints = tool_pose::by_joints(file, demo, JOINTS, joints)?;
    let at_t = tool_pose::compare(file, demo, (POSES, poses), &by_joints)?;
    if at_t.norm() > NEAR {
        let what = format!(
            "{:.0} mm from where {JOINTS} puts the tool: expected poses in the frame of the robot's base",
            1e3 * at_t.norm()
        );
        return Err(wrong(file, demo, POSES, what));
    }
    Ok(at_t)
}

/// How the gripper's number is coded: a finger's position, or 1 open and -1 shut.
///
/// # Errors
/// Neither.
fn gripper(file: &TaskFile, demo: usize, actions: &[Row]) -> Result<GripperEncoding, DatasetError> {
    let number = |row: &Row| row.numbers[6];
    let within = |low: f64, high: f64| actions.iter().map(number).all(|x| (low..=high).contains(&x));
    if within(FINGER[0], FINGER[1]) {
        return Ok(FINGERS);
    }
    if actions.iter().map(number).all(|x| x.abs() == 1.0) {
        return Ok(SIGN);
    }
    let odd = |row: &Row| !(FINGER[0]..=FINGER[1]).contains(&number(row));
    let step = actions.iter().position(odd).unwrap_or_default();
    let what = format!(
        "step {step}, number 6: {}, expected a finger's position of 0 (shut) to 0.04 m, or 1 (open) and -1 (shut) alone",
        number(&actions[step])
    );
    Err(wrong(file, demo, "actions", what))
}

/// Whether the fingers of the actions are those that were measured.
fn are_measured(file: &TaskFile, demo: usize, actions: &[Row]) -> Result<bool, DatasetError> {
    let Some(fingers) = if_there::<2>(file, demo, "obs/gripper_pos", actions.len())? else {
        return Ok(false);
    };
    Ok(actions.iter().zip(fingers).all(|(row, fingers)| (row.numbers[6] - fingers[0]).abs() < MEASURED))
}

/// What stands around at the start: `initial_state`, or the first of `states`.
fn things(file: &TaskFile, demo: usize) -> Result<Vec<ForeignObjectPose>, DatasetError> {
    let first = |name: &str| file.has(demo, name).then(|| numbers(file, demo, name)).transpose();
    let pose = |folder: &str, name: &str| -> Result<Option<Pose>, DatasetError> {
        for last in ["root_pose", "root_pose_w"] {
            let key = format!("{folder}/{name}/{last}");
            let Some((all, shape)) = first(&key)? else { continue };
            let length = all.get(3..7).map(|q| q.iter().map(|x| x * x).sum::<f64>().sqrt());
            if shape.last() != Some(&7) || !length.is_some_and(|length| (length - 1.0).abs() < 1e-2) {
                let what = format!(
                    "expected a place (m) and a quaternion w x y z of length 1, got the shape {shape:?}"
                );
                return Err(wrong(file, demo, &key, what));
            }
            return Ok(all.get(..7).and_then(pose_of));
        }
        Ok(None)
    };
    for root in ["initial_state", "states"] {
        let mut things = Vec::new();
        let base = pose(&format!("{root}/articulation"), "robot")?;
        if base.is_some_and(|base| base.rotation.angle() > BACKWARDS) {
            let what = "the robot stands turned by half a turn or on its head: are its quaternions of another order than w x y z?";
            return Err(wrong(file, demo, &format!("{root}/articulation/robot"), what.to_owned()));
        }
        let seen = |pose_w: Pose| base.map_or(pose_w, |base| base.inverse() * pose_w);
        for kind in ["rigid_object", "articulation"] {
            let folder = format!("{root}/{kind}");
            for name in file.groups(demo, &folder).into_iter().filter(|name| name != "robot") {
                let Some(pose_w) = pose(&folder, &name)? else { continue };
                things.push(ForeignObjectPose {
                    name,
                    pose: seen(pose_w),
                    in_base: base.is_some(),
                    soft: false,
                });
            }
        }
        let folder = format!("{root}/deformable_object");
        for name in file.groups(demo, &folder) {
            let nodes =
                ["nodal_position", "nodal_pos_w"].map(|last| first(&format!("{folder}/{name}/{last}")));
            let Some((all, shape)) = nodes.into_iter().find_map(Result::transpose).transpose()? else {
                continue;
            };
            // One step of them: all but the first axis.
            let count = shape.iter().skip(usize::from(shape.len() > 2)).product::<usize>().min(all.len());
            let nodes = all[..count].as_chunks::<3>().0;
            let centre = nodes.iter().map(|x| Vec3::from(*x)).sum::<Vec3>() / nodes.len().max(1) as f64;
            let pose = seen(Pose::translation(centre.x, centre.y, centre.z));
            things.push(ForeignObjectPose { name, pose, in_base: base.is_some(), soft: true });
        }
        if !things.is_empty() {
            return Ok(things);
        }
    }
    Ok(Vec::new())
}
