//! The robot's own sensors: [`RobotState`], and [`ROBOT_STREAMS`], which declares each of its quantities once.
//!
//! Profiles, the spaces of `softvt serve`, policies in Lua, recordings, exports and `docs/data.md` take names, shapes,
//! units and bounds from these declarations.

use std::f64::consts::PI;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use softvt_geometry::{Pose, Quat, Vec3};
use softvt_robot::{gripper::MAX_WIDTH, panda::ARM_DOFS, rotation};

/// Proprioception: readings of the robot's own sensors in one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotState {
    /// Tool position in the robot base frame, m.
    pub ee_position_b: Vec3,
    /// Tool orientation in the base frame.
    pub ee_rotation_b: Quat,
    /// The same as axis-angle, rad: continuous along the episode, from the vector that is nearest to a hand that points
    /// straight down, (π, 0, 0).
    pub ee_axis_angle_b: Vec3,
    pub joints: [f64; ARM_DOFS],
    /// Arm joint velocities, rad/s.
    pub joint_velocities: [f64; ARM_DOFS],
    /// Torques of the arm's drives in the last physics step, N m. Gravity is compensated and not part of them.
    pub joint_torques: [f64; ARM_DOFS],
    /// Exact positions of the left and right finger, m: 0 (closed) to 0.04.
    pub fingers_m: [f64; 2],
    /// Exact gripper width, m: 0 to 0.08 between the apexes of the gels.
    pub gripper_width_m: f64,
    /// Gripper width with the errors of a real hand (settings `robot.width_sensor`), m.
    pub sensed_width_m: f64,
    /// Closure last commanded, 0 (open) ..= 1 (closed).
    pub closure: f64,
}

impl Default for RobotState {
    /// A robot at rest with the tool at the origin of the base frame and the gripper open.
    fn default() -> Self {
        Self {
            ee_position_b: Vec3::zeros(),
            ee_rotation_b: Quat::identity(),
            ee_axis_angle_b: Vec3::zeros(),
            joints: [0.0; ARM_DOFS],
            joint_velocities: [0.0; ARM_DOFS],
            joint_torques: [0.0; ARM_DOFS],
            fingers_m: [MAX_WIDTH / 2.0; 2],
            gripper_width_m: MAX_WIDTH,
            sensed_width_m: MAX_WIDTH,
            closure: 0.0,
        }
    }
}

impl RobotState {
    pub fn tool_b(&self) -> Pose {
        Pose::from_parts(self.ee_position_b.into(), self.ee_rotation_b)
    }
}

/// A quantity of the robot: a vector of numbers in each state.
#[derive(Debug)]
pub struct RobotStream {
    /// Its name among the parts of a profile's state.
    pub part: Option<&'static str>,
    /// Its name among the fields of `softvt.Observation` in Lua.
    pub field: Option<&'static str>,
    /// Its dataset in HDF5 files.
    pub recorded: Option<RecordedStream>,
    /// Its feature in LeRobot and RLDS datasets, which have it if the recording does.
    pub exported: Option<ExportedStream>,
    pub width: usize,
    /// Unit; components of several units are separated by commas.
    pub unit: &'static str,
    /// Largest possible magnitude of a component.
    pub bound: f64,
    /// True for readings that tell the grip force, which a policy in Lua gets with `observes.drives` alone.
    pub is_drive: bool,
    /// Meaning: a sentence.
    pub about: &'static str,
    pub read: fn(&RobotState) -> Vec<f64>,
}

#[derive(Debug)]
pub struct RecordedStream {
    /// Path below the demonstration.
    pub path: &'static str,
    pub number_type: NumberType,
    /// Attribute `frame`; empty for none.
    pub frame: &'static str,
    /// Attribute `meaning`; empty for none.
    pub meaning: &'static str,
    /// Value of `softvt record --streams` that adds it; `None` for one that every recording has.
    pub flag: Option<&'static str>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberType {
    F64,
    F32,
    U8,
}

impl NumberType {
    pub fn bytes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::F32 => 4,
            Self::U8 => 1,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "float64",
            Self::F32 => "float32",
            Self::U8 => "uint8",
        }
    }
}

#[derive(Debug)]
pub struct ExportedStream {
    /// Name in the data of openpi and SoftVTBench.
    pub name: &'static str,
    /// Key in LeRobot v3.0.
    pub lerobot: &'static str,
    pub components: &'static [&'static str],
    /// Meaning: a phrase.
    pub about: &'static str,
}

pub const JOINT_NAMES: [&str; ARM_DOFS] =
    ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "joint_7"];

/// Bound of positions along any axis of the base frame, m; larger than the reach of the arm.
pub const MAX_POSITION_M: f64 = 2.0;
/// Bound of rotation angles, rad: vectors that are continuous along an episode pass half a turn.
pub const MAX_ANGLE: f64 = 2.0 * PI;
/// Bound of joint velocities, rad/s, and of the torques of their drives, N m; larger than what the arm reaches.
const MAX_JOINT_RATE: f64 = 1e3;
/// Bound of quaternions, closures, and widths in metres.
const ABOUT_ONE: f64 = 1.0 + 1e-3;

impl RobotStream {
    const fn new(
        width: usize,
        unit: &'static str,
        bound: f64,
        about: &'static str,
        read: fn(&RobotState) -> Vec<f64>,
    ) -> Self {
        let (part, field, recorded, exported) = (None, None, None, None);
        Self { part, field, recorded, exported, width, unit, bound, is_drive: false, about, read }
    }

    const fn part(self, name: &'static str) -> Self {
        Self { part: Some(name), ..self }
    }

    const fn field(self, name: &'static str) -> Self {
        Self { field: Some(name), ..self }
    }

    const fn drive(self) -> Self {
        Self { is_drive: true, ..self }
    }

    const fn recorded(self, recorded: RecordedStream) -> Self {
        Self { recorded: Some(recorded), ..self }
    }

    const fn exported(self, exported: ExportedStream) -> Self {
        Self { exported: Some(exported), ..self }
    }
}

impl RecordedStream {
    const fn new(path: &'static str) -> Self {
        Self { path, number_type: NumberType::F64, frame: "", meaning: "", flag: None }
    }
}

/// Paths of recorded streams that imports and exports read.
pub mod stream_paths {
    pub const POSES: &str = "obs/eef_pose";
    pub const STATES: &str = "obs/state";
    pub const JOINTS: &str = "obs/arm_joint_pos";
    pub const FINGERS: &str = "obs/gripper_pos";
    pub const SENSED_WIDTHS: &str = "obs/gripper_width_sensed";
}

const BASE: &str = "robot base";

/// All quantities. Those that are recorded are in the order of the HDF5 files.
pub static ROBOT_STREAMS: &[RobotStream] = {
    use RecordedStream as Dataset;
    use RobotStream as Stream;
    &[
        Stream::new(3, "m", MAX_POSITION_M, "Tool position, m.", |robot| robot.ee_position_b.as_slice().to_vec())
            .part("position")
            .field("position"),
        Stream::new(
            3,
            "rad",
            MAX_ANGLE,
            "Tool orientation as axis-angle, rad, continuous along the episode: its length may exceed π.",
            |robot| robot.ee_axis_angle_b.as_slice().to_vec(),
        )
        .part("axis_angle")
        .field("axis_angle"),
        Stream::new(4, "1", ABOUT_ONE, "Tool orientation as quaternion w, x, y, z with w ≥ 0.", |robot| {
            let q = rotation::from_axis_angle(&robot.ee_axis_angle_b);
            vec![q.w, q.i, q.j, q.k]
        })
        .part("quaternion_wxyz")
        .field("quaternion"),
        Stream::new(4, "1", ABOUT_ONE, "Tool orientation as quaternion x, y, z, w with w ≥ 0.", |robot| {
            rotation::from_axis_angle(&robot.ee_axis_angle_b).coords.as_slice().to_vec()
        })
        .part("quaternion_xyzw"),
        Stream::new(7, "m, 1", MAX_POSITION_M, "Tool position, quaternion, base.", |robot| {
            pose_row(&robot.tool_b()).to_vec()
        })
        .recorded(Dataset {
            frame: BASE,
            meaning: "tool position, quaternion w x y z with w >= 0",
            ..Dataset::new(stream_paths::POSES)
        }),
        Stream::new(
            7,
            "m, rad, m",
            MAX_ANGLE,
            "Tool position, axis-angle, continuous as in `actions`, exact position of one finger (0 closed to 0.04 m).",
            |robot| {
                let finger = [0.5 * robot.gripper_width_m];
                [robot.ee_position_b.as_slice(), robot.ee_axis_angle_b.as_slice(), &finger].concat()
            },
        )
        .recorded(Dataset {
            frame: BASE,
            meaning: "tool position, axis-angle, position of one finger (0 shut to 0.04)",
            ..Dataset::new(stream_paths::STATES)
        }),
        Stream::new(ARM_DOFS, "rad", MAX_ANGLE, "The seven joint angles of the arm, rad.", |robot| robot.joints.to_vec())
            .part("joints")
            .field("joints")
            .recorded(Dataset::new(stream_paths::JOINTS)),
        Stream::new(ARM_DOFS, "rad/s", MAX_JOINT_RATE, "Velocities of the arm's joints, rad/s.", |robot| {
            robot.joint_velocities.to_vec()
        })
        .part("joint_velocities")
        .field("joint_velocities"),
        Stream::new(
            ARM_DOFS,
            "N m",
            MAX_JOINT_RATE,
            "Torques of the arm's drives in the physics step before, N m; gravity is compensated and not part of them.",
            |robot| robot.joint_torques.to_vec(),
        )
        .part("joint_torques")
        .field("joint_torques")
        .recorded(Dataset {
            meaning: "torques of the arm's drives; gravity is compensated and not part of them",
            flag: Some("joint-torques"),
            ..Dataset::new("obs/joint_torques")
        })
        .exported(ExportedStream {
            name: "joint_torques",
            lerobot: "observation.joint_torques",
            components: &JOINT_NAMES,
            about: "torques of the arm's drives (N m), without gravity",
        }),
        Stream::new(2, "m", ABOUT_ONE, "Exact positions of the fingers, m.", |robot| robot.fingers_m.to_vec())
            .recorded(Dataset::new(stream_paths::FINGERS)),
        Stream::new(1, "m", ABOUT_ONE, "Exact distance between the gels, 0 to 0.08 m.", |robot| vec![robot.gripper_width_m])
            .part("gripper_width")
            .drive()
            .recorded(Dataset::new("obs/gripper_width")),
        Stream::new(1, "m", ABOUT_ONE, "Exact position of one finger, half the gripper width, m.", |robot| {
            vec![0.5 * robot.gripper_width_m]
        })
        .part("finger_position")
        .drive(),
        Stream::new(
            1,
            "m",
            ABOUT_ONE,
            "The distance as the sensor of a real hand measures it, m: what the profiles `vision` and `visuo_tactile` observe.",
            |robot| vec![robot.sensed_width_m],
        )
        .part("sensed_width")
        .recorded(Dataset {
            meaning: "the width with the steps and the offset of a real hand",
            ..Dataset::new(stream_paths::SENSED_WIDTHS)
        }),
        Stream::new(1, "m", ABOUT_ONE, "Half of the sensed width, m.", |robot| vec![0.5 * robot.sensed_width_m])
            .part("sensed_finger_position"),
        Stream::new(2, "m", ABOUT_ONE, "Both fingers in robosuite's convention, m: half the width and its negative.", |robot| {
            vec![0.5 * robot.gripper_width_m, -0.5 * robot.gripper_width_m]
        })
        .part("finger_pair")
        .drive(),
        Stream::new(1, "1", ABOUT_ONE, "Measured: 1 − width / 0.08 m.", |robot| {
            vec![1.0 - robot.gripper_width_m / MAX_WIDTH]
        })
        .recorded(Dataset { meaning: "measured: 1 - width / 0.08 m", ..Dataset::new("obs/gripper_close_norm") }),
        Stream::new(1, "1", ABOUT_ONE, "Last commanded closure, 0 open to 1 closed.", |robot| vec![robot.closure])
            .part("closure")
            .field("closure")
            .drive()
            .recorded(Dataset { meaning: "commanded last: 0 open to 1 shut", ..Dataset::new("obs/gripper_closure") }),
    ]
};

const PART_COUNT: usize = {
    let (mut count, mut index) = (0, 0);
    while index < ROBOT_STREAMS.len() {
        count += ROBOT_STREAMS[index].part.is_some() as usize;
        index += 1;
    }
    count
};

impl RobotStream {
    pub const PARTS: &[&str] = &{
        let mut names = [""; PART_COUNT];
        let (mut at, mut index) = (0, 0);
        while index < ROBOT_STREAMS.len() {
            if let Some(name) = ROBOT_STREAMS[index].part {
                names[at] = name;
                at += 1;
            }
            index += 1;
        }
        names
    };

    /// The streams that recordings have with this value of `--streams`; without one, the streams of all recordings.
    pub fn recorded_with(
        flag: Option<&str>,
    ) -> impl Iterator<Item = (&'static Self, &'static RecordedStream)> {
        let recorded = ROBOT_STREAMS.iter().filter_map(|stream| Some((stream, stream.recorded.as_ref()?)));
        recorded.filter(move |(_, recorded)| recorded.flag == flag)
    }
}

/// A part of a profile's state: a stream with a name among the parts.
#[derive(Clone, Copy, Debug)]
pub struct StatePart(&'static RobotStream);

impl StatePart {
    pub fn named(name: &str) -> Option<Self> {
        ROBOT_STREAMS.iter().find(|stream| stream.part == Some(name)).map(Self)
    }

    pub fn stream(self) -> &'static RobotStream {
        self.0
    }

    pub fn name(self) -> &'static str {
        self.0.part.unwrap_or_default()
    }
}

impl PartialEq for StatePart {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Serialize for StatePart {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for StatePart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::unknown_variant(&name, RobotStream::PARTS))
    }
}

/// Position, and quaternion w x y z with w ≥ 0.
pub fn pose_row(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, rotation::canonical(&pose.rotation));
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}
