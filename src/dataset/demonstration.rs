//! [`Demonstration`]: a rollout as training data, without its images.

use softvt_benchmark::CONTROL_DT;
use softvt_geometry::Vec3;
use softvt_policy::{Action, profile::GripCode};
use softvt_robot::{
    GripTarget,
    gripper::{self, MAX_WIDTH},
    ik::ArmAngles,
    panda::ARM_DOFS,
    rotation,
};
use softvt_rollout::{FinishedEpisode, Sensors, StateRecording};
use softvt_runs::record::EpisodeRecord;
use softvt_scene::STANDARD_CAMERAS;
use softvt_sensing::tactile::{MARKER_COUNT, Markers};

use super::{
    grip_labels, privileged,
    stream::{DataStream, pose_row},
};

/// A rollout as training data: the state before each control step, and the action commanded in it.
///
/// Images are not part of it; [`super::demonstration_writer`] renders them into the files.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    /// Header and verdict of the episode.
    pub record: EpisodeRecord,
    /// Commanded action per control step, as it was executed. Files have continuous rotation vectors in its place.
    pub actions: Vec<Action>,
    /// Joint positions that each action means, rad; see
    /// [`FinishedEpisode::joint_commands`](softvt_rollout::FinishedEpisode::joint_commands).
    pub joint_commands: Vec<ArmAngles>,
    /// True in steps in which the gripper is commanded to hold: its binary code.
    pub gripper_closed: Vec<bool>,
    /// Seventh numbers of the actions in the code force, N.
    pub grip_labels_n: Vec<f64>,
    /// Observations other than images, `obs/…`.
    pub observed: Vec<DataStream>,
    /// Ground truth that no real robot could measure, `privileged/…`; may be left out.
    pub privileged: Vec<DataStream>,
}

/// Value of the attribute `frame`.
const BASE: &str = "robot base";

impl Demonstration {
    /// Collects the streams of a rollout that was run with a state recording and a trace.
    ///
    /// `gripper_closed` has one entry per control step; `with_privileged` adds the ground-truth streams.
    pub fn new(
        finished: &FinishedEpisode,
        recording: &StateRecording,
        gripper_closed: Vec<bool>,
        with_privileged: bool,
    ) -> Self {
        let actions = finished.actions.clone();
        let privileged = if with_privileged { privileged::streams(finished, recording) } else { Vec::new() };
        Self {
            record: finished.record.clone(),
            observed: [proprioception_streams(recording, &actions), camera_streams(recording, actions.len())]
                .concat(),
            grip_labels_n: grip_labels::forces(&grip_forces(recording, actions.len()), &gripper_closed),
            gripper_closed,
            actions,
            joint_commands: finished.joint_commands.clone(),
            privileged,
        }
    }

    /// Number of control steps.
    pub fn steps(&self) -> usize {
        self.actions.len()
    }

    /// Appends the stream of the torques of the arm's drives, given per state.
    pub fn set_joint_torques(&mut self, torques: &[[f64; ARM_DOFS]]) {
        let rows = torques.iter().take(self.steps()).flatten().copied().collect();
        let stream = DataStream::f64(JOINT_TORQUES, &[ARM_DOFS], rows)
            .unit("N m", "")
            .attribute("meaning", "torques of the arm's drives; gravity is compensated and not part of them");
        self.observed.push(stream);
    }

    /// Appends the stream of tactile marker positions, given per step and finger (left, right).
    pub fn set_markers(&mut self, markers: &[[Markers; 2]]) {
        let positions = markers.iter().flatten().flat_map(Markers::to_array).flatten().flatten().collect();
        let stream = DataStream::f32("obs/gripper_marker_motion", &[2, 2, MARKER_COUNT, 2], positions)
            .unit("px of the tactile picture", "")
            .attribute("axes", "step, finger (left, right), initial and present, marker, (x, y)");
        self.observed.push(stream);
    }

    /// The streams outside `obs` and `privileged`: actions in every grip code, rewards, episode ends and timestamps.
    pub fn top_level_streams(&self) -> Vec<DataStream> {
        let steps = self.steps();
        let mut all = GripCode::ALL.map(|code| self.actions_in(code)).to_vec();
        all.push(
            DataStream::f64(
                JOINT_ACTIONS,
                &[ARM_DOFS],
                self.joint_commands.iter().flatten().copied().collect(),
            )
            .unit("rad", "")
            .attribute("meaning", "the motion of the actions as commanded joint positions"),
        );
        if self.actions.iter().any(|action| action.joints.is_some()) {
            let are_joints = self.actions.iter().map(|action| u8::from(action.joints.is_some()));
            all.push(
                DataStream::u8(COMMANDS_JOINTS, &[], are_joints.collect()).attribute(
                    "meaning",
                    "1 where the recorded policy commanded joint positions, not a pose",
                ),
            );
        }
        let pairs = || self.actions.iter().zip(continuous(&self.actions));
        if pairs().any(|(action, written)| action.axis_angle_b != written.axis_angle_b) {
            let vectors = self.actions.iter().flat_map(|action| <[f64; 3]>::from(action.axis_angle_b));
            all.push(
                DataStream::f64(COMMANDED_ROTATIONS, &[3], vectors.collect()).unit("rad", BASE).attribute(
                    "meaning",
                    "axis-angle of the actions as commanded, which may change sign at half a turn",
                ),
            );
        }
        let last = |step: usize| step + 1 == steps;
        all.extend([
            DataStream::f64("rewards", &[], (0..steps).map(|step| f64::from(u8::from(last(step)))).collect()),
            DataStream::u8("dones", &[], (0..steps).map(|step| u8::from(last(step))).collect()),
            DataStream::f64("timestamps", &[], (0..steps).map(|step| step as f64 * CONTROL_DT).collect())
                .unit("s", ""),
        ]);
        all
    }

    /// The actions with their seventh number in a grip code.
    fn actions_in(&self, code: GripCode) -> DataStream {
        let closures: Vec<f64> = self.actions.iter().map(|action| action.closure()).collect();
        let (grip, meaning) = match code {
            GripCode::Continuous => (closures, "continuous closure: 1 - commanded width / 0.08 m"),
            GripCode::Binary => {
                let closed = self.gripper_closed.iter().map(|is_closed| f64::from(u8::from(*is_closed)));
                (closed.collect(), "binary: 1 while the gripper closes to hold, and holds, else 0")
            }
            GripCode::TwoWidth => (
                grip_labels::two_widths(&closures, &self.gripper_closed),
                "two-width: closure 0 while open, the median commanded closure of the closed steps while closed",
            ),
            GripCode::Force => (
                self.grip_labels_n.clone(),
                "force: mean pressing force of both pads after the step, N, while closed; -1 while open",
            ),
        };
        let rows = continuous(&self.actions).zip(grip);
        let rows = rows
            .flat_map(|(action, closure)| Action { grip: GripTarget::Closure(closure), ..action }.to_array())
            .collect();
        let unit = if code == GripCode::Force { "m, rad, N" } else { "m, rad, 1" };
        DataStream::f64(actions_stream_name(code), &[7], rows)
            .unit(unit, BASE)
            .attribute(
                "meaning",
                "absolute tool position (m) and axis-angle (rad, continuous along the episode), gripper",
            )
            .attribute("gripper", meaning)
            .attribute("grip_code", code.name())
    }
}

/// Name of the stream of the torques of the arm's drives.
pub(crate) const JOINT_TORQUES: &str = "obs/joint_torques";
/// Name of the stream of actions as joint positions.
pub(crate) const JOINT_ACTIONS: &str = "actions_joints";
/// Name of the stream of the rotation vectors as commanded, rad; present if those of the actions are others.
pub(crate) const COMMANDED_ROTATIONS: &str = "commanded_rotations";
/// Name of the stream that marks actions that commanded joint positions; present if there are any.
pub(crate) const COMMANDS_JOINTS: &str = "commands_joints";

/// The actions with rotation vectors that are continuous along the episode.
pub(crate) fn continuous(actions: &[Action]) -> impl Iterator<Item = Action> {
    let vectors = rotation::continuous(actions.iter().map(|action| action.axis_angle_b));
    actions.iter().zip(vectors).map(|(action, axis_angle_b)| Action { axis_angle_b, ..*action })
}

/// Name of the stream of actions in a grip code.
pub(crate) fn actions_stream_name(code: GripCode) -> &'static str {
    match code {
        GripCode::Continuous => "actions",
        GripCode::Binary => "actions_binary",
        GripCode::TwoWidth => "actions_two_width",
        GripCode::Force => "actions_force",
    }
}

/// Mean pressing force of both pads after each step, N.
fn grip_forces(recording: &StateRecording, steps: usize) -> Vec<f64> {
    let after = recording.frames.iter().skip(1).chain(recording.frames.last());
    let force = |frame| {
        let pads = Sensors::pad_forces(frame);
        pads.iter().map(|pad| pad.wrench.normal().max(0.0)).sum::<f64>() / pads.len() as f64
    };
    after.take(steps).map(force).collect()
}

/// Names of the streams with the poses of the standard cameras.
pub(crate) const CAMERA_POSES: [&str; 2] = ["obs/agentview_pose", "obs/eye_in_hand_pose"];

/// Poses of the standard cameras before each action, with their intrinsic matrices.
fn camera_streams(recording: &StateRecording, steps: usize) -> Vec<DataStream> {
    let sensors = &recording.sensors;
    let base_inverse = sensors.base_w().inverse();
    let stream = |(camera_name, stream_name): (&str, &str)| {
        let index = sensors.cameras().iter().position(|camera| camera.name == camera_name)?;
        let pose_b = |frame| base_inverse * sensors.cameras_w(frame)[index];
        let poses = recording.frames.iter().take(steps).flat_map(|frame| pose_row(&pose_b(frame)));
        let stream = DataStream::f64(stream_name, &[7], poses.collect()).unit("m, 1", BASE);
        let meaning = "position, quaternion w x y z with w >= 0; x right, y up, view along -z";
        let matrix = format!("{:?}", sensors.cameras()[index].intrinsic());
        Some(stream.attribute("meaning", meaning).attribute("intrinsic", &matrix))
    };
    STANDARD_CAMERAS.into_iter().zip(CAMERA_POSES).filter_map(stream).collect()
}

/// Proprioception before each action.
fn proprioception_streams(recording: &StateRecording, actions: &[Action]) -> Vec<DataStream> {
    let states: Vec<_> =
        recording.frames.iter().take(actions.len()).map(|f| recording.sensors.proprioception(f)).collect();
    let each =
        |numbers: &dyn Fn(usize) -> Vec<f64>| (0..states.len()).flat_map(numbers).collect::<Vec<f64>>();
    let width = |i: usize| gripper::width(states[i].fingers);
    let commanded =
        |i: usize| i.checked_sub(1).map_or(0.0, |before| actions[before].closure().clamp(0.0, 1.0));
    let pose = each(&|i| pose_row(&states[i].tool_b).to_vec());
    let turns = states.iter().map(|state| rotation::axis_angle(&state.tool_b.rotation));
    let turns: Vec<Vec3> = rotation::continuous(turns).collect();
    let state = each(&|i| {
        let place = states[i].tool_b.translation.vector;
        place.iter().chain(turns[i].iter()).copied().chain([0.5 * width(i)]).collect()
    });
    vec![
        DataStream::f64("obs/eef_pose", &[7], pose)
            .unit("m, 1", BASE)
            .attribute("meaning", "tool position, quaternion w x y z with w >= 0"),
        DataStream::f64("obs/state", &[7], state)
            .unit("m, rad, m", BASE)
            .attribute("meaning", "tool position, axis-angle, position of one finger (0 shut to 0.04)"),
        DataStream::f64("obs/arm_joint_pos", &[7], each(&|i| states[i].joints.to_vec())).unit("rad", ""),
        DataStream::f64("obs/gripper_pos", &[2], each(&|i| states[i].fingers.to_vec())).unit("m", ""),
        DataStream::f64("obs/gripper_width", &[1], each(&|i| vec![width(i)])).unit("m", ""),
        DataStream::f64("obs/gripper_width_sensed", &[1], each(&|i| vec![states[i].sensed_width_m]))
            .unit("m", "")
            .attribute("meaning", "the width with the steps and the offset of a real hand"),
        DataStream::f64("obs/gripper_close_norm", &[1], each(&|i| vec![1.0 - width(i) / MAX_WIDTH]))
            .unit("1", "")
            .attribute("meaning", "measured: 1 - width / 0.08 m"),
        DataStream::f64("obs/gripper_closure", &[1], each(&|i| vec![commanded(i)]))
            .unit("1", "")
            .attribute("meaning", "commanded last: 0 open to 1 shut"),
    ]
}
