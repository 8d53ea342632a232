//! Quasi-Newton correction of a kept factor from the last steps.
//!
//! Contacts that have begun to slip since the factor was computed change the Hessian by a matrix of low rank, which a
//! few secant pairs capture: limited-memory BFGS (Nocedal 1980) with the factor in the place of the initial matrix.

use crate::sparse::dense::dot;

/// A step and the change of the gradient along it.
#[derive(Clone, Debug, Default)]
struct SecantPair {
    step: Vec<f64>,
    change: Vec<f64>,
    curvature: f64,
}

/// Number of pairs kept per factor. Their cost is small against the triangular solves of islands that take many steps.
const MAX_PAIRS: usize = 20;

/// The last [`MAX_PAIRS`] pairs of a change of velocity and of gradient.
#[derive(Clone, Debug, Default)]
pub(super) struct SecantPairs {
    /// Oldest first; beyond `used`, buffers of discarded pairs.
    pairs: Vec<SecantPair>,
    used: usize,
}

impl SecantPairs {
    /// Discards all pairs, after a new factorization.
    pub(super) fn clear(&mut self) {
        self.used = 0;
    }

    /// Adds a step and the change of the gradient along it, entry by entry.
    pub(super) fn push(&mut self, entries: impl Iterator<Item = (f64, f64)>) {
        if self.used == MAX_PAIRS {
            self.pairs.rotate_left(1);
            self.used -= 1;
        } else if self.used == self.pairs.len() {
            self.pairs.push(SecantPair::default());
        }
        let SecantPair { step, change, curvature } = &mut self.pairs[self.used];
        step.clear();
        change.clear();
        for (s, y) in entries {
            step.push(s);
            change.push(y);
        }
        *curvature = dot(step, change);
        // The cost is convex, so a curvature below this is rounding.
        let floor = 1e-12 * (dot(step, step) * dot(change, change)).sqrt();
        if *curvature > floor {
            self.used += 1;
        }
    }

    /// Solves with the corrected factor in place (the two-loop recursion); `solve` solves with the factor itself, which
    /// includes `stiffness` on the diagonal of the last velocities. The pairs do not include it.
    pub(super) fn solve(&self, stiffness: &[f64], b: &mut [f64], solve: impl FnOnce(&mut [f64])) {
        let head = b.len() - stiffness.len();
        let (mut weights, mut curvatures) = ([0.0; MAX_PAIRS], [0.0; MAX_PAIRS]);
        let pairs = self.pairs[..self.used].iter();
        for ((pair, weight), curvature) in pairs.clone().zip(&mut weights).zip(&mut curvatures).rev() {
            let tail = || pair.step[head..].iter().zip(stiffness);
            *curvature = pair.curvature + tail().map(|(s, k)| k * s * s).sum::<f64>();
            *weight = dot(&pair.step, b) / *curvature;
            b.iter_mut().zip(&pair.change).for_each(|(b, y)| *b -= *weight * y);
            b[head..].iter_mut().zip(tail()).for_each(|(b, (s, k))| *b -= *weight * k * s);
        }
        solve(b);
        for ((pair, weight), curvature) in pairs.zip(&weights).zip(&curvatures) {
            let tail = pair.step[head..].iter().zip(stiffness).zip(&b[head..]);
            let along = dot(&pair.change, b) + tail.map(|((s, k), b)| k * s * b).sum::<f64>();
            let missing = weight - along / curvature;
            b.iter_mut().zip(&pair.step).for_each(|(b, s)| *b += missing * s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_pairs_of_every_changed_direction_make_the_solve_exact() {
        // The Hessian is diagonal, the factor is the identity: as many pairs as entries that differ.
        let hessian = [1.0, 5.0, 0.25, 1.0, 3.0];
        let mut pairs = SecantPairs::default();
        for i in [1, 2, 4] {
            let v: [f64; 5] = std::array::from_fn(|j| if i == j { 0.7 } else { 0.0 });
            let g: [f64; 5] = std::array::from_fn(|j| hessian[j] * v[j]);
            pairs.push(v.into_iter().zip(g));
        }
        let mut b = [1.0, 2.0, 3.0, 4.0, 5.0];
        let full = [1.0, 5.0, 0.25, 1.0, 3.0 + 2.0];
        let exact: [f64; 5] = std::array::from_fn(|i| b[i] / full[i]);
        pairs.solve(&[2.0], &mut b, |b| b[4] /= 1.0 + 2.0);
        assert!(b.iter().zip(exact).all(|(b, e)| (b - e).abs() < 1e-14), "{b:?}");
    }
}
