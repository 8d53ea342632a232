//! Dense Cholesky on column-major storage: the kernels under the sparse factor and the contact solve.

/// Columns factored between two updates of the rest.
const PANEL: usize = 24;
/// Rows and columns of the register tile of the update.
const ROWS: usize = 8;
const COLUMNS: usize = 4;

/// Factors the first `k` columns of the lower triangle of the `n × n` matrix `a` in place and updates the rest:
/// afterwards those columns hold `L`, the trailing block its Schur complement. `false` if a pivot is not positive.
pub fn partial_cholesky(a: &mut [f64], n: usize, k: usize) -> bool {
    let mut start = 0;
    while start < k {
        let end = (start + PANEL).min(k);
        if !factor_panel(a, n, start, end) {
            return false;
        }
        update_rest(a, n, start, end);
        start = end;
    }
    true
}

/// Factors columns `start..end` over all rows below, left-looking within the panel.
fn factor_panel(a: &mut [f64], n: usize, start: usize, end: usize) -> bool {
    for j in start..end {
        for p in start..j {
            let (left, right) = a.split_at_mut(j * n);
            let source = &left[p * n + j..p * n + n];
            let scale = source[0];
            right[j..n].iter_mut().zip(source).for_each(|(x, s)| *x -= scale * s);
        }
        let pivot = a[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        a[j * n + j..j * n + n].iter_mut().for_each(|x| *x *= inverse);
    }
    true
}

/// Subtracts `L Lᵀ` of columns `start..end` from the lower triangle of columns `end..n`.
fn update_rest(a: &mut [f64], n: usize, start: usize, end: usize) {
    let (panel, rest) = a.split_at_mut(end * n);
    let panel = &panel[start * n..];
    let mut column = end;
    while column < n {
        let columns = COLUMNS.min(n - column);
        let mut row = column;
        while row < n {
            let rows = ROWS.min(n - row);
            let target = &mut rest[(column - end) * n..];
            if rows == ROWS && columns == COLUMNS {
                tile(panel, target, n, row, column);
            } else {
                tile_edge(panel, target, n, (row, rows), (column, columns));
            }
            row += rows;
        }
        column += columns;
    }
}

/// Full register tile: `C[8×4] −= A[8×k] B[4×k]ᵀ`; may write above the diagonal, which nobody reads.
fn tile(panel: &[f64], target: &mut [f64], n: usize, row: usize, column: usize) {
    let mut sum = [[0.0; ROWS]; COLUMNS];
    for p in panel.chunks_exact(n) {
        let a: &[f64; ROWS] = p[row..row + ROWS].try_into().expect("tile height");
        let b: &[f64; COLUMNS] = p[column..column + COLUMNS].try_into().expect("tile width");
        for (sum, b) in sum.iter_mut().zip(b) {
            for (s, a) in sum.iter_mut().zip(a) {
                *s += a * b;
            }
        }
    }
    for (c, sum) in sum.iter().enumerate() {
        target[c * n + row..c * n + row + ROWS].iter_mut().zip(sum).for_each(|(x, s)| *x -= s);
    }
}

fn tile_edge(
    panel: &[f64],
    target: &mut [f64],
    n: usize,
    (row, rows): (usize, usize),
    (column, columns): (usize, usize),
) {
    for c in 0..columns {
        for r in 0..rows {
            let dot: f64 = panel.chunks_exact(n).map(|p| p[row + r] * p[column + c]).sum();
            target[c * n + row + r] -= dot;
        }
    }
}

/// Solves `L y = b` in place for the first `k` columns of `l` (`n` rows), then subtracts their part from `b[k..n]`.
pub fn forward(l: &[f64], n: usize, k: usize, b: &mut [f64]) {
    for j in 0..k {
        let column = &l[j * n..j * n + n];
        let (head, tail) = b.split_at_mut(j + 1);
        let y = head[j] / column[j];
        head[j] = y;
        tail[..n - j - 1].iter_mut().zip(&column[j + 1..]).for_each(|(b, l)| *b -= y * l);
    }
}

/// Solves `Lᵀ x = y` in place for the first `k` columns of `l`, given `x[k..n]`.
pub fn backward(l: &[f64], n: usize, k: usize, x: &mut [f64]) {
    for j in (0..k).rev() {
        let column = &l[j * n..j * n + n];
        let dot = strided_dot(&column[j + 1..], &x[j + 1..n]);
        x[j] = (x[j] - dot) / column[j];
    }
}

/// Dot product in four fixed lanes (one order on every machine, and fast).
pub fn strided_dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a4.zip(b4) {
        for i in 0..4 {
            lanes[i] += a[i] * b[i];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail
}

/// `y = A x` for a symmetric matrix of which only the lower triangle is stored.
pub fn symmetric_multiply(a: &[f64], n: usize, x: &[f64], y: &mut [f64]) {
    y[..n].fill(0.0);
    for j in 0..n {
        let column = &a[j * n + j + 1..j * n + n];
        let xj = x[j];
        y[j + 1..n].iter_mut().zip(column).for_each(|(y, a)| *y += a * xj);
        y[j] += a[j * n + j] * xj + strided_dot(column, &x[j + 1..n]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spd(n: usize) -> Vec<f64> {
        let wave = |i: usize, j: usize| ((i * 37 + j * 101 + 7) % 97) as f64 / 97.0 - 0.5;
        (0..n * n)
            .map(|at| {
                let (i, j) = (at % n, at / n);
                let dot: f64 = (0..n).map(|p| wave(i, p) * wave(j, p)).sum();
                dot + if i == j { 1.0 } else { 0.0 }
            })
            .collect()
    }

    #[test]
    fn partial_factor_solves_and_leaves_the_schur_complement() {
        for (n, k) in [(1, 1), (7, 3), (40, 40), (61, 29), (100, 52)] {
            let a = spd(n);
            let mut l = a.clone();
            assert!(partial_cholesky(&mut l, n, k));
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let mut b = vec![0.0; n];
            symmetric_multiply(&a, n, &x, &mut b);
            forward(&l, n, k, &mut b);
            if k < n {
                assert!(partial_cholesky(&mut schur(&l, n, k), n - k, n - k));
                let s = schur(&l, n, k);
                let mut right = vec![0.0; n - k];
                symmetric_multiply(&s, n - k, &x[k..], &mut right);
                assert!(right.iter().zip(&b[k..]).all(|(a, b)| (a - b).abs() < 1e-11), "{n} {k}");
                b[k..].copy_from_slice(&x[k..]);
            }
            backward(&l, n, k, &mut b);
            assert!(b.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10), "{n} {k}");
        }
    }

    fn schur(l: &[f64], n: usize, k: usize) -> Vec<f64> {
        (0..(n - k) * (n - k)).map(|at| l[(at / (n - k) + k) * n + k + at % (n - k)]).collect()
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        assert!(!partial_cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2, 2));
    }
}
