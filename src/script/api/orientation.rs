//! Directions and turns from numbers of any size.

use nalgebra::Quaternion;

use crate::geometry::{Quat, Vec3};

/// Shorter than this has no direction.
const LEAST: f64 = 1e-9;

/// Numbers divided by the largest of them, so that no square over- or underflows; none where that is too small or no number.
fn scaled<const N: usize>(numbers: [f64; N]) -> Option<[f64; N]> {
    let largest =
        numbers.iter().fold(0.0, |most: f64, x| if x.is_nan() { f64::NAN } else { most.max(x.abs()) });
    (largest.is_finite() && largest >= LEAST).then(|| numbers.map(|x| x / largest))
}

/// A unit vector.
pub(crate) fn direction(numbers: [f64; 3]) -> Option<Vec3> {
    scaled(numbers).map(|numbers| Vec3::from(numbers).normalize())
}

/// A turn from w, x, y, z.
pub(crate) fn turn(numbers: [f64; 4]) -> Option<Quat> {
    scaled(numbers).map(|[w, x, y, z]| Quat::new_normalize(Quaternion::new(w, x, y, z)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_does_not_matter_until_there_is_none() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        for size in [1e-8, 1.0, 1e200, f64::MAX] {
            let turned = turn([size, 0.0, 0.0, -size]).expect("a turn");
            assert!((turned.w - half).abs() < 1e-15 && (turned.k + half).abs() < 1e-15, "{size}: {turned:?}");
            let way = direction([size, -size, 0.0]).expect("a direction");
            assert!((way - Vec3::new(half, -half, 0.0)).norm() < 1e-15, "{size}: {way:?}");
        }
        for nothing in [0.0, 1e-300, f64::NAN, f64::INFINITY] {
            assert!(turn([nothing, 0.0, 0.0, 0.0]).is_none() && direction([0.0, nothing, 0.0]).is_none());
        }
        assert!(turn([1.0, f64::NAN, 0.0, 0.0]).is_none(), "a NaN beside a number");
    }
}
