//! One episode: settle → observe → act → step → judge; and the batch of them.

pub mod batch;
mod build;
pub mod episode;
mod evidence;
mod rig;
pub mod simulation;
pub mod stop;
mod trace;

pub use build::{BuildError, RestCache, soft_rest};
pub use episode::{ControlError, Controller, Episode, EpisodeError, EpisodeSpec, Finished, ScoreFrame};
pub use rig::Rig;
pub use simulation::{Handle, Kind, SettleError, Simulation};
pub use trace::{ObjectTrace, StepTrace};
