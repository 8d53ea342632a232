//! A demonstration in memory: everything but its pictures.

use crate::{
    benchmark::control::CONTROL_DT,
    evaluation::record::EpisodeRecord,
    policy::Action,
    robot::{
        gripper::{self, MAX_WIDTH},
        rotation,
    },
    rollout::{FinishedEpisode, StateRecording},
    sensing::tactile::{MARKERS, Markers},
};

use super::hidden;

/// Numbers of a stream, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Doubles.
    F64(Vec<f64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Bytes: pictures and truth values.
    U8(Vec<u8>),
}

/// One stream: an array whose first axis are the control steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// Path below the demonstration, such as `obs/eef_pose`.
    pub name: String,
    /// Shape of one step; empty for a single number.
    pub row: Vec<usize>,
    /// The numbers, steps × row.
    pub numbers: Numbers,
    /// What to know of them: `unit`, `frame`, …
    pub notes: Vec<(String, String)>,
}

/// A rollout to learn from: the state before each control step, and what was commanded in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    /// Which episode it is of, and how it was judged.
    pub record: EpisodeRecord,
    /// What was commanded in each control step.
    pub actions: Vec<Action>,
    /// Whether the gripper was meant to hold in each control step: the gripper's binary code.
    pub shut: Vec<bool>,
    /// What a policy may see but pictures, `obs/…`.
    pub observed: Vec<Stream>,
    /// What no real robot could measure, `privileged/…`; empty if it was left out.
    pub privileged: Vec<Stream>,
}

/// Words of the notes.
const BASE: &str = "robot base";

impl Stream {
    /// A stream of doubles.
    pub fn f64(name: impl Into<String>, row: &[usize], numbers: Vec<f64>) -> Self {
        Self { name: name.into(), row: row.to_vec(), numbers: Numbers::F64(numbers), notes: Vec::new() }
    }

    /// A stream in single precision.
    pub fn f32(name: impl Into<String>, row: &[usize], numbers: Vec<f32>) -> Self {
        Self { name: name.into(), row: row.to_vec(), numbers: Numbers::F32(numbers), notes: Vec::new() }
    }

    /// A stream of bytes.
    pub fn u8(name: impl Into<String>, row: &[usize], numbers: Vec<u8>) -> Self {
        Self { name: name.into(), row: row.to_vec(), numbers: Numbers::U8(numbers), notes: Vec::new() }
    }

    /// The same with something to know of it.
    pub fn note(mut self, name: &str, text: &str) -> Self {
        self.notes.push((name.to_owned(), text.to_owned()));
        self
    }

    /// The same with its unit and its frame.
    pub fn of(self, unit: &str, frame: &str) -> Self {
        let stream = self.note("unit", unit);
        if frame.is_empty() { stream } else { stream.note("frame", frame) }
    }
}

impl Demonstration {
    /// That of a finished rollout with a film and a trace; `shut` as whoever drove meant it, in every control step.
    pub fn new(finished: &FinishedEpisode, film: &StateRecording, shut: Vec<bool>, privileged: bool) -> Self {
        let actions = finished.actions.clone();
        let privileged = if privileged { hidden::streams(finished, film) } else { Vec::new() };
        Self {
            record: finished.record.clone(),
            observed: observed(film, &actions),
            shut,
            actions,
            privileged,
        }
    }

    /// Control steps.
    pub fn steps(&self) -> usize {
        self.actions.len()
    }

    /// Takes what the fingers felt in each step.
    pub fn set_markers(&mut self, felt: &[[Markers; 2]]) {
        let places = felt.iter().flatten().flatten().flatten().flatten().copied().collect();
        let stream = Stream::f32("obs/gripper_marker_motion", &[2, 2, MARKERS, 2], places)
            .of("px of the tactile picture", "")
            .note("axes", "step, finger (left, right), initial and present, marker, (x, y)");
        self.observed.push(stream);
    }

    /// What is beside `obs` and `privileged`: actions in both codes of the gripper, rewards, ends and times.
    pub fn outer(&self) -> Vec<Stream> {
        let steps = self.steps();
        let coded = |closure: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let row = |(step, a): (usize, &Action)| {
                let [p, r] = [a.position_b, a.axis_angle_b];
                [p.x, p.y, p.z, r.x, r.y, r.z, closure(step)]
            };
            self.actions.iter().enumerate().flat_map(row).collect()
        };
        let meaning = "absolute tool position (m) and axis-angle (rad), gripper 0 open to 1 shut";
        let last = |step: usize| step + 1 == steps;
        vec![
            Stream::f64("actions", &[7], coded(&|step| self.actions[step].closure))
                .of("m, rad, 1", BASE)
                .note("meaning", meaning)
                .note("gripper", "continuous closure: 1 - commanded width / 0.08 m"),
            Stream::f64("actions_binary", &[7], coded(&|step| f64::from(u8::from(self.shut[step]))))
                .of("m, rad, 1", BASE)
                .note("meaning", meaning)
                .note("gripper", "binary: 1 while the gripper is meant to hold, else 0"),
            Stream::f64("rewards", &[], (0..steps).map(|step| f64::from(u8::from(last(step)))).collect()),
            Stream::u8("dones", &[], (0..steps).map(|step| u8::from(last(step))).collect()),
            Stream::f64("timestamps", &[], (0..steps).map(|step| step as f64 * CONTROL_DT).collect())
                .of("s", ""),
        ]
    }
}

/// What the robot measures of itself before each action.
fn observed(film: &StateRecording, actions: &[Action]) -> Vec<Stream> {
    let stances: Vec<_> =
        film.frames.iter().take(actions.len()).map(|f| film.sensors.proprioception(f)).collect();
    let each =
        |numbers: &dyn Fn(usize) -> Vec<f64>| (0..stances.len()).flat_map(numbers).collect::<Vec<f64>>();
    let width = |i: usize| gripper::width(stances[i].fingers);
    let commanded = |i: usize| i.checked_sub(1).map_or(0.0, |before| actions[before].closure.clamp(0.0, 1.0));
    let pose = each(&|i| {
        let tool = stances[i].tool_b;
        let q = rotation::canonical(&tool.rotation);
        tool.translation.vector.iter().copied().chain([q.w, q.i, q.j, q.k]).collect()
    });
    let state = each(&|i| {
        let tool = stances[i].tool_b;
        let turn = rotation::axis_angle(&tool.rotation);
        tool.translation.vector.iter().chain(turn.iter()).copied().chain([0.5 * width(i)]).collect()
    });
    vec![
        Stream::f64("obs/eef_pose", &[7], pose)
            .of("m, 1", BASE)
            .note("meaning", "tool position, quaternion w x y z with w >= 0"),
        Stream::f64("obs/state", &[7], state)
            .of("m, rad, m", BASE)
            .note("meaning", "tool position, axis-angle, position of one finger (0 shut to 0.04)"),
        Stream::f64("obs/arm_joint_pos", &[7], each(&|i| stances[i].joints.to_vec())).of("rad", ""),
        Stream::f64("obs/gripper_pos", &[2], each(&|i| stances[i].fingers.to_vec())).of("m", ""),
        Stream::f64("obs/gripper_width", &[1], each(&|i| vec![width(i)])).of("m", ""),
        Stream::f64("obs/gripper_close_norm", &[1], each(&|i| vec![1.0 - width(i) / MAX_WIDTH]))
            .of("1", "")
            .note("meaning", "measured: 1 - width / 0.08 m"),
        Stream::f64("obs/gripper_closure", &[1], each(&|i| vec![commanded(i)]))
            .of("1", "")
            .note("meaning", "commanded last: 0 open to 1 shut"),
    ]
}
