//! Dense Cholesky kernels on column-major storage, for the fronts of the sparse factor and for the contact solve.
//!
//! Products are added by `mul_add`, which is exactly rounded on every machine, and sums have a fixed order, so the
//! results are the same bits everywhere. The factorization and the triangular solves exist in double and in single
//! precision.

use std::ops::Range;

use nalgebra::RealField;

use super::NotPositiveDefinite;

/// Columns per block at each level: a block is factored in blocks of the level below, each followed by the update of
/// the rest of its block. Narrow blocks waste few operations, wide ones pass over a large matrix less often.
const WIDTHS: [usize; 3] = [8, 32, 128];
/// Columns of the register tile of the update.
const COLUMNS: usize = 4;
/// Rows of that tile in double precision: with these, it fills the registers of AVX2.
const ROWS: usize = 12;
/// Rows of that tile in single precision.
const SINGLE_ROWS: usize = 16;
/// Columns processed at once by triangular solves and products, so that the vector is loaded and stored less often.
const WIDE: usize = 4;
/// Partial sums of a dot product.
const LANES: usize = 8;

/// A floating-point type.
pub(crate) trait Real: RealField + Copy {}

impl Real for f64 {}
impl Real for f32 {}

/// Factors the first `k` columns of the `n × n` matrix `a` (column-major, lower triangle) in place.
///
/// Afterwards those columns hold `L` and the trailing block its Schur complement. The upper triangle is
/// neither read nor preserved.
///
/// # Errors
/// A pivot is not positive.
pub(crate) fn partial_cholesky(a: &mut [f64], n: usize, k: usize) -> Result<(), NotPositiveDefinite> {
    factor_blocks::<f64, ROWS>(a, n, 0..k, n, &WIDTHS, &mut packing_buffer::<ROWS, _>(n, k))
}

/// As [`partial_cholesky`], in single precision.
pub(crate) fn partial_cholesky_single(a: &mut [f32], n: usize, k: usize) -> Result<(), NotPositiveDefinite> {
    factor_blocks::<f32, SINGLE_ROWS>(a, n, 0..k, n, &WIDTHS, &mut packing_buffer::<SINGLE_ROWS, _>(n, k))
}

fn packing_buffer<const R: usize, T>(n: usize, k: usize) -> Vec<T> {
    Vec::with_capacity(WIDTHS[WIDTHS.len() - 1].min(k) * n.next_multiple_of(R))
}

/// Factors `columns` in blocks of the last of `widths`, and updates the columns up to `last` after each.
fn factor_blocks<T: Real, const R: usize>(
    a: &mut [T],
    n: usize,
    columns: Range<usize>,
    last: usize,
    widths: &[usize],
    packed: &mut Vec<T>,
) -> Result<(), NotPositiveDefinite> {
    let Some((&width, narrower)) = widths.split_last() else {
        return factor_strip(a, n, columns.start, columns.end);
    };
    for start in columns.clone().step_by(width) {
        let end = (start + width).min(columns.end);
        factor_blocks::<T, R>(a, n, start..end, end, narrower, packed)?;
        update::<T, R>(a, n, start..end, last, packed);
    }
    Ok(())
}

/// Factors columns `start..end` over all rows below, left-looking.
fn factor_strip<T: Real>(a: &mut [T], n: usize, start: usize, end: usize) -> Result<(), NotPositiveDefinite> {
    for j in start..end {
        for p in start..j {
            let (left, right) = a.split_at_mut(j * n);
            let source = &left[p * n + j..p * n + n];
            let scale = source[0];
            right[j..n].iter_mut().zip(source).for_each(|(x, s)| *x = s.mul_add(-scale, *x));
        }
        let pivot = a[j * n + j];
        // The comparison fails for NaN.
        let is_positive = pivot > T::zero();
        if !is_positive {
            return Err(NotPositiveDefinite);
        }
        let inverse = T::one() / pivot.sqrt();
        a[j * n + j..j * n + n].iter_mut().for_each(|x| *x *= inverse);
    }
    Ok(())
}

/// Subtracts `L Lᵀ` of `columns` from the lower triangle of the columns up to `last`. It may write above the
/// diagonal, which is never read.
fn update<T: Real, const R: usize>(
    a: &mut [T],
    n: usize,
    columns: Range<usize>,
    last: usize,
    packed: &mut Vec<T>,
) {
    let Range { start, end } = columns;
    if end >= last {
        return;
    }
    let depth = end - start;
    let (panel, rest) = a.split_at_mut(end * n);
    pack::<T, R>(&panel[start * n..], n, end, packed);
    let mut right = [[T::zero(); COLUMNS]; WIDTHS[WIDTHS.len() - 1]];
    for column in (end..last).step_by(COLUMNS) {
        let width = COLUMNS.min(last - column);
        let (first, offset) = ((column - end) / R, (column - end) % R);
        let stripe = packed[first * R * depth..(first + 1) * R * depth].chunks_exact(R);
        right.iter_mut().zip(stripe).for_each(|(to, row)| to.copy_from_slice(&row[offset..offset + COLUMNS]));
        for (index, left) in packed.chunks_exact(R * depth).enumerate().skip(first) {
            let row = end + index * R;
            let sum = tile::<T, R>(left, &right[..depth]);
            let rows = R.min(n - row);
            for (c, sum) in sum.iter().enumerate().take(width) {
                let at = (column - end + c) * n + row;
                rest[at..at + rows].iter_mut().zip(sum).for_each(|(x, s)| *x -= *s);
            }
        }
    }
}

/// Copies rows `from..n` of a panel into stripes of `R` rows, column by column, padded with zeros.
fn pack<T: Real, const R: usize>(panel: &[T], n: usize, from: usize, packed: &mut Vec<T>) {
    packed.clear();
    for row in (from..n).step_by(R) {
        let rows = R.min(n - row);
        for column in panel.chunks_exact(n) {
            packed.extend_from_slice(&column[row..row + rows]);
            packed.extend_from_slice(&[T::zero(); R][rows..]);
        }
    }
}

/// `A[R×k] B[4×k]ᵀ` in registers.
#[inline(always)]
fn tile<T: Real, const R: usize>(left: &[T], right: &[[T; COLUMNS]]) -> [[T; R]; COLUMNS] {
    let mut sum = [[T::zero(); R]; COLUMNS];
    for (a, b) in left.as_chunks::<R>().0.iter().zip(right) {
        for (sum, b) in sum.iter_mut().zip(b) {
            for (s, a) in sum.iter_mut().zip(a) {
                *s = a.mul_add(*b, *s);
            }
        }
    }
    sum
}

/// [`WIDE`] adjacent columns of a matrix, from row `from` to the end.
fn wide_columns<T>(a: &[T], n: usize, column: usize, from: usize) -> [&[T]; WIDE] {
    std::array::from_fn(|c| &a[(column + c) * n + from..(column + c + 1) * n])
}

/// Solves `L y = b` in place for the first `k` columns of `l` (`n` rows), and subtracts
/// their contribution from `b[k..n]`.
pub(crate) fn forward<T: Real>(l: &[T], n: usize, k: usize, b: &mut [T]) {
    let mut j = 0;
    while j + WIDE <= k {
        for c in j..j + WIDE {
            b[c] /= l[c * n + c];
            let y = b[c];
            (c + 1..j + WIDE).for_each(|r| b[r] -= y * l[c * n + r]);
        }
        let [l0, l1, l2, l3] = wide_columns(l, n, j, j + WIDE);
        let (y0, y1, y2, y3) = (b[j], b[j + 1], b[j + 2], b[j + 3]);
        let tail = b[j + WIDE..n].iter_mut().zip(l0).zip(l1).zip(l2).zip(l3);
        tail.for_each(|((((b, l0), l1), l2), l3)| {
            *b -= y0.mul_add(*l0, y1 * *l1) + y2.mul_add(*l2, y3 * *l3);
        });
        j += WIDE;
    }
    for j in j..k {
        let column = &l[j * n..j * n + n];
        let (head, tail) = b.split_at_mut(j + 1);
        let y = head[j] / column[j];
        head[j] = y;
        tail[..n - j - 1].iter_mut().zip(&column[j + 1..]).for_each(|(b, l)| *b = l.mul_add(-y, *b));
    }
}

/// Solves `Lᵀ x = y` in place for the first `k` columns of `l`, given `x[k..n]`.
pub(crate) fn backward<T: Real>(l: &[T], n: usize, k: usize, x: &mut [T]) {
    let whole = k - k % WIDE;
    for j in (whole..k).rev() {
        x[j] = (x[j] - dot(&l[j * n + j + 1..(j + 1) * n], &x[j + 1..n])) / l[j * n + j];
    }
    for j in (0..whole).step_by(WIDE).rev() {
        let dot = dot_columns(wide_columns(l, n, j, j + WIDE), &x[j + WIDE..n]);
        for c in (0..WIDE).rev() {
            let column = &l[(j + c) * n + j..(j + c) * n + j + WIDE];
            let mut rest = x[j + c] - dot[c];
            for r in c + 1..WIDE {
                rest -= column[r] * x[j + r];
            }
            x[j + c] = rest / column[c];
        }
    }
}

/// Sum of the lanes in a fixed order.
fn sum_lanes<T: Real>(l: [T; LANES]) -> T {
    ((l[0] + l[1]) + (l[2] + l[3])) + ((l[4] + l[5]) + (l[6] + l[7]))
}

/// Dot product in [`LANES`] lanes: a fixed order of summation that vectorises.
pub(crate) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [T::zero(); LANES];
    for (a, b) in a.iter().zip(b) {
        (0..LANES).for_each(|i| lanes[i] = a[i].mul_add(b[i], lanes[i]));
    }
    let rest = a_rest.iter().zip(b_rest).fold(T::zero(), |sum, (a, b)| sum + *a * *b);
    sum_lanes(lanes) + rest
}

/// Dot products of [`WIDE`] columns with `x`.
fn dot_columns<T: Real>([a, b, c, d]: [&[T]; WIDE], x: &[T]) -> [T; WIDE] {
    let mut lanes = [[T::zero(); LANES]; WIDE];
    let whole = x.len() - x.len() % LANES;
    let chunks = |values| <[T]>::as_chunks::<LANES>(values).0;
    for ((((x, a), b), c), d) in chunks(x).iter().zip(chunks(a)).zip(chunks(b)).zip(chunks(c)).zip(chunks(d))
    {
        for i in 0..LANES {
            lanes[0][i] = a[i].mul_add(x[i], lanes[0][i]);
            lanes[1][i] = b[i].mul_add(x[i], lanes[1][i]);
            lanes[2][i] = c[i].mul_add(x[i], lanes[2][i]);
            lanes[3][i] = d[i].mul_add(x[i], lanes[3][i]);
        }
    }
    let mut sums = lanes.map(sum_lanes);
    for i in whole..x.len() {
        for (sum, column) in sums.iter_mut().zip([a, b, c, d]) {
            *sum += column[i] * x[i];
        }
    }
    sums
}

/// `y = A x` for a symmetric matrix of which only the lower triangle is read.
pub(crate) fn symmetric_multiply(a: &[f64], n: usize, x: &[f64], y: &mut [f64]) {
    y[..n].fill(0.0);
    let whole = n - n % WIDE;
    for j in (0..whole).step_by(WIDE) {
        let (head, tail) = y[j..n].split_at_mut(WIDE);
        let columns = wide_columns(a, n, j, j + WIDE);
        let dot = dot_and_add(columns, [x[j], x[j + 1], x[j + 2], x[j + 3]], &x[j + WIDE..n], tail);
        for c in 0..WIDE {
            let column = &a[(j + c) * n + j..(j + c) * n + j + WIDE];
            head[c] += dot[c] + column[c] * x[j + c];
            for r in c + 1..WIDE {
                head[c] += column[r] * x[j + r];
                head[r] += column[r] * x[j + c];
            }
        }
    }
    for j in whole..n {
        y[j] += a[j * n + j] * x[j];
        for r in j + 1..n {
            y[j] += a[j * n + r] * x[r];
            y[r] += a[j * n + r] * x[j];
        }
    }
}

/// Dot products of [`WIDE`] columns with `x`, and `y += ` the columns times `factors`, in one pass over the columns.
fn dot_and_add([a, b, c, d]: [&[f64]; WIDE], factors: [f64; WIDE], x: &[f64], y: &mut [f64]) -> [f64; WIDE] {
    let [x0, x1, x2, x3] = factors;
    let mut lanes = [[0.0; 4]; WIDE];
    let whole = x.len() - x.len() % 4;
    let chunks = |values| <[f64]>::as_chunks::<4>(values).0;
    let columns = chunks(a).iter().zip(chunks(b)).zip(chunks(c)).zip(chunks(d));
    let vectors = chunks(x).iter().zip(<[f64]>::as_chunks_mut::<4>(y).0);
    for ((x, y), (((a, b), c), d)) in vectors.zip(columns) {
        for i in 0..4 {
            lanes[0][i] = a[i].mul_add(x[i], lanes[0][i]);
            lanes[1][i] = b[i].mul_add(x[i], lanes[1][i]);
            lanes[2][i] = c[i].mul_add(x[i], lanes[2][i]);
            lanes[3][i] = d[i].mul_add(x[i], lanes[3][i]);
            y[i] += a[i].mul_add(x0, b[i] * x1) + c[i].mul_add(x2, d[i] * x3);
        }
    }
    let mut sums = lanes.map(|l| (l[0] + l[1]) + (l[2] + l[3]));
    for i in whole..x.len() {
        for (sum, column) in sums.iter_mut().zip([a, b, c, d]) {
            *sum += column[i] * x[i];
        }
        y[i] += a[i].mul_add(x0, b[i] * x1) + c[i].mul_add(x2, d[i] * x3);
    }
    sums
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
        for (n, k) in [(1, 1), (7, 3), (40, 40), (61, 29), (100, 52), (310, 290)] {
            let a = spd(n);
            let mut l = a.clone();
            partial_cholesky(&mut l, n, k).expect("positive definite");
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let mut b = vec![0.0; n];
            symmetric_multiply(&a, n, &x, &mut b);
            forward(&l, n, k, &mut b);
            if k < n {
                partial_cholesky(&mut schur(&l, n, k), n - k, n - k).expect("positive definite");
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

    #[test]
    fn the_product_reads_the_lower_triangle_only() {
        for n in [1, 3, 4, 10, 41] {
            let a = spd(n);
            let mut lower = a.clone();
            (0..n * n).filter(|at| at % n < at / n).for_each(|at| lower[at] = f64::NAN);
            let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
            let mut y = vec![f64::NAN; n];
            symmetric_multiply(&lower, n, &x, &mut y);
            for (r, y) in y.iter().enumerate() {
                let plain: f64 = (0..n).map(|c| a[c * n + r] * x[c]).sum();
                assert!((y - plain).abs() < 1e-11, "{n} {r}");
            }
        }
    }

    fn schur(l: &[f64], n: usize, k: usize) -> Vec<f64> {
        (0..(n - k) * (n - k)).map(|at| l[(at / (n - k) + k) * n + k + at % (n - k)]).collect()
    }

    #[test]
    fn an_indefinite_matrix_is_rejected() {
        assert_eq!(partial_cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2, 2), Err(NotPositiveDefinite));
        assert_eq!(partial_cholesky(&mut [f64::NAN], 1, 1), Err(NotPositiveDefinite));
    }

    #[test]
    fn a_single_precision_factor_is_the_rounded_one() {
        for (n, k) in [(1, 1), (7, 3), (61, 29), (300, 280)] {
            let mut a = spd(n);
            let mut single: Vec<f32> = a.iter().map(|x| *x as f32).collect();
            partial_cholesky(&mut a, n, k).expect("positive definite");
            partial_cholesky_single(&mut single, n, k).expect("positive definite");
            let lower = (0..n * n).filter(|at| at % n >= at / n);
            let largest = a.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
            lower.for_each(|at| {
                assert!((a[at] - f64::from(single[at])).abs() < 1e-5 * largest, "{n} {k} {at}")
            });
        }
    }
}
