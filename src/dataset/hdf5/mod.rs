//! HDF5 files in robomimic's layout: `/data/demo_0`, `/data/demo_1`, … with one dataset per stream.

mod merge;
mod read;
mod write;

use std::path::Path;

use rust_hdf5::{DatatypeMessage, H5Dataset};

use super::DatasetError;

pub use merge::merge_parts;
pub use read::{FloatRows, ImageBlock, TaskFile, actions};
pub(super) use write::{ChunkedSteps, Hdf5Writer};

/// Number types of the datasets that softvt reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    F64,
    F32,
    U8,
    Other,
}

impl NumberType {
    pub(super) fn of(path: &Path, key: &str, data: &H5Dataset) -> Result<Self, DatasetError> {
        let datatype = data.datatype().map_err(|e| DatasetError::hdf5(path, key)(e))?;
        Ok(match datatype {
            DatatypeMessage::FloatingPoint { size: 8, .. } => Self::F64,
            DatatypeMessage::FloatingPoint { size: 4, .. } => Self::F32,
            DatatypeMessage::FixedPoint { size: 1, signed: false, .. } => Self::U8,
            _ => Self::Other,
        })
    }
}
