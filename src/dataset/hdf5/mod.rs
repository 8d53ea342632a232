//! HDF5 files in robomimic's layout: `/data/demo_0`, `/data/demo_1`, … with one dataset per stream.

mod merge;
mod read;
mod write;

pub use merge::merge_parts;
pub use read::{FloatArray, ImageStack, TaskFile};
pub(super) use write::{ChunkedSteps, Hdf5Writer, write_file, write_text_attributes};
