//! A factored Hessian, in double or in single precision.
//!
//! A factor only gives the direction of a step, whose length and end are found with the exact gradient. So its rounding
//! costs at most a few steps and changes no solution, as in iterative refinement (Higham, *Accuracy and Stability of
//! Numerical Algorithms*, 2002, ch. 12). In single precision it takes half of the time and memory. The Hessian is
//! scaled to a unit diagonal first, which removes the differences of units and masses.

use crate::sparse::{NotPositiveDefinite, dense};

/// Precision of a factor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Precision {
    /// `f64`.
    #[default]
    Double,
    /// `f32`, of the Hessian with a unit diagonal.
    Single,
}

/// Cholesky factor of the first columns of a Hessian; the other columns hold their Schur complement.
#[derive(Clone, Debug, Default)]
pub(super) struct Factor {
    pub precision: Precision,
    /// Column-major, lower triangle; one of the two is used.
    double: Vec<f64>,
    single: Vec<f32>,
    /// `diag(H)^-1/2` for a single-precision factor.
    scale: Vec<f64>,
    /// Right-hand side of a single-precision solve.
    work: Vec<f32>,
}

impl Factor {
    /// Factors the first `head` columns of a Hessian of side `n`.
    ///
    /// # Errors
    /// It is not positive definite in this precision.
    pub(super) fn set(
        &mut self,
        hessian: &[f64],
        n: usize,
        head: usize,
        precision: Precision,
    ) -> Result<(), NotPositiveDefinite> {
        self.precision = precision;
        if precision == Precision::Double {
            self.double.clear();
            self.double.extend_from_slice(&hessian[..n * n]);
            return dense::partial_cholesky(&mut self.double, n, head);
        }
        self.scale.clear();
        self.scale.extend((0..n).map(|i| 1.0 / hessian[i * n + i].sqrt()));
        self.single.resize(n * n, 0.0);
        for c in 0..n {
            let columns = (&mut self.single[c * n + c..(c + 1) * n], &hessian[c * n + c..(c + 1) * n]);
            let rows = columns.0.iter_mut().zip(columns.1).zip(&self.scale[c..]);
            rows.for_each(|((to, h), scale)| *to = (h * self.scale[c] * scale) as f32);
        }
        dense::partial_cholesky_single(&mut self.single, n, head)
    }

    /// Solves in place, with `stiffness` added to the diagonal of the last columns. `constrained` is a buffer.
    pub(super) fn solve(&mut self, n: usize, stiffness: &[f64], b: &mut [f64], constrained: &mut Vec<f64>) {
        let head = n - stiffness.len();
        match self.precision {
            Precision::Double => {
                let at = |c: usize, r: usize| self.double[c * n + r];
                factor_constrained(head, stiffness, |_| 1.0, at, constrained);
                dense::forward(&self.double, n, head, b);
                solve_constrained(constrained, &mut b[head..]);
                dense::backward(&self.double, n, head, b);
            }
            Precision::Single => {
                let (work, scale) = (&mut self.work, &self.scale);
                let at = |c: usize, r: usize| f64::from(self.single[c * n + r]);
                factor_constrained(head, stiffness, |i| scale[i], at, constrained);
                work.clear();
                work.extend(b.iter().zip(scale).map(|(b, scale)| (b * scale) as f32));
                dense::forward(&self.single, n, head, work);
                let tail = &mut b[head..];
                tail.iter_mut().zip(&work[head..]).for_each(|(b, w)| *b = f64::from(*w));
                solve_constrained(constrained, tail);
                work[head..].iter_mut().zip(tail).for_each(|(w, b)| *w = *b as f32);
                dense::backward(&self.single, n, head, work);
                b.iter_mut().zip(work).zip(scale).for_each(|((b, w), scale)| *b = f64::from(*w) * scale);
            }
        }
    }
}

/// Factors the Schur complement `at(column, row)` from column `head`, with the scaled `stiffness` on its diagonal.
fn factor_constrained(
    head: usize,
    stiffness: &[f64],
    scale: impl Fn(usize) -> f64,
    at: impl Fn(usize, usize) -> f64,
    constrained: &mut Vec<f64>,
) {
    let t = stiffness.len();
    constrained.clear();
    for (c, stiffness) in stiffness.iter().enumerate() {
        constrained.extend((0..t).map(|r| at(head + c, head + r)));
        constrained[c * t + c] += stiffness * scale(head + c).powi(2);
    }
    // The Schur complement of a positive definite matrix plus stiffness is positive definite: this cannot fail in
    // double precision, and a single-precision one that fails gives no descent, so that it is replaced.
    let _ = dense::partial_cholesky(constrained, t, t);
}

fn solve_constrained(constrained: &[f64], b: &mut [f64]) {
    dense::forward(constrained, b.len(), b.len(), b);
    dense::backward(constrained, b.len(), b.len(), b);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Hessian whose diagonal spans eight decades, as that of light nodes in contact with heavy links.
    fn hessian(n: usize) -> Vec<f64> {
        let scale = |i: usize| 10f64.powi(-((i % 5) as i32));
        let entry = |r: usize, c: usize| {
            let wave = ((r.max(c) * 37 + r.min(c) * 101) % 97) as f64 / 97.0 - 0.5;
            scale(r) * scale(c) * if r == c { 8.0 } else { 0.3 * wave }
        };
        (0..n * n).map(|at| entry(at % n, at / n)).collect()
    }

    #[test]
    fn both_precisions_solve_with_stiffness_on_the_last_columns() {
        let (n, stiffness) = (120, [5.0, 0.0, 1e3]);
        let head = n - stiffness.len();
        let mut full = hessian(n);
        stiffness.iter().enumerate().for_each(|(i, k)| full[(head + i) * (n + 1)] += k);
        let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin() * 10f64.powi((i % 5) as i32)).collect();
        let mut b = vec![0.0; n];
        dense::symmetric_multiply(&full, n, &x, &mut b);
        for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-5)] {
            let (mut factor, mut solved) = (Factor::default(), b.clone());
            factor.set(&hessian(n), n, head, precision).expect("positive definite");
            factor.solve(n, &stiffness, &mut solved, &mut Vec::new());
            let scaled = |i: usize| 10f64.powi((i % 5) as i32);
            let error = (0..n).map(|i| ((solved[i] - x[i]) / scaled(i)).abs()).fold(0.0, f64::max);
            assert!(error < tolerance, "{precision:?}: {error}");
        }
    }
}
