//! What the tests of contact and the validation of the mechanics put into a world.

use std::sync::Arc;

use softvt::{
    geometry::{
        Pose,
        mass::mass_properties,
        samples::{SampleSpec, surface_samples},
        shape::Shape,
        voxel::{VoxelSpec, voxel_mesh},
    },
    physics::{
        World,
        contact::{Collider, Friction, Mover},
        fem::{Material, Rest},
    },
};

/// Gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// The rest data of a soft body.
pub fn soft_rest(shape: &Shape, material: Material, resolution: usize, spec: &SampleSpec) -> Arc<Rest> {
    let mesh = voxel_mesh(shape, &VoxelSpec { resolution }).expect("a mesh");
    let samples = surface_samples(shape, &mesh, spec);
    Rest::new(mesh, material, mass_properties(shape, 1.0).mass, samples)
}

/// A collider of a hard shape.
pub fn put(
    world: &mut World,
    name: &str,
    (mover, pose): (Mover, Pose),
    shape: &Shape,
    mu: Friction,
) -> usize {
    let layer = world.rigid_layer();
    world.add_collider(Collider::new(name, (mover, pose), Arc::new(shape.clone()), mu, layer))
}
