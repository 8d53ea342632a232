//! Mechanics: soft bodies, rigid bodies, articulations, contact, and the one convex solve that moves them all.
//!
//! [`World`] owns the state, and [`World::step`] is the algorithm: its documentation has examples. The modules below it
//! can be used on their own: [`fem`] (corotational finite elements), [`rigid`] and [`joints`] (articulated dynamics).
//! No module here depends on scripts, files or images.
#![warn(missing_docs, unreachable_pub)]

pub mod contact;
pub mod fem;
pub mod ids;
pub mod joints;
pub mod params;
pub mod rigid;
mod solver;
mod sparse;
pub mod world;

pub use ids::{
    ArticulationId, AttachmentId, BodyId, ColliderId, ContactPartner, KinematicId, LinkId, RigidId, SoftId,
};
pub use params::{PhysicsParams, STANDARD_GRAVITY};
pub use solver::SolverStats;
pub use world::World;
