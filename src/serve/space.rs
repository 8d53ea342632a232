//! What observations and actions look like: shapes, types and bounds. The bounds are of what can be, not of what is likely.

use std::f64::consts::PI;

use rmpv::Value;

use super::{
    catalog::ServerConfig,
    response::{key, pair},
};
use crate::policy::{
    Observation,
    encode::{ObservationEntry, content},
    profile::{ACTION_LEN, ActionEncoding, ActionUnits, InputSource, PoseEncoding, StatePart},
};

/// Farther than the arm gets along any axis of its base, m.
const REACH_M: f64 = 2.0;
/// A little more than half a turn, so that no rounding leads beyond.
const HALF_TURN: f64 = PI + 1e-3;
/// Larger than any place in a tactile picture or next to it, px.
const MARKER_PX: f64 = 1e4;
/// Larger than any force between bodies that hold together, N.
const FORCE_N: f64 = 1e6;

/// The entries of an observation, by example.
pub(super) fn observation(offer: &ServerConfig, first: &Observation) -> Value {
    let entries = offer.profile.inputs.iter().filter_map(|input| {
        let space = match content(first, &input.source)? {
            ObservationEntry::Text(_) => text(offer),
            ObservationEntry::Array(array) => {
                let (low, high) = bounds(&input.source);
                numbers(&array.dtype, &array.shape, low, high)
            }
        };
        Some(pair(key(input), space))
    });
    Value::Map(entries.collect())
}

/// An action of seven numbers.
pub(super) fn action(code: &ActionEncoding) -> Value {
    let most = match code.pose {
        PoseEncoding::Absolute => [REACH_M, REACH_M, REACH_M, HALF_TURN, HALF_TURN, HALF_TURN],
        PoseEncoding::Delta { .. } | PoseEncoding::DeltaOsc { .. } => [1.0; ACTION_LEN - 1],
    };
    let ActionUnits { scale, offset } = code.units.unwrap_or(ActionUnits::SAME);
    // In the actor's own units, whose factors may be negative.
    let end = |i: usize, sign: f64| (sign * scale[i].signum() * most[i] - offset[i]) / scale[i];
    let mut low: Vec<f64> = (0..most.len()).map(|i| end(i, -1.0)).collect();
    let mut high: Vec<f64> = (0..most.len()).map(|i| end(i, 1.0)).collect();
    low.push(code.gripper.open.min(code.gripper.shut));
    high.push(code.gripper.open.max(code.gripper.shut));
    numbers("<f8", &[ACTION_LEN], low, high)
}

/// Text; the longest prompt there is.
fn text(offer: &ServerConfig) -> Value {
    let prompts = offer.suites.iter().flat_map(|one| &one.suite.tasks).map(|task| task.prompt.as_str());
    let longest = prompts.clone().map(|prompt| prompt.chars().count()).max().unwrap_or(0);
    let mut letters: Vec<char> = prompts.flat_map(str::chars).collect();
    letters.sort_unstable();
    letters.dedup();
    let letters: String = letters.into_iter().collect();
    Value::Map(vec![pair("max_length", longest.into()), pair("charset", letters.into())])
}

/// `low` and `high` hold one number for all, or one for each.
fn numbers(dtype: &str, shape: &[usize], low: Vec<f64>, high: Vec<f64>) -> Value {
    let list = |all: Vec<f64>| match all[..] {
        [one] => Value::F64(one),
        _ => Value::Array(all.into_iter().map(Value::F64).collect()),
    };
    let shape = shape.iter().map(|n| Value::from(*n)).collect();
    Value::Map(vec![
        pair("dtype", dtype.into()),
        pair("shape", Value::Array(shape)),
        pair("low", list(low)),
        pair("high", list(high)),
    ])
}

fn bounds(source: &InputSource) -> (Vec<f64>, Vec<f64>) {
    let within = |most: f64| (vec![-most], vec![most]);
    match source {
        InputSource::Camera { .. } | InputSource::TactileImage { .. } | InputSource::Tactile { .. } => {
            (vec![0.0], vec![255.0])
        }
        InputSource::State { parts } => {
            let of = |part: &StatePart| vec![largest(*part); part.count()];
            let high: Vec<f64> = parts.iter().flat_map(of).collect();
            (high.iter().map(|x| -x).collect(), high)
        }
        InputSource::MarkerMotion => within(MARKER_PX),
        InputSource::Force => within(FORCE_N),
        InputSource::Prompt => within(f64::INFINITY),
    }
}

/// The largest size of a number of the state.
fn largest(part: StatePart) -> f64 {
    match part {
        StatePart::Position => REACH_M,
        StatePart::AxisAngle => HALF_TURN,
        StatePart::Joints => 2.0 * PI,
        // Quaternions, the closure, and widths in metres.
        _ => 1.0 + 1e-3,
    }
}
