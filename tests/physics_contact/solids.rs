//! Helpers that add rigid bodies and colliders to a world.

use softvt::{
    geometry::{Pose, Quat, Vec3, mass::mass_properties, shape::Shape},
    physics::{BodyId, ColliderId, PhysicsParams, RigidId, World, contact::Friction, rigid::RigidState},
};

pub use crate::bodies::GRAVITY;

/// Surfaces with both coefficients.
pub fn friction(static_mu: f64, dynamic_mu: f64) -> Friction {
    Friction::new(static_mu, dynamic_mu)
}

/// A world that never sleeps, with gravity along −z.
pub fn world() -> World {
    tilted(0.0)
}

/// A world whose gravity is tilted by `angle` (rad) towards +x: a slope in its own frame.
pub fn tilted(angle: f64) -> World {
    World::new(PhysicsParams { sleeping: false, ..PhysicsParams::default() }, gravity(angle))
}

/// Gravity on a slope of `angle` (rad) down +x, in the slope's frame.
pub fn gravity(angle: f64) -> Vec3 {
    Vec3::new(angle.sin(), 0.0, -angle.cos()) * GRAVITY
}

pub fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::cuboid(Vec3::new(x, y, z))
}

pub fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

pub fn turned(pose: Pose, turn: Vec3) -> Pose {
    pose * Quat::from_scaled_axis(turn)
}

/// A static floor whose top is z = 0.
pub fn floor(world: &mut World, mu: Friction) -> ColliderId {
    world.add_shape("floor", BodyId::World, at(0.0, 0.0, -0.05), &cuboid(40.0, 40.0, 0.1), mu)
}

/// Adds a free uniform rigid body with one collider.
pub fn rigid(world: &mut World, shape: &Shape, mass: f64, object_w: Pose, mu: Friction) -> RigidId {
    let one = mass_properties(shape, 1.0);
    let density = mass / one.mass;
    let body = RigidState::new(&object_w, one.com, mass, one.inertia * density).expect("a real body");
    let index = world.add_rigid("body", body);
    world.add_shape("body", index, Pose::identity(), shape, mu);
    index
}

/// A box of these edges (m) whose edges are rounded.
pub fn rounded_box(size: Vec3, radius: f64) -> Shape {
    Shape::cuboid(size.add_scalar(-2.0 * radius)).rounded(radius)
}

/// A cylinder along z whose edges are rounded; full height, m.
pub fn rounded_can(radius: f64, height: f64, rounding: f64) -> Shape {
    Shape::Cylinder { radius: radius - rounding, half_height: 0.5 * height - rounding }.rounded(rounding)
}

/// Settles on the flat, then tilts gravity to `angle` (rad) within `seconds` and waits for as long again.
pub fn tilt(world: &mut World, angle: f64, seconds: f64) {
    run(world, 0.3);
    let steps = (seconds / world.params.dt).round();
    for step in 0..2 * steps as usize {
        world.gravity = gravity(angle * ((step as f64 + 1.0) / steps).min(1.0));
        world.step().expect("a step that converges");
    }
}

/// Steps until `seconds` have passed.
pub fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds / world.params.dt).round() as usize {
        world.step().expect("a step that converges");
    }
}
