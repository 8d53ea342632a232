//! Input and output of experts at a control step: the true state of the simulation, and a command.

use std::sync::Arc;

use mlua::Lua;

use super::{
    random::LuaRng,
    scene::{LuaScene, empty_scene},
    tasks::{SuiteSpec, TaskSpec},
};
use crate::schema::Constructed;
use softvt_benchmark::{
    CONTROL_DT,
    seed::{EpisodeSeed, RandomStream},
    variation::VariationRanges,
};
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_common::parallel::lock;
use softvt_geometry::{Aabb, Pose, Vec3};
use softvt_robot::{
    DiffIk, GripperSpec, IkSpec,
    ik::{ArmAngles, PoseDifference, PoseTolerance, UnreachablePose},
};
use softvt_rollout::{ObjectInstance, Simulation};
use softvt_scene::{Asset, Object};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ObjectView {
    pub name: String,
    /// Shape, material and hints of this instance.
    pub asset: Arc<Asset>,
    /// The object as it was placed; `None` for a part.
    pub placed: Option<Object>,
    /// Object frame in the world.
    pub pose_w: Pose,
    /// Bounds of its shape at rest, object frame.
    pub bounds: Aabb,
    /// Edge lengths of its bounding box, upright as it has settled, m.
    pub size: Vec3,
    /// Centre of that box, world frame, m.
    pub centre_w: Vec3,
    /// Rotation of that box about the vertical, rad.
    pub yaw: f64,
    pub joint: Option<JointView>,
    pub parts: Vec<ObjectView>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointView {
    /// Value, m or rad.
    pub value: f64,
    pub range: [f64; 2],
    /// Direction in which the value of a slider grows, axis about which that of a hinge does; world frame.
    pub axis_w: Vec3,
    /// A point of the axis of a hinge, world frame, m.
    pub origin_w: Vec3,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ExpertView {
    pub time_s: f64,
    /// Length of a control step, s.
    pub dt_s: f64,
    /// Robot base in the world.
    pub base_w: Pose,
    /// Kinematics of the arm from its present joint positions.
    pub reach: ArmReach,
    /// Tool centre point in the robot base frame.
    pub tcp_b: Pose,
    /// Distance of the gels, m.
    pub width_m: f64,
    /// Drives of the fingers.
    pub gripper: GripperSpec,
    /// Last commanded closure: 0 is open, 1 is closed.
    pub closure: f64,
    /// Normal force on the left and the right pad, N.
    pub pad_force_n: [f64; 2],
    /// Controller of the gripper in place of the expert's own grip.
    pub grip_controller: Option<&'static str>,
    /// The instances of the suite, for a controller that must not know this one.
    pub instances: Option<Arc<SuiteInstances>>,
    /// The objects, in the order of the scene.
    pub objects: Vec<ObjectView>,
}

/// The instances of a suite: what a controller may know that must not know the instance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SuiteInstances {
    pub suite: String,
    /// Its variation; without one every object is its asset.
    pub ranges: Option<VariationRanges>,
    pub goals: Vec<GoalObject>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GoalObject {
    /// Name of the layout that places it, and its function.
    pub layout: String,
    pub build: mlua::Function,
    pub name: String,
}

impl SuiteInstances {
    /// The instances of a suite with these ranges, which may be others than its own.
    pub(crate) fn new(lua: &Lua, suite: &SuiteSpec, ranges: Option<VariationRanges>) -> mlua::Result<Self> {
        let goal = |task: &Constructed<TaskSpec>| {
            let (layout, build) = (task.layout.name.clone(), task.layout.build.clone());
            Ok(GoalObject { layout, build, name: task.object_name(lua)? })
        };
        let goals = suite.tasks.iter().map(goal).collect::<mlua::Result<_>>()?;
        Ok(Self { suite: suite.name.clone(), ranges, goals })
    }

    /// The assets of the objects of all goals, each once, as their files define them.
    pub(crate) fn kinds(&self) -> mlua::Result<Vec<Arc<Asset>>> {
        let id = EpisodeId {
            suite: self.suite.clone(),
            task: 0,
            episode: 0,
            base_seed: 0,
            split: EpisodeSplit::Experiment,
        };
        let mut kinds: Vec<Arc<Asset>> = Vec::new();
        for goal in &self.goals {
            let scene = LuaScene::new(empty_scene());
            let rng = LuaRng::new(EpisodeSeed::new(&id, &goal.layout), RandomStream::Layout);
            goal.build.call::<()>((scene.clone(), rng))?;
            let scene = lock(&scene.scene);
            let Some(object) = scene.objects.iter().find(|object| object.name == goal.name) else { continue };
            if !kinds.iter().any(|kind| kind.name == object.nominal.name) {
                kinds.push(object.nominal.clone());
            }
        }
        Ok(kinds)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExpertCommand {
    /// Tool centre point in the robot base frame.
    pub pose_b: Pose,
    /// Closure: 0 is open, 1 is closed.
    pub closure: f64,
    /// True while the gripper should hold an object: the command of a binary gripper.
    pub gripping: bool,
    /// End of the motion that the command belongs to, robot base frame.
    pub goal_b: Option<Pose>,
}

/// The poses that the arm reaches from its present joint positions.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArmReach {
    pub ik: IkSpec,
    /// Joint positions, rad.
    pub joints: ArmAngles,
}

impl ArmReach {
    /// Difference of poses up to which one is reached.
    const TOLERANCE: PoseTolerance = PoseTolerance { distance: 1e-3, angle: 0.01 };
    /// Control steps in which the arm may get there: 20 s.
    const STEPS: usize = 400;

    /// Remaining difference to a tool pose, base frame, where the arm stops; `None` if it gets there.
    pub(crate) fn miss(&self, pose_b: &Pose) -> Option<PoseDifference> {
        let mut ik = DiffIk::new(&self.ik, self.joints, CONTROL_DT);
        let mut joints = self.joints;
        let mut miss = PoseDifference::between(&ik.tool_pose(&joints), pose_b);
        for _ in 0..Self::STEPS {
            if Self::TOLERANCE.contains(&miss) {
                return None;
            }
            let next = ik.step(&joints, pose_b);
            if next == joints {
                break;
            }
            joints = next;
            miss = PoseDifference::between(&ik.tool_pose(&joints), pose_b);
        }
        Some(miss)
    }
}

pub(crate) fn expert_view(sim: &Simulation, time_s: f64) -> ExpertView {
    ExpertView {
        time_s,
        dt_s: CONTROL_DT,
        base_w: sim.robot.base_w,
        reach: ArmReach { ik: sim.robot.spec.ik.clone(), joints: sim.robot.q(&sim.world) },
        tcp_b: sim.robot.tool_b(&sim.world),
        width_m: sim.robot.width(&sim.world),
        gripper: sim.robot.spec.gripper.clone(),
        closure: sim.robot.closure(),
        pad_force_n: sim.pad_normal_forces(),
        grip_controller: None,
        instances: None,
        objects: (0..sim.objects.len())
            .filter(|&index| sim.objects[index].part.is_none())
            .map(|index| ObjectView {
                parts: sim.parts(index).map(|(part, spec)| object_view(sim, part, &spec.name)).collect(),
                ..object_view(sim, &sim.objects[index], &sim.objects[index].name)
            })
            .collect(),
    }
}

fn object_view(sim: &Simulation, object: &ObjectInstance, name: &str) -> ObjectView {
    let pose = sim.pose(object);
    let bounds = object.bounds;
    // The box of an object that rests as modelled is that of its shape.
    let (box_w, own) = match object.settled {
        Some(settled) => (pose * settled.frame_o, settled.bounds),
        None => (pose, bounds),
    };
    let centre_w = (box_w * nalgebra::Point3::from(own.centre())).coords;
    let x = box_w.rotation * Vec3::x();
    let placed = sim.scene.objects.iter().find(|placed| placed.name == object.name);
    ObjectView {
        name: name.to_owned(),
        asset: object.asset.clone(),
        placed: placed.cloned(),
        pose_w: pose,
        bounds,
        size: own.size(),
        centre_w,
        yaw: x.y.atan2(x.x),
        joint: joint_view(sim, object),
        parts: Vec::new(),
    }
}

/// The joint of a part. Its own motion changes neither its axis nor, about a hinge, the origin in the object frame.
fn joint_view(sim: &Simulation, object: &ObjectInstance) -> Option<JointView> {
    let joint = &object.part.as_ref()?.joint;
    let pose = sim.pose(object);
    Some(JointView {
        value: sim.joint(object)?,
        range: [joint.lower, joint.upper],
        axis_w: pose.rotation * joint.axis_o,
        origin_w: (pose * nalgebra::Point3::from(joint.origin_o)).coords,
    })
}

/// Tracking error beyond which the tool counts as away from its command.
const TRACKING_LIMIT: PoseTolerance = PoseTolerance { distance: 0.02, angle: 0.2 };

/// Control steps beyond [`TRACKING_LIMIT`] before the command's reachability is searched, which takes tens of
/// milliseconds. A fast motion lags for fewer steps, and its command is found to be reachable otherwise.
const MAX_LAG_STEPS: u32 = 20;

/// Distance from the robot's base that the tool never reaches, m.
const FAR: f64 = 2.0;
/// Distance from the robot's base that a script gives in another unit by mistake, m.
const OTHER_UNIT: f64 = 5.0;

/// Detects commands that the arm cannot reach. A policy may command anything; in a script it is a mistake.
#[derive(Debug, Default)]
pub(crate) struct TrackingErrorMonitor {
    pub command: Option<ExpertCommand>,
    /// Control steps for which the tool has been away from its commands.
    steps: u32,
}

impl TrackingErrorMonitor {
    /// A complaint for the script once the tool has been away for a second from a pose that it cannot reach.
    pub(crate) fn complaint(&mut self, sim: &Simulation) -> Option<String> {
        let ExpertCommand { pose_b: command_b, goal_b, .. } = self.command?;
        let unreachable = |pose_b: &Pose| {
            let miss = sim.robot.solve_ik(&sim.world, pose_b).err()?;
            let is_away = miss.distance > TRACKING_LIMIT.distance || miss.angle > TRACKING_LIMIT.angle;
            is_away.then_some(miss)
        };
        let base_w = &sim.robot.base_w;
        // A motion to a far end may take minutes until the arm lags behind it.
        let end_b = goal_b.unwrap_or(command_b);
        if end_b.translation.vector.norm() > FAR
            && let Some(miss) = unreachable(&end_b)
        {
            return Some(unreachable_message(&miss, base_w));
        }
        let error = PoseDifference::between(&sim.robot.tool_b(&sim.world), &command_b);
        self.steps = if TRACKING_LIMIT.contains(&error) { 0 } else { self.steps + 1 };
        if self.steps < MAX_LAG_STEPS {
            return None;
        }
        self.steps = 0;
        let miss = unreachable(&command_b)?;
        // The command is a point on the way to what the script asked for.
        Some(match goal_b.filter(|goal_b| *goal_b != command_b) {
            None => unreachable_message(&miss, base_w),
            Some(goal_b) => match unreachable(&goal_b) {
                Some(goal_miss) => unreachable_message(&goal_miss, base_w),
                None => format!(
                    "the straight line to {} leads through an {}",
                    position(&goal_b.translation.vector, base_w),
                    unreachable_message(&miss, base_w)
                ),
            },
        })
    }
}

/// A point of the base frame in the world frame, as scripts give it.
fn position(point_b: &Vec3, base_w: &Pose) -> String {
    let at = base_w.transform_point(&(*point_b).into());
    format!("({:.3}, {:.3}, {:.3}) m", at.x, at.y, at.z)
}

fn unreachable_message(miss: &UnreachablePose, base_w: &Pose) -> String {
    let unit = if miss.target_b.norm() > OTHER_UNIT { "; positions are in metres" } else { "" };
    format!(
        "unreachable pose: the tool gets no nearer to {} than {:.0} mm and {:.0}°; bring it nearer to the robot's base at {} \
         or turn it towards straight down{unit}",
        position(&miss.target_b, base_w),
        miss.distance * 1e3,
        miss.angle.to_degrees(),
        position(&Vec3::zeros(), base_w)
    )
}
