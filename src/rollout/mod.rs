//! One episode: settle → observe → act → step → judge; and the batch of them.

pub mod batch;
mod build;
pub mod episode;
mod evidence;
mod furniture;
mod looks;
mod made;
mod recent;
mod rig;
pub mod senses;
pub mod simulation;
mod spec;
pub mod stop;
mod streams;
mod trace;

pub use build::{BuildError, RestCache, soft_rest};
pub use episode::{ControlError, Controller, Episode, EpisodeError, Finished, ScoreFrame};
pub use looks::Looks;
pub use rig::Rig;
pub use senses::{Film, SenseError, Senses};
pub use simulation::{Handle, Kind, PartOf, SettleError, Simulation};
pub use spec::{EpisodeSpec, Which, target_asset};
pub use streams::{CAMERA_PICTURES, FINGER_PICTURES, FINGERS, check_senses};
pub use trace::{ObjectTrace, StepTrace};
