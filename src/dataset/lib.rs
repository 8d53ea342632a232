//! Datasets of demonstrations: recording to HDF5 and video, reading, checking, statistics, and conversion from
//! and to other formats.
//!
//! A [`Demonstration`] holds the numbers of a rollout in memory, one [`DataStream`] per quantity. Images are rendered
//! one step at a time and go straight into files ([`demonstration_writer::DemonstrationWriter`]), since those of a
//! whole rollout would not fit into memory. `docs/data.md` describes every stream.
#![warn(unreachable_pub)]

pub mod card;
pub mod check;
pub mod demonstration_writer;
mod error;
pub mod export;
mod grip_labels;
mod hdf5;
#[cfg(feature = "import")]
pub mod import;
pub mod layout;
pub mod manifest;
pub mod stats;
mod stream;
mod streams;

pub use error::DatasetError;
pub use hdf5::{FloatArray, ImageStack, TaskFile, merge_parts};
pub use stream::{DataStream, Demonstration, OptionalStream, StreamValues};
pub use streams::stream_tables;
