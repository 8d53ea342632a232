//! Execution of episodes: building and settling a scene, observing, acting, stepping and judging.
//!
//! `build` turns a scene into a [`Simulation`]; an [`Episode`] runs it with a [`Controller`] and returns the record.
//! Data derived from assets are shared between episodes in [`AssetCache`] and [`SensorAssets`].

mod asset_cache;
mod build;
mod build_error;
pub mod cancel;
mod controller;
mod episode;
mod evidence;
mod observation_history;
mod robot_instance;
mod sensor_assets;
mod sensors;
mod shared_cache;
mod simulation;
mod soft_model;
mod trace;

pub use asset_cache::AssetCache;
pub use build_error::BuildError;
pub use controller::{ChunkedPolicy, Controller};
pub use episode::{Episode, EpisodeError, EpisodeSpec, FinishedEpisode, ScoreFrame, target_asset};
pub use robot_instance::RobotInstance;
pub use sensor_assets::{SensingError, SensorAssets};
pub use sensors::{
    BodyConfiguration, CAMERA_IMAGE_SUFFIXES, Proprioception, ROBOT_SEGMENTATION_ID, SensorSuite,
    StateRecording, TACTILE_IMAGE_SUFFIXES, TACTILE_IMAGES, check_sensors,
};
pub use simulation::{ArticulatedPart, ObjectInstance, SettleError, Simulation, state_hash};
pub use soft_model::soft_model;
pub use trace::{ObjectTrace, StepTrace};
