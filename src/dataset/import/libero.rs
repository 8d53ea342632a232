//! robomimic's and LIBERO's files: steps away from where the tool is, for robosuite's operational-space controller.
//!
//! robosuite sets the controller's goal a step away from the tool: `goal = tool + 0.05 m · action`, the turn before the tool's
//! orientation, about the axes of the base; without a turn the last goal's orientation stays (controllers/osc.py). With the
//! tool's recorded poses that gives the poses that the controller was given. LIBERO keeps observations *after* each action
//! (scripts/create_dataset.py), robomimic before it; `states`, which both keep before it, tell them apart.

use super::{
    super::{DatasetError, TaskFile},
    ForeignDemo, InitialCondition,
    header::Header,
    mujoco::MujocoModel,
    rows::{if_there, numbers, rows, wrong},
    tool_pose,
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    policy::{
        ToolCommand, decode, osc,
        profile::{ActionEncoding, PoseEncoding, Profile},
    },
    robot::{ik::ArmAngles, rotation},
};

/// How far a share may be beyond −1..1: single precision.
const SLACK: f64 = 1e-5;
/// robosuite's grip site is nearer to the hand than the tool by this, m: 0.1065 + 0.097 m from the last joint
/// (robots/panda/robot.xml, grippers/panda_gripper.xml), the tool is 0.107 + 0.1034 m from it.
const SITE_TO_TOOL: f64 = 0.0069;
/// Where LIBERO's robots stand: that of the floor and that of the table (envs/robots), world, m.
const BASES: [[f64; 3]; 2] = [[-0.6, 0.0, 0.0], [-0.66, 0.0, 0.912]];
/// Where the tool is at the start, base frame, and how near it must be for a base to be taken for the robot's, m.
const NEAR_START: ([f64; 3], f64) = ([0.46, 0.0, 0.26], 0.25);

/// A demonstration of such a file.
///
/// # Errors
/// Something is missing, or is not as expected.
pub(super) fn demo(file: &TaskFile, header: &Header, demo: usize) -> Result<ForeignDemo, DatasetError> {
    let steps = steps(file, header, demo)?;
    let model = model(file, demo)?;
    let (numbers, width) = states(file, demo, (steps.len(), model.as_ref()))?;
    let states: Vec<&[f64]> = numbers.chunks_exact(width).collect();
    let arm = arm(file, demo, (&states, steps.len()))?;
    let tool = tool_poses(file, demo, steps.len(), model.as_ref())?;
    let (commands, said) = match (&arm, &tool) {
        (Some(arm), recorded) => {
            let observed = tool_pose::by_joints(file, demo, arm.name, &arm.observed)?;
            if let Some((name, recorded)) = recorded {
                tool_pose::compare(file, demo, (name, recorded), &observed)?;
            }
            let before = tool_pose::by_joints(file, demo, arm.name, &arm.before)?;
            (goals(&before, &steps), "steps away from where the recorded joint angles put the tool")
        }
        (None, Some((name, recorded))) => {
            tool_pose::check_start(file, demo, (name, &recorded[0]))?;
            (goals(&late(recorded), &steps), "steps away from the recorded poses of the tool")
        }
        (None, None) => {
            (steps.clone(), "steps away from where our own tool is: the file has neither joints nor poses")
        }
    };
    let things = states.first().zip(model.as_ref()).and_then(|(state, model)| model.standing(state));
    Ok(ForeignDemo {
        name: format!("demo_{demo}"),
        task: header.task(file, demo),
        shut: steps
            .iter()
            .map(|step| matches!(step, ToolCommand::Step { closure, .. } if *closure > 0.5))
            .collect(),
        held: vec![false; commands.len()],
        commands,
        begins: InitialCondition::OtherSimulator {
            joints: arm.map(|arm| tool_pose::within_limits(arm.before[0])),
            things: things.unwrap_or_default(),
        },
        said,
    })
}

/// The world as MuJoCo's, if the file tells it.
fn model(file: &TaskFile, demo: usize) -> Result<Option<MujocoModel>, DatasetError> {
    let Some(xml) = file.text(demo, "model_file").ok().filter(|xml| !xml.trim().is_empty()) else {
        return Ok(None);
    };
    let what = || "no model of MuJoCo's: it has no body in a worldbody".to_owned();
    MujocoModel::read(&xml).map(Some).ok_or_else(|| wrong(file, demo, "attribute model_file", what()))
}

/// MuJoCo's states before each action, and how many numbers each has; none if there are none, or if there is no model that says
/// what they are: others keep something else there.
///
/// # Errors
/// They are not of the model.
fn states(
    file: &TaskFile,
    demo: usize,
    (steps, model): (usize, Option<&MujocoModel>),
) -> Result<(Vec<f64>, usize), DatasetError> {
    const KEY: &str = "states";
    if !file.has(demo, KEY) {
        return Ok((Vec::new(), 1));
    }
    let (all, shape) = numbers(file, demo, KEY)?;
    match (shape[..] == [steps, shape.last().copied().unwrap_or(0)], model) {
        (true, None) => Ok((all, shape[1].max(1))),
        (false, None) => Ok((Vec::new(), 1)),
        (true, Some(model)) if shape[1] == model.width() => Ok((all, shape[1])),
        (_, Some(model)) => {
            let what = format!(
                "expected the shape ({steps}, {}), a state of model_file before each action, got {shape:?}",
                model.width()
            );
            Err(wrong(file, demo, KEY, what))
        }
    }
}

/// The steps, as our own profile for LIBERO's policies reads them.
fn steps(file: &TaskFile, header: &Header, demo: usize) -> Result<Vec<ToolCommand>, DatasetError> {
    let actions = rows::<7>(file, demo, "actions", None)?;
    for (step, row) in actions.iter().enumerate() {
        if let Some(i) = row.iter().position(|x| x.abs() > 1.0 + SLACK) {
            let what = format!("step {step}, number {i}: {}, expected shares of a step in -1..1", row[i]);
            return Err(wrong(file, demo, "actions", what));
        }
    }
    let [translation_m, rotation_rad] = header.longest_step(file)?;
    let gripper = Profile::named("libero").map(|profile| profile.actions.gripper);
    let gripper = gripper.ok_or_else(|| wrong(file, demo, "actions", "no profile reads it".to_owned()))?;
    let code = ActionEncoding::plain(PoseEncoding::DeltaOsc { translation_m, rotation_rad }, gripper);
    let read =
        |row: &[f64; 7]| decode::command(row, &code).map_err(|e| wrong(file, demo, "actions", e.to_string()));
    actions.iter().map(read).collect()
}

/// Joint angles of the arm.
struct Arm {
    name: &'static str,
    /// As they were kept.
    observed: Vec<ArmAngles>,
    /// Before each action.
    before: Vec<ArmAngles>,
}

fn arm(
    file: &TaskFile,
    demo: usize,
    (states, steps): (&[&[f64]], usize),
) -> Result<Option<Arm>, DatasetError> {
    let named = ["obs/joint_states", "obs/robot0_joint_pos"].into_iter().find(|name| file.has(demo, name));
    let Some(name) = named else { return Ok(None) };
    let observed = tool_pose::joints(file, demo, name, steps)?;
    let before = match agreement(states, &observed) {
        Some(true) => states.iter().map(|state| std::array::from_fn(|i| state[1 + i])).collect(),
        Some(false) => observed.clone(),
        None if name.contains("robot0") => observed.clone(),
        None => late(&observed),
    };
    Ok(Some(Arm { name, observed, before }))
}

/// How far joint angles of a state may be from those observed, rad: playing back does not repeat to the bit.
const ALIKE: f64 = 0.02;

/// Whether observations are of after each action, by the joints of robosuite's states (time, then positions, the arm's first),
/// which are of before it; none if the states are something else.
fn agreement(states: &[&[f64]], observed: &[ArmAngles]) -> Option<bool> {
    if states.len() != observed.len() || states.first()?.len() < 8 {
        return None;
    }
    let apart = |(state, q): (&&[f64], &ArmAngles)| -> f64 {
        state[1..8].iter().zip(q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let pairs = observed.len().saturating_sub(1).max(1) as f64;
    let before = states.iter().zip(observed).map(apart).sum::<f64>() / observed.len() as f64;
    let after = states[1..].iter().zip(observed).map(apart).sum::<f64>() / pairs;
    (before.min(after) < ALIKE).then_some(after < before)
}

/// What was observed after each action, as what was there before each: of the first nothing better is known.
fn late<T: Copy>(observed: &[T]) -> Vec<T> {
    observed[..1].iter().chain(observed).take(observed.len()).copied().collect()
}

/// The tool's recorded poses in the base frame, and their key.
fn tool_poses(
    file: &TaskFile,
    demo: usize,
    steps: usize,
    model: Option<&MujocoModel>,
) -> Result<Option<(&'static str, Vec<Pose>)>, DatasetError> {
    let Some((name, site)) = site_poses(file, demo, steps)? else { return Ok(None) };
    let near = |base: &Pose| {
        let (start, reach) = NEAR_START;
        (base.inverse_transform_point(&site[0].translation.vector.into()).coords - Vec3::from(start)).norm()
            < reach
    };
    let known = BASES.map(|at| Pose::translation(at[0], at[1], at[2]));
    let stated = model.and_then(|model| model.base_w);
    if near(&Pose::identity()) && stated.is_none() {
        // In the frame of the base, which robosuite never writes: as softvt does, of the tool itself.
        return Ok(Some((name, site)));
    }
    let Some(base) = stated.into_iter().chain(known).find(near) else {
        // Joints say more; without them there is nothing to go by.
        if ["obs/joint_states", "obs/robot0_joint_pos"].iter().any(|name| file.has(demo, name)) {
            return Ok(Some((name, site)));
        }
        let at = site[0].translation.vector;
        let what = format!(
            "step 0: the tool is at ({:.2}, {:.2}, {:.2}) m, which is neither near the start in the frame of the base nor in LIBERO's \
             worlds: where the robot stands is not known (joint_states, or model_file, would say so)",
            at.x, at.y, at.z
        );
        return Err(wrong(file, demo, name, what));
    };
    let to_tool = Pose::translation(0.0, 0.0, SITE_TO_TOOL);
    Ok(Some((name, site.iter().map(|site| base.inverse() * site * to_tool).collect())))
}

/// What robosuite records of the tool: its grip site's place and its hand's orientation, world.
fn site_poses(
    file: &TaskFile,
    demo: usize,
    steps: usize,
) -> Result<Option<(&'static str, Vec<Pose>)>, DatasetError> {
    let turned = |at: &[f64], v: &[f64]| {
        Pose::from_parts(
            Vec3::new(at[0], at[1], at[2]).into(),
            rotation::from_axis_angle(&Vec3::new(v[0], v[1], v[2])),
        )
    };
    if let Some(all) = if_there::<6>(file, demo, "obs/ee_states", steps)? {
        return Ok(Some(("obs/ee_states", all.iter().map(|row| turned(&row[..3], &row[3..])).collect())));
    }
    if let Some(at) = if_there::<3>(file, demo, "obs/ee_pos", steps)? {
        let turns = rows::<3>(file, demo, "obs/ee_ori", Some(steps))?;
        return Ok(Some(("obs/ee_pos", at.iter().zip(&turns).map(|(at, v)| turned(at, v)).collect())));
    }
    let quaternion = |name: &'static str, step: usize, q: &[f64]| {
        let q = nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]);
        if (q.norm() - 1.0).abs() > 1e-2 {
            let what =
                format!("step {step}: no quaternion x y z w of length 1: its length is {:.3}", q.norm());
            return Err(wrong(file, demo, name, what));
        }
        Ok(Quat::new_normalize(q))
    };
    if let Some(at) = if_there::<3>(file, demo, "obs/robot0_eef_pos", steps)? {
        let name = "obs/robot0_eef_quat";
        let turns = rows::<4>(file, demo, name, Some(steps))?;
        let pose = |(step, (at, q)): (usize, (&[f64; 3], &[f64; 4]))| -> Result<Pose, DatasetError> {
            Ok(Pose::from_parts(Vec3::from(*at).into(), quaternion(name, step, q)?))
        };
        return Ok(Some((name, at.iter().zip(&turns).enumerate().map(pose).collect::<Result<_, _>>()?)));
    }
    let Some(states) = if_there::<9>(file, demo, "robot_states", steps)? else { return Ok(None) };
    let pose = |(step, row): (usize, &[f64; 9])| -> Result<Pose, DatasetError> {
        let at = Vec3::new(row[2], row[3], row[4]);
        Ok(Pose::from_parts(at.into(), quaternion("robot_states", step, &row[5..])?))
    };
    Ok(Some(("robot_states", states.iter().enumerate().map(pose).collect::<Result<_, _>>()?)))
}

/// The poses that robosuite's controller was given: a step away from the tool each.
pub(super) fn goals(tool_b: &[Pose], steps: &[ToolCommand]) -> Vec<ToolCommand> {
    let mut turned = tool_b.first().map_or(Quat::identity(), |pose| pose.rotation);
    let goal = |(pose, step): (&Pose, &ToolCommand)| {
        let ToolCommand::Step { translation_b, rotation_b, closure, .. } = *step else { return *step };
        if rotation_b != Vec3::zeros() {
            turned = pose.rotation;
        }
        let action = osc::goal((pose.translation.vector, turned), translation_b, rotation_b, closure);
        turned = rotation::from_axis_angle(&action.axis_angle_b);
        ToolCommand::Pose(action)
    };
    tool_b.iter().zip(steps).map(goal).collect()
}
