//! Execution of episodes: building and settling a scene, observing, acting, stepping and judging.
//!
//! `build` turns a scene into a [`Simulation`]; an [`Episode`] runs it with a [`Controller`] and returns the record.
//! Data derived from assets are shared between episodes in [`AssetCache`] and [`SensorAssets`].

mod articulated;
mod asset_cache;
mod build;
mod build_error;
pub mod cancel;
mod controller;
mod episode;
mod evidence;
mod object;
mod observation_history;
mod robot_instance;
mod sensor_assets;
mod sensor_check;
mod sensors;
mod settle;
mod shared_cache;
mod simulation;
mod soft_model;
mod spec;
mod trace;

pub use asset_cache::AssetCache;
pub use build_error::BuildError;
pub use controller::{ChunkedPolicy, Controller};
pub use episode::{Episode, EpisodeError, FinishedEpisode, ScoreFrame};
pub use object::{ArticulatedPart, ObjectInstance};
pub use robot_instance::RobotInstance;
pub use sensor_assets::{SensingError, SensorAssets};
pub use sensor_check::{CAMERA_IMAGE_SUFFIXES, TACTILE_IMAGE_SUFFIXES, TACTILE_IMAGES, check_sensors};
pub use sensors::{BodyConfiguration, Proprioception, ROBOT_SEGMENTATION_ID, SensorSuite, StateRecording};
pub use settle::SettleError;
pub use simulation::{Simulation, state_hash};
pub use soft_model::soft_model;
pub use spec::{EpisodeSpec, target_asset};
pub use trace::{ObjectTrace, StepTrace};
