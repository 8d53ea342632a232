//! Declarations of all streams of a recording: names, shapes, units and values. HDF5 files, their checks and the tables
//! of `docs/data.md` follow from them. Streams of the robot's own sensors are declared in
//! [`ROBOT_STREAMS`](softvt_policy::ROBOT_STREAMS).

use softvt_benchmark::CONTROL_DT;
use softvt_evaluation::{
    deformation::{METRIC_ID, V1_METRIC_ID},
    judge::ControlStepScore,
};
use softvt_geometry::Vec3;
use softvt_policy::{
    Action, NumberType, PadForce, ROBOT_STREAMS, RobotState, RobotStream, pose_row, profile::GripCode,
};
use softvt_robot::{GripTarget, panda::ARM_DOFS, rotation};
use softvt_rollout::{BodyConfiguration, FinishedEpisode, Sensors, StateRecording, StepTrace};
use softvt_scene::STANDARD_CAMERAS;
use softvt_sensing::tactile::{MARKER_COUNT, Markers};

use super::{
    grip_labels,
    stream::{DataStream, StreamValues},
};

#[derive(Clone, Debug)]
pub(crate) struct StreamSpec {
    /// Path below the demonstration, with [`NAME`] for the name of an object.
    pub path: &'static str,
    pub number_type: NumberType,
    /// Shape per step; lengths that differ between recordings are `None`.
    pub row: Vec<Option<usize>>,
    pub presence: Presence,
    /// Text attributes: `unit`, `frame`, `meaning`, …
    pub attributes: Vec<(&'static str, &'static str)>,
    /// Row of `docs/data.md`.
    pub about: &'static str,
    read: Read,
}

/// Recordings that have a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Presence {
    Always,
    /// Recordings in which it varies, unless they were asked to leave it out.
    Possible,
    /// Recordings with this value of `--streams`.
    Flag(&'static str),
}

#[derive(Clone, Copy, Debug)]
enum Read {
    /// From the whole rollout, step by step.
    Rollout(fn(&Rollout<'_>) -> Option<Vec<f64>>),
    /// From the state of the robot before each action.
    Robot(fn(&RobotState) -> Vec<f64>),
    Camera(usize),
    /// Configurations of the bodies of this kind.
    Bodies(fn(&BodyConfiguration<'_>) -> Option<Vec<f64>>),
    /// By rendering; written step by step.
    Rendered,
}

pub(crate) struct Rollout<'a> {
    finished: &'a FinishedEpisode,
    recording: &'a StateRecording,
    /// Per control step: true if the gripper is commanded to hold.
    is_closed: &'a [bool],
    /// Per control step: the markers of both fingers.
    markers: &'a [[Markers; 2]],
    /// The actions with rotation vectors that are continuous along the episode.
    actions: Vec<Action>,
    /// Loads of both pads in each state.
    loads: Vec<[PadForce; 2]>,
}

/// Names of the streams of images: third-person camera, wrist camera, left and right finger.
pub(crate) const IMAGES: [&str; 4] = [
    "obs/agentview_rgb",
    "obs/eye_in_hand_rgb",
    "obs/gsmini_left_tactile_rgb",
    "obs/gsmini_right_tactile_rgb",
];
/// Names of the streams of the depth of both cameras.
pub(crate) const DEPTHS: [&str; 2] = ["obs/agentview_depth", "obs/eye_in_hand_depth"];
/// Value of `--streams` that adds depth.
pub(crate) const DEPTH_FLAG: &str = "depth";
/// Name of the stream of actions as joint positions.
pub(crate) const JOINT_ACTIONS: &str = "actions_joints";
/// Name of the stream of the rotation vectors as commanded, rad; present if `actions` has others.
pub(crate) const COMMANDED_ROTATIONS: &str = "commanded_rotations";
/// Name of the stream that marks actions that commanded joint positions; present if there are any.
pub(crate) const COMMANDS_JOINTS: &str = "commands_joints";
/// Name of the stream of D, %.
pub(crate) const DEFORMATION: &str = "privileged/d";
pub(crate) const MARKER_MOTION: &str = "obs/gripper_marker_motion";
/// Shape of its rows: finger, initial and present, marker, (x, y).
pub(crate) const MARKER_ROW: [usize; 4] = [2, 2, MARKER_COUNT, 2];

/// Name of the stream of actions in a grip code.
pub(crate) fn actions_in(code: GripCode) -> &'static str {
    match code {
        GripCode::Continuous => "actions",
        GripCode::Binary => "actions_binary",
        GripCode::TwoWidth => "actions_two_width",
        GripCode::Force => "actions_force",
    }
}

/// Value of the attribute `frame`.
const BASE: &str = "robot base";
const ACTION: &str = "absolute tool position (m) and axis-angle (rad, continuous along the episode), gripper";
const CAMERA_POSE: &str = "position, quaternion w x y z with w >= 0; x right, y up, view along -z";

/// All streams in the order of the files, images and depth last.
pub(crate) fn all() -> Vec<StreamSpec> {
    let robot = |flag| RobotStream::recorded_with(flag).map(|(stream, _)| of_robot(stream));
    let optional = ROBOT_STREAMS.iter().filter_map(|stream| stream.recorded.as_ref()?.flag);
    let mut all = top_level();
    all.extend(robot(None).flatten());
    all.extend(observed());
    all.extend(optional.flat_map(|flag| robot(Some(flag)).flatten()));
    all.extend(privileged());
    all.extend(images());
    all
}

/// The declaration of the stream at a path.
pub(crate) fn named(path: &str) -> Option<StreamSpec> {
    all().into_iter().find(|spec| spec.is_at(path))
}

/// Stands for the name of an object in a path.
const NAME: &str = "<name>";

impl StreamSpec {
    pub(crate) fn is_at(&self, path: &str) -> bool {
        match self.path.split_once(NAME) {
            Some((before, after)) => path.starts_with(before) && path.ends_with(after),
            None => path == self.path,
        }
    }

    /// True for the true state, which no real robot could measure.
    pub(crate) fn is_privileged(&self) -> bool {
        self.path.starts_with("privileged/")
    }

    pub(crate) fn is_rendered(&self) -> bool {
        matches!(self.read, Read::Rendered)
    }

    /// Shape of the stream, in words.
    pub(crate) fn shape_text(&self) -> String {
        let mut open = if self.is_rendered() { ["height", "width"].iter() } else { ["N"].iter() };
        let length = |length: &Option<usize>| match length {
            Some(length) => format!(", {length}"),
            None => format!(", {}", open.next().unwrap_or(&"…")),
        };
        format!("(T{})", self.row.iter().map(length).collect::<String>())
    }

    /// The stream of these numbers of so many steps.
    fn stream(&self, path: String, steps: usize, numbers: Vec<f64>) -> DataStream {
        let fixed: usize = self.row.iter().flatten().product();
        let nodes = numbers.len() / (steps * fixed).max(1);
        DataStream {
            name: path,
            row_shape: self.row.iter().map(|length| length.unwrap_or(nodes)).collect(),
            values: StreamValues::new(self.number_type, numbers),
            attributes: self
                .attributes
                .iter()
                .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
                .collect(),
        }
    }
}

/// A stream that every recording has.
fn always(
    path: &'static str,
    row: &'static [usize],
    read: fn(&Rollout<'_>) -> Option<Vec<f64>>,
) -> StreamSpec {
    StreamSpec {
        path,
        number_type: NumberType::F64,
        row: row.iter().copied().map(Some).collect(),
        presence: Presence::Always,
        attributes: Vec::new(),
        about: "",
        read: Read::Rollout(read),
    }
}

/// A stream that not every recording has, read in another way.
fn read_by(path: &'static str, row: &[Option<usize>], read: Read) -> StreamSpec {
    StreamSpec { row: row.to_vec(), read, presence: Presence::Possible, ..always(path, &[], |_| None) }
}

/// A stream that not every recording has.
fn sometimes(
    path: &'static str,
    row: &'static [usize],
    read: fn(&Rollout<'_>) -> Option<Vec<f64>>,
) -> StreamSpec {
    StreamSpec { presence: Presence::Possible, ..always(path, row, read) }
}

impl StreamSpec {
    fn attribute(mut self, name: &'static str, text: &'static str) -> Self {
        self.attributes.push((name, text));
        self
    }

    fn unit(self, unit: &'static str) -> Self {
        self.attribute("unit", unit)
    }

    fn frame(self, frame: &'static str) -> Self {
        self.attribute("frame", frame)
    }

    fn meaning(self, meaning: &'static str) -> Self {
        self.attribute("meaning", meaning)
    }

    fn number_type(self, number_type: NumberType) -> Self {
        Self { number_type, ..self }
    }

    fn about(self, about: &'static str) -> Self {
        Self { about, ..self }
    }
}

fn of_robot(stream: &'static RobotStream) -> Option<StreamSpec> {
    let recorded = stream.recorded.as_ref()?;
    let attributes = [("unit", stream.unit), ("frame", recorded.frame), ("meaning", recorded.meaning)];
    let presence = recorded.flag.map_or(Presence::Always, Presence::Flag);
    let attributes = attributes.into_iter().filter(|(_, text)| !text.is_empty()).collect();
    let own = read_by(recorded.path, &[Some(stream.width)], Read::Robot(stream.read));
    let own = own.number_type(recorded.number_type).about(stream.about);
    Some(StreamSpec { presence, attributes, ..own })
}

/// Actions, rewards, episode ends and timestamps.
fn top_level() -> Vec<StreamSpec> {
    let action = |code: GripCode, gripper, read| {
        let unit = if code == GripCode::Force { "m, rad, N" } else { "m, rad, 1" };
        let spec = always(actions_in(code), &[7], read).unit(unit).frame(BASE).meaning(ACTION);
        spec.attribute("gripper", gripper).attribute("grip_code", code.name())
    };
    vec![
        action(GripCode::Continuous, "continuous closure: 1 - commanded width / 0.08 m", |rollout| {
            Some(rollout.actions_with(rollout.closures()))
        })
        .about(
            "absolute tool position (m) and axis-angle (rad), base, a vector that is [continuous](policies.md#profiles) along \
             the demonstration; closure from 0 open to 1 closed, continuous",
        ),
        action(GripCode::Binary, "binary: 1 while the gripper closes to hold, and holds, else 0", |rollout| {
            Some(rollout.actions_with(rollout.is_closed.iter().map(|is_closed| one(*is_closed)).collect()))
        })
        .about(
            "the same with 1 from the step in which the hand begins to close in order to hold until it lets go, else 0",
        ),
        action(
            GripCode::TwoWidth,
            "two-width: closure 0 while open, the median commanded closure of the closed steps while closed",
            |rollout| Some(rollout.actions_with(grip_labels::two_widths(&rollout.closures(), rollout.is_closed))),
        )
        .about(
            "the same with 0 while open; while closed the median closure that is commanded in the closed steps of this \
             demonstration",
        ),
        action(
            GripCode::Force,
            "force: mean pressing force of both pads after the step, N, while closed; -1 while open",
            |rollout| Some(rollout.actions_with(grip_labels::forces(&rollout.grip_forces(), rollout.is_closed))),
        )
        .about(
            "the same with −1 while open; while closed the grip force after the step, N: the mean pressing force of both \
             pads. Until it first reaches its median over the closed steps, the label is that median, since the hand closes \
             to it",
        ),
        always(JOINT_ACTIONS, &[ARM_DOFS], |rollout| {
            Some(rollout.finished.joint_commands.iter().flatten().copied().collect())
        })
        .unit("rad")
        .meaning("the motion of the actions as commanded joint positions")
        .about(
            "the motion of the actions as joint positions, rad: what inverse kinematics makes of the pose in that step, \
             without a disturbance, or what the policy commanded. With the gripper of one of the streams above it is an \
             action in [joint positions](policies.md#joint-positions)",
        ),
        sometimes(COMMANDS_JOINTS, &[], |rollout| {
            let are_joints = rollout.finished.actions.iter().map(|action| action.joints.is_some());
            are_joints.clone().any(|are| are).then(|| are_joints.map(one).collect())
        })
        .number_type(NumberType::U8)
        .meaning("1 where the recorded policy commanded joint positions, not a pose")
        .about(
            "1 where the policy commanded joint positions; only if there are any. `actions` then have the pose at these",
        ),
        sometimes(COMMANDED_ROTATIONS, &[3], |rollout| {
            let vectors = rollout.finished.actions.iter().map(|action| action.axis_angle_b);
            let differs = vectors.clone().zip(&rollout.actions).any(|(own, action)| own != action.axis_angle_b);
            differs.then(|| vectors.flat_map(<[f64; 3]>::from).collect())
        })
        .unit("rad")
        .frame(BASE)
        .meaning("axis-angle of the actions as commanded, which may change sign at half a turn")
        .about(
            "axis-angle of the actions as commanded, rad, which may change sign at half a turn; only where `actions` differ. \
             Replays start from it",
        ),
        always("rewards", &[], |rollout| Some(rollout.is_last())).about("1 in the last step"),
        always("dones", &[], |rollout| Some(rollout.is_last())).number_type(NumberType::U8).about("1 in the last step"),
        always("timestamps", &[], |rollout| {
            Some((0..rollout.steps()).map(|step| step as f64 * CONTROL_DT).collect())
        })
        .unit("s")
        .about("s, 20 Hz"),
    ]
}

/// Observations other than images and the robot's own state.
fn observed() -> Vec<StreamSpec> {
    let camera = |index: usize, path| {
        let pose = read_by(path, &[Some(7)], Read::Camera(index)).unit("m, 1").frame(BASE);
        pose.meaning(CAMERA_POSE).about(
            "pose of the camera, base, with OpenGL's axes (x right, y up, view along −z); the attribute `intrinsic` is the \
             matrix for the recorded images, for OpenCV's axes: JSON as text, see below",
        )
    };
    vec![
        camera(0, "obs/agentview_pose"),
        camera(1, "obs/eye_in_hand_pose"),
        always(MARKER_MOTION, &MARKER_ROW, |rollout| {
            let numbers = rollout.markers.iter().flatten().flat_map(Markers::to_array);
            Some(numbers.flatten().flatten().map(f64::from).collect())
        })
        .number_type(NumberType::F32)
        .unit("px of the tactile picture")
        .attribute("axes", "step, finger (left, right), initial and present, marker, (x, y)")
        .about("finger, initial and present, marker, (x, y) px"),
    ]
}

/// Images and their depth, which the writer renders.
fn images() -> Vec<StreamSpec> {
    let image = |path: &'static str| {
        let about = match path.contains("tactile") {
            true => "240 × 320, without markers",
            false => "224 × 224 by default, rows from the top, sRGB",
        };
        let image = read_by(path, &[None, None, Some(3)], Read::Rendered).number_type(NumberType::U8);
        image.attribute("axes", "step, row from the top, column, RGB (sRGB)").about(about)
    };
    let depth = |path| {
        let depth = read_by(path, &[None, None], Read::Rendered).number_type(NumberType::F32).unit("m");
        let depth = depth.attribute("axes", "step, row from the top, column").about(
            "depth along the optical axis, m; infinite in the background. About 25 kB per step of the static camera and \
             50 kB of the wrist camera, compressed",
        );
        let presence = Presence::Flag(DEPTH_FLAG);
        StreamSpec { presence, ..depth }.meaning("depth along the optical axis; infinite in the background")
    };
    IMAGES.into_iter().map(image).chain(DEPTHS.into_iter().map(depth)).collect()
}

/// Ground truth: shapes, forces, contact and deformation, which no real robot could measure.
fn privileged() -> Vec<StreamSpec> {
    let deformation = |path, metric, read| {
        let percent = sometimes(path, &[], read).unit("% of the settled bounding box's diagonal");
        percent
            .attribute("metric_id", metric)
            .meaning("worst over the physics steps of the control step before")
    };
    vec![
        sometimes("privileged/actions_with_force", &[13], |rollout| {
            let forces = rollout.loads(|pad| pad.wrench.force);
            let rows = rollout.actions.iter().zip(forces.as_chunks::<6>().0);
            Some(rows.flat_map(|(action, force)| action.to_array().into_iter().chain(*force)).collect())
        })
        .unit("m, rad, 1, N")
        .frame("robot base; forces: pad")
        .meaning("the actions, then the force on the left and on the right gel")
        .about("SoftVTBench's actions: `actions`, then both forces"),
        sometimes("privileged/gripper_net_force", &[2, 3], |rollout| Some(rollout.loads(|pad| pad.wrench.force)))
            .unit("N")
            .frame("pad")
            .about("force on the left and on the right gel, N, pad frame"),
        sometimes("privileged/gripper_net_moment", &[2, 3], |rollout| Some(rollout.loads(|pad| pad.wrench.moment)))
            .unit("N m")
            .frame("pad, about its apex")
            .about("moment on the left and on the right gel, N m, pad frame"),
        sometimes("privileged/contact", &[2], |rollout| {
            rollout.traced(|trace| trace.pad_force_n.map(|force| one(force > 0.0)).to_vec())
        })
        .number_type(NumberType::U8)
        .meaning("whether the left and the right pad press on the target")
        .about("of the pads on the object: 1 if in contact"),
        sometimes("privileged/pad_force", &[2], |rollout| rollout.traced(|trace| trace.pad_force_n.to_vec()))
            .unit("N")
            .meaning("normal force of the left and the right pad on the target")
            .about("of the pads on the object: normal force, N"),
        sometimes("privileged/slip", &[2], |rollout| rollout.traced(|trace| trace.slip_mm.to_vec())).unit("mm").about(
            "of the pads on the object: distance slid since first contact, mm, on a support too (NoSlip counts \
             [less](results.md#episodesjsonl))",
        ),
        sometimes("privileged/dropped", &[], |rollout| rollout.traced(|trace| vec![one(trace.dropped)]))
            .number_type(NumberType::U8)
            .about("1 once dropped"),
        deformation(DEFORMATION, METRIC_ID, |rollout| {
            rollout.scored(|score| Some(score.targets[0].deformation?.rms_pct))
        })
        .about("D, % of the diagonal; the worst of the previous control step"),
        deformation("privileged/d_max", METRIC_ID, |rollout| {
            rollout.scored(|score| Some(score.targets[0].deformation?.max_pct))
        })
        .about("the largest displacement of a node, % of the diagonal; the worst of the previous control step"),
        deformation("privileged/soft_extras/fem_deformation_rms", V1_METRIC_ID, |rollout| {
            rollout.scored(|score| Some(score.targets[0].deformation_v1?.v1_rms_pct))
        })
        .about("D as SoftVTBench's released code defines it"),
        sometimes("privileged/soft_extras/fem_bbox_dims", &[3], |rollout| {
            let at_rest: [f64; 3] = rollout.finished.reference.as_ref()?.bbox_m().into();
            let size = |score: &ControlStepScore| {
                score.targets[0].deformation_v1.map_or(vec![f64::NAN; 3], |d| d.bbox_m.as_slice().to_vec())
            };
            Some(shifted(&rollout.finished.scores, at_rest.to_vec(), size))
        })
        .unit("m")
        .frame("world")
        .about("edges of the bounding box, m"),
        read_by(
            "privileged/states/deformable_object/<name>/nodal_pos_w",
            &[None, Some(3)],
            Read::Bodies(|body| match body {
                BodyConfiguration::Nodes(nodes) => Some(nodes.iter().flatten().copied().collect()),
                BodyConfiguration::Pose(_) => None,
            }),
        )
        .number_type(NumberType::F32)
        .unit("m")
        .frame("world")
        .about("m, world"),
        read_by(
            "privileged/states/rigid_object/<name>/root_pose_w",
            &[Some(7)],
            Read::Bodies(|body| match body {
                BodyConfiguration::Nodes(_) => None,
                BodyConfiguration::Pose(pose) => Some(pose_row(pose).to_vec()),
            }),
        )
        .unit("m, 1")
        .frame("world")
        .meaning("position, quaternion w x y z with w >= 0")
        .about("position, quaternion, world; also for parts of articulated objects"),
    ]
}

fn one(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// Rows of the states before each action, given those after each step. `first` is the row of the settled state.
fn shifted<T>(after: &[T], first: Vec<f64>, numbers: impl Fn(&T) -> Vec<f64>) -> Vec<f64> {
    // The state after the last action has no row.
    let before = after.len().saturating_sub(1);
    first.into_iter().chain(after[..before].iter().flat_map(numbers)).collect()
}

impl<'a> Rollout<'a> {
    pub(crate) fn new(
        finished: &'a FinishedEpisode,
        recording: &'a StateRecording,
        is_closed: &'a [bool],
        markers: &'a [[Markers; 2]],
    ) -> Self {
        let loads = recording.frames.iter().map(Sensors::pad_forces).collect();
        Self {
            finished,
            recording,
            is_closed,
            markers,
            actions: continuous(&finished.actions).collect(),
            loads,
        }
    }

    fn steps(&self) -> usize {
        self.finished.actions.len()
    }

    fn closures(&self) -> Vec<f64> {
        self.finished.actions.iter().map(Action::closure).collect()
    }

    /// Rows of actions with these numbers of the gripper.
    fn actions_with(&self, grips: Vec<f64>) -> Vec<f64> {
        let row =
            |(action, grip): (&Action, f64)| Action { grip: GripTarget::Closure(grip), ..*action }.to_array();
        self.actions.iter().zip(grips).flat_map(row).collect()
    }

    /// Mean pressing force of both pads after each step, N.
    fn grip_forces(&self) -> Vec<f64> {
        let after = self.loads.iter().skip(1).chain(self.loads.last()).take(self.steps());
        let force = |pads: &[PadForce; 2]| {
            pads.iter().map(|pad| pad.wrench.normal().max(0.0)).sum::<f64>() / pads.len() as f64
        };
        after.map(force).collect()
    }

    fn loads(&self, pick: fn(&PadForce) -> Vec3) -> Vec<f64> {
        let pads = self.loads.iter().take(self.steps()).flatten();
        pads.flat_map(|pad| <[f64; 3]>::from(pick(pad))).collect()
    }

    fn is_last(&self) -> Vec<f64> {
        (1..=self.steps()).map(|count| one(count == self.steps())).collect()
    }

    /// Numbers of the trace, which is 0 in the settled state; `None` without a trace.
    fn traced(&self, numbers: fn(&StepTrace) -> Vec<f64>) -> Option<Vec<f64>> {
        let trace = &self.finished.trace;
        let width = numbers(trace.first()?).len();
        Some(shifted(trace, vec![0.0; width], numbers))
    }

    /// Numbers of a soft target, which are 0 in the settled state.
    fn scored(&self, number: fn(&ControlStepScore) -> Option<f64>) -> Option<Vec<f64>> {
        self.finished.reference.as_ref()?;
        let number = |score: &ControlStepScore| vec![number(score).unwrap_or(f64::NAN)];
        Some(shifted(&self.finished.scores, vec![0.0], number))
    }

    /// Poses of a standard camera before each action, with its intrinsic matrix.
    fn camera(&self, spec: &StreamSpec, standard: usize) -> Option<DataStream> {
        let (sensors, frames) = (&self.recording.sensors, &self.recording.frames);
        let name = STANDARD_CAMERAS[standard];
        let index = sensors.cameras().iter().position(|camera| camera.name == name)?;
        let base_inverse = sensors.base_w().inverse();
        let pose_b = |frame| base_inverse * sensors.cameras_w(frame)[index];
        let poses = frames.iter().take(self.steps()).flat_map(|frame| pose_row(&pose_b(frame)));
        let mut stream = spec.stream(spec.path.to_owned(), self.steps(), poses.collect());
        stream
            .attributes
            .push(("intrinsic".to_owned(), format!("{:?}", sensors.cameras()[index].intrinsic())));
        Some(stream)
    }

    /// All streams but images and depth. The true state is left out unless it is asked for, and so are streams
    /// with a flag that is not among `flags`.
    pub(crate) fn streams(&self, has_privileged: bool, flags: impl Fn(&str) -> bool) -> Vec<DataStream> {
        let is_wanted = |spec: &StreamSpec| match spec.presence {
            Presence::Flag(flag) => flags(flag),
            _ => has_privileged || !spec.is_privileged(),
        };
        let (bodies, others): (Vec<_>, Vec<_>) =
            all().into_iter().filter(is_wanted).partition(|spec| matches!(spec.read, Read::Bodies(_)));
        others.iter().filter_map(|spec| self.stream(spec)).chain(self.bodies(&bodies)).collect()
    }

    fn stream(&self, spec: &StreamSpec) -> Option<DataStream> {
        let numbers = match spec.read {
            Read::Rollout(read) => read(self)?,
            Read::Robot(read) => self.recording.robot.iter().take(self.steps()).flat_map(read).collect(),
            Read::Camera(standard) => return self.camera(spec, standard),
            Read::Bodies(_) | Read::Rendered => return None,
        };
        Some(spec.stream(spec.path.to_owned(), self.steps(), numbers))
    }

    /// Configurations of all bodies before each action, in the order of the scene.
    fn bodies(&self, specs: &[StreamSpec]) -> Vec<DataStream> {
        let (sensors, mut all) = (&self.recording.sensors, Vec::<(&StreamSpec, String, Vec<f64>)>::new());
        for (step, frame) in self.recording.frames.iter().take(self.steps()).enumerate() {
            for (index, (name, body)) in sensors.body_configurations(frame).enumerate() {
                let read = |spec: &StreamSpec| match spec.read {
                    Read::Bodies(read) => read(&body),
                    _ => None,
                };
                let Some((spec, row)) = specs.iter().find_map(|spec| Some((spec, read(spec)?))) else {
                    continue;
                };
                if step == 0 {
                    all.push((spec, spec.path.replace(NAME, name), Vec::new()));
                }
                all[index].2.extend(row);
            }
        }
        all.into_iter().map(|(spec, path, numbers)| spec.stream(path, self.steps(), numbers)).collect()
    }
}

/// The actions with rotation vectors that are continuous along the episode.
pub(crate) fn continuous(actions: &[Action]) -> impl Iterator<Item = Action> {
    let vectors = rotation::continuous(actions.iter().map(|action| action.axis_angle_b));
    actions.iter().zip(vectors).map(|(action, axis_angle_b)| Action { axis_angle_b, ..*action })
}

/// A sentence as the content of a cell: without its full stop, and without a capital at its beginning.
fn phrase(sentence: &str) -> String {
    let text = sentence.trim_end_matches('.');
    let is_word = text.chars().nth(1).is_some_and(char::is_lowercase);
    let first = text.chars().next().filter(|_| is_word && !text.starts_with("SoftVTBench"));
    first.map_or(text.to_owned(), |first| format!("{}{}", first.to_lowercase(), &text[first.len_utf8()..]))
}

/// The tables of `docs/data.md`, by name: usual streams, streams with a flag, and the true state.
pub fn stream_tables() -> [(&'static str, String); 3] {
    let table = |is_in: &dyn Fn(&StreamSpec) -> bool, prefix: &str| {
        let row = |spec: StreamSpec| {
            let (path, shape) = (spec.path.trim_start_matches(prefix), spec.shape_text());
            format!("| `{path}` | {shape} {} | {} |\n", spec.number_type.name(), phrase(spec.about))
        };
        let rows: String = all().into_iter().filter(is_in).map(row).collect();
        format!("| stream | shape | |\n|---|---|---|\n{rows}")
    };
    let has_flag = |spec: &StreamSpec| matches!(spec.presence, Presence::Flag(_));
    [
        ("streams", table(&|spec| !has_flag(spec) && !spec.is_privileged(), "")),
        ("optional-streams", table(&has_flag, "")),
        ("privileged-streams", table(&StreamSpec::is_privileged, "privileged/")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_lists_every_stream() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/data.md");
        let page = std::fs::read_to_string(path).unwrap();
        let mut updated = page;
        for (name, table) in stream_tables() {
            let [begin, end] = ["begin", "end"].map(|edge| format!("<!-- {name}:{edge} -->\n"));
            let (before, rest) = updated.split_once(&begin).expect("the beginning of the table");
            let (_, after) = rest.split_once(&end).expect("its end");
            updated = format!("{before}{begin}{table}{end}{after}");
        }
        if std::env::var_os("SOFTVT_WRITE_DOCS").is_some() {
            std::fs::write(path, &updated).unwrap();
        }
        assert!(
            std::fs::read_to_string(path).unwrap() == updated,
            "docs/data.md differs from the declarations; run .ci/regenerate streams"
        );
    }
}
