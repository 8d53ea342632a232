//! Helpers that add soft bodies to a world, and those of `solids`.

use std::sync::Arc;

use softvt::{
    geometry::{Pose, samples::SampleSpec, shape::Shape},
    physics::{
        SoftId, World,
        contact::Friction,
        fem::{ElasticMaterial, FemModel},
    },
};

use crate::bodies;
pub use crate::solids::*;

/// A soft material like that of bread.
pub fn crumb() -> ElasticMaterial {
    ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid")
}

/// The model of a soft block with samples every `spacing` m.
pub fn fem_model(shape: &Shape, material: ElasticMaterial, resolution: usize, spacing: f64) -> Arc<FemModel> {
    let spec = SampleSpec { grasp_spacing: spacing, other_spacing: spacing };
    bodies::fem_model(shape, material, resolution, &spec)
}

/// Adds a soft block with a surface for other soft blocks.
pub fn soft(world: &mut World, shape: &Shape, rest: &Arc<FemModel>, pose: Pose, mu: Friction) -> SoftId {
    world.add_soft("soft", rest.clone(), Some(Arc::new(shape.clone())), &pose, mu)
}
