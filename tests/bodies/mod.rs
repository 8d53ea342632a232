//! Helpers shared by the contact tests and the validation of the mechanics.

use std::sync::Arc;

use softvt::{
    geometry::{samples::SampleSpec, shape::Shape},
    physics::{
        fem::{ElasticMaterial, FemModel},
        world::SoftBodyBuilder,
    },
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
    let body = SoftBodyBuilder::new("body", shape, material).resolution(resolution).samples(*spec);
    body.model().expect("a mesh")
}
