//! Encoding of observations as profiles define them.

use image::{RgbImage, imageops};
use rmpv::Value;

use super::{
    Observation,
    msgpack::pack_array,
    profile::{InputSource, Profile, StatePart},
};
use softvt_common::npy::NpyArray;
use softvt_robot::rotation;
use softvt_sensing::tactile::{HISTORY_LENGTH, MARKER_COUNT};

/// Content of an entry of an observation, before it is packed.
#[derive(Clone, Debug, PartialEq)]
pub enum ObservationEntry {
    /// Numbers or an image.
    Array(NpyArray),
    /// The instruction.
    Text(String),
}

impl ObservationEntry {
    /// Converts to msgpack; see [`pack_array`].
    pub fn into_value(self, bin_keys: bool) -> Value {
        match self {
            Self::Array(array) => pack_array(array, bin_keys),
            Self::Text(text) => Value::from(text),
        }
    }
}

/// Content of an entry, in the type and shape given at [`InputSource`]. `None` if the observation lacks its stream.
pub fn content(observation: &Observation, source: &InputSource) -> Option<ObservationEntry> {
    let array = match source {
        InputSource::Prompt => return Some(ObservationEntry::Text(observation.prompt.clone())),
        InputSource::Camera { camera, half_turn } => {
            let image = observation.camera(camera)?;
            image_array(if *half_turn { imageops::rotate180(image) } else { image.clone() })
        }
        InputSource::State { parts } => {
            let numbers: Vec<f32> = parts.iter().flat_map(|part| state(observation, *part)).collect();
            NpyArray::from_f32(vec![numbers.len()], numbers)
        }
        InputSource::TactileImage { layout } => image_array(observation.tactile.as_ref()?.mosaic(*layout)),
        InputSource::Tactile { finger } => {
            image_array(observation.tactile.as_ref()?.now()?[finger.index()].image.clone())
        }
        InputSource::MarkerMotion => {
            let rows = observation.tactile.as_ref()?.marker_motion();
            NpyArray::from_f32(vec![rows.len(), 2 * MARKER_COUNT, 2], rows.into_iter().flatten().flatten())
        }
        InputSource::Force => {
            let past = &observation.force_history;
            // A short history starts with copies of its oldest entry.
            let rows = (0..HISTORY_LENGTH)
                .map(|place| past.get((place + past.len()).saturating_sub(HISTORY_LENGTH)));
            let rows: Option<Vec<&[f64; 6]>> = rows.collect();
            NpyArray::from_f32(vec![HISTORY_LENGTH, 6], rows?.into_iter().flatten().map(|x| *x as f32))
        }
    };
    Some(ObservationEntry::Array(array))
}

/// The observation as a msgpack map in openpi's format.
pub fn openpi(observation: &Observation, profile: &Profile) -> Value {
    let mut entries = Vec::new();
    for input in &profile.inputs {
        let Some(content) = content(observation, &input.source) else { continue };
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

fn state(o: &Observation, part: StatePart) -> Vec<f32> {
    let quaternion = || rotation::from_axis_angle(&o.ee_axis_angle_b).into_inner();
    let numbers: Vec<f64> = match part {
        StatePart::Position => o.ee_position_b.iter().copied().collect(),
        StatePart::AxisAngle => o.ee_axis_angle_b.iter().copied().collect(),
        StatePart::QuaternionWxyz => {
            let q = quaternion();
            vec![q.w, q.i, q.j, q.k]
        }
        StatePart::QuaternionXyzw => {
            let q = quaternion();
            vec![q.i, q.j, q.k, q.w]
        }
        StatePart::Joints => o.joints.to_vec(),
        StatePart::GripperWidth => vec![o.gripper_width_m],
        StatePart::FingerPosition => vec![0.5 * o.gripper_width_m],
        StatePart::FingerPair => vec![0.5 * o.gripper_width_m, -0.5 * o.gripper_width_m],
        StatePart::Closure => vec![o.closure],
    };
    debug_assert_eq!(numbers.len(), part.count());
    numbers.into_iter().map(|x| x as f32).collect()
}
