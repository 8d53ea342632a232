//! Numeric factorization: assembly of the fronts, elimination, and the triangular solves.

use super::{NotPositiveDefinite, SymbolicFactor, dense, symbolic::Run};

/// Cholesky factor of a block matrix, for one [`SymbolicFactor`] at a time. Its buffers are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct CholeskyFactor {
    panels: Vec<f64>,
    stack: Vec<f64>,
    front: Vec<f64>,
    schur: Vec<f64>,
    gather: Vec<f64>,
    /// Row of each position in the current front, for those in it.
    row_of: Vec<u32>,
}

/// A symmetric matrix of 3×3 blocks over a graph of nodes.
pub(crate) trait BlockMatrix {
    /// Calls `visit(other, block, is_transposed)` for the diagonal block of `node` and for each neighbour. The block is
    /// `A[other, node]`, column-major, or its transpose.
    fn column(&self, node: u32, visit: &mut dyn FnMut(u32, &[f64; 9], bool));
}

impl CholeskyFactor {
    /// Factors `matrix`. Afterwards [`CholeskyFactor::schur`] is the Schur complement of the retained nodes.
    ///
    /// # Errors
    /// The matrix is not positive definite.
    pub(crate) fn refill(
        &mut self,
        plan: &SymbolicFactor,
        matrix: &dyn BlockMatrix,
    ) -> Result<(), NotPositiveDefinite> {
        self.panels.resize(plan.factor_len, 0.0);
        self.stack.resize(plan.stack_len, 0.0);
        self.front.resize(plan.largest * plan.largest, 0.0);
        self.gather.resize(plan.largest, 0.0);
        self.row_of.resize(plan.order.len(), 0);
        let mut top = 0;
        for (index, front) in plan.fronts.iter().enumerate() {
            let n = 3 * front.rows.len();
            let k = 3 * front.pivots;
            let is_root = index + 1 == plan.fronts.len();
            if is_root {
                self.schur.resize(n * n, 0.0);
            }
            let values = if is_root { &mut self.schur } else { &mut self.front };
            (0..n).for_each(|c| values[c * n + c / 3 * 3..(c + 1) * n].fill(0.0));
            front.rows.iter().zip(0..).for_each(|(&at, row)| self.row_of[at as usize] = row);
            assemble(plan, index, matrix, &self.row_of, values);
            for &child in front.children.iter().rev() {
                let rest = 3 * (plan.fronts[child].rows.len() - plan.fronts[child].pivots);
                top -= rest * rest;
                extend_add(values, n, &self.stack[top..], rest, &plan.fronts[child].into_parent);
            }
            if is_root {
                break;
            }
            dense::partial_cholesky(&mut self.front[..n * n], n, k)?;
            self.panels[front.offset..front.offset + n * k].copy_from_slice(&self.front[..n * k]);
            push_update(&self.front, n, k, &mut self.stack[top..]);
            top += (n - k) * (n - k);
        }
        Ok(())
    }

    /// Schur complement of the retained nodes: side `3 · retained`, column-major, lower triangle.
    pub(crate) fn schur(&self) -> &[f64] {
        &self.schur
    }

    /// Forward substitution on `b` (in elimination order, 3 per position). Its retained part becomes
    /// the reduced right-hand side.
    pub(crate) fn forward(&mut self, plan: &SymbolicFactor, b: &mut [f64]) {
        for front in plan.fronts.iter().filter(|f| f.pivots > 0) {
            let (n, k) = (3 * front.rows.len(), 3 * front.pivots);
            let work = &mut self.gather[..n];
            load(work, b, &front.rows);
            dense::forward(&self.panels[front.offset..front.offset + n * k], n, k, work);
            store(b, work, &front.rows);
        }
    }

    /// Backward substitution: completes a forward-substituted vector to the solution, given the retained part of `x`.
    pub(crate) fn backward(&mut self, plan: &SymbolicFactor, x: &mut [f64]) {
        for front in plan.fronts.iter().rev().filter(|f| f.pivots > 0) {
            let (n, k) = (3 * front.rows.len(), 3 * front.pivots);
            let work = &mut self.gather[..n];
            load(work, x, &front.rows);
            dense::backward(&self.panels[front.offset..front.offset + n * k], n, k, work);
            let pivots = 3 * front.first;
            x[pivots..pivots + k].copy_from_slice(&work[..k]);
        }
    }
}

/// Adds the matrix entries whose earlier position is eliminated in this front (or retained, in the root).
fn assemble(
    plan: &SymbolicFactor,
    index: usize,
    matrix: &dyn BlockMatrix,
    row_of: &[u32],
    values: &mut [f64],
) {
    let front = &plan.fronts[index];
    let n = 3 * front.rows.len();
    let root = index + 1 == plan.fronts.len();
    let columns = if root { front.rows.len() } else { front.pivots };
    for column in 0..columns {
        let at = front.first + column;
        matrix.column(plan.order[at], &mut |other, block, transposed| {
            let row = plan.position[other as usize];
            if (row as usize) < at {
                return;
            }
            let row = row_of[row as usize] as usize;
            for c in 0..3 {
                for r in 0..3 {
                    let value = if transposed { block[3 * r + c] } else { block[3 * c + r] };
                    values[(3 * column + c) * n + 3 * row + r] += value;
                }
            }
        });
    }
}

fn load(work: &mut [f64], b: &[f64], rows: &[u32]) {
    for (w, &row) in work.chunks_exact_mut(3).zip(rows) {
        w.copy_from_slice(&b[3 * row as usize..3 * row as usize + 3]);
    }
}

fn store(b: &mut [f64], work: &[f64], rows: &[u32]) {
    for (w, &row) in work.chunks_exact(3).zip(rows) {
        b[3 * row as usize..3 * row as usize + 3].copy_from_slice(w);
    }
}

/// Copies the trailing block of a finished front onto the stack.
fn push_update(front: &[f64], n: usize, k: usize, stack: &mut [f64]) {
    let rest = n - k;
    for c in 0..rest {
        stack[c * rest + c..(c + 1) * rest].copy_from_slice(&front[(k + c) * n + k + c..(k + c + 1) * n]);
    }
}

/// Adds a child's update matrix (side `rest`) to its parent's front, lower triangles.
fn extend_add(front: &mut [f64], n: usize, update: &[f64], rest: usize, into: &[Run]) {
    for (index, run) in into.iter().enumerate() {
        for c in 0..run.len {
            let source = &update[(run.from + c) * rest..(run.from + c + 1) * rest];
            let target = &mut front[(run.to + c) * n..(run.to + c + 1) * n];
            add(&mut target[run.to + c..run.to + run.len], &source[run.from + c..run.from + run.len]);
            for below in &into[index + 1..] {
                add(&mut target[below.to..below.to + below.len], &source[below.from..below.from + below.len]);
            }
        }
    }
}

fn add(target: &mut [f64], source: &[f64]) {
    target.iter_mut().zip(source).for_each(|(t, s)| *t += s);
}

#[cfg(test)]
mod tests {
    use super::*;

    struct PatternGrid {
        neighbours: Vec<Vec<u32>>,
    }

    impl PatternGrid {
        fn new(n: usize) -> Self {
            let at = |i: usize, j: usize, k: usize| (i + n * (j + n * k)) as u32;
            let mut neighbours = vec![Vec::new(); n * n * n];
            for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
                for (a, b, c) in (0..27).map(|c| (i + c % 3, j + c / 3 % 3, k + c / 9)) {
                    let inside = |x: usize| x >= 1 && x <= n;
                    let other = (inside(a) && inside(b) && inside(c)).then(|| at(a - 1, b - 1, c - 1));
                    if let Some(other) = other.filter(|&o| o != at(i, j, k)) {
                        neighbours[at(i, j, k) as usize].push(other);
                    }
                }
            }
            Self { neighbours }
        }

        fn block(&self, row: u32, column: u32) -> [f64; 9] {
            let (low, high) = (row.min(column) as f64, row.max(column) as f64);
            let mut block: [f64; 9] =
                std::array::from_fn(|e| ((low * 3.0 + high * 7.0 + e as f64).sin()) * 0.3);
            if row == column {
                block = [0.0; 9];
                (0..3).for_each(|i| block[4 * i] = 30.0 + i as f64);
            } else if row < column {
                block = std::array::from_fn(|e| block[(e % 3) * 3 + e / 3]);
            }
            block
        }
    }

    impl BlockMatrix for PatternGrid {
        fn column(&self, node: u32, visit: &mut dyn FnMut(u32, &[f64; 9], bool)) {
            visit(node, &self.block(node, node), false);
            for &other in &self.neighbours[node as usize] {
                visit(other, &self.block(other, node), false);
            }
        }
    }

    #[test]
    fn the_factor_solves_with_any_retained_set() {
        let grid = PatternGrid::new(5);
        let nodes = 125usize;
        let x: Vec<f64> = (0..3 * nodes).map(|i| (i as f64 * 0.37).cos()).collect();
        let mut b = vec![0.0; 3 * nodes];
        for column in 0..nodes as u32 {
            grid.column(column, &mut |row, block, _| {
                for (c, r) in (0..9).map(|e| (e / 3, e % 3)) {
                    b[3 * row as usize + r] += block[3 * c + r] * x[3 * column as usize + c];
                }
            });
        }
        for keep in [vec![], vec![3, 4, 77], (0..25).collect::<Vec<u32>>(), (0..125).collect()] {
            let places: Vec<[i32; 3]> = (0..125).map(|c| [c % 5, c / 5 % 5, c / 25]).collect();
            let plan = SymbolicFactor::new(&grid.neighbours, &places, &keep);
            let mut factor = CholeskyFactor::default();
            factor.refill(&plan, &grid).expect("positive definite");
            let mut y = vec![0.0; 3 * nodes];
            for (at, &node) in plan.order.iter().enumerate() {
                y[3 * at..3 * at + 3].copy_from_slice(&b[3 * node as usize..3 * node as usize + 3]);
            }
            factor.forward(&plan, &mut y);
            let inner = 3 * (nodes - keep.len());
            let side = 3 * keep.len();
            let mut reduced = factor.schur().to_vec();
            dense::partial_cholesky(&mut reduced, side, side).expect("positive definite");
            dense::forward(&reduced, side, side, &mut y[inner..]);
            dense::backward(&reduced, side, side, &mut y[inner..]);
            factor.backward(&plan, &mut y);
            for (at, &node) in plan.order.iter().enumerate() {
                for i in 0..3 {
                    assert!((y[3 * at + i] - x[3 * node as usize + i]).abs() < 1e-10, "kept {}", keep.len());
                }
            }
        }
    }
}
