//! Newton's method with an exact line search on each island, and the lagged passes around it.

use super::{
    assemble::{ClusterHessian, DofMap},
    cost::PassResidual,
    island::{FactorCache, Island, islands},
    law::{ConstraintResponse, LinearSegment},
    options::{
        ABSOLUTE_TOLERANCE, FACTOR_COST_IN_STEPS, MAX_NEWTON, MAX_PASSES, PASS_TOLERANCE,
        REFACTOR_EVERY_STEP_AFTER, RELATIVE_TOLERANCE, STALE_FACTOR_TRIAL,
    },
    problem::ContactProblem,
};
use crate::{geometry::Vec3, physics::sparse::dense};

/// Iteration counts of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverStats {
    /// Newton steps of all passes and islands.
    pub newton_steps: u32,
    /// Newton steps of the island with most of them.
    pub max_newton_steps: u32,
    /// Factored Hessians; the other steps used an existing factor.
    pub factorizations: u32,
}

/// The solve did not converge.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the island of block {block} did not converge: residual {residual_ratio:.1e} times the tolerance")]
pub struct SolverFailure {
    /// The first block of the island that failed.
    pub block: usize,
    /// Norm of the scaled gradient over the tolerance.
    pub residual_ratio: f64,
}

/// The solver: buffers, and factors kept from one problem to the next.
///
/// A clone continues identically. Results depend on the sequence of problems, because kept factors influence the path
/// of convergence within the tolerance.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    /// First index of each block in the vectors of its island.
    pub(super) offsets: Vec<usize>,
    pub(super) v: Vec<f64>,
    pub(super) trial: Vec<f64>,
    pub(super) step: Vec<f64>,
    pub(super) gradient: Vec<f64>,
    pub(super) trial_gradient: Vec<f64>,
    /// `A v`.
    pub(super) product: Vec<f64>,
    /// `diag(A)^-1/2`.
    scale: Vec<f64>,
    pub(super) cache: FactorCache,
    /// Segment on which each scalar constraint of the island is assumed to end.
    pub(super) segments: Vec<LinearSegment>,
    /// Curvature of the scalar constraints on the velocities of the constrained block.
    pub(super) stiffness: Vec<f64>,
    pub(super) local: ClusterHessian,
    pub(super) map: DofMap,
    /// Velocities and responses of one cluster.
    pub(super) solved: Vec<(Vec3, Option<ConstraintResponse>)>,
    factorizations: u32,
}

/// Convergence with the current factor.
#[derive(Clone, Copy)]
struct NewtonProgress {
    steps: u32,
    /// Residual over tolerance before the first of these steps.
    initial_ratio: f64,
}

impl NewtonProgress {
    /// Number of steps to convergence if they continue at the same rate.
    fn remaining_steps(&self, ratio: f64) -> f64 {
        if ratio <= 1.0 {
            return 0.0;
        }
        let gained = (self.initial_ratio / ratio).ln();
        if gained > 0.0 { f64::from(self.steps) * ratio.ln() / gained } else { f64::INFINITY }
    }
}

impl Solver {
    /// Solves the problem in place: writes velocities into the blocks, impulses into points
    /// and forces into constraints.
    ///
    /// # Errors
    /// An island did not converge, which happens if a block is not positive definite or a value is not finite. The
    /// results are void then.
    pub fn solve(&mut self, problem: &mut ContactProblem) -> Result<SolverStats, SolverFailure> {
        let mut stats = SolverStats::default();
        self.factorizations = 0;
        for island in islands(problem) {
            let steps = self.solve_island(problem, &island)?;
            stats.newton_steps += steps;
            stats.max_newton_steps = stats.max_newton_steps.max(steps);
        }
        stats.factorizations = self.factorizations;
        Ok(stats)
    }

    /// Solves one island; returns the number of Newton steps.
    fn solve_island(&mut self, problem: &mut ContactProblem, island: &Island) -> Result<u32, SolverFailure> {
        self.prepare(problem, island);
        let mut steps = 0;
        for pass in 0..MAX_PASSES {
            steps += self.newton(problem, island)?;
            let PassResidual { change, total } = self.record(problem, island);
            if change <= PASS_TOLERANCE * total {
                break;
            }
            if pass + 1 < MAX_PASSES {
                for &cluster in &island.clusters {
                    let cluster = problem.clusters[cluster];
                    for point in &mut problem.points[cluster.first..cluster.last] {
                        point.previous_normal_impulse = point.normal_impulse;
                    }
                }
            }
        }
        for &block in &island.blocks {
            let (start, dim) = (self.offsets[block], problem.blocks[block].dim);
            problem.blocks[block].v.copy_from_slice(&self.v[start..start + dim]);
        }
        for &index in &island.constraints {
            let constraint = &mut problem.constraints[index];
            let v = self.v[self.offsets[constraint.block] + constraint.index];
            constraint.force = constraint.force_and_cost(problem.dt, v).0;
        }
        Ok(steps)
    }

    fn prepare(&mut self, problem: &ContactProblem, island: &Island) {
        self.offsets.resize(problem.blocks.len(), 0);
        self.v.clear();
        self.scale.clear();
        for &block in &island.blocks {
            self.offsets[block] = self.v.len();
            let b = &problem.blocks[block];
            self.v.extend_from_slice(&b.v);
            self.scale.extend((0..b.dim).map(|i| 1.0 / b.matrix[i * b.dim + i].sqrt()));
        }
        for buffer in
            [&mut self.trial, &mut self.step, &mut self.gradient, &mut self.trial_gradient, &mut self.product]
        {
            buffer.resize(island.size, 0.0);
        }
    }

    /// Newton's method for one pass; returns the number of steps.
    ///
    /// The cost is piecewise quadratic and changes little from step to step, so an existing factor of its Hessian is
    /// used for as long as that is cheaper than a new one. The gradient is always exact.
    fn newton(&mut self, problem: &ContactProblem, island: &Island) -> Result<u32, SolverFailure> {
        let mut cost = self.update_gradient(problem, island);
        let mut ratio = self.residual_ratio(problem, island);
        let mut has_factor = self.cache.select(problem, island);
        let mut progress = NewtonProgress { steps: 0, initial_ratio: ratio };
        for step in 0..MAX_NEWTON {
            if ratio <= 1.0 {
                self.cache.record_pass(progress.steps);
                return Ok(step);
            }
            let is_new = !has_factor;
            if is_new && !(ratio.is_finite() && self.refactor(problem, island)) {
                break;
            }
            if is_new {
                progress = NewtonProgress { steps: 0, initial_ratio: ratio };
            }
            self.find_step(problem, island);
            let Some(lower) = self.line_search(problem, island, cost) else {
                if !is_new {
                    has_factor = false;
                    continue;
                }
                // No descent is left in floating point: converged to its precision if the residual is small already.
                return if ratio < 1e3 {
                    Ok(step)
                } else {
                    Err(SolverFailure { block: island.blocks[0], residual_ratio: ratio })
                };
            };
            cost = lower;
            self.correct_factor(problem, island);
            ratio = self.residual_ratio(problem, island);
            progress.steps += 1;
            has_factor = step + 1 < REFACTOR_EVERY_STEP_AFTER
                && (progress.steps < STALE_FACTOR_TRIAL
                    || progress.remaining_steps(ratio) < FACTOR_COST_IN_STEPS);
        }
        Err(SolverFailure { block: island.blocks[0], residual_ratio: ratio })
    }

    /// Updates the gradient at the current velocities; returns the cost.
    fn update_gradient(&mut self, problem: &ContactProblem, island: &Island) -> f64 {
        let v = std::mem::take(&mut self.v);
        let mut gradient = std::mem::take(&mut self.gradient);
        let cost = self.evaluate(problem, island, &v, &mut gradient);
        (self.v, self.gradient) = (v, gradient);
        cost
    }

    /// Factors the Hessian at the current velocities down to the constrained block. False if it
    /// is not positive definite.
    fn refactor(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let mut hessian = self.cache.take(island);
        let v = std::mem::take(&mut self.v);
        self.assemble_hessian(problem, island, &v, &mut hessian);
        self.v = v;
        let n = island.size;
        let constrained = island.constrained_size(problem, &self.offsets);
        let is_definite = dense::partial_cholesky(&mut hessian[..n * n], n, n - constrained);
        self.cache.set(hessian, is_definite);
        self.factorizations += 1;
        is_definite
    }

    /// Norm of the scaled gradient over the tolerance.
    fn residual_ratio(&self, problem: &ContactProblem, island: &Island) -> f64 {
        let norm =
            |values: &[f64]| values.iter().zip(&self.scale).map(|(g, s)| (g * s).powi(2)).sum::<f64>().sqrt();
        let mut rhs = 0.0;
        for &block in &island.blocks {
            let start = self.offsets[block];
            let b = &problem.blocks[block];
            rhs += b.rhs.iter().zip(&self.scale[start..]).map(|(r, s)| (r * s).powi(2)).sum::<f64>();
        }
        let momentum = rhs.sqrt().max(norm(&self.product));
        norm(&self.gradient) / (RELATIVE_TOLERANCE * momentum + ABSOLUTE_TOLERANCE)
    }

    /// Moves along `step` to a lower cost: by the full step if that descends enough, else to the minimum on the line.
    ///
    /// Returns the new cost; the gradient there is in `gradient`. `None` if no descent was found.
    fn line_search(&mut self, problem: &ContactProblem, island: &Island, cost: f64) -> Option<f64> {
        let slope: f64 = self.gradient.iter().zip(&self.step).map(|(g, s)| g * s).sum();
        if slope.is_nan() || slope >= 0.0 {
            return None;
        }
        let (mut low, mut high, mut at) = (0.0, f64::INFINITY, 1.0);
        let mut value = f64::INFINITY;
        for _ in 0..40 {
            let along;
            (value, along) = self.probe(problem, island, at);
            let descends = value <= cost + 1e-4 * at * slope;
            // At a slope this small, or still downhill, the model is accurate enough to take the step.
            if descends && (along.abs() <= 0.3 * slope.abs() || along <= 0.0) {
                break;
            }
            if along > 0.0 || !value.is_finite() {
                high = at;
            } else {
                low = at;
            }
            if high - low < 1e-9 {
                break;
            }
            at = if high.is_finite() { 0.5 * (low + high) } else { 1.5 * at };
        }
        if value.is_nan() || value > cost {
            return None;
        }
        std::mem::swap(&mut self.v, &mut self.trial);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        Some(value)
    }

    /// Cost and slope at `v + at · step`, which is left in `trial`.
    fn probe(&mut self, problem: &ContactProblem, island: &Island, at: f64) -> (f64, f64) {
        self.trial.iter_mut().zip(&self.v).zip(&self.step).for_each(|((t, v), s)| *t = v + at * s);
        let trial = std::mem::take(&mut self.trial);
        let mut gradient = std::mem::take(&mut self.trial_gradient);
        let value = self.evaluate(problem, island, &trial, &mut gradient);
        let along = gradient.iter().zip(&self.step).map(|(g, s)| g * s).sum();
        (self.trial, self.trial_gradient) = (trial, gradient);
        (value, along)
    }
}
