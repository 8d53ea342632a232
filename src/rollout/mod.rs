//! One episode: settle → observe → act → step → judge; and the batch of them.

pub mod batch;
mod build;
pub mod cancel;
mod command;
mod control;
pub mod episode;
mod evidence;
mod furniture;
mod judging;
mod looks;
mod made;
mod recent;
mod rest_cache;
mod rig;
pub mod senses;
mod settle;
pub mod simulation;
mod spec;
mod stance;
mod state_hash;
mod streams;
mod trace;

pub use build::{BuildError, check_support, soft_rest};
pub use control::{ControlError, Controller};
pub use episode::{Episode, EpisodeError, Finished, ScoreFrame};
pub use looks::Looks;
pub use rest_cache::RestCache;
pub use rig::Rig;
pub use senses::{Film, SenseError, Senses};
pub use settle::SettleError;
pub use simulation::{Handle, Kind, PartOf, Simulation};
pub use spec::{EpisodeSpec, Which, target_asset};
pub use stance::{BodyState, Stance};
pub use state_hash::state_hash;
pub use streams::{CAMERA_PICTURES, FINGER_PICTURES, FINGERS, check_senses};
pub use trace::{ObjectTrace, StepTrace};
