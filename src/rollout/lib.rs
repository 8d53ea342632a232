//! Execution of episodes: building and settling a scene, observing, acting, stepping and judging.
//!
//! `build` turns a scene into a [`Simulation`]; an [`Episode`] runs it with a [`Controller`] and returns the record.
//! Data derived from assets are shared between episodes in [`AssetCache`].
//!
//! # Example
//!
//! An episode from its scene to its record. It is compiled but not run here, because settling takes seconds without
//! optimisation.
//!
//! ```no_run
//! use std::sync::Arc;
//!
//! use softvt_benchmark::{Goal, Placement, Task, settings::Settings};
//! use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
//! use softvt_evaluation::verdict::Outcome;
//! use softvt_geometry::{Aabb, Pose, Vec3, shape::Shape};
//! use softvt_physics::contact::Friction;
//! use softvt_policy::{EpisodeBrief, builtin::NoopPolicy};
//! use softvt_rollout::{AssetCache, ChunkedPolicy, Episode, EpisodeSpec};
//! use softvt_scene::{Asset, Body, Lighting, Object, Scene};
//!
//! // A cube of 4 cm and a slab rest on a table top of 5 cm, whose upper side is at z = 0.
//! let cuboid = |name: &str, size: Vec3, [y, z]: [f64; 2], body| {
//!     let asset = Asset {
//!         name: name.to_owned(),
//!         // The lowest point of an asset is at z = 0.
//!         shape: Shape::cuboid(size).translated(Vec3::z() * (0.5 * size.z)),
//!         body,
//!         friction: Friction::default(),
//!         visuals: Vec::new(),
//!         hints: Default::default(),
//!     };
//!     Object::new(name, Arc::new(asset), Pose::translation(0.0, y, z))
//! };
//! let scene = Scene {
//!     objects: vec![
//!         cuboid("table", Vec3::new(0.4, 0.4, 0.05), [0.0, -0.05], Body::Static),
//!         cuboid("slab", Vec3::new(0.1, 0.1, 0.01), [0.1, 0.0], Body::Static),
//!         cuboid("cube", Vec3::repeat(0.04), [-0.1, 0.0], Body::Rigid { density: 500.0 }),
//!     ],
//!     base_w: Pose::translation(-0.66, 0.0, 0.012),
//!     start_q: [0.0, -0.19, 0.0, -2.4, 0.0, 2.25, 0.79],
//!     gravity: Vec3::new(0.0, 0.0, -9.81),
//!     workspace: Aabb { min: Vec3::new(-0.5, -0.6, -0.05), max: Vec3::new(0.5, 0.6, 1.0) },
//!     lighting: Lighting::default(),
//!     cameras: Vec::new(),
//! };
//! let (object, target) = ("cube".to_owned(), "slab".to_owned());
//! let task = Task {
//!     id: 0,
//!     prompt: "do nothing".to_owned(),
//!     prompt_varies: false,
//!     layout: "cube".to_owned(),
//!     goal: Goal::On(Placement { object: object.clone(), target, hold_s: 10.0 }),
//!     object,
//!     budget_steps: 3,
//!     expert: false,
//! };
//! let suite = "example".to_owned();
//! let id = EpisodeId { suite: suite.clone(), task: 0, episode: 0, base_seed: 0, split: EpisodeSplit::Validation };
//! let spec = EpisodeSpec::new(id, "noop", &task, &scene.clone(), scene, &Settings::default());
//! let episode = Episode::start(spec, &AssetCache::default())?;
//!
//! let brief = EpisodeBrief { suite, task: 0, prompt: task.prompt.clone(), episode: 0, seed: 0, alias: None };
//! let finished = episode.run(&mut ChunkedPolicy::new(Box::<NoopPolicy>::default(), brief, 1))?;
//! assert_eq!(finished.record.outcome, Outcome::Budget);
//! assert_eq!(finished.record.stats.steps, 3);
//! # Ok::<(), softvt_rollout::EpisodeError>(())
//! ```
#![warn(unreachable_pub)]

mod action_check;
mod asset_cache;
mod build;
mod build_error;
mod controller;
mod disturbance;
mod episode;
mod episode_error;
mod evidence;
mod goal_in_scene;
mod metric;
mod observation_history;
mod plausibility;
mod robot_instance;
mod sensor_noise;
mod sensors;
mod settled_box;
mod shared_cache;
mod simulation;
mod soft_model;
mod trace;

pub use asset_cache::AssetCache;
pub use build::MAX_OVERLAP;
pub use build_error::SceneBuildError;
pub use controller::{ChunkedPolicy, Controller};
pub use episode::{Episode, EpisodeSpec, FinishedEpisode, target_asset};
pub use episode_error::EpisodeError;
pub use goal_in_scene::{GoalAtStart, StatePredicate, check_goal};
pub use metric::{MeasuredMetric, StateFunction};
pub use plausibility::{asset_warnings, ineffective_friction, scene_warnings};
pub use robot_instance::{ArmCommand, RobotInstance};
pub use sensor_noise::SensorSeed;
pub use sensors::{
    BodyConfiguration, CAMERA_IMAGE_SUFFIXES, CloseUp, SensingError, Sensors, StateDeformation,
    StateRecording, TACTILE_IMAGE_SUFFIXES, TACTILE_IMAGES, check_sensors, strain_colour,
};
pub use settled_box::SettledBox;
pub use simulation::{ArticulatedPart, ObjectInstance, SettleError, Simulation, state_hash};
pub use soft_model::{cost_warning, soft_model};
pub use trace::{ObjectTrace, StepTrace};
