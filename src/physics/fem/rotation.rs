//! Rotation of an element: the orthogonal polar factor of its mean deformation gradient.

use softvt_geometry::{Mat3, Vec3};

/// Newton steps before the singular value decomposition takes over.
const MAX_NEWTON: usize = 8;

/// Rotation part of `f`, starting from an estimate `r`.
///
/// Maximises `tr(Rᵀ F)` by Newton's method on SO(3): with `S = Rᵀ F` the step is `ω = (tr S I − sym S)⁻¹ axial(S −
/// Sᵀ)`. Near the estimate it converges quadratically, and through an inversion it stays on its branch instead of
/// flipping. Where the Hessian is not positive definite, the proper polar factor is computed by SVD.
pub fn polar(f: &Mat3, mut r: Mat3) -> Mat3 {
    for _ in 0..MAX_NEWTON {
        let s = r.tr_mul(f);
        let axial = Vec3::new(s[(2, 1)] - s[(1, 2)], s[(0, 2)] - s[(2, 0)], s[(1, 0)] - s[(0, 1)]);
        let Some(w) = positive_inverse(&stretch_hessian(&s)).map(|inv| inv * axial) else {
            return polar_svd(f);
        };
        let size = w.norm_squared();
        if size > 0.25 {
            return polar_svd(f);
        }
        r *= small_rotation(&w);
        // Convergence is quadratic: the error after a step of 1e-6 is of the order of 1e-12.
        if size < 1e-12 {
            return r;
        }
    }
    polar_svd(f)
}

/// `tr S I − sym S`, the Hessian of `−tr(Rᵀ F)` on SO(3).
pub fn stretch_hessian(s: &Mat3) -> Mat3 {
    Mat3::from_diagonal_element(s.trace()) - (s + s.transpose()) * 0.5
}

/// Inverse of a symmetric matrix, if it is positive definite by a margin.
pub fn positive_inverse(m: &Mat3) -> Option<Mat3> {
    let (a, b, c, d, e, f) = (m[(0, 0)], m[(1, 0)], m[(2, 0)], m[(1, 1)], m[(2, 1)], m[(2, 2)]);
    let (first, second, third) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let minor = a * d - b * b;
    let det = a * first + b * second + c * third;
    let is_definite = a > 1e-3 && minor > 1e-6 && det > 1e-6;
    let mixed = b * c - a * e;
    is_definite
        .then(|| Mat3::new(first, second, third, second, a * f - c * c, mixed, third, mixed, minor) / det)
}

/// `exp([w]×)` by the Cayley map's second-order form with exact orthogonality.
fn small_rotation(w: &Vec3) -> Mat3 {
    // Cayley: R = I + 4/(4+|w|²) ([w] + [w]²/2); orthogonal for every w and equal to exp to O(|w|³).
    let square = w.norm_squared();
    let half_square = (w * w.transpose() - Mat3::from_diagonal_element(square)) * 0.5;
    Mat3::identity() + (w.cross_matrix() + half_square) * (4.0 / (4.0 + square))
}

/// Proper polar factor by singular values; the axis of the smallest is flipped where `det F < 0`.
pub fn polar_svd(f: &Mat3) -> Mat3 {
    let svd = f.svd(true, true);
    let (Some(mut u), Some(vt)) = (svd.u, svd.v_t) else {
        return Mat3::identity();
    };
    if (u * vt).determinant() < 0.0 {
        let flip = svd.singular_values.imin();
        u.column_mut(flip).neg_mut();
    }
    u * vt
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use softvt_geometry::Quat;

    proptest! {
        #[test]
        fn newton_and_svd_agree(e in prop::array::uniform9(-0.25f64..0.25), axis in prop::array::uniform3(-0.3f64..0.3)) {
            let stretch = Mat3::identity() + Mat3::from_column_slice(&e);
            prop_assume!(stretch.determinant() > 0.2);
            let start = *Quat::from_scaled_axis(Vec3::new(0.4, 2.0, -1.0)).to_rotation_matrix().matrix();
            let turned = start * *Quat::from_scaled_axis(Vec3::from(axis)).to_rotation_matrix().matrix() * stretch;
            let r = polar(&turned, start);
            prop_assert!((r - polar_svd(&turned)).norm() < 1e-8);
            prop_assert!((r.tr_mul(&r) - Mat3::identity()).norm() < 1e-12);
        }
    }

    #[test]
    fn a_rotation_by_half_a_turn_is_found() {
        let half = *Quat::from_scaled_axis(Vec3::z() * std::f64::consts::PI).to_rotation_matrix().matrix();
        assert!((polar(&half, Mat3::identity()) - half).norm() < 1e-12);
    }
}
