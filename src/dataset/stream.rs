//! [`DataStream`]: a quantity of a demonstration in its control steps.

use std::sync::LazyLock;

use clap::{ValueEnum, builder::PossibleValue};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use softvt_common::digest::sha256_hex;
use softvt_policy::{NumberType, ROBOT_STREAMS};
use softvt_runs::record::EpisodeRecord;

use super::streams::DEPTH_FLAG;

/// A value of `softvt record --streams`: a stream that a recording has only if it is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OptionalStream(&'static str);

static OPTIONAL_STREAMS: LazyLock<Vec<OptionalStream>> = LazyLock::new(|| {
    let of_robot = ROBOT_STREAMS.iter().filter_map(|stream| stream.recorded.as_ref()?.flag);
    [DEPTH_FLAG].into_iter().chain(of_robot).map(OptionalStream).collect()
});

impl OptionalStream {
    pub fn named(name: &str) -> Option<Self> {
        OPTIONAL_STREAMS.iter().copied().find(|stream| stream.0 == name)
    }

    /// Name in flags and files.
    pub fn name(self) -> &'static str {
        self.0
    }
}

impl ValueEnum for OptionalStream {
    fn value_variants<'a>() -> &'a [Self] {
        &OPTIONAL_STREAMS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0))
    }
}

impl Serialize for OptionalStream {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}

impl<'de> Deserialize<'de> for OptionalStream {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::custom(format!("unknown stream {name:?}")))
    }
}

/// Attribute of a stream with the SHA-256 of its numbers, as they were recorded.
pub(super) const DIGEST: &str = "sha256";

#[derive(Clone, Debug, PartialEq)]
pub enum StreamValues {
    F64(Vec<f64>),
    /// The same with half the size.
    F32(Vec<f32>),
    /// Images and truth values.
    U8(Vec<u8>),
}

/// An array whose first axis is the control step; one dataset of an HDF5 file.
#[derive(Clone, Debug, PartialEq)]
pub struct DataStream {
    /// Path below the demonstration, such as `obs/eef_pose`.
    pub name: String,
    /// Shape per step; empty for a scalar.
    pub row_shape: Vec<usize>,
    /// `steps × row_shape` values in row-major order.
    pub values: StreamValues,
    /// Text attributes by name: `unit`, `frame`, `meaning`, …
    pub attributes: Vec<(String, String)>,
}

/// A rollout as training data, without its images: the state before each control step, and the action commanded in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    pub record: EpisodeRecord,
    /// All streams other than images and depth.
    pub streams: Vec<DataStream>,
}

impl StreamValues {
    pub(super) fn new(number_type: NumberType, numbers: Vec<f64>) -> Self {
        match number_type {
            NumberType::F64 => Self::F64(numbers),
            NumberType::F32 => Self::F32(numbers.into_iter().map(|x| x as f32).collect()),
            NumberType::U8 => Self::U8(numbers.into_iter().map(|x| x as u8).collect()),
        }
    }

    pub(super) fn into_f64(self) -> Vec<f64> {
        match self {
            Self::F64(values) => values,
            Self::F32(values) => values.into_iter().map(f64::from).collect(),
            Self::U8(values) => values.into_iter().map(f64::from).collect(),
        }
    }

    /// SHA-256 of the numbers in little endian, hexadecimal.
    pub(super) fn sha256(&self) -> String {
        match self {
            Self::F64(values) => sha256_hex(values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()),
            Self::F32(values) => sha256_hex(values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()),
            Self::U8(values) => sha256_hex(values),
        }
    }

    pub(super) fn number_type(&self) -> NumberType {
        match self {
            Self::F64(_) => NumberType::F64,
            Self::F32(_) => NumberType::F32,
            Self::U8(_) => NumberType::U8,
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::U8(values) => values.len(),
        }
    }
}
