//! The step of one iteration: the minimum of a model in which everything but the scalar constraints is quadratic.
//!
//! Drives at their effort limit, stops and dry joint friction are far stiffer than what they act on, so a joint that
//! begins to move makes a kept factor of the whole Hessian useless. They act on a few velocities only, which are last
//! in the island (the *constrained block*). So the factor excludes them, and each step is solved with the scalar
//! constraints in the state that they will have at its end: a proximal Newton method (Lee, Sun & Saunders 2014) in
//! which the scalar constraints are the part that is not linearised.

use super::{
    island::Island, law::LinearSegment, newton::Solver, options::MAX_SEGMENT_GUESSES,
    problem::ContactProblem, secant::SecantState,
};

impl Solver {
    /// Writes the step from the current velocities into `step`. It is always a descent direction.
    pub(super) fn find_step(&mut self, problem: &ContactProblem, island: &Island) {
        self.segments.clear();
        self.segments.extend(island.constraints.iter().map(|&index| {
            let constraint = &problem.constraints[index];
            constraint.segment(problem.dt, self.v[self.offsets[constraint.block] + constraint.index])
        }));
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
        self.step.iter_mut().zip(&self.gradient).for_each(|(s, g)| *s = -g);
        self.stiffness.clear();
        self.stiffness.resize(island.constrained_size(problem, &self.offsets), 0.0);
        let first = island.size - self.stiffness.len();
        for (&index, segment) in island.constraints.iter().zip(&self.segments) {
            let constraint = &problem.constraints[index];
            let at = self.offsets[constraint.block] + constraint.index;
            let (slope, curvature) = constraint.derivatives(*segment, problem.dt, self.v[at]);
            self.step[at] -= slope + problem.dt * constraint.force_and_cost(problem.dt, self.v[at]).0;
            self.stiffness[at - first] += curvature;
        }
        self.cache.solve(island, &self.stiffness, &mut self.step);
    }

    /// Moves each guess by one segment towards that on which its constraint ended; true if any moved.
    fn update_segments(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let mut moved = false;
        for (&index, segment) in island.constraints.iter().zip(&mut self.segments) {
            let constraint = &problem.constraints[index];
            let at = self.offsets[constraint.block] + constraint.index;
            let ended = constraint.segment(problem.dt, self.v[at] + self.step[at]);
            if ended != *segment {
                moved = true;
                *segment = if *segment == LinearSegment::Linear { ended } else { LinearSegment::Linear };
            }
        }
        moved
    }

    /// Corrects the kept factor by the last step, without the contribution of the scalar constraints.
    pub(super) fn correct_factor(&mut self, problem: &ContactProblem, island: &Island) {
        let (old, new) = (&self.trial, &self.v);
        let constraint_changes = island.constraints.iter().map(|&index| {
            let constraint = &problem.constraints[index];
            let at = self.offsets[constraint.block] + constraint.index;
            let force = |v: &[f64]| constraint.force_and_cost(problem.dt, v[at]).0;
            (at, problem.dt * (force(old) - force(new)))
        });
        let before = SecantState { v: old, gradient: &self.trial_gradient };
        let after = SecantState { v: new, gradient: &self.gradient };
        self.cache.correct(before, after, constraint_changes);
    }
}
