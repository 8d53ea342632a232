//! Shading of rows of eight pixels, one below the other, on one plane: light is evaluated in some rows and interpolated
//! between them where it changes linearly. Textures are sampled in all rows.

use crate::camera::math::{Vec3x8, f32x8};

/// Maximum number of rows between two whose light is evaluated first.
const SPAN: usize = 16;
/// Maximum distance between rows that are interpolated, texels of the shadow map: penumbras are wider than half of it.
const MAX_DISTANCE: f32 = 7.0;
/// Maximum difference of light from its interpolation, relative and absolute.
const MAX_DEVIATION: [f32; 2] = [0.01, 0.004];

/// Rows of eight pixels, one below the other, that can be shaded from the light in some of them.
pub(crate) trait ShadedRows {
    /// The light in a row.
    type Light;

    /// Evaluates the light in a row and shades the row.
    fn evaluate(&mut self, row: usize) -> Self::Light;

    /// True if light can be interpolated between the three rows: `middle`, the given share of the way from `start` to
    /// `end`, is close to the interpolation.
    fn is_linear(start: &Self::Light, middle: &Self::Light, end: &Self::Light, share: f32) -> bool;

    /// Shades a row by light that is interpolated, the given share of the way from `start` to `end`.
    fn interpolate(&mut self, row: usize, start: &Self::Light, end: &Self::Light, share: f32);
}

/// Shades the rows 0 to `count`.
pub(crate) fn shade_rows<R: ShadedRows>(rows: &mut R, count: usize) {
    let Some(last) = count.checked_sub(1) else { return };
    let mut start = rows.evaluate(0);
    for first in (0..last).step_by(SPAN) {
        let next = (first + SPAN).min(last);
        let end = rows.evaluate(next);
        shade_between(rows, [first, next], &start, &end);
        start = end;
    }
}

/// Shades the rows between two, of which the light is known.
fn shade_between<R: ShadedRows>(rows: &mut R, [first, last]: [usize; 2], start: &R::Light, end: &R::Light) {
    if last - first < 2 {
        return;
    }
    let middle_row = usize::midpoint(first, last);
    let middle = rows.evaluate(middle_row);
    let share = |row: usize, [first, last]: [usize; 2]| (row - first) as f32 / (last - first) as f32;
    let is_linear = R::is_linear(start, &middle, end, share(middle_row, [first, last]));
    for (ends, [from, to]) in [([first, middle_row], [start, &middle]), ([middle_row, last], [&middle, end])]
    {
        if is_linear {
            (ends[0] + 1..ends[1]).for_each(|row| rows.interpolate(row, from, to, share(row, ends)));
        } else {
            shade_between(rows, ends, from, to);
        }
    }
}

/// The value the given share of the way from `a` to `b`.
#[inline(always)]
pub(crate) fn mix(a: f32x8, b: f32x8, share: f32) -> f32x8 {
    a + (b - a) * f32x8::splat(share)
}

/// As [`mix`].
#[inline(always)]
pub(crate) fn mix_vectors(a: &Vec3x8, b: &Vec3x8, share: f32) -> Vec3x8 {
    *a + (*b - *a) * f32x8::splat(share)
}

/// True if light and its interpolation look the same.
#[inline(always)]
pub(crate) fn is_close(light: &Vec3x8, interpolated: &Vec3x8) -> bool {
    let [relative, absolute] = MAX_DEVIATION.map(f32x8::splat);
    let is_close = |of: fn(&Vec3x8) -> f32x8| {
        (of(light) - of(interpolated)).abs().simd_le(of(light) * relative + absolute)
    };
    (is_close(|v| v.x) & is_close(|v| v.y) & is_close(|v| v.z)).all()
}

/// True if no shadow can fall between two rows without touching either; given their columns and rows in the shadow
/// map, texels.
#[inline(always)]
pub(crate) fn is_near(a: &[f32x8; 2], b: &[f32x8; 2]) -> bool {
    let is_near = |axis: usize| (a[axis] - b[axis]).abs().simd_le(f32x8::splat(MAX_DISTANCE));
    (is_near(0) & is_near(1)).all()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows whose light is a function of the row.
    struct Rows<F> {
        light: F,
        evaluated: Vec<usize>,
        shown: Vec<Option<f32>>,
    }

    impl<F: Fn(usize) -> f32> ShadedRows for Rows<F> {
        type Light = f32;

        fn evaluate(&mut self, row: usize) -> f32 {
            self.evaluated.push(row);
            let light = (self.light)(row);
            assert_eq!(self.shown[row].replace(light), None, "row {row} is shaded twice");
            light
        }

        fn is_linear(start: &f32, middle: &f32, end: &f32, share: f32) -> bool {
            (middle - (start + (end - start) * share)).abs() < 1e-3
        }

        fn interpolate(&mut self, row: usize, start: &f32, end: &f32, share: f32) {
            assert_eq!(
                self.shown[row].replace(start + (end - start) * share),
                None,
                "row {row} is shaded twice"
            );
        }
    }

    fn shade(count: usize, light: impl Fn(usize) -> f32) -> Rows<impl Fn(usize) -> f32> {
        let mut rows = Rows { light, evaluated: Vec::new(), shown: vec![None; count] };
        shade_rows(&mut rows, count);
        rows
    }

    #[test]
    fn every_row_is_shaded_once_and_linear_light_is_evaluated_in_few_rows() {
        for count in 0..40 {
            let rows = shade(count, |row| 0.5 + 0.25 * row as f32);
            for (row, shown) in rows.shown.iter().enumerate() {
                let shown = shown.expect("it is shaded");
                assert!((shown - (0.5 + 0.25 * row as f32)).abs() < 1e-4, "row {row} of {count}: {shown}");
            }
            assert!(count < 32 || rows.evaluated.len() <= 7, "{:?} of {count} rows", rows.evaluated);
        }
    }

    #[test]
    fn light_is_evaluated_in_all_rows_around_a_step() {
        let step = |row: usize| if row < 21 { 1.0 } else { 0.0 };
        let rows = shade(32, step);
        let expected: Vec<_> = (0..32).map(|row| Some(step(row))).collect();
        assert_eq!(rows.shown, expected);
        assert!(rows.evaluated.len() < 20, "{:?}", rows.evaluated);
    }
}
