//! One convex solve for everything that touches: blocks of generalised velocity and rows between them.
//!
//! Minimises `½ vᵀA v − rᵀv + Σ ℓ(J v)` over the velocities of all blocks, after Castro, Permenter & Han, "An Unconstrained
//! Convex Formulation of Compliant Contact" (2022), with two changes: the tangential rows are springs to a remembered
//! stick anchor, so that a held object does not creep, and the friction bound is previous_normal_impulse (`|γ_t| ≤ μ γ_n` with `γ_n` of the
//! pass before), so that a sliding surface is not pushed away and the problem stays convex. Drives, limits and joint
//! friction are scalar rows of the same solve. The solver names no kind of body: a *block* is a symmetric positive definite
//! matrix with a right-hand side, a *cluster* is a set of contact samples between two endpoints.

mod assemble;
mod cost;
mod direction;
mod island;
mod law;
mod newton;
mod problem;
mod secant;

pub use law::ScalarConstraint;
pub use newton::{Solver, SolverFailure, SolverStats};
pub use problem::{ContactCluster, ContactPoint, ContactProblem, Endpoint, FrameJacobian, VelocityBlock};
