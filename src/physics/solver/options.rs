//! Tolerances and limits of the solver.

/// Convergence of the gradient relative to the momenta of the island (both scaled by `diag(A)^-1/2`).
pub(super) const RELATIVE_TOLERANCE: f64 = 1e-5;
/// Absolute tolerance of the scaled gradient, √J.
pub(super) const ABSOLUTE_TOLERANCE: f64 = 1e-10;
/// Largest number of Newton steps per pass.
pub(super) const MAX_NEWTON: u32 = 240;
/// Newton steps of a pass after which each step refactors. With many stiff points that open and close, quasi-Newton
/// corrections of a stale factor may stop converging.
pub(super) const REFACTOR_EVERY_STEP_AFTER: u32 = 60;
/// Largest number of passes over the lagged friction bound.
pub(super) const MAX_PASSES: usize = 3;
/// Relative change of the normal impulses below which the passes end.
pub(super) const PASS_TOLERANCE: f64 = 0.01;

/// Cost of a factorization in Newton steps with an existing factor.
pub(super) const FACTOR_COST_IN_STEPS: f64 = 8.0;
/// Steps after which the convergence with a stale factor, corrected by those steps, is judged.
pub(super) const STALE_FACTOR_TRIAL: u32 = 2;
/// Steps of a pass that refactoring would not avoid.
pub(super) const UNAVOIDABLE_STEPS: u32 = 4;
/// Number of islands whose factors are kept.
pub(super) const MAX_CACHED_FACTORS: usize = 6;
/// Number of secant pairs kept per factor.
pub(super) const MAX_SECANT_PAIRS: usize = 8;
/// Guesses of the active segments of the scalar constraints before the segments at the current velocities are taken.
pub(super) const MAX_SEGMENT_GUESSES: usize = 8;
