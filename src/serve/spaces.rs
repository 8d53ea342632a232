//! Spaces of observations and actions for clients: types, shapes and bounds. The bounds are of possible values,
//! not of likely ones.

use std::collections::BTreeSet;

use rmpv::Value;

use super::config::ServerConfig;
use softvt_common::text::MAX_TEXT_BYTES;
use softvt_policy::{
    MAX_ANGLE, MAX_POSITION_M, Observation,
    encode::{ObservationEntry, content},
    msgpack::map,
    profile::{ActionEncoding, GripCode, GripperValues, ObservationSource, PoseEncoding, ProfileInput},
};
use softvt_robot::panda::{self, JointRange};

/// Bound of marker positions, px; larger than a tactile image.
const MAX_MARKER_PX: f64 = 1e4;
/// Bound of forces, N.
const MAX_FORCE_N: f64 = 1e6;

/// Space of the observations. `first` is an example, which gives the shapes.
pub(super) fn observation(config: &ServerConfig, first: &Observation) -> Value {
    let entries = config.profile.inputs.iter().filter_map(|input| {
        let space = match content(first, input, None)? {
            ObservationEntry::Query(_) => return None,
            ObservationEntry::Text(_) => text(config),
            ObservationEntry::Array(array) => {
                let high = magnitude_bounds(input);
                let low = match array.dtype.as_str() {
                    "|u1" | "<u2" => vec![0.0],
                    _ => high.iter().map(|x| -x).collect(),
                };
                array_space(&array.dtype, &array.shape, low, high)
            }
        };
        Some((input.shortest_key(), space))
    });
    map(entries)
}

/// Space of the actions, with the names of its numbers. Joint positions have the limits of the joints, grip forces go
/// up to the effort of the gripper.
pub(super) fn action(encoding: &ActionEncoding, effort_n: f64) -> Value {
    let symmetric = |most: f64| JointRange { lower: -most, upper: most };
    let ranges: Vec<JointRange> = match encoding.pose {
        PoseEncoding::Absolute => {
            [MAX_POSITION_M, MAX_POSITION_M, MAX_POSITION_M, MAX_ANGLE, MAX_ANGLE, MAX_ANGLE]
                .map(symmetric)
                .to_vec()
        }
        PoseEncoding::Joints => panda::joint_ranges().to_vec(),
        PoseEncoding::Delta { .. } | PoseEncoding::DeltaOsc { .. } => {
            vec![symmetric(1.0); encoding.pose.numbers()]
        }
    };
    // In the units of the action, whose factors may be negative.
    let ends = |(i, range): (usize, &JointRange)| match &encoding.units {
        Some(units) => [range.lower, range.upper].map(|value| units.from_si(i, value)),
        None => [range.lower, range.upper],
    };
    let ends: Vec<[f64; 2]> = ranges.iter().enumerate().map(ends).collect();
    let mut low: Vec<f64> = ends.iter().map(|[a, b]| a.min(*b)).collect();
    let mut high: Vec<f64> = ends.iter().map(|[a, b]| a.max(*b)).collect();
    let GripperValues { open, closed, code, .. } = encoding.gripper;
    low.push(open.min(closed));
    high.push(if code == GripCode::Force { effort_n } else { open.max(closed) });
    let space = array_space("<f8", &[encoding.numbers()], low, high);
    let names = encoding.names().into_iter().map(Value::from).collect();
    let Value::Map(mut entries) = space else { return space };
    entries.push(("names".into(), Value::Array(names)));
    Value::Map(entries)
}

/// Space of the prompts: the length of the longest one and all characters in use. Prompts that differ between the
/// episodes of a task have at most [`MAX_TEXT_BYTES`] printable characters of ASCII, or of the others in use.
fn text(config: &ServerConfig) -> Value {
    let tasks = || config.suites.iter().flat_map(|suite| &suite.tasks);
    let mut longest = tasks().map(|task| task.prompt.chars().count()).max().unwrap_or(0);
    let mut characters: BTreeSet<char> = tasks().flat_map(|task| task.prompt.chars()).collect();
    if tasks().any(|task| task.prompt_varies) {
        longest = MAX_TEXT_BYTES;
        characters.extend(' '..='~');
    }
    map([("max_length", longest.into()), ("charset", String::from_iter(characters).into())])
}

/// Space of an array; its bounds are one number for all elements, or one per element.
fn array_space(dtype: &str, shape: &[usize], low: Vec<f64>, high: Vec<f64>) -> Value {
    let list = |all: Vec<f64>| match all[..] {
        [one] => Value::F64(one),
        _ => Value::Array(all.into_iter().map(Value::F64).collect()),
    };
    let shape = shape.iter().map(|n| Value::from(*n)).collect();
    map([("dtype", dtype.into()), ("shape", Value::Array(shape)), ("low", list(low)), ("high", list(high))])
}

/// Largest magnitude of all elements, or of each.
fn magnitude_bounds(input: &ProfileInput) -> Vec<f64> {
    match &input.source {
        ObservationSource::State { parts } => {
            let one = parts.iter().flat_map(|part| vec![part.stream().bound; part.stream().width]);
            one.collect::<Vec<_>>().repeat(input.steps())
        }
        ObservationSource::Depth { .. } => vec![f64::INFINITY],
        ObservationSource::Segmentation { .. } => vec![f64::from(u16::MAX)],
        ObservationSource::MarkerMotion => vec![MAX_MARKER_PX],
        ObservationSource::Force => vec![MAX_FORCE_N],
        ObservationSource::Prompt | ObservationSource::Query | ObservationSource::QuerySeed => {
            vec![f64::INFINITY]
        }
        ObservationSource::Camera { .. }
        | ObservationSource::TactileImage { .. }
        | ObservationSource::Tactile { .. } => {
            vec![255.0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_policy::{
        msgpack::entry,
        profile::{ActionUnits, Profile},
    };

    fn numbers(space: &Value, key: &str) -> Vec<f64> {
        let list = entry(space, key).and_then(Value::as_array).expect("a list");
        list.iter().map(|number| number.as_f64().expect("a number")).collect()
    }

    #[test]
    fn the_space_of_joint_positions_has_the_limits_of_the_joints() {
        let mut encoding = Profile::named("vision_joints").unwrap().actions;
        let space = action(&encoding, 70.0);
        let [low, high] = ["low", "high"].map(|end| numbers(&space, end));
        assert_eq!((low[3], high[3], low[7], high[7]), (-3.0718, -0.0698, 0.0, 1.0));
        let names = entry(&space, "names").and_then(Value::as_array).unwrap();
        assert_eq!(
            (names.len(), names[0].as_str(), names[7].as_str()),
            (8, Some("joint_1"), Some("gripper"))
        );
        // Degrees, counted the other way round.
        let degrees = -(1.0_f64.to_radians());
        encoding.units = Some(ActionUnits { scale: vec![degrees; 7], offset: vec![0.0; 7] });
        let space = action(&encoding, 70.0);
        let [low, high] = ["low", "high"].map(|end| numbers(&space, end)[3]);
        assert!((low - 4.0).abs() < 0.01 && (high - 176.0).abs() < 0.01, "{low} {high}");
    }
}
