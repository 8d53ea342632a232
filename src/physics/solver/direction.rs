//! The step of one iteration: the minimum of a model in which everything but the scalar rows is quadratic.
//!
//! Drives at their effort, stops and dry joint friction are so much stiffer than what they act on that a joint which
//! begins to move changes the Hessian beyond use. They act on a few velocities only, which stand last, so they are
//! left out of the kept factor and each step is solved with them as they will be at its end: a proximal Newton method
//! (Lee, Sun, Saunders 2014) with the scalar rows as the part that is not smoothed.

use super::{island::Island, law::LinearSegment, newton::Solver, problem::ContactProblem};

/// Guesses of the segments on which the scalar rows end before the present ones are taken.
const MAX_GUESSES: usize = 8;

/// Number of velocities from the first one with a scalar row to the end of the island.
pub(super) fn tail(problem: &ContactProblem, offsets: &[usize], island: &Island) -> usize {
    let rows = island.constraints.iter().map(|&row| &problem.constraints[row]);
    let first = rows.map(|row| offsets[row.block] + row.index).min().unwrap_or(island.size);
    island.size - first
}

impl Solver {
    /// Writes the step from the present velocities into `step`; it always goes downhill.
    pub(super) fn find_step(&mut self, problem: &ContactProblem, island: &Island) {
        self.segments.clear();
        self.segments.extend(island.constraints.iter().map(|&row| {
            let row = &problem.constraints[row];
            row.segment(problem.dt, self.v[self.offsets[row.block] + row.index])
        }));
        let present = self.segments.clone();
        for _ in 0..MAX_GUESSES {
            self.step_on_pieces(problem, island);
            if !self.guess_again(problem, island) {
                return;
            }
        }
        self.segments = present;
        self.step_on_pieces(problem, island);
    }

    /// Solves the model with the scalar rows on the guessed segments.
    fn step_on_pieces(&mut self, problem: &ContactProblem, island: &Island) {
        self.step.iter_mut().zip(&self.gradient).for_each(|(s, g)| *s = -g);
        self.stiffness.clear();
        self.stiffness.resize(tail(problem, &self.offsets, island), 0.0);
        let first = island.size - self.stiffness.len();
        for (&row, segment) in island.constraints.iter().zip(&self.segments) {
            let row = &problem.constraints[row];
            let at = self.offsets[row.block] + row.index;
            let (slope, curvature) = row.on(*segment, problem.dt, self.v[at]);
            self.step[at] -= slope + problem.dt * row.answer(problem.dt, self.v[at]).0;
            self.stiffness[at - first] += curvature;
        }
        self.cache.solve(island, &self.stiffness, &mut self.step);
    }

    /// Moves each guess towards the segment on which its row has ended, by one segment; whether any moved.
    fn guess_again(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let mut moved = false;
        for (&row, segment) in island.constraints.iter().zip(&mut self.segments) {
            let row = &problem.constraints[row];
            let at = self.offsets[row.block] + row.index;
            let ended = row.segment(problem.dt, self.v[at] + self.step[at]);
            if ended != *segment {
                moved = true;
                *segment = if *segment == LinearSegment::Inside { ended } else { LinearSegment::Inside };
            }
        }
        moved
    }

    /// Teaches the kept factor the last step, less what the scalar rows did.
    pub(super) fn learn(&mut self, problem: &ContactProblem, island: &Island) {
        let (old, new) = (&self.trial, &self.v);
        let by_rows = island.constraints.iter().map(|&row| {
            let row = &problem.constraints[row];
            let at = self.offsets[row.block] + row.index;
            let force = |v: &[f64]| row.answer(problem.dt, v[at]).0;
            (at, problem.dt * (force(old) - force(new)))
        });
        self.cache.learn((old, &self.trial_gradient), (new, &self.gradient), by_rows);
    }
}
