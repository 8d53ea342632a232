//! Quantities of demonstrations and forms of answers, by control step.

use std::f64::consts::{PI, TAU};

use super::sampling::{DemoSamples, StepSample};
use softvt_common::text::AXIS_NAMES;
use softvt_geometry::{Quat, Vec3};
use softvt_robot::rotation;

/// A quantity of a demonstration that an answer can stand for. Axes are those of the base unless the name says
/// otherwise; displacements start at the tool pose that the policy observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Position(usize),
    Shift(usize),
    ToolShift(usize),
    AxisAngle(usize),
    Turn(usize),
    ToolTurn(usize),
    /// Angles about the fixed axes x, y, z.
    Euler(usize),
    /// x, y, z, w.
    Quaternion(usize),
    Joint(usize),
    JointShift(usize),
    Closure,
    /// 1 where the closure is above the middle of its range, 0 elsewhere.
    Closed,
}

impl Quantity {
    pub(super) fn name(self) -> String {
        let axis = |i: usize| AXIS_NAMES[i];
        match self {
            Self::Position(i) => axis(i).to_owned(),
            Self::Shift(i) => format!("Δ{}", axis(i)),
            Self::ToolShift(i) => format!("Δ{} of tool", axis(i)),
            Self::AxisAngle(i) => format!("r{}", axis(i)),
            Self::Turn(i) => format!("Δr{}", axis(i)),
            Self::ToolTurn(i) => format!("Δr{} of tool", axis(i)),
            Self::Euler(i) => ["roll", "pitch", "yaw"][i].to_owned(),
            Self::Quaternion(i) => ["qx", "qy", "qz", "qw"][i].to_owned(),
            Self::Joint(i) => format!("q{}", i + 1),
            Self::JointShift(i) => format!("Δq{}", i + 1),
            Self::Closure => "closure".to_owned(),
            Self::Closed => "closed".to_owned(),
        }
    }
}

/// A form of the numbers of answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Plain,
    /// Rotation vectors without jumps by a turn.
    Continuous,
    /// Single angles without jumps by a turn.
    Unwrapped,
    /// Quaternions without changes of sign.
    Signed,
    /// The answered motion less the observed pose.
    Displaced,
}

/// The control steps of a demonstration that answers stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Timing {
    /// Control steps per command; −1 for answers that are reversed in time.
    pub rate: f64,
    /// Control steps by which the answers are late.
    pub lag: i32,
}

impl Timing {
    pub(super) const NONE: Self = Self { rate: 1.0, lag: 0 };
}

pub(super) struct DemoSeries<'a> {
    pub steps: &'a [StepSample],
    /// Commands of the answer of each control step.
    answer_lengths: Vec<usize>,
    axis_angles: Vec<Vec3>,
    euler: Vec<Vec3>,
    quaternions: Vec<[f64; 4]>,
    orientations: Vec<Quat>,
    middle: f64,
}

impl<'a> DemoSeries<'a> {
    pub(super) fn new(demo: &'a DemoSamples) -> Self {
        let steps = &demo.steps;
        let recorded = || steps.iter().map(|s| s.recorded.action.axis_angle_b);
        let orientations: Vec<Quat> = recorded().map(|v| rotation::from_axis_angle(&v)).collect();
        let fixed = orientations.iter().map(|q| Vec3::from(<[f64; 3]>::from(q.euler_angles())));
        let answers = steps.chunk_by(|a, b| a.request == b.request);
        let closures = || steps.iter().map(|s| s.recorded.action.closure());
        let quaternions = orientations.iter().map(|q| [q.i, q.j, q.k, q.w]);
        Self {
            steps,
            answer_lengths: answers.flat_map(|answer| vec![answer.len(); answer.len()]).collect(),
            axis_angles: rotation::continuous(recorded()).collect(),
            euler: unwrapped(fixed, TAU),
            quaternions: signed(quaternions),
            orientations,
            middle: 0.5 * (closures().fold(f64::INFINITY, f64::min) + closures().fold(0.0, f64::max)),
        }
    }

    /// Largest number of commands of an answer that were executed.
    pub(super) fn longest_answer(&self) -> usize {
        self.answer_lengths.iter().copied().max().unwrap_or(0)
    }

    /// The control step that the command executed in step `now` stands for; `None` after the last one.
    fn step(&self, now: usize, timing: Timing) -> Option<usize> {
        let request = self.steps[now].request;
        let command = (now - request) as f64;
        let steps = match timing.rate {
            // Thirds are not exact.
            rate if rate > 0.0 => (rate * command + 1e-9).floor(),
            _ => self.answer_lengths[now] as f64 - 1.0 - command,
        };
        let step = request as i64 + steps as i64 - i64::from(timing.lag);
        Some(step.max(0) as usize).filter(|step| *step < self.steps.len())
    }

    /// A quantity of the demonstration for the command executed in step `now`.
    pub(super) fn quantity(&self, quantity: Quantity, now: usize, timing: Timing) -> Option<f64> {
        let at = self.step(now, timing)?;
        // A displacement starts where it is executed, and an absolute pose is compared with the observation.
        let from = &self.steps[if self.steps[now].is_step { at } else { self.steps[now].request }];
        let recorded = &self.steps[at].recorded;
        let shift = || recorded.action.position_b - from.tool;
        let turn = || rotation::error(&from.tool_orientation, &self.orientations[at]);
        let to_tool = |v: Vec3| from.tool_orientation.inverse() * v;
        Some(match quantity {
            Quantity::Position(i) => recorded.action.position_b[i],
            Quantity::Shift(i) => shift()[i],
            Quantity::ToolShift(i) => to_tool(shift())[i],
            Quantity::AxisAngle(i) => self.axis_angles[at][i],
            Quantity::Turn(i) => turn()[i],
            Quantity::ToolTurn(i) => to_tool(turn())[i],
            Quantity::Euler(i) => self.euler[at][i],
            Quantity::Quaternion(i) => self.quaternions[at][i],
            Quantity::Joint(i) => recorded.joints?[i],
            Quantity::JointShift(i) => recorded.joints?[i] - from.measured_joints[i],
            Quantity::Closure => recorded.action.closure(),
            Quantity::Closed => f64::from(u8::from(recorded.action.closure() > self.middle)),
        })
    }

    /// A channel of the answers in a form, by control step. The closure follows the numbers of the motion.
    pub(super) fn answered(&self, form: Form, channel: usize) -> Vec<f64> {
        let steps = self.steps;
        let closing = steps.first().map_or(0, |s| s.numbers.len());
        let vectors = || steps.iter().map(|s| Vec3::from_fn(|i, _| s.numbers[3 + i]));
        // Angles above a turn are in degrees.
        let turn = if vectors().any(|v| v.amax() > 1.2 * TAU) { 360.0 } else { TAU };
        let of = |vectors: Vec<Vec3>| vectors.iter().map(|v| v[channel - 3]).collect();
        match form {
            Form::Continuous if (3..6).contains(&channel) => {
                of(rotation::continuous(vectors().map(|v| v * (TAU / turn)))
                    .map(|v| v * (turn / TAU))
                    .collect())
            }
            Form::Unwrapped if (3..6).contains(&channel) => of(unwrapped(vectors(), turn)),
            Form::Signed if (3..7).contains(&channel) => {
                let numbers = steps.iter().zip(vectors()).map(|(s, v)| [v.x, v.y, v.z, s.closure]);
                signed(numbers).iter().map(|q| q[channel - 3]).collect()
            }
            Form::Displaced if channel < closing => {
                steps.iter().map(|s| self.displaced(s, channel)).collect()
            }
            _ if channel == closing => steps.iter().map(|s| s.closure).collect(),
            _ => steps.iter().map(|s| s.numbers[channel]).collect(),
        }
    }

    fn displaced(&self, s: &StepSample, channel: usize) -> f64 {
        let from = if s.is_step { s } else { &self.steps[s.request] };
        match (s.answered.joints, channel) {
            (Some(joints), i) => joints[i] - from.measured_joints[i],
            (None, 0..3) => s.answered.position_b[channel] - from.tool[channel],
            (None, _) => {
                let orientation = rotation::from_axis_angle(&s.answered.axis_angle_b);
                rotation::error(&from.tool_orientation, &orientation)[channel - 3]
            }
        }
    }
}

/// Angles without jumps by a turn, from those of a hand that points down on.
fn unwrapped(angles: impl Iterator<Item = Vec3>, turn: f64) -> Vec<Vec3> {
    let down = rotation::POINTING_DOWN * (turn / (2.0 * PI));
    let next = |before: &mut Vec3, angles: Vec3| {
        *before = angles.zip_map(before, |angle, before| angle - turn * ((angle - before) / turn).round());
        Some(*before)
    };
    angles.scan(down, next).collect()
}

/// Quaternions without changes of sign along a demonstration; the first one has a positive largest part.
fn signed(quaternions: impl Iterator<Item = [f64; 4]>) -> Vec<[f64; 4]> {
    let mut before: Option<[f64; 4]> = None;
    let next = |q: [f64; 4]| {
        // The closure is not part of the sign where three numbers are answered.
        let along = match before {
            Some(before) => (0..3).map(|i| q[i] * before[i]).sum(),
            None => {
                q[..3].iter().copied().fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most })
            }
        };
        let q = if along < 0.0 { q.map(|x| -x) } else { q };
        before = Some(q);
        q
    };
    quaternions.map(next).collect()
}
