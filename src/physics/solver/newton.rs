//! Newton's method with an exact line search on each island, and the previous_normal_impulse passes around it.

use super::{
    assemble::{ClusterHessian, DofMap},
    direction::tail,
    island::{Cache, Island, islands},
    law::{ConstraintResponse, LinearSegment},
    problem::ContactProblem,
};
use crate::{geometry::Vec3, physics::sparse::dense};

/// Convergence of the gradient relative to the momenta in play (both scaled by `diag(A)^-1/2`).
const RELATIVE: f64 = 1e-5;
/// Convergence in absolute terms, √J.
const ABSOLUTE: f64 = 1e-10;
/// Most Newton steps a pass.
const MAX_NEWTON: u32 = 240;
/// Newton steps after which every one gets a factor of its own: with many stiff points that open and close, what old factors
/// were taught may lead nowhere.
const REFACTOR_EVERY_STEP_AFTER: u32 = 60;
/// Most previous_normal_impulse passes.
const MAX_PASSES: usize = 3;
/// Change of the normal impulses that ends the passes.
const PASS_CHANGE: f64 = 0.01;

/// A new factor costs about as much as this many steps with the old one.
pub(super) const FACTOR_COST_IN_STEPS: f64 = 8.0;
/// Steps after which an old factor, corrected by what they taught, is judged.
const STALE_FACTOR_TRIAL: u32 = 2;

/// What a solve took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverStats {
    /// Newton steps over all passes and islands.
    pub newton: u32,
    /// Most Newton steps of one island.
    pub newton_max: u32,
    /// Hessians factored; the other steps used an old factor.
    pub factored: u32,
}

/// The solve did not converge: which block, and how far it was.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverFailure {
    /// A block of the island that failed.
    pub block: usize,
    /// Scaled gradient over tolerance.
    pub residual_ratio: f64,
}

/// Buffers of the solver.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    pub(super) offsets: Vec<usize>,
    pub(super) v: Vec<f64>,
    pub(super) trial: Vec<f64>,
    pub(super) step: Vec<f64>,
    pub(super) gradient: Vec<f64>,
    pub(super) trial_gradient: Vec<f64>,
    pub(super) product: Vec<f64>,
    scale: Vec<f64>,
    pub(super) cache: Cache,
    /// The segment on which each scalar row of the island is taken to end.
    pub(super) segments: Vec<LinearSegment>,
    /// Curvature of the scalar rows at the island's last velocities.
    pub(super) stiffness: Vec<f64>,
    pub(super) local: ClusterHessian,
    pub(super) map: DofMap,
    /// Velocities and answers of one cluster.
    pub(super) solved: Vec<(Vec3, Option<ConstraintResponse>)>,
    factored: u32,
}

impl Solver {
    /// Solves the problem in place: velocities in the blocks, impulses in points and constraints.
    pub fn solve(&mut self, problem: &mut ContactProblem) -> Result<SolverStats, SolverFailure> {
        let mut stats = SolverStats::default();
        self.factored = 0;
        for island in islands(problem) {
            let taken = self.solve_island(problem, &island)?;
            stats.newton += taken;
            stats.newton_max = stats.newton_max.max(taken);
        }
        stats.factored = self.factored;
        Ok(stats)
    }

    fn solve_island(&mut self, problem: &mut ContactProblem, island: &Island) -> Result<u32, SolverFailure> {
        self.prepare(problem, island);
        let mut taken = 0;
        for pass in 0..MAX_PASSES {
            taken += self.newton(problem, island)?;
            let (change, total) = self.record(problem, island);
            if change <= PASS_CHANGE * total {
                break;
            }
            if pass + 1 < MAX_PASSES {
                island_points(problem, island).into_iter().for_each(|range| {
                    problem.points[range]
                        .iter_mut()
                        .for_each(|p| p.previous_normal_impulse = p.normal_impulse);
                });
            }
        }
        for &block in &island.blocks {
            let (start, dim) = (self.offsets[block], problem.blocks[block].dim);
            problem.blocks[block].v.copy_from_slice(&self.v[start..start + dim]);
        }
        for &row in &island.constraints {
            let scalar = &mut problem.constraints[row];
            scalar.force = scalar.answer(problem.dt, self.v[self.offsets[scalar.block] + scalar.index]).0;
        }
        Ok(taken)
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

    /// Newton's method for one pass; the number of steps taken.
    ///
    /// The cost is piecewise quadratic and mostly the same from step to step, so an old factor of its Hessian is used
    /// for as long as that is cheaper than a new one; the gradient itself is always exact.
    fn newton(&mut self, problem: &ContactProblem, island: &Island) -> Result<u32, SolverFailure> {
        let mut cost = self.gradient_at_v(problem, island);
        let mut residual_ratio = self.residual_ratio(problem, island);
        let mut usable = self.cache.matches(problem, island);
        // Steps with this factor, and the residual_ratio before them.
        let mut since = (0, residual_ratio);
        for taken in 0..MAX_NEWTON {
            if residual_ratio <= 1.0 {
                self.cache.took(since.0);
                return Ok(taken);
            }
            let fresh = !usable;
            if fresh && !(residual_ratio.is_finite() && self.refactor(problem, island)) {
                break;
            }
            if fresh {
                since = (0, residual_ratio);
            }
            self.find_step(problem, island);
            let Some(lower) = self.line_search(problem, island, cost) else {
                if !fresh {
                    usable = false;
                    continue;
                }
                // No descent left in floating point: as converged as it can be if it is near.
                return if residual_ratio < 1e3 {
                    Ok(taken)
                } else {
                    Err(SolverFailure { block: island.blocks[0], residual_ratio })
                };
            };
            cost = lower;
            self.learn(problem, island);
            residual_ratio = self.residual_ratio(problem, island);
            since.0 += 1;
            usable = taken + 1 < REFACTOR_EVERY_STEP_AFTER
                && (since.0 < STALE_FACTOR_TRIAL || steps_left(since, residual_ratio) < FACTOR_COST_IN_STEPS);
        }
        Err(SolverFailure { block: island.blocks[0], residual_ratio })
    }

    /// Cost and gradient at the present velocities.
    fn gradient_at_v(&mut self, problem: &ContactProblem, island: &Island) -> f64 {
        let v = std::mem::take(&mut self.v);
        let mut gradient = std::mem::take(&mut self.gradient);
        let cost = self.evaluate(problem, island, &v, &mut gradient);
        (self.v, self.gradient) = (v, gradient);
        cost
    }

    /// Assembles the Hessian at the present velocities and factors it down to the velocities with scalar rows.
    fn refactor(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let mut hessian = self.cache.take(island);
        let v = std::mem::take(&mut self.v);
        self.assemble_hessian(problem, island, &v, &mut hessian);
        self.v = v;
        let n = island.size;
        let tail = tail(problem, &self.offsets, island);
        let sound = dense::partial_cholesky(&mut hessian[..n * n], n, n - tail);
        self.cache.give(hessian, sound);
        self.factored += 1;
        sound
    }

    /// Scaled gradient over tolerance.
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
        norm(&self.gradient) / (RELATIVE * momentum + ABSOLUTE)
    }

    /// Moves along `step` to a lower cost, which it returns with the gradient there: the full step if it is good, else
    /// the minimum on the line.
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
            let enough = value <= cost + 1e-4 * at * slope;
            // Beyond the full step the model is exact enough: take it.
            if enough && (along.abs() <= 0.3 * slope.abs() || along <= 0.0) {
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

    /// Cost and slope at `v + at · step`; leaves that point in `trial`.
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

/// Steps to convergence if they go on like the ones since then, which began at the residual_ratio `before`.
fn steps_left((steps, before): (u32, f64), after: f64) -> f64 {
    if after <= 1.0 {
        return 0.0;
    }
    let gained = (before / after).ln();
    if gained > 0.0 { f64::from(steps) * after.ln() / gained } else { f64::INFINITY }
}

fn island_points(problem: &ContactProblem, island: &Island) -> Vec<std::ops::Range<usize>> {
    island.clusters.iter().map(|&i| problem.clusters[i].first..problem.clusters[i].last).collect()
}
