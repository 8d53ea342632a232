//! Inertia and bias forces of a joint tree, by the composite-rigid-body and recursive Newton–Euler algorithms
//! (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6). All spatial vectors are taken at the world
//! origin, so that no transforms between links are needed.

use nalgebra::{DMatrix, DVector};

use super::{
    JointTree,
    kinematics::{LinkVelocity, unit_joint_velocity},
    tree::point_inertia,
};
use softvt_geometry::{Mat3, Pose, Vec3};

/// A spatial velocity, acceleration or (moment, force) pair at the world origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SpatialVector {
    /// Angular velocity, or moment about the world origin.
    angular: Vec3,
    /// Velocity of the point at the world origin, or force.
    linear: Vec3,
}

impl SpatialVector {
    fn plus(&self, other: &Self, scale: f64) -> Self {
        Self { angular: self.angular + other.angular * scale, linear: self.linear + other.linear * scale }
    }

    fn dot(&self, other: &Self) -> f64 {
        self.angular.dot(&other.angular) + self.linear.dot(&other.linear)
    }

    /// Rate of change of the motion `other` carried along by `self` (Featherstone's ×).
    fn cross_motion(&self, other: &Self) -> Self {
        Self {
            angular: self.angular.cross(&other.angular),
            linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular),
        }
    }

    /// Rate of change of the momentum or force `other` carried along by `self` (Featherstone's ×*).
    fn cross_force(&self, other: &Self) -> Self {
        Self {
            angular: self.angular.cross(&other.angular) + self.linear.cross(&other.linear),
            linear: self.angular.cross(&other.linear),
        }
    }
}

/// Rigid-body inertia about the world origin, world axes.
#[derive(Clone, Copy, Debug)]
struct Inertia {
    /// Mass, kg.
    mass: f64,
    /// Mass times centre of mass, kg m.
    first: Vec3,
    /// Second moment about the origin, kg m².
    second: Mat3,
}

impl Inertia {
    fn of(tree: &JointTree, poses: &[Pose], index: usize) -> Self {
        let link = &tree.links[index];
        let com = poses[index].transform_point(&link.com.into()).coords;
        let rotation = poses[index].rotation.to_rotation_matrix();
        let central = rotation.matrix() * link.inertia * rotation.matrix().transpose();
        Self { mass: link.mass, first: com * link.mass, second: central + point_inertia(link.mass, &com) }
    }

    fn momentum(&self, motion: &SpatialVector) -> SpatialVector {
        SpatialVector {
            angular: self.second * motion.angular + self.first.cross(&motion.linear),
            linear: motion.linear * self.mass - self.first.cross(&motion.angular),
        }
    }
}

/// Motions of unit joint speed, and inertias of the links.
fn axes_and_inertias(tree: &JointTree, poses: &[Pose]) -> (Vec<SpatialVector>, Vec<Inertia>) {
    let axis = |index| {
        let LinkVelocity { linear, angular } = unit_joint_velocity(tree, poses, index, &Vec3::zeros());
        SpatialVector { angular, linear }
    };
    (0..tree.dofs()).map(|index| (axis(index), Inertia::of(tree, poses, index))).unzip()
}

/// The joint-space mass matrix `M(q)`, n×n (kg m², kg m, kg by kinds of joint), symmetric positive definite.
pub fn mass_matrix(tree: &JointTree, poses: &[Pose]) -> DMatrix<f64> {
    let (axes, mut inertias) = axes_and_inertias(tree, poses);
    let mut out = DMatrix::zeros(tree.dofs(), tree.dofs());
    for index in (0..tree.dofs()).rev() {
        let composite = inertias[index];
        if let Some(parent) = tree.links[index].parent {
            let carrier = &mut inertias[parent];
            carrier.mass += composite.mass;
            carrier.first += composite.first;
            carrier.second += composite.second;
        }
        let momentum = composite.momentum(&axes[index]);
        let mut at = Some(index);
        while let Some(ancestor) = at {
            let entry = axes[ancestor].dot(&momentum);
            out[(index, ancestor)] = entry;
            out[(ancestor, index)] = entry;
            at = tree.links[ancestor].parent;
        }
    }
    out
}

/// The effort that keeps the joints from accelerating at speeds `v` under `gravity` (world, m/s²): Coriolis,
/// centrifugal and gravity terms, N m or N. With `v = 0` it is the gravity compensation.
pub fn bias(tree: &JointTree, poses: &[Pose], v: &[f64], gravity: &Vec3) -> DVector<f64> {
    let (axes, inertias) = axes_and_inertias(tree, poses);
    let (mut velocities, mut accelerations, mut forces) = (Vec::new(), Vec::new(), Vec::new());
    // Weight enters as an upward acceleration of the base.
    let base = (SpatialVector::default(), SpatialVector { angular: Vec3::zeros(), linear: -gravity });
    for (index, link) in tree.links.iter().enumerate() {
        let (velocity, acceleration) =
            link.parent.map_or(base, |parent: usize| (velocities[parent], accelerations[parent]));
        let velocity: SpatialVector = velocity.plus(&axes[index], v[index]);
        let acceleration: SpatialVector = acceleration.plus(&velocity.cross_motion(&axes[index]), v[index]);
        let inertia = &inertias[index];
        let force =
            inertia.momentum(&acceleration).plus(&velocity.cross_force(&inertia.momentum(&velocity)), 1.0);
        velocities.push(velocity);
        accelerations.push(acceleration);
        forces.push(force);
    }
    let mut out = DVector::zeros(tree.dofs());
    for (index, link) in tree.links.iter().enumerate().rev() {
        out[index] = axes[index].dot(&forces[index]);
        if let Some(parent) = link.parent {
            forces[parent] = forces[parent].plus(&forces[index], 1.0);
        }
    }
    out
}

/// Kinetic energy at joint speeds `v`, J: the sum over links, independent of [`mass_matrix`].
pub fn kinetic_energy(tree: &JointTree, poses: &[Pose], v: &[f64]) -> f64 {
    let velocities = super::velocities(tree, poses, v);
    let energy = |index: usize| {
        let (link, pose, velocity) = (&tree.links[index], &poses[index], &velocities[index]);
        let com = velocity.at(pose, &pose.transform_point(&link.com.into()).coords);
        let spin = pose.rotation.inverse_transform_vector(&velocity.angular);
        0.5 * (link.mass * com.norm_squared() + spin.dot(&(link.inertia * spin)))
    };
    (0..tree.dofs()).map(energy).sum()
}

/// Potential energy under `gravity` (world, m/s²), zero with every centre of mass at the world origin, J.
pub fn potential_energy(tree: &JointTree, poses: &[Pose], gravity: &Vec3) -> f64 {
    let energy = |(link, pose): (&super::Link, &Pose)| {
        -link.mass * gravity.dot(&pose.transform_point(&link.com.into()).coords)
    };
    tree.links.iter().zip(poses).map(energy).sum()
}
