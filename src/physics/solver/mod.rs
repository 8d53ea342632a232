//! One convex solve for everything that touches: blocks of generalised velocities, contact points between
//! them, and scalar constraints.
//!
//! Minimises `½ vᵀA v − rᵀv + Σ ℓ(J v)` over the velocities of all blocks, after Castro, Permenter & Han, "An
//! Unconstrained Convex Formulation of Compliant Contact" (2022), with two changes. The tangential springs are
//! attached to a stick anchor that persists between steps, so that a held object does not creep. And the friction
//! bound is lagged (`|γ_t| ≤ μ γ_n` with `γ_n` of the previous pass), so that friction does not lift a sliding
//! surface and the problem stays convex. Drives, limits and joint friction are scalar constraints of the same solve.
//!
//! The solver does not depend on the kinds of bodies: a [`VelocityBlock`] is a symmetric positive definite matrix
//! with a right-hand side, a [`ContactCluster`] a set of contact points between two endpoints.

mod factor;
mod island;
mod kinematics;
mod lanes;
mod law;
mod newton;
mod problem;
mod secant;

pub(crate) use newton::Solver;
pub use newton::SolverStats;
pub(crate) use problem::{
    BlockIdentity, ContactCluster, ContactPoint, ContactProblem, Endpoint, FrameJacobian, ScalarConstraint,
    VelocityBlock,
};
