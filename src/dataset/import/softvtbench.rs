//! SoftVTBench's files: absolute poses in the robot's base frame.
//!
//! An action is the pose *measured* when the action was taken, the finger position and, in the longer form, the
//! forces on both fingers (core/recorders/recorders.py). Quaternions are w x y z.

use super::{
    super::{DatasetError, FloatArray},
    demo_reader::{DemoReader, is_unit, pose_from_row},
    foreign::{ForeignDemo, ForeignObjectPose, InitialCondition},
    header::Header,
    tool_pose::{self, RecordedPoses},
};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_policy::{
    Action, ToolCommand,
    profile::{GripCode, GripperValues},
    stream_paths::{FINGERS, JOINTS, POSES},
};
use softvt_robot::rotation;

/// Largest distance of the recorded tool point from ours, m: its frame may be slightly farther out.
const MAX_TOOL_OFFSET: f64 = 0.03;
/// Largest mean distance of actions from the recorded poses, m and rad.
const MAX_LEAD_M: f64 = 0.1;
const MAX_LEAD_RAD: f64 = 0.6;
/// Largest plausible rotation of the robot's base, rad; more indicates another quaternion order.
const MAX_BASE_ROTATION: f64 = 2.8;
/// Force above which a finger counts as pressed, N.
const MIN_HOLD_FORCE: f64 = 0.1;
/// Largest difference, in every step, between finger positions of actions and of observations for the actions to
/// count as measured, m.
const MEASURED_TOLERANCE: f64 = 1e-4;
/// Range of finger positions, m, with some slack.
const FINGER_RANGE: [f64; 2] = [-0.001, 0.045];
/// The two encodings of the gripper in actions.
const FINGER_POSITION: GripperValues = GripperValues::new(0.04, 0.0);
const SIGN: GripperValues = GripperValues { code: GripCode::Binary, ..GripperValues::new(1.0, -1.0) };

struct SoftvtbenchAction {
    position_b: Vec3,
    axis_angle_b: Vec3,
    /// Position of a finger (m), or 1 open and -1 closed.
    gripper: f64,
    /// True if forces are recorded and both fingers are pressed.
    is_pressed: bool,
}

impl SoftvtbenchAction {
    fn new(row: &[f64], is_pressed: bool) -> Self {
        let [position_b, axis_angle_b] = [&row[..3], &row[3..6]].map(Vec3::from_column_slice);
        Self { position_b, axis_angle_b, gripper: row[6], is_pressed }
    }

    fn rotation(&self) -> Quat {
        rotation::from_axis_angle(&self.axis_angle_b)
    }
}

pub(super) fn demo(reader: DemoReader, header: &Header) -> Result<ForeignDemo, DatasetError> {
    let actions = actions(reader)?;
    let poses = poses(reader, &actions)?;
    let joints =
        reader.has(JOINTS).then(|| tool_pose::joint_angles(reader, JOINTS, actions.len())).transpose()?;
    let offset_t = joints.as_ref().map_or(Ok(Vec3::zeros()), |joints| tool_offset(reader, &poses, joints))?;
    check_lead(reader, &actions, &poses.poses)?;
    let gripper = gripper_encoding(reader, &actions)?;
    let is_measured = fingers_are_measured(reader, &actions)?;
    let command = |action: &SoftvtbenchAction| {
        let position_b = action.position_b - action.rotation() * offset_t;
        let closure = gripper.closure(action.gripper).clamp(0.0, 1.0);
        ToolCommand::from(Action::new(position_b, action.axis_angle_b, closure))
    };
    let start = initial_joints(reader)?;
    Ok(ForeignDemo {
        name: format!("demo_{}", reader.demo),
        task: header.task(reader.file, reader.demo),
        gripper_closed: actions.iter().map(|a| a.is_pressed || gripper.closure(a.gripper) > 0.5).collect(),
        is_stopped_by_object: actions.iter().map(|action| is_measured && action.is_pressed).collect(),
        commands: actions.iter().map(command).collect(),
        initial_condition: InitialCondition::OtherSimulator {
            joints: start.or(joints.map(|all| all[0])).map(tool_pose::clamp_to_limits),
            objects: match objects_of(reader, "initial_state")? {
                none if none.is_empty() => objects_of(reader, "states")?,
                objects => objects,
            },
        },
        command_source: "absolute poses and the fingers' positions",
    })
}

/// Joint angles of the arm at the start, if they are recorded.
fn initial_joints(reader: DemoReader) -> Result<Option<[f64; 7]>, DatasetError> {
    const KEY: &str = "initial_state/articulation/robot/joint_position";
    if !reader.has(KEY) {
        return Ok(None);
    }
    let FloatArray { values, shape } = reader.array(KEY)?;
    let arm: Option<[f64; 7]> = values.get(..7).and_then(|seven| seven.try_into().ok());
    match (arm, shape.last()) {
        (Some(arm), Some(7 | 9)) => {
            tool_pose::forward_kinematics(reader, KEY, &[arm])?;
            Ok(Some(arm))
        }
        _ => {
            let what = format!(
                "expected 7 joint angles of a Panda, or 9 with both fingers, got the shape {shape:?}: is it another robot?"
            );
            Err(reader.error(KEY, what))
        }
    }
}

fn actions(reader: DemoReader) -> Result<Vec<SoftvtbenchAction>, DatasetError> {
    const KEY: &str = "actions";
    if reader.shape(KEY)?.get(1) == Some(&7) {
        let rows = reader.rows::<7>(KEY, None)?;
        return Ok(rows.iter().map(|row| SoftvtbenchAction::new(row, false)).collect());
    }
    let is_pressed = |force: &[f64]| Vec3::from_column_slice(force).norm() > MIN_HOLD_FORCE;
    let rows = reader.rows::<13>(KEY, None)?;
    let action =
        |row: &[f64; 13]| SoftvtbenchAction::new(row, is_pressed(&row[7..10]) && is_pressed(&row[10..]));
    Ok(rows.iter().map(action).collect())
}

fn poses(reader: DemoReader, actions: &[SoftvtbenchAction]) -> Result<RecordedPoses, DatasetError> {
    let rows = reader.rows::<7>(POSES, Some(actions.len()))?;
    if let Some(step) = rows.iter().position(|row| !is_unit(&row[3..])) {
        let what = format!("step {step}: not a unit quaternion w x y z: {:?}", &rows[step][3..]);
        return Err(reader.error(POSES, what));
    }
    Ok(RecordedPoses { name: POSES, poses: rows.iter().filter_map(|row| pose_from_row(row)).collect() })
}

/// Checks that actions are near the recorded poses: they lead the tool, but not far.
fn check_lead(reader: DemoReader, actions: &[SoftvtbenchAction], poses: &[Pose]) -> Result<(), DatasetError> {
    let (mut distance, mut angle) = (0.0, 0.0);
    for (action, pose) in actions.iter().zip(poses) {
        distance += (action.position_b - pose.translation.vector).norm();
        angle += action.rotation().angle_to(&pose.rotation);
    }
    let (distance, angle) = (distance / poses.len() as f64, angle / poses.len() as f64);
    if distance <= MAX_LEAD_M && angle <= MAX_LEAD_RAD {
        return Ok(());
    }
    let what = format!(
        "on average {:.0} mm and {:.0}° from {POSES}: expected absolute poses in the robot's base frame, m and rad (axis-angle)",
        1e3 * distance,
        angle.to_degrees()
    );
    Err(reader.error("actions", what))
}

/// Position of the recorded tool point in our tool frame, m.
fn tool_offset(reader: DemoReader, poses: &RecordedPoses, joints: &[[f64; 7]]) -> Result<Vec3, DatasetError> {
    let from_joints = tool_pose::forward_kinematics(reader, JOINTS, joints)?;
    let offset_t = tool_pose::tool_offset(reader, poses, &from_joints)?;
    if offset_t.norm() > MAX_TOOL_OFFSET {
        let what = format!(
            "{:.0} mm from where {JOINTS} puts the tool: expected poses in the robot's base frame",
            1e3 * offset_t.norm()
        );
        return Err(reader.error(POSES, what));
    }
    Ok(offset_t)
}

/// Encoding of the gripper: a finger position, or 1 open and -1 closed.
fn gripper_encoding(
    reader: DemoReader,
    actions: &[SoftvtbenchAction],
) -> Result<GripperValues, DatasetError> {
    let is_position = |x: f64| (FINGER_RANGE[0]..=FINGER_RANGE[1]).contains(&x);
    let Some(step) = actions.iter().position(|action| !is_position(action.gripper)) else {
        return Ok(FINGER_POSITION);
    };
    if actions.iter().all(|action| action.gripper.abs() == 1.0) {
        return Ok(SIGN);
    }
    let what = format!(
        "step {step}, number 6: {}, expected a finger's position of 0 (closed) to 0.04 m, or only 1 (open) and -1 (closed)",
        actions[step].gripper
    );
    Err(reader.error("actions", what))
}

/// True if the finger positions in the actions are the measured ones.
fn fingers_are_measured(reader: DemoReader, actions: &[SoftvtbenchAction]) -> Result<bool, DatasetError> {
    let fingers = reader.rows_if_present::<2>(FINGERS, actions.len())?;
    let is_measured =
        |action: &SoftvtbenchAction, finger: f64| (action.gripper - finger).abs() < MEASURED_TOLERANCE;
    Ok(fingers
        .is_some_and(|fingers| actions.iter().zip(fingers).all(|(a, finger)| is_measured(a, finger[0]))))
}

/// First recorded poses of the objects below a group.
fn objects_of(reader: DemoReader, root: &str) -> Result<Vec<ForeignObjectPose>, DatasetError> {
    let base_w = root_pose(reader, &format!("{root}/articulation/robot"))?;
    if base_w.is_some_and(|base| base.rotation.angle() > MAX_BASE_ROTATION) {
        let what = "the robot's base is rotated by half a turn or upside down: are its quaternions in another order than w x y z?";
        return Err(reader.error(&format!("{root}/articulation/robot"), what));
    }
    let object = |name: String, pose_w: Pose, is_soft: bool| ForeignObjectPose {
        name,
        pose: base_w.map_or(pose_w, |base| base.inverse() * pose_w),
        in_base: base_w.is_some(),
        is_soft,
    };
    let mut objects = Vec::new();
    for kind in ["rigid_object", "articulation"] {
        let group = format!("{root}/{kind}");
        for name in reader.file.groups(reader.demo, &group).into_iter().filter(|name| name != "robot") {
            if let Some(pose_w) = root_pose(reader, &format!("{group}/{name}"))? {
                objects.push(object(name, pose_w, false));
            }
        }
    }
    let group = format!("{root}/deformable_object");
    for name in reader.file.groups(reader.demo, &group) {
        let key = ["nodal_position", "nodal_pos_w"].map(|last| format!("{group}/{name}/{last}"));
        let Some(key) = key.iter().find(|key| reader.has(key)) else { continue };
        let FloatArray { values, shape } = reader.array(key)?;
        // The nodes of the first step: all axes but the first, if there are three.
        let count = shape.iter().skip(usize::from(shape.len() > 2)).product::<usize>().min(values.len());
        let nodes = values[..count].as_chunks::<3>().0;
        let centre = nodes.iter().map(|x| Vec3::from(*x)).sum::<Vec3>() / nodes.len().max(1) as f64;
        objects.push(object(name, Pose::translation(centre.x, centre.y, centre.z), true));
    }
    Ok(objects)
}

/// First pose of the object whose group is `group`, if one is recorded.
fn root_pose(reader: DemoReader, group: &str) -> Result<Option<Pose>, DatasetError> {
    let keys = ["root_pose", "root_pose_w"].map(|last| format!("{group}/{last}"));
    let Some(key) = keys.iter().find(|key| reader.has(key)) else { return Ok(None) };
    let FloatArray { values, shape } = reader.array(key)?;
    if shape.last() != Some(&7) || !values.get(3..7).is_some_and(is_unit) {
        let what = format!("expected a position (m) and a unit quaternion w x y z, got the shape {shape:?}");
        return Err(reader.error(key, what));
    }
    Ok(values.get(..7).and_then(pose_from_row))
}
