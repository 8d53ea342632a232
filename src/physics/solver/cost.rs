//! The cost of a solve, `½ vᵀA v − rᵀv + Σ ℓ(J v)`, its gradient and its Hessian.

use super::{
    assemble::{add_point_impulse, endpoint_velocities, point_velocity, scatter_impulses},
    island::Island,
    law::{ConstraintResponse, ContactLaw},
    newton::Solver,
    problem::{ContactCluster, ContactPoint, ContactProblem},
};
use crate::{geometry::Vec3, physics::sparse::dense};

/// Calls `visit` with every point of a cluster, its relative velocity and its response at `v`.
#[inline]
fn for_each_response(
    problem: &ContactProblem,
    offsets: &[usize],
    cluster: &ContactCluster,
    v: &[f64],
    mut visit: impl FnMut(&ContactPoint, Vec3, Option<ConstraintResponse>),
) {
    let law = ContactLaw::new(problem.dt, problem.dissipation_time);
    let ua = endpoint_velocities(problem, offsets, &cluster.a, v);
    let ub = endpoint_velocities(problem, offsets, &cluster.b, v);
    for point in &problem.points[cluster.first..cluster.last] {
        let relative = point_velocity(problem, &cluster.a, &ua, &point.weights_a, &point.p)
            - point_velocity(problem, &cluster.b, &ub, &point.weights_b, &point.p)
            - point.drift;
        visit(point, relative, law.contact(point, &relative));
    }
}

/// Normal impulses of an island after a pass, N s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PassResidual {
    /// Sum of the absolute changes against the previous pass.
    pub change: f64,
    /// Sum.
    pub total: f64,
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
            let (mut on_a, mut on_b, mut is_touched) = ([Vec3::zeros(); 8], [Vec3::zeros(); 8], false);
            for_each_response(problem, &self.offsets, cluster, v, |point, _, response| {
                let Some(response) = response else { return };
                is_touched = true;
                cost += response.cost;
                add_point_impulse(
                    problem,
                    &cluster.a,
                    &mut on_a,
                    &point.weights_a,
                    &point.p,
                    &response.impulse,
                );
                add_point_impulse(
                    problem,
                    &cluster.b,
                    &mut on_b,
                    &point.weights_b,
                    &point.p,
                    &response.impulse,
                );
            });
            if is_touched {
                scatter_impulses(problem, &self.offsets, &cluster.a, -1.0, &on_a, gradient);
                scatter_impulses(problem, &self.offsets, &cluster.b, 1.0, &on_b, gradient);
            }
        }
        for constraint in island.constraints.iter().map(|&row| &problem.constraints[row]) {
            let at = self.offsets[constraint.block] + constraint.index;
            let (force, value) = constraint.force_and_cost(problem.dt, v[at]);
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

    /// Hessian at `v` without the scalar constraints: `island.size` squared, column-major, lower triangle.
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
        let law = ContactLaw::new(problem.dt, problem.dissipation_time);
        for cluster in island.clusters.iter().map(|&index| &problem.clusters[index]) {
            let (local, mut is_touched) = (&mut self.local, false);
            local.start(&cluster.a, &cluster.b);
            for_each_response(problem, &self.offsets, cluster, v, |point, _, response| {
                let Some(response) = response else { return };
                is_touched = true;
                local.add(problem, &cluster.a, &cluster.b, point, &law.curvature(point, &response));
            });
            if is_touched {
                self.map.set(problem, &self.offsets, &cluster.a, &cluster.b);
                self.local.scatter(&self.map, hessian, n);
            }
        }
    }

    /// Writes impulses and velocities into the points.
    pub(super) fn record(&mut self, problem: &mut ContactProblem, island: &Island) -> PassResidual {
        let PassResidual { mut change, mut total } = PassResidual::default();
        let mut points = std::mem::take(&mut self.solved);
        for &index in &island.clusters {
            let cluster = problem.clusters[index];
            points.clear();
            for_each_response(problem, &self.offsets, &cluster, &self.v, |_, v, response| {
                points.push((v, response))
            });
            for (point, (v, response)) in problem.points[cluster.first..cluster.last].iter_mut().zip(&points)
            {
                let normal = response.map_or(0.0, |response| response.normal);
                change += (normal - point.previous_normal_impulse).abs();
                total += normal;
                point.normal_impulse = normal;
                point.shear_impulse = response.map_or(Vec3::zeros(), |a| a.impulse - point.normal * normal);
                point.is_slipping = response.is_some_and(|response| response.is_slipping);
                point.velocity = *v;
            }
        }
        self.solved = points;
        PassResidual { change, total }
    }
}
