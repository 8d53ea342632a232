//! One episode: settle → observe → act → step → judge; and the batch of them.

mod articulated;
mod asset_cache;
mod build;
pub mod cancel;
mod command;
mod controller;
pub mod episode;
mod evidence;
mod judging;
mod observation_history;
mod proprioception;
mod robot_instance;
mod sensor_assets;
mod sensor_check;
pub mod sensors;
mod settle;
mod shared_cache;
pub mod simulation;
mod spec;
mod state_hash;
mod trace;

pub use asset_cache::AssetCache;
pub use build::{BuildError, check_support, soft_rest};
pub use controller::{Cancellable, ControlError, Controller};
pub use episode::{Episode, EpisodeError, FinishedEpisode, ScoreFrame};
pub use proprioception::{BodyConfiguration, Proprioception};
pub use robot_instance::RobotInstance;
pub use sensor_assets::SensorAssets;
pub use sensor_check::{CAMERA_IMAGE_SUFFIXES, TACTILE_IMAGE_SUFFIXES, TACTILE_IMAGES, check_sensors};
pub use sensors::{SensingError, SensorSuite, StateRecording};
pub use settle::SettleError;
pub use simulation::{ArticulatedPart, ObjectInstance, Simulation};
pub use spec::{EpisodeRef, EpisodeSpec, target_asset};
pub use state_hash::state_hash;
pub use trace::{ObjectTrace, StepTrace};
