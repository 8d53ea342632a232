//! Elasticity of the gel: from force and shape of a contact to pressure, shear and displacement of the gel's surface.
//!
//! The gel is an elastic layer bonded to a rigid base. Its response is known in closed form for each wave number
//! (`softvt_physics::contact::LayerResponse`) and applied by Fourier transforms ([`softvt_signal::fourier`]).
//! `normal_contact` finds the pressure under a pressed shape; [`GelField::solve`] adds the shear of the solver's
//! contact points.

mod gel;
mod gel_field;
mod height_map;
mod normal_contact;
mod pad_wrench;
mod substrate;
#[cfg(test)]
pub(super) mod tests;

pub use gel::{Gel, GelScratch};
pub(super) use gel_field::cubic_taps;
pub use gel_field::{GelField, PlanarMotion, TactileContact, TactileContactError};
pub use height_map::SkinMesh;
pub use pad_wrench::{PadWrench, Taxels};
pub use substrate::SubstrateCompliance;
