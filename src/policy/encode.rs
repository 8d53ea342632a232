//! Encoding of observations as profiles define them.

use image::{RgbImage, imageops};
use rmpv::Value;

use super::{
    CameraImage, EpisodeBrief, Observation, QueryId, RobotState,
    msgpack::{map, pack_array},
    observation::last,
    profile::{ObservationSource, Profile, ProfileInput},
};
use softvt_common::npy::NpyArray;
use softvt_sensing::tactile::MARKER_COUNT;

/// Content of an entry of an observation, before it is packed.
#[derive(Clone, Debug, PartialEq)]
pub enum ObservationEntry {
    /// Numbers or an image.
    Array(NpyArray),
    Text(String),
    /// A seed, or the identity of a request.
    Query(Value),
}

impl ObservationEntry {
    /// Converts to msgpack; see [`pack_array`].
    pub fn into_value(self, bin_keys: bool) -> Value {
        match self {
            Self::Array(array) => pack_array(array, bin_keys),
            Self::Text(text) => Value::from(text),
            Self::Query(value) => value,
        }
    }
}

/// Content of an entry, in the type and shape given at [`ObservationSource`]; [`ProfileInput::frames`] adds an axis.
/// `None` if the observation lacks its stream, or `query` is needed and missing.
pub fn content(
    observation: &Observation,
    input: &ProfileInput,
    query: Option<&QueryId>,
) -> Option<ObservationEntry> {
    let steps = input.steps();
    let array = match &input.source {
        ObservationSource::Prompt => return Some(ObservationEntry::Text(observation.prompt.clone())),
        ObservationSource::Query => return Some(ObservationEntry::Query(query_map(query?))),
        ObservationSource::QuerySeed => return Some(ObservationEntry::Query(query?.seed().into())),
        ObservationSource::Camera { camera, half_turn } => {
            let turned = |one: &CameraImage| match half_turn {
                true => imageops::rotate180(&one.image),
                false => one.image.clone(),
            };
            let images = observation.camera_images(camera, steps);
            stacked(input, images.into_iter().map(|one| image_array(turned(one))))?
        }
        ObservationSource::Depth { camera, half_turn } => {
            let depth = |one: &CameraImage| {
                let numbers = turned(one.depth.as_ref()?, *half_turn);
                Some(NpyArray::from_f32(shape_of(one), numbers))
            };
            let images = observation.camera_images(camera, steps);
            stacked(input, images.into_iter().filter_map(depth))?
        }
        ObservationSource::Segmentation { camera, half_turn } => {
            let objects = |one: &CameraImage| {
                let numbers = turned(one.segmentation.as_ref()?, *half_turn);
                Some(NpyArray::from_u16(shape_of(one), numbers))
            };
            let images = observation.camera_images(camera, steps);
            stacked(input, images.into_iter().filter_map(objects))?
        }
        ObservationSource::State { parts } => {
            let row = |robot: &RobotState| {
                let numbers = parts.iter().flat_map(|part| (part.stream().read)(robot));
                let numbers: Vec<f32> = numbers.map(|number| number as f32).collect();
                NpyArray::from_f32(vec![numbers.len()], numbers)
            };
            stacked(input, observation.robot_states(steps).into_iter().map(row))?
        }
        ObservationSource::TactileImage { layout, markers } => {
            image_array(observation.tactile.as_ref()?.mosaic(*layout, *markers))
        }
        ObservationSource::Tactile { finger, markers } => {
            let frames = observation.tactile.as_ref()?.last(steps);
            let images = frames.into_iter().map(|frame| {
                let frame = &frame[finger.index()];
                markers.map_or_else(|| frame.image.clone(), |style| frame.with_markers(style))
            });
            stacked(input, images.map(image_array))?
        }
        ObservationSource::MarkerMotion => {
            let rows = observation.tactile.as_ref()?.marker_motion(steps);
            NpyArray::from_f32(vec![rows.len(), 2 * MARKER_COUNT, 2], rows.into_iter().flatten().flatten())
        }
        ObservationSource::Force => {
            let past: Vec<&[f64; 6]> = observation.force_history.iter().collect();
            let rows = last(&past, steps);
            NpyArray::from_f32(vec![rows.len(), 6], rows.into_iter().flatten().map(|x| *x as f32))
        }
    };
    Some(ObservationEntry::Array(array))
}

/// The arrays of all steps along a first axis if the input has one, else the only array. `None` without an array.
fn stacked(input: &ProfileInput, steps: impl Iterator<Item = NpyArray>) -> Option<NpyArray> {
    let mut all = steps.collect::<Vec<_>>();
    match input.frames {
        None => all.pop(),
        Some(_) => {
            let NpyArray { dtype, shape, .. } = all.first()?;
            let shape = [&[all.len()], shape.as_slice()].concat();
            let dtype = dtype.clone();
            Some(NpyArray { dtype, shape, data: all.into_iter().flat_map(|one| one.data).collect() })
        }
    }
}

/// The pixels of an image, rotated by 180° if asked for.
fn turned<T: Copy>(pixels: &[T], half_turn: bool) -> Vec<T> {
    if half_turn { pixels.iter().rev().copied().collect() } else { pixels.to_vec() }
}

fn shape_of(image: &CameraImage) -> Vec<usize> {
    vec![image.image.height() as usize, image.image.width() as usize]
}

fn query_map(query: &QueryId) -> Value {
    let EpisodeBrief { suite, task, episode, seed, alias, .. } = &query.brief;
    let identity = match alias {
        Some(alias) => vec![("id", Value::from(alias.as_str()))],
        None => vec![
            ("suite", Value::from(suite.as_str())),
            ("task", Value::from(*task as u64)),
            ("episode", Value::from(*episode)),
            ("run_seed", Value::from(*seed)),
        ],
    };
    map(identity.into_iter().chain([
        ("step", Value::from(query.step)),
        ("query", Value::from(query.query)),
        ("seed", Value::from(query.seed())),
        ("wants_actions", Value::from(query.wants_actions)),
    ]))
}

/// The observation as a msgpack map in openpi's format.
pub fn openpi(observation: &Observation, profile: &Profile, query: &QueryId) -> Value {
    let mut entries = Vec::new();
    for input in &profile.inputs {
        let Some(content) = content(observation, input, Some(query)) else { continue };
        let Some((last, others)) = input.keys.split_last() else { continue };
        let value = content.into_value(true);
        entries.extend(others.iter().map(|key| (Value::from(key.as_str()), value.clone())));
        entries.push((Value::from(last.as_str()), value));
    }
    Value::Map(entries)
}

/// An image as an array, uint8 (height, width, 3).
pub fn image_array(image: RgbImage) -> NpyArray {
    let shape = vec![image.height() as usize, image.width() as usize, 3];
    NpyArray::from_bytes(shape, image.into_raw())
}
