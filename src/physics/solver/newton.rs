//! Newton's method with an exact line search on each island, and the lagged passes around it.
//!
//! The cost of a solve is `½ vᵀA v − rᵀv + Σ ℓ(J v)`. The step of one iteration is the minimum of a model in which
//! everything but the scalar constraints is quadratic. Drives at their effort limit, stops and dry joint friction are
//! far stiffer than what they act on, so a joint that begins to move makes a kept factor of the whole Hessian useless.
//! They act on a few velocities only, which are last in the island (the *constrained block*). So the factor excludes
//! them, and each step is solved with the scalar constraints in the state that they will have at its end: a proximal
//! Newton method (Lee, Sun & Saunders 2014) in which the scalar constraints are the part that is not linearised.

use wide::f64x4;

use super::{
    factor::Precision,
    island::{FactorCache, Island, islands},
    kinematics::{ClusterHessian, ClusterImpulses, DofMap},
    lanes::{IslandPacks, LANES, sum_lanes},
    law::{ContactLaw, LinearSegment},
    problem::ContactProblem,
};
use crate::sparse::{NotPositiveDefinite, dense};

/// Convergence of the gradient relative to the momenta of the island (both scaled by `diag(A)^-1/2`).
///
/// Ten times larger, bodies that slide into each other come to rest at angles other than those of converged solutions;
/// steps that converge this far are a few per cent more.
const RELATIVE_TOLERANCE: f64 = 1e-6;
/// Absolute tolerance of the scaled gradient, √J.
const ABSOLUTE_TOLERANCE: f64 = 1e-10;
/// Largest number of Newton steps per pass.
const MAX_NEWTON: u32 = 240;
/// Newton steps of a pass after which each step refactors. With many stiff points that open and close, quasi-Newton
/// corrections of a stale factor may stop converging.
const REFACTOR_EVERY_STEP_AFTER: u32 = 60;
/// Largest number of passes over the lagged friction bound.
const MAX_PASSES: usize = 3;
/// Relative change of the normal impulses below which the passes end.
const PASS_TOLERANCE: f64 = 0.01;
/// Steps after which the convergence with a stale factor, corrected by those steps, is judged.
const STALE_FACTOR_TRIAL: u32 = 3;
/// Velocities from which an island's Hessian is factored in single precision, which is worth it
/// for large matrices only.
const SINGLE_FROM: usize = 96;
/// Slope at the end of a line search, relative to that at its start. Points on the line are cheap: they need no product
/// with the matrices of the blocks.
const LINE_TOLERANCE: f64 = 0.3;
/// Guesses of the active segments of the scalar constraints before the segments at the current velocities are taken.
const MAX_SEGMENT_GUESSES: usize = 8;

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
pub(crate) struct SolverFailure {
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
pub(crate) struct Solver {
    v: Vec<f64>,
    trial: Vec<f64>,
    step: Vec<f64>,
    gradient: Vec<f64>,
    trial_gradient: Vec<f64>,
    /// `A v`, `A` times the step, and `A` times the trial point.
    product: Vec<f64>,
    step_product: Vec<f64>,
    trial_product: Vec<f64>,
    /// `diag(A)^-1/2`.
    scale: Vec<f64>,
    /// Hessian without the scalar constraints, `n × n`, column-major, lower triangle.
    hessian: Vec<f64>,
    cache: FactorCache,
    /// Segment on which each scalar constraint of the island is assumed to end.
    segments: Vec<LinearSegment>,
    /// Curvature of the scalar constraints on the velocities of the constrained block.
    stiffness: Vec<f64>,
    local: ClusterHessian,
    map: DofMap,
    /// The contact points of the island.
    packs: IslandPacks,
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

/// Normal impulses of an island after a pass, N s.
#[derive(Default)]
struct PassImpulses {
    /// Sum of the absolute changes against the previous pass.
    change: f64,
    total: f64,
}

impl Solver {
    /// Solves the problem in place: writes velocities into the blocks, impulses into points
    /// and forces into constraints.
    ///
    /// # Errors
    /// An island did not converge, which happens if a block is not positive definite or a value is not finite. The
    /// results must not be used then.
    pub(crate) fn solve(&mut self, problem: &mut ContactProblem) -> Result<SolverStats, SolverFailure> {
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
        self.start(problem, island);
        self.packs.set(problem, island);
        multiply(problem, island, &self.v, &mut self.product);
        let mut steps = 0;
        for pass in 0..MAX_PASSES {
            steps += self.newton(problem, island)?;
            let PassImpulses { change, total } = self.write_back(problem, island);
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
                self.packs.update_bounds(problem, island);
            }
        }
        for &block in &island.blocks {
            let range = problem.range(block);
            problem.blocks[block].v.copy_from_slice(&self.v[range]);
        }
        Ok(steps)
    }

    /// Reads the initial velocities of an island and gives the buffers its size.
    fn start(&mut self, problem: &mut ContactProblem, island: &Island) {
        self.v.clear();
        self.scale.clear();
        for &block in &island.blocks {
            let b = &mut problem.blocks[block];
            b.offset = self.v.len();
            self.v.extend_from_slice(&b.v);
            self.scale.extend((0..b.dim).map(|i| 1.0 / b.matrix[i * b.dim + i].sqrt()));
        }
        let vectors = [&mut self.trial, &mut self.step, &mut self.gradient, &mut self.trial_gradient];
        let products = [&mut self.product, &mut self.step_product, &mut self.trial_product];
        vectors.into_iter().chain(products).for_each(|buffer| buffer.resize(island.size, 0.0));
    }

    /// Newton's method for one pass; returns the number of steps.
    ///
    /// The cost is piecewise quadratic and changes little from step to step, so an existing factor of its Hessian is
    /// used for as long as that is cheaper than a new one. The gradient is always exact.
    fn newton(&mut self, problem: &ContactProblem, island: &Island) -> Result<u32, SolverFailure> {
        let mut cost = evaluate(problem, island, &self.packs, &self.v, &self.product, &mut self.gradient);
        let mut ratio = self.residual_ratio(problem, island);
        let mut has_factor = self.cache.select(problem, island);
        let mut precision = if island.size < SINGLE_FROM { Precision::Double } else { Precision::Single };
        let mut progress = NewtonProgress { steps: 0, initial_ratio: ratio };
        for step in 0..MAX_NEWTON {
            if ratio <= 1.0 {
                self.cache.record_pass(progress.steps);
                return Ok(step);
            }
            if step == REFACTOR_EVERY_STEP_AFTER {
                precision = Precision::Double;
            }
            let is_new = !has_factor;
            if is_new && !(ratio.is_finite() && self.refactor(problem, island, precision).is_ok()) {
                break;
            }
            if is_new {
                progress = NewtonProgress { steps: 0, initial_ratio: ratio };
            }
            self.find_step(problem, island);
            let lower = self.line_search(problem, island, cost, by_interpolation);
            if lower.is_none() && (!is_new || self.cache.precision() == Precision::Single) {
                // A new factor that gives no descent is too coarse.
                precision = if is_new { Precision::Double } else { precision };
                has_factor = false;
                continue;
            }
            if lower.is_none() && ratio < 1e3 {
                // No descent is left in floating point: converged to its precision if the residual is small already.
                return Ok(step);
            }
            let Some(lower) = lower.or_else(|| self.line_search(problem, island, cost, by_bisection)) else {
                return Err(SolverFailure { block: island.blocks[0], residual_ratio: ratio });
            };
            cost = lower;
            self.correct_factor(problem, island);
            ratio = self.residual_ratio(problem, island);
            progress.steps += 1;
            has_factor = step + 1 < REFACTOR_EVERY_STEP_AFTER
                && (progress.steps < STALE_FACTOR_TRIAL
                    || progress.remaining_steps(ratio) < island.factor_cost());
        }
        Err(SolverFailure { block: island.blocks[0], residual_ratio: ratio })
    }

    /// Factors the Hessian at the current velocities, without the scalar constraints, down to the constrained block; in
    /// double precision if single precision fails.
    ///
    /// # Errors
    /// It is not positive definite.
    fn refactor(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        precision: Precision,
    ) -> Result<(), NotPositiveDefinite> {
        self.assemble_hessian(problem, island);
        self.factorizations += 1;
        let factored = self.cache.factor(problem, island, &self.hessian, precision);
        if factored.is_err() && precision == Precision::Single {
            return self.cache.factor(problem, island, &self.hessian, Precision::Double);
        }
        factored
    }

    /// Writes the lower triangle of the Hessian at the current velocities, without the scalar constraints.
    fn assemble_hessian(&mut self, problem: &ContactProblem, island: &Island) {
        let n = island.size;
        self.hessian.resize(n * n, 0.0);
        for b in island.blocks.iter().map(|&block| &problem.blocks[block]) {
            for column in 0..b.dim {
                let source = &b.matrix[column * b.dim + column..(column + 1) * b.dim];
                let start = (b.offset + column) * n;
                let target = &mut self.hessian[start + b.offset + column..start + n];
                let (diagonal, below) = target.split_at_mut(source.len());
                diagonal.copy_from_slice(source);
                below.fill(0.0);
            }
        }
        let law = ContactLaw::new(problem.dt, problem.dissipation_time);
        for (cluster, packs) in self.packs.clusters(problem, island) {
            let (motion, mut is_touched) = (problem.cluster_motion(cluster, &self.v), false);
            self.local.start(cluster);
            let points = problem.points[cluster.first..cluster.last].chunks(LANES);
            for (pack, points) in packs.iter().zip(points) {
                let Some(response) = law.contact(pack, motion.velocities(pack)) else { continue };
                is_touched = true;
                for (lane, point) in points.iter().enumerate() {
                    let Some(curvature) = law.curvature(pack, &response, lane) else { continue };
                    self.local.add(problem, cluster, point, &curvature);
                }
            }
            if is_touched {
                self.map.set(problem, cluster);
                self.map.scatter(&self.local, &mut self.hessian, n);
            }
        }
    }

    /// Writes impulses and velocities into the points.
    fn write_back(&mut self, problem: &mut ContactProblem, island: &Island) -> PassImpulses {
        let mut impulses = PassImpulses::default();
        let law = ContactLaw::new(problem.dt, problem.dissipation_time);
        for (&index, packs) in island.clusters.iter().zip(self.packs.of_clusters()) {
            let cluster = problem.clusters[index];
            let motion = problem.cluster_motion(&cluster, &self.v);
            let points = problem.points[cluster.first..cluster.last].chunks_mut(LANES);
            for (pack, points) in packs.iter().zip(points) {
                let velocities = motion.velocities(pack);
                let response = law.contact(pack, velocities).unwrap_or_default();
                let (normals, slipping) = (response.normal.to_array(), response.is_slipping.to_bitmask());
                for (lane, point) in points.iter_mut().enumerate() {
                    let normal = normals[lane];
                    if !point.is_bonded {
                        impulses.change += (normal - point.previous_normal_impulse).abs();
                        impulses.total += normal;
                    }
                    point.normal_impulse = normal;
                    point.shear_impulse = response.impulse.lane(lane) - point.normal * normal;
                    point.is_slipping = slipping >> lane & 1 == 1;
                    point.velocity = velocities.lane(lane);
                }
            }
        }
        impulses
    }

    /// Writes the step from the current velocities into `step`. It is always a descent direction.
    fn find_step(&mut self, problem: &ContactProblem, island: &Island) {
        self.segments.clear();
        let scalars = island.scalars(problem);
        self.segments.extend(scalars.map(|(at, constraint)| constraint.segment(problem.dt, self.v[at])));
        let current = self.segments.clone();
        for _ in 0..MAX_SEGMENT_GUESSES {
            self.step_on_segments(problem, island);
            if !self.update_segments(problem, island) {
                return;
            }
        }
        self.segments = current;
        self.step_on_segments(problem, island);
    }

    /// Solves the model with the scalar constraints on the guessed segments.
    fn step_on_segments(&mut self, problem: &ContactProblem, island: &Island) {
        let dt = problem.dt;
        self.step.iter_mut().zip(&self.gradient).for_each(|(s, g)| *s = -g);
        self.stiffness.clear();
        self.stiffness.resize(island.constrained_size(problem), 0.0);
        let first = island.size - self.stiffness.len();
        for ((at, constraint), &segment) in island.scalars(problem).zip(&self.segments) {
            let v = self.v[at];
            self.step[at] -= constraint.slope(segment, dt, v) + dt * constraint.force_at(dt, v);
            self.stiffness[at - first] += constraint.curvature(segment, dt);
        }
        self.cache.solve(island, &self.stiffness, &mut self.step);
    }

    /// Moves each guess by one segment towards that on which its constraint ended; true if any moved.
    fn update_segments(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let mut moved = false;
        for ((at, constraint), segment) in island.scalars(problem).zip(&mut self.segments) {
            let ended = constraint.segment(problem.dt, self.v[at] + self.step[at]);
            if ended != *segment {
                moved = true;
                *segment = if *segment == LinearSegment::Linear { ended } else { LinearSegment::Linear };
            }
        }
        moved
    }

    /// Corrects the kept factor by the last step, without the contribution of the scalar constraints.
    fn correct_factor(&mut self, problem: &ContactProblem, island: &Island) {
        let (old, new) = (&self.trial, &self.v);
        // The former gradient becomes the change.
        self.trial_gradient.iter_mut().zip(&self.gradient).for_each(|(g0, g)| *g0 = g - *g0);
        for (at, constraint) in island.scalars(problem) {
            let force = |v: &[f64]| constraint.force_at(problem.dt, v[at]);
            self.trial_gradient[at] -= problem.dt * (force(old) - force(new));
        }
        let steps = new.iter().zip(old).map(|(v, v0)| v - v0);
        self.cache.corrections().push(steps.zip(self.trial_gradient.iter().copied()));
    }

    /// Norm of the scaled gradient over the tolerance.
    fn residual_ratio(&self, problem: &ContactProblem, island: &Island) -> f64 {
        let norm =
            |values: &[f64]| values.iter().zip(&self.scale).map(|(g, s)| (g * s).powi(2)).sum::<f64>().sqrt();
        let mut rhs = 0.0;
        for &block in &island.blocks {
            let b = &problem.blocks[block];
            rhs += b.rhs.iter().zip(&self.scale[b.offset..]).map(|(r, s)| (r * s).powi(2)).sum::<f64>();
        }
        let momentum = rhs.sqrt().max(norm(&self.product));
        norm(&self.gradient) / (RELATIVE_TOLERANCE * momentum + ABSOLUTE_TOLERANCE)
    }

    /// Moves along `step` to a lower cost: by the full step if that descends enough, else to the minimum on the line.
    ///
    /// `next_trial` chooses a point in the bracket of that minimum. Returns the new cost; the gradient there is in
    /// `gradient`, the former point and its gradient in `trial`. `None` if no descent was found.
    fn line_search(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        cost: f64,
        next_trial: fn(LinePoint, LinePoint) -> f64,
    ) -> Option<f64> {
        let slope: f64 = self.gradient.iter().zip(&self.step).map(|(g, s)| g * s).sum();
        if slope.is_nan() || slope >= 0.0 {
            return None;
        }
        multiply(problem, island, &self.step, &mut self.step_product);
        // Ends of the bracket of the minimum.
        let mut low = LinePoint { position: 0.0, slope };
        let mut high = LinePoint { position: f64::INFINITY, slope: f64::INFINITY };
        let mut at = 1.0;
        let mut value = f64::INFINITY;
        for _ in 0..40 {
            self.trial.iter_mut().zip(&self.v).zip(&self.step).for_each(|((t, v), s)| *t = v + at * s);
            let products = self.product.iter().zip(&self.step_product);
            self.trial_product.iter_mut().zip(products).for_each(|(t, (p, s))| *t = p + at * s);
            value = evaluate(
                problem,
                island,
                &self.packs,
                &self.trial,
                &self.trial_product,
                &mut self.trial_gradient,
            );
            let along: f64 = self.trial_gradient.iter().zip(&self.step).map(|(g, s)| g * s).sum();
            let descends = value <= cost + 1e-4 * at * slope;
            // If the full step still leads downhill, the model is accurate enough to take it.
            let is_downhill = along <= 0.0 && high.position.is_infinite();
            if descends && (is_downhill || along.abs() <= LINE_TOLERANCE * slope.abs()) {
                break;
            }
            let reached = LinePoint { position: at, slope: along };
            if along > 0.0 || !value.is_finite() {
                high = reached;
            } else {
                low = reached;
            }
            if high.position - low.position < 1e-9 {
                break;
            }
            at = next_trial(low, high);
        }
        if value.is_nan() || value > cost {
            return None;
        }
        std::mem::swap(&mut self.v, &mut self.trial);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        std::mem::swap(&mut self.product, &mut self.trial_product);
        Some(value)
    }
}

/// `A v` for the velocities `v` of an island.
fn multiply(problem: &ContactProblem, island: &Island, v: &[f64], product: &mut [f64]) {
    for &block in &island.blocks {
        let (b, range) = (&problem.blocks[block], problem.range(block));
        dense::symmetric_multiply(&b.matrix, b.dim, &v[range.clone()], &mut product[range]);
    }
}

/// Cost and gradient at `v`, where `product` is `A v`.
fn evaluate(
    problem: &ContactProblem,
    island: &Island,
    packs: &IslandPacks,
    v: &[f64],
    product: &[f64],
    gradient: &mut [f64],
) -> f64 {
    let mut cost = 0.0;
    for &block in &island.blocks {
        let (b, range) = (&problem.blocks[block], problem.range(block));
        let rows = gradient[range.clone()].iter_mut().zip(&product[range.clone()]);
        for ((g, p), (r, v)) in rows.zip(b.rhs.iter().zip(&v[range])) {
            *g = p - r;
            cost += v * (0.5 * p - r);
        }
    }
    let law = ContactLaw::new(problem.dt, problem.dissipation_time);
    let mut contact_cost = f64x4::ZERO;
    for (cluster, packs) in packs.clusters(problem, island) {
        let motion = problem.cluster_motion(cluster, v);
        let (mut impulses, mut is_touched) = (ClusterImpulses::default(), false);
        for pack in packs {
            let Some(response) = law.contact(pack, motion.velocities(pack)) else { continue };
            is_touched = true;
            contact_cost += response.cost;
            impulses.add(&motion, pack, response.impulse);
        }
        if is_touched {
            impulses.scatter(problem, cluster, gradient);
        }
    }
    cost += sum_lanes(contact_cost);
    for (at, constraint) in island.scalars(problem) {
        cost += constraint.cost(problem.dt, v[at]);
        gradient[at] -= problem.dt * constraint.force_at(problem.dt, v[at]);
    }
    cost
}

/// A point of a line search.
#[derive(Clone, Copy)]
struct LinePoint {
    /// Multiple of the step.
    position: f64,
    /// Derivative of the cost by the position.
    slope: f64,
}

/// Root of the linear interpolation of the slope of the cost between two points of a line.
///
/// The slope of a convex cost grows monotonically, so this is nearer to the minimum than the middle; it keeps a tenth
/// of the bracket from either end. Where friction reverses, however, the slope jumps. If it jumps near the low end, to
/// less than about a ninth of the slope there, only the high end moves, by a tenth of the bracket per trial (one end
/// of a regula falsi may stay for ever: Dowell & Jarratt 1971), and the trials may end before any of them descends.
fn by_interpolation(low: LinePoint, high: LinePoint) -> f64 {
    if !high.position.is_finite() {
        return 1.5 * low.position;
    }
    let share = low.slope / (low.slope - high.slope);
    let share = if share.is_finite() { share.clamp(0.1, 0.9) } else { 0.5 };
    low.position + share * (high.position - low.position)
}

/// Middle between two points of a line. It halves the bracket whatever the slopes are, and is the fallback of the line
/// search of Drake's contact solver, too (`DoNewtonWithBisectionFallback`).
fn by_bisection(low: LinePoint, high: LinePoint) -> f64 {
    if high.position.is_finite() { 0.5 * (low.position + high.position) } else { 1.5 * low.position }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{ContactCluster, ContactPoint, Endpoint, VelocityBlock};
    use softvt_geometry::Vec3;

    /// Mass, kg; friction bound and normal impulse, N s; product of step and tangential stiffness, N s/m.
    const MASS: f64 = 0.05;
    const BOUND: f64 = 0.5 * WEIGHT;
    const WEIGHT: f64 = MASS * 9.81 / 60.0;
    const SHEAR: f64 = 5e5 / 60.0;

    /// A light body on a stiff floor that slid to the left and is now pushed to the right with a share
    /// of the friction bound.
    fn pushed_back(share: f64) -> ContactProblem {
        let (dt, stiffness, left) = (1.0 / 60.0, 1e6, -1e-6);
        let mut weights_a = [0.0; 8];
        weights_a[0] = 1.0;
        let block = VelocityBlock {
            dim: 3,
            matrix: (0..9).map(|i| if i % 4 == 0 { MASS } else { 0.0 }).collect(),
            rhs: vec![share * BOUND, 0.0, -WEIGHT],
            v: vec![left, 0.0, 0.0],
            ..VelocityBlock::default()
        };
        let point = ContactPoint {
            weights_a,
            normal: Vec3::z(),
            stiffness,
            shear_stiffness: SHEAR / dt,
            gap: -WEIGHT / (dt * stiffness),
            offset: Vec3::x() * (-BOUND / SHEAR),
            mu: 0.5,
            previous_normal_impulse: WEIGHT,
            ..ContactPoint::default()
        };
        let node = Endpoint::Nodes { block: 0, at: [0; 8], count: 4 };
        ContactProblem {
            dt,
            dissipation_time: 5e-3,
            blocks: vec![block],
            clusters: vec![ContactCluster { a: node, b: Endpoint::Known, first: 0, last: 1 }],
            points: vec![point],
            ..ContactProblem::default()
        }
    }

    #[test]
    fn a_light_body_sticks_where_friction_reverses_at_the_start_of_a_long_step() {
        for share in [0.3, 0.6, 0.8, 0.82, 0.85, 0.9, 0.95] {
            let mut problem = pushed_back(share);
            Solver::default()
                .solve(&mut problem)
                .unwrap_or_else(|failure| panic!("share {share}: {failure}"));
            let v = problem.blocks[0].v[0];
            let expected = (1.0 + share) * BOUND / (MASS + SHEAR * (problem.dt + problem.dissipation_time));
            assert!((v / expected - 1.0).abs() < 1e-5, "share {share}: {v} m/s, expected {expected} m/s");
            assert!(!problem.points[0].is_slipping, "share {share}");
        }
    }
}
