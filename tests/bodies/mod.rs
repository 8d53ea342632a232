//! Helpers shared by the contact tests and the validation of the mechanics.

use std::sync::Arc;

use softvt::{
    geometry::{mass::mass_properties, samples::SampleSpec, shape::Shape},
    physics::fem::{ElasticMaterial, FemModel},
};

/// Gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// The finite-element model of a soft body.
pub fn fem_model(
    shape: &Shape,
    material: ElasticMaterial,
    resolution: usize,
    spec: &SampleSpec,
) -> Arc<FemModel> {
    let volume = mass_properties(shape, 1.0).mass;
    FemModel::from_shape(shape, volume, material, resolution, spec).expect("a mesh")
}
