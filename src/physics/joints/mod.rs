//! Articulated dynamics: trees of rigid links connected by joints of one degree of freedom.
//!
//! The equation of motion is `M(q) v̇ + bias(q, v) = τ + Σ Jᵀ f`: [`mass_matrix`] gives `M`, [`bias`] the Coriolis,
//! centrifugal and gravity terms, [`jacobian`] and [`point_jacobian`] the `J` of forces on a link. Everything is
//! computed in world coordinates from the link poses of [`forward`], so that a step needs the kinematics only once.

mod dynamics;
mod kinematics;
mod tree;

pub use dynamics::{bias, kinetic_energy, mass_matrix, potential_energy};
pub use kinematics::{LinkVelocity, forward, jacobian, point_jacobian, velocities};
pub use tree::{JointKind, JointState, JointTree, JointTreeError, Link};

#[cfg(test)]
mod tests;
