//! The cost of a solve, `½ vᵀA v − rᵀv + Σ ℓ(J v)`, its gradient and its Hessian.

use super::{
    assemble::{gather, pull, spread, velocity},
    island::Island,
    law::{ConstraintResponse, Law},
    newton::Solver,
    problem::{ContactCluster, ContactPoint, ContactProblem},
};
use crate::{geometry::Vec3, physics::sparse::dense};

/// Calls `visit` with every point of a cluster, its relative velocity and its answer at `v`.
#[inline]
fn answers(
    problem: &ContactProblem,
    offsets: &[usize],
    cluster: &ContactCluster,
    v: &[f64],
    mut visit: impl FnMut(&ContactPoint, Vec3, Option<ConstraintResponse>),
) {
    let law = Law::new(problem.dt, problem.dissipation_time);
    let ua = gather(problem, offsets, &cluster.a, v);
    let ub = gather(problem, offsets, &cluster.b, v);
    for point in &problem.points[cluster.first..cluster.last] {
        let relative = velocity(problem, &cluster.a, &ua, &point.weights_a, &point.p)
            - velocity(problem, &cluster.b, &ub, &point.weights_b, &point.p)
            - point.drift;
        visit(point, relative, law.contact(point, &relative));
    }
}

impl Solver {
    /// Cost and gradient at `v`.
    pub(super) fn evaluate(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        v: &[f64],
        gradient: &mut [f64],
    ) -> f64 {
        let mut cost = self.momentum_terms(problem, island, v, gradient);
        for cluster in island.clusters.iter().map(|&index| &problem.clusters[index]) {
            let (mut on_a, mut on_b, mut touched) = ([Vec3::zeros(); 8], [Vec3::zeros(); 8], false);
            answers(problem, &self.offsets, cluster, v, |point, _, answer| {
                let Some(answer) = answer else { return };
                touched = true;
                cost += answer.cost;
                pull(problem, &cluster.a, &mut on_a, &point.weights_a, (&point.p, &answer.impulse));
                pull(problem, &cluster.b, &mut on_b, &point.weights_b, (&point.p, &answer.impulse));
            });
            if touched {
                spread(problem, &self.offsets, &cluster.a, (-1.0, &on_a), gradient);
                spread(problem, &self.offsets, &cluster.b, (1.0, &on_b), gradient);
            }
        }
        for scalar in island.constraints.iter().map(|&row| &problem.constraints[row]) {
            let at = self.offsets[scalar.block] + scalar.index;
            let (force, value) = scalar.answer(problem.dt, v[at]);
            cost += value;
            gradient[at] -= problem.dt * force;
        }
        cost
    }

    /// `½ vᵀA v − rᵀv` and its gradient.
    fn momentum_terms(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        v: &[f64],
        gradient: &mut [f64],
    ) -> f64 {
        let mut cost = 0.0;
        for &block in &island.blocks {
            let (b, start) = (&problem.blocks[block], self.offsets[block]);
            let range = start..start + b.dim;
            let product = &mut self.product[range.clone()];
            dense::symmetric_multiply(&b.matrix, b.dim, &v[range.clone()], product);
            let rows = gradient[range.clone()].iter_mut().zip(product.iter());
            for ((g, p), (r, v)) in rows.zip(b.rhs.iter().zip(&v[range])) {
                *g = p - r;
                cost += v * (0.5 * p - r);
            }
        }
        cost
    }

    /// Hessian at `v` but for the scalar rows: column-major lower triangle of side `island.size`.
    pub(super) fn assemble_hessian(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        v: &[f64],
        hessian: &mut [f64],
    ) {
        let n = island.size;
        hessian[..n * n].fill(0.0);
        for &block in &island.blocks {
            let (b, start) = (&problem.blocks[block], self.offsets[block]);
            for column in 0..b.dim {
                let source = &b.matrix[column * b.dim + column..(column + 1) * b.dim];
                let target = (start + column) * n + start + column;
                hessian[target..target + source.len()].copy_from_slice(source);
            }
        }
        let law = Law::new(problem.dt, problem.dissipation_time);
        for cluster in island.clusters.iter().map(|&index| &problem.clusters[index]) {
            let (local, mut touched) = (&mut self.local, false);
            local.start(&cluster.a, &cluster.b);
            answers(problem, &self.offsets, cluster, v, |point, _, answer| {
                let Some(answer) = answer else { return };
                touched = true;
                local.add(problem, &cluster.a, &cluster.b, point, &law.curvature(point, &answer));
            });
            if touched {
                self.map.set(problem, &self.offsets, &cluster.a, &cluster.b);
                self.local.scatter(&self.map, hessian, n);
            }
        }
    }

    /// Writes impulses into the points; returns (change against the previous_normal_impulse ones, total) of the normal impulses.
    pub(super) fn record(&mut self, problem: &mut ContactProblem, island: &Island) -> (f64, f64) {
        let (mut change, mut total) = (0.0, 0.0);
        let mut points = std::mem::take(&mut self.solved);
        for &index in &island.clusters {
            let cluster = problem.clusters[index];
            points.clear();
            answers(problem, &self.offsets, &cluster, &self.v, |_, v, answer| points.push((v, answer)));
            for (point, (v, answer)) in problem.points[cluster.first..cluster.last].iter_mut().zip(&points) {
                let normal = answer.map_or(0.0, |answer| answer.normal);
                change += (normal - point.previous_normal_impulse).abs();
                total += normal;
                point.normal_impulse = normal;
                point.shear_impulse = answer.map_or(Vec3::zeros(), |a| a.impulse - point.normal * normal);
                point.is_slipping = answer.is_some_and(|answer| answer.is_slipping);
                point.velocity = *v;
            }
        }
        self.solved = points;
        (change, total)
    }
}
