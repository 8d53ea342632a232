//! Files of robomimic and LIBERO: relative steps for robosuite's operational-space controller.
//!
//! robosuite sets the controller's goal relative to the tool: `goal = tool + 0.05 m · action`; the rotation is
//! applied before the tool's orientation, about the axes of the base; without a rotation the last goal's orientation
//! stays (controllers/osc.py). Together with the recorded tool poses this gives the goals the controller tracked.
//! LIBERO stores observations *after* each action (scripts/create_dataset.py), robomimic before it; `states`, which
//! both store before it, tell them apart.

use super::{
    super::DatasetError,
    demo_reader::{DemoReader, is_unit},
    foreign::{ForeignDemo, InitialCondition},
    header::{Header, StepScale},
    mujoco::MujocoModel,
    tool_pose::{self, RecordedPoses},
};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_policy::{
    Action, EncodedGrip, ToolCommand, ToolMotion, decode, osc,
    profile::{ActionEncoding, PoseEncoding, Profile},
};
use softvt_robot::{GripTarget, ik::ArmAngles, rotation};

/// Tolerance of the range −1..1 of actions, for single precision.
const ACTION_TOLERANCE: f64 = 1e-5;
/// Distance from robosuite's grip site to our tool point, m. The site is 0.1065 + 0.097 m from the last joint
/// (robots/panda/robot.xml, grippers/panda_gripper.xml), the tool 0.107 + 0.1034 m.
const SITE_TO_TOOL: f64 = 0.0069;
/// Positions of LIBERO's robots, on the floor and on the table (envs/robots), world, m.
const BASES: [[f64; 3]; 2] = [[-0.6, 0.0, 0.0], [-0.66, 0.0, 0.912]];
/// Usual initial tool position in the base frame, and the largest distance from it for a base to be accepted, m.
const INITIAL_TOOL: [f64; 3] = [0.46, 0.0, 0.26];
const MAX_INITIAL_DISTANCE: f64 = 0.25;
/// Largest difference of corresponding joint angles in states and observations, rad: playback is not bitwise exact.
const SAME_JOINTS: f64 = 0.02;
const JOINT_KEYS: [&str; 2] = ["obs/joint_states", "obs/robot0_joint_pos"];

pub(super) fn demo(reader: DemoReader, header: &Header) -> Result<ForeignDemo, DatasetError> {
    let steps = relative_steps(reader, header)?;
    let model = model(reader)?;
    let states = states(reader, steps.len(), model.as_ref())?;
    let arm = arm_angles(reader, &states, steps.len())?;
    let recorded = tool_poses(reader, steps.len(), model.as_ref())?;
    let (commands, command_source) = match (&arm, &recorded) {
        (Some(arm), recorded) => {
            let observed = tool_pose::forward_kinematics(reader, arm.name, &arm.observed)?;
            if let Some(recorded) = recorded {
                tool_pose::tool_offset(reader, recorded, &observed)?;
            }
            let before = tool_pose::forward_kinematics(reader, arm.name, &arm.before)?;
            (goals(&before, &steps), "steps away from where the recorded joint angles put the tool")
        }
        (None, Some(recorded)) => {
            tool_pose::check_first_pose(reader, recorded)?;
            (goals(&delayed(&recorded.poses), &steps), "steps away from the recorded poses of the tool")
        }
        (None, None) => (
            steps.clone(),
            "steps away from where the tool is in softvt: the file has neither joints nor poses",
        ),
    };
    let objects = states.first().zip(model.as_ref()).and_then(|(state, model)| model.object_poses(state));
    Ok(ForeignDemo {
        name: format!("demo_{}", reader.demo),
        task: header.task(reader.file, reader.demo),
        gripper_closed: steps
            .iter()
            .map(|step| matches!(step.grip, EncodedGrip::Target(GripTarget::Closure(closure)) if closure > 0.5))
            .collect(),
        is_stopped_by_object: vec![false; commands.len()],
        commands,
        initial_condition: InitialCondition::OtherSimulator {
            joints: arm.map(|arm| tool_pose::clamp_to_limits(arm.before[0])),
            objects: objects.unwrap_or_default(),
        },
        command_source,
    })
}

/// MuJoCo model of the scene, if it is stored.
fn model(reader: DemoReader) -> Result<Option<MujocoModel>, DatasetError> {
    let xml = reader.file.text(reader.demo, "model_file");
    let Some(xml) = xml.ok().filter(|xml| !xml.trim().is_empty()) else { return Ok(None) };
    let what = "not a MuJoCo model: it has no body in a worldbody";
    MujocoModel::read(&xml).map(Some).ok_or_else(|| reader.error("attribute model_file", what))
}

/// MuJoCo states before each action. Empty if they are missing, or if their shape is unexpected and there is no model
/// to check it against: other programs store something else under this key.
fn states(
    reader: DemoReader,
    steps: usize,
    model: Option<&MujocoModel>,
) -> Result<Vec<Vec<f64>>, DatasetError> {
    const KEY: &str = "states";
    if !reader.has(KEY) {
        return Ok(Vec::new());
    }
    let array = reader.array(KEY)?;
    let width = array.width();
    let is_per_step = array.shape[..] == [steps, width];
    match model.map(MujocoModel::state_width) {
        Some(expected) if !is_per_step || width != expected => {
            let what = format!(
                "expected the shape ({steps}, {expected}), a state of model_file before each action, got {:?}",
                array.shape
            );
            Err(reader.error(KEY, what))
        }
        None if !is_per_step || width == 0 => Ok(Vec::new()),
        _ => Ok(array.values.chunks_exact(width).map(<[f64]>::to_vec).collect()),
    }
}

/// The actions, decoded as softvt's profile for LIBERO's policies does.
fn relative_steps(reader: DemoReader, header: &Header) -> Result<Vec<ToolCommand>, DatasetError> {
    let actions = reader.rows::<7>("actions", None)?;
    for (step, row) in actions.iter().enumerate() {
        if let Some(i) = row.iter().position(|x| x.abs() > 1.0 + ACTION_TOLERANCE) {
            let what = format!("step {step}, number {i}: {}, expected a fraction of a step in -1..1", row[i]);
            return Err(reader.error("actions", what));
        }
    }
    let StepScale { translation_m, rotation_rad } = header.step_scale(reader.file)?;
    let gripper = Profile::named("libero").map(|profile| profile.actions.gripper);
    let gripper = gripper.ok_or_else(|| reader.error("actions", "there is no profile that reads it"))?;
    let encoding = ActionEncoding::new(PoseEncoding::DeltaOsc { translation_m, rotation_rad }, gripper);
    let decode =
        |row: &[f64; 7]| decode::command(row, &encoding).map_err(|e| reader.error("actions", e.to_string()));
    actions.iter().map(decode).collect()
}

struct LiberoArm {
    /// Key of the observations.
    name: &'static str,
    observed: Vec<ArmAngles>,
    before: Vec<ArmAngles>,
}

fn arm_angles(
    reader: DemoReader,
    states: &[Vec<f64>],
    steps: usize,
) -> Result<Option<LiberoArm>, DatasetError> {
    let Some(name) = JOINT_KEYS.into_iter().find(|name| reader.has(name)) else { return Ok(None) };
    let observed = tool_pose::joint_angles(reader, name, steps)?;
    let before = match observed_after_action(states, &observed) {
        Some(true) => states.iter().map(|state| std::array::from_fn(|i| state[1 + i])).collect(),
        Some(false) => observed.clone(),
        None if name.contains("robot0") => observed.clone(),
        None => delayed(&observed),
    };
    Ok(Some(LiberoArm { name, observed, before }))
}

/// True if observations are from after each action, judged by the joints in robosuite's states (time, then positions,
/// the arm's first), which are from before it. `None` if the states are something else.
fn observed_after_action(states: &[Vec<f64>], observed: &[ArmAngles]) -> Option<bool> {
    if states.len() != observed.len() || states.first()?.len() < 8 {
        return None;
    }
    let difference = |(state, q): (&Vec<f64>, &ArmAngles)| -> f64 {
        state[1..8].iter().zip(q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let pairs = observed.len().saturating_sub(1).max(1) as f64;
    let before = states.iter().zip(observed).map(difference).sum::<f64>() / observed.len() as f64;
    let after = states[1..].iter().zip(observed).map(difference).sum::<f64>() / pairs;
    (before.min(after) < SAME_JOINTS).then_some(after < before)
}

/// Values from before each action, given those from after it. The first is repeated: the value before it is unknown.
fn delayed<T: Copy>(observed: &[T]) -> Vec<T> {
    observed[..1].iter().chain(observed).take(observed.len()).copied().collect()
}

/// Recorded poses of our tool point in the base frame.
fn tool_poses(
    reader: DemoReader,
    steps: usize,
    model: Option<&MujocoModel>,
) -> Result<Option<RecordedPoses>, DatasetError> {
    let Some(RecordedPoses { name, poses: site }) = site_poses(reader, steps)? else { return Ok(None) };
    let is_near_start = |base: &Pose| {
        let tool_b = base.inverse_transform_point(&site[0].translation.vector.into()).coords;
        (tool_b - Vec3::from(INITIAL_TOOL)).norm() < MAX_INITIAL_DISTANCE
    };
    let stated = model.and_then(|model| model.base_w);
    if is_near_start(&Pose::identity()) && stated.is_none() {
        // Already in the base frame, which robosuite never writes: these are poses of the tool
        // itself, as softvt records.
        return Ok(Some(RecordedPoses { name, poses: site }));
    }
    let known = BASES.map(|at| Pose::translation(at[0], at[1], at[2]));
    let Some(base) = stated.into_iter().chain(known).find(is_near_start) else {
        // Joint angles, if present, determine the poses; without them the base is unknown.
        if JOINT_KEYS.iter().any(|name| reader.has(name)) {
            return Ok(Some(RecordedPoses { name, poses: site }));
        }
        let at = site[0].translation.vector;
        let what = format!(
            "step 0: the tool is at ({:.2}, {:.2}, {:.2}) m, which is neither near the start in the base frame nor in LIBERO's \
             scenes: the robot's position is not known (joint_states or model_file would give it)",
            at.x, at.y, at.z
        );
        return Err(reader.error(name, what));
    };
    let to_tool = Pose::translation(0.0, 0.0, SITE_TO_TOOL);
    let poses = site.iter().map(|site| base.inverse() * site * to_tool).collect();
    Ok(Some(RecordedPoses { name, poses }))
}

/// robosuite's record of the tool: position of the grip site and orientation of the hand, world.
fn site_poses(reader: DemoReader, steps: usize) -> Result<Option<RecordedPoses>, DatasetError> {
    let pose = |at: &[f64], rotation: Quat| Pose::from_parts(Vec3::from_column_slice(at).into(), rotation);
    let from_axis_angle = |v: &[f64]| rotation::from_axis_angle(&Vec3::from_column_slice(v));
    if let Some(rows) = reader.rows_if_present::<6>("obs/ee_states", steps)? {
        let poses = rows.iter().map(|row| pose(&row[..3], from_axis_angle(&row[3..]))).collect();
        return Ok(Some(RecordedPoses { name: "obs/ee_states", poses }));
    }
    if let Some(positions) = reader.rows_if_present::<3>("obs/ee_pos", steps)? {
        let rotations = reader.rows::<3>("obs/ee_ori", Some(steps))?;
        let poses = positions.iter().zip(&rotations).map(|(at, v)| pose(at, from_axis_angle(v))).collect();
        return Ok(Some(RecordedPoses { name: "obs/ee_pos", poses }));
    }
    // Position and quaternion x y z w.
    let (name, rows): (_, Vec<[f64; 7]>) =
        if let Some(positions) = reader.rows_if_present::<3>("obs/robot0_eef_pos", steps)? {
            let name = "obs/robot0_eef_quat";
            let quaternions = reader.rows::<4>(name, Some(steps))?;
            let row = |(p, q): (&[f64; 3], &[f64; 4])| [p[0], p[1], p[2], q[0], q[1], q[2], q[3]];
            (name, positions.iter().zip(&quaternions).map(row).collect())
        } else if let Some(states) = reader.rows_if_present::<9>("robot_states", steps)? {
            // Two fingers come first.
            ("robot_states", states.iter().map(|row| std::array::from_fn(|i| row[2 + i])).collect())
        } else {
            return Ok(None);
        };
    let poses = rows.iter().enumerate().map(|(step, row)| {
        let q = nalgebra::Quaternion::new(row[6], row[3], row[4], row[5]);
        if !is_unit(&row[3..]) {
            let what = format!("step {step}: not a unit quaternion x y z w: its length is {:.3}", q.norm());
            return Err(reader.error(name, what));
        }
        Ok(pose(&row[..3], Quat::new_normalize(q)))
    });
    Ok(Some(RecordedPoses { name, poses: poses.collect::<Result<_, _>>()? }))
}

/// The goals that robosuite's controller tracked, each relative to the tool.
pub(super) fn goals(tool_b: &[Pose], steps: &[ToolCommand]) -> Vec<ToolCommand> {
    let mut goal_rotation = tool_b.first().map_or(Quat::identity(), |pose| pose.rotation);
    let goal = |(pose, step): (&Pose, &ToolCommand)| {
        let ToolMotion::Delta { translation_b, rotation_b, .. } = step.motion else { return *step };
        if rotation_b != Vec3::zeros() {
            goal_rotation = pose.rotation;
        }
        let Action { position_b, axis_angle_b, .. } = osc::goal(
            pose.translation.vector,
            goal_rotation,
            translation_b,
            rotation_b,
            GripTarget::Closure(0.0),
        );
        goal_rotation = rotation::from_axis_angle(&axis_angle_b);
        ToolCommand { motion: ToolMotion::Pose { position_b, axis_angle_b }, ..*step }
    };
    tool_b.iter().zip(steps).map(goal).collect()
}
