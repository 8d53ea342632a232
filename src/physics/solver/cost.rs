//! The cost of a solve, `½ vᵀA v − rᵀv + Σ ℓ(J v)`, its gradient and its Hessian.

use super::{
    assemble::{gather, pull, spread, velocity},
    island::Island,
    law::{Answer, Law},
    newton::Solver,
    problem::{Patch, Point, Problem},
};
use crate::{geometry::Vec3, physics::sparse::dense};

/// Calls `visit` with every point of a patch, its relative velocity and its answer at `v`.
#[inline]
fn answers(
    problem: &Problem,
    offsets: &[usize],
    patch: &Patch,
    v: &[f64],
    mut visit: impl FnMut(&Point, Vec3, Option<Answer>),
) {
    let law = Law::new(problem.dt, problem.tau);
    let ua = gather(problem, offsets, &patch.a, v);
    let ub = gather(problem, offsets, &patch.b, v);
    for point in &problem.points[patch.first..patch.last] {
        let relative = velocity(problem, &patch.a, &ua, &point.weights_a, &point.p)
            - velocity(problem, &patch.b, &ub, &point.weights_b, &point.p)
            - point.drift;
        visit(point, relative, law.contact(point, &relative));
    }
}

impl Solver {
    /// Cost and gradient at `v`.
    pub(super) fn evaluate(
        &mut self,
        problem: &Problem,
        island: &Island,
        v: &[f64],
        gradient: &mut [f64],
    ) -> f64 {
        let mut cost = self.momentum_terms(problem, island, v, gradient);
        for patch in island.patches.iter().map(|&index| &problem.patches[index]) {
            let (mut on_a, mut on_b, mut touched) = ([Vec3::zeros(); 8], [Vec3::zeros(); 8], false);
            answers(problem, &self.offsets, patch, v, |point, _, answer| {
                let Some(answer) = answer else { return };
                touched = true;
                cost += answer.cost;
                pull(problem, &patch.a, &mut on_a, &point.weights_a, (&point.p, &answer.impulse));
                pull(problem, &patch.b, &mut on_b, &point.weights_b, (&point.p, &answer.impulse));
            });
            if touched {
                spread(problem, &self.offsets, &patch.a, (-1.0, &on_a), gradient);
                spread(problem, &self.offsets, &patch.b, (1.0, &on_b), gradient);
            }
        }
        for scalar in island.scalars.iter().map(|&row| &problem.scalars[row]) {
            let at = self.offsets[scalar.block] + scalar.index;
            let (force, value) = scalar.answer(problem.dt, v[at]);
            cost += value;
            gradient[at] -= problem.dt * force;
        }
        cost
    }

    /// `½ vᵀA v − rᵀv` and its gradient.
    fn momentum_terms(&mut self, problem: &Problem, island: &Island, v: &[f64], gradient: &mut [f64]) -> f64 {
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
        problem: &Problem,
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
        let law = Law::new(problem.dt, problem.tau);
        for patch in island.patches.iter().map(|&index| &problem.patches[index]) {
            let (local, mut touched) = (&mut self.local, false);
            local.start(&patch.a, &patch.b);
            answers(problem, &self.offsets, patch, v, |point, _, answer| {
                let Some(answer) = answer else { return };
                touched = true;
                local.add(problem, &patch.a, &patch.b, point, &law.curvature(point, &answer));
            });
            if touched {
                self.map.set(problem, &self.offsets, &patch.a, &patch.b);
                self.local.scatter(&self.map, hessian, n);
            }
        }
    }

    /// Writes impulses into the points; returns (change against the lagged ones, total) of the normal impulses.
    pub(super) fn record(&mut self, problem: &mut Problem, island: &Island) -> (f64, f64) {
        let (mut change, mut total) = (0.0, 0.0);
        let mut points = std::mem::take(&mut self.solved);
        for &index in &island.patches {
            let patch = problem.patches[index];
            points.clear();
            answers(problem, &self.offsets, &patch, &self.v, |_, v, answer| points.push((v, answer)));
            for (point, (v, answer)) in problem.points[patch.first..patch.last].iter_mut().zip(&points) {
                let normal = answer.map_or(0.0, |answer| answer.normal);
                change += (normal - point.lagged).abs();
                total += normal;
                point.normal_impulse = normal;
                point.shear_impulse = answer.map_or(Vec3::zeros(), |a| a.impulse - point.normal * normal);
                point.slipping = answer.is_some_and(|answer| answer.slipping);
                point.velocity = *v;
            }
        }
        self.solved = points;
        (change, total)
    }
}
