//! Short ways to put things into a world: hard ones of `solids`, and soft ones.

use std::sync::Arc;

use softvt::{
    geometry::{Pose, samples::SampleSpec, shape::Shape},
    physics::{
        World,
        contact::Friction,
        fem::{Material, Rest},
    },
};

use crate::bodies;
pub use crate::solids::*;

/// A soft material like bread.
pub const SOFT: Material = Material { youngs_pa: 3e4, poisson: 0.4, density: 300.0 };

/// The rest data of a soft block with samples every `spacing` m.
pub fn soft_rest(shape: &Shape, material: Material, resolution: usize, spacing: f64) -> Arc<Rest> {
    let spec = SampleSpec { grasp_spacing: spacing, other_spacing: spacing };
    bodies::soft_rest(shape, material, resolution, &spec)
}

/// Adds a soft block that other soft blocks feel; its index.
pub fn soft(world: &mut World, shape: &Shape, rest: &Arc<Rest>, pose: Pose, mu: Friction) -> usize {
    world.add_soft("soft", rest.clone(), Some(Arc::new(shape.clone())), &pose, mu)
}
