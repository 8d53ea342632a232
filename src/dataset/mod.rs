//! What is kept of rollouts for people and for training: demonstrations as HDF5, and videos.
//!
//! A [`Demonstration`] is the numbers of a rollout, stream by stream; pictures are drawn one step at a time
//! ([`pictures::Easel`]) and go straight into files ([`recorder::Recorder`]), since those of a whole rollout would not fit into
//! memory a hundred times. `docs/data.md` says what every stream is.

pub mod card;
pub mod check;
mod copy;
mod demonstration;
mod error;
mod hidden;
pub mod import;
pub mod layout;
pub mod lerobot;
pub mod manifest;
pub mod pictures;
mod read;
pub mod recorder;
pub mod stats;
pub mod video;
mod write;

pub use copy::assemble;
pub use demonstration::{Demonstration, Numbers, Stream};
pub use error::DatasetError;
pub use read::{TaskFile, actions};
