//! The mechanics: soft bodies, rigid bodies, joint trees, contact, and the one solve that moves them all.
//!
//! Knows no Lua, no files and no images. [`World`] owns the state; [`World::step`] is the whole algorithm.

pub mod contact;
pub mod fem;
pub mod joints;
pub mod params;
pub mod rigid;
pub mod solver;
pub mod sparse;
pub mod world;

pub use params::Params;
pub use world::World;
