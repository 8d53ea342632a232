//! [`DataStream`]: one quantity of a demonstration over time.

use serde::{Deserialize, Serialize};
use softvt_geometry::Pose;
use softvt_robot::rotation;

/// Streams that a recording has only if they are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OptionalStream {
    /// Depth of the images of both cameras, m.
    #[value(help = None::<&str>)]
    Depth,
    /// Torques of the arm's drives, N m.
    #[value(help = None::<&str>)]
    JointTorques,
}

impl OptionalStream {
    /// Name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::JointTorques => "joint-torques",
        }
    }
}

/// Values of a [`DataStream`], step by step.
#[derive(Clone, Debug, PartialEq)]
pub enum StreamValues {
    /// Physical quantities.
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

impl StreamValues {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::U8(values) => values.len(),
        }
    }
}

impl DataStream {
    /// A stream of 64-bit numbers, of this shape per step.
    pub fn f64(name: impl Into<String>, row_shape: &[usize], values: Vec<f64>) -> Self {
        Self::new(name.into(), row_shape, StreamValues::F64(values))
    }

    /// A stream of 32-bit numbers, of this shape per step.
    pub fn f32(name: impl Into<String>, row_shape: &[usize], values: Vec<f32>) -> Self {
        Self::new(name.into(), row_shape, StreamValues::F32(values))
    }

    /// A stream of bytes, of this shape per step.
    pub fn u8(name: impl Into<String>, row_shape: &[usize], values: Vec<u8>) -> Self {
        Self::new(name.into(), row_shape, StreamValues::U8(values))
    }

    fn new(name: String, row_shape: &[usize], values: StreamValues) -> Self {
        Self { name, row_shape: row_shape.to_vec(), values, attributes: Vec::new() }
    }

    /// Adds an attribute.
    pub fn attribute(mut self, name: &str, text: &str) -> Self {
        self.attributes.push((name.to_owned(), text.to_owned()));
        self
    }

    /// Adds the attributes `unit` and, if it is not empty, `frame`.
    pub fn unit(self, unit: &str, frame: &str) -> Self {
        let stream = self.attribute("unit", unit);
        if frame.is_empty() { stream } else { stream.attribute("frame", frame) }
    }
}

/// Position, and quaternion w x y z with w ≥ 0.
pub(super) fn pose_row(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, rotation::canonical(&pose.rotation));
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}
