//! Elastic force of one element and its energy.

use super::{
    relaxation::{Branch, BranchStep},
    rotation::{polar, positive_inverse, stretch_hessian},
};
use softvt_geometry::{Mat3, Vec3};

/// Corner positions or forces of an element.
pub type ElementCorners = [Vec3; 8];

/// Elastic response of an element.
pub struct ElasticResponse {
    /// Rotation of the element.
    pub rotation: Mat3,
    /// Force on each corner, N, world frame: exactly `−∂U/∂x`.
    pub force: ElementCorners,
    /// Stored energy, J.
    pub energy: f64,
}

/// An element with a Maxwell branch that moves to its positions within a step.
pub struct Relaxing<'a> {
    /// State of the branch.
    pub branch: &'a mut Branch,
    /// Stiffness of the branch over that of the element.
    pub share: f64,
    /// Effect of the step on the branch.
    pub step: BranchStep,
}

/// Force and energy of an element at world corner positions `x`.
///
/// `rest` are the undeformed corners (m), `g` mean shape gradients (1/m, with any weights), `k0` the rest stiffness
/// (N/m, column-major 24×24), and `last` is an estimate of the rotation. The force is `f_a = −R (p_a − q × g_a)` with
/// `p = K₀ (y − X)`, `m = Σ y_a × p_a`, `S = Rᵀ F`, `q = (tr S I − S)⁻¹ m`: the second term is due to the change of the
/// rotation itself. Without it the force is not the derivative of the energy and has a spurious moment. A
/// [`Relaxing`] element adds `K₀ g d` to `p`.
pub fn elastic(
    x: &ElementCorners,
    rest: &ElementCorners,
    g: &[Vec3; 8],
    k0: &[f64; 576],
    last: Mat3,
    relaxing: Option<Relaxing>,
) -> ElasticResponse {
    let f = deformation_gradient(x, g);
    let r = polar(&f, last);
    let mut u = [0.0; 24];
    let mut y = [Vec3::zeros(); 8];
    for a in 0..8 {
        // Differences to one corner keep precision far from the origin; K₀ is invariant to translations.
        y[a] = r.tr_mul(&(x[a] - x[0]));
        let d = y[a] - (rest[a] - rest[0]);
        u[3 * a..3 * a + 3].copy_from_slice(d.as_slice());
    }
    let work = |p: &[f64; 24], u: &[f64; 24]| 0.5 * p.iter().zip(u).map(|(p, u)| p * u).sum::<f64>();
    let mut p = multiply(k0, &u);
    let mut energy = work(&p, &u);
    if let Some(Relaxing { branch, share, step }) = relaxing {
        let stretch = branch.advance(&u, step);
        let extra = multiply(k0, stretch);
        energy += share * work(&extra, stretch);
        p.iter_mut().zip(extra).for_each(|(p, extra)| *p += share * extra);
    }
    let corner = |a: usize| Vec3::new(p[3 * a], p[3 * a + 1], p[3 * a + 2]);
    let moment: Vec3 = (1..8).map(|a| y[a].cross(&corner(a))).sum();
    // An inverted or flattened element has no unique rotation; its projection term is left out there.
    let q = positive_inverse(&stretch_hessian(&r.tr_mul(&f))).map_or(Vec3::zeros(), |inv| inv * moment);
    let force = std::array::from_fn(|a| -(r * (corner(a) - q.cross(&g[a]))));
    ElasticResponse { rotation: r, force, energy }
}

/// Mean deformation gradient `F = Σ x_a ⊗ g_a`.
pub fn deformation_gradient(x: &ElementCorners, g: &[Vec3; 8]) -> Mat3 {
    (1..8).fold(Mat3::zeros(), |f, a| f + (x[a] - x[0]) * g[a].transpose())
}

/// `K u` for a column-major 24×24 matrix.
fn multiply(k: &[f64; 576], u: &[f64; 24]) -> [f64; 24] {
    let mut p = [0.0; 24];
    for (column, &value) in k.chunks_exact(24).zip(u) {
        for (p, k) in p.iter_mut().zip(column) {
            *p = k.mul_add(value, *p);
        }
    }
    p
}

/// Slopes of an element's positions along each axis: each at the four Gauss positions on the other two axes,
/// the lower axis first.
///
/// A column of F is the slope along one axis: the mean of the four edges in that direction, weighted by the position
/// of the point across them. So it has only four values per element.
fn gauss_slopes(x: &ElementCorners, h: f64) -> [[Vec3; 4]; 3] {
    let near = 0.5 + 0.5 / 3f64.sqrt();
    std::array::from_fn(|axis| {
        let (i, j) = (1 << ((axis == 0) as usize), 4 >> ((axis == 2) as usize));
        let edge = |corner: usize| (x[corner + (1 << axis)] - x[corner]) / h;
        let along = |a: Vec3, b: Vec3| [a * near + b * (1.0 - near), a * (1.0 - near) + b * near];
        let low = along(edge(0), edge(i));
        let high = along(edge(j), edge(i + j));
        let (first, second) = (along(low[0], high[0]), along(low[1], high[1]));
        [first[0], second[0], first[1], second[1]]
    })
}

/// Deformation gradients at the 2×2×2 Gauss points of a voxel of edge `h` (m).
pub fn gauss_gradients(x: &ElementCorners, h: f64) -> [Mat3; 8] {
    let slopes = gauss_slopes(x, h);
    std::array::from_fn(|g| {
        let (x, y, z) = (g & 1, g >> 1 & 1, g >> 2);
        Mat3::from_columns(&[slopes[0][y + 2 * z], slopes[1][x + 2 * z], slopes[2][x + 2 * y]])
    })
}

/// Smallest det F over the 2×2×2 Gauss points of a voxel of edge `h` (m); ≤ 0 means inverted.
pub fn min_det(x: &ElementCorners, h: f64) -> f64 {
    let slopes = gauss_slopes(x, h);
    let det = |g: usize| {
        let (x, y, z) = (g & 1, g >> 1 & 1, g >> 2);
        slopes[0][y + 2 * z].dot(&slopes[1][x + 2 * z].cross(&slopes[2][x + 2 * y]))
    };
    (0..8).map(det).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{
        ElasticMaterial,
        element::{mean_gradients, stiffness},
    };
    use proptest::prelude::*;
    use softvt_geometry::{Quat, hex8, voxel::OccupancyMask};

    const H: f64 = 0.01;
    fn material() -> ElasticMaterial {
        ElasticMaterial::new(3e4, 0.4, 1.0).expect("valid")
    }

    fn cube() -> ElementCorners {
        std::array::from_fn(|a| hex8::corner(a) * H)
    }

    /// Fills of a voxel: full, a half, a thin layer, one corner.
    fn fills() -> [OccupancyMask; 4] {
        [
            OccupancyMask::full(),
            OccupancyMask::from_fn(|cell| cell % 6 < 3),
            OccupancyMask::from_fn(|cell| cell < 36),
            OccupancyMask::from_fn(|cell| cell % 6 < 2 && cell < 80),
        ]
    }

    fn evaluate(x: &ElementCorners, fill: &OccupancyMask, last: Mat3) -> ElasticResponse {
        elastic(x, &cube(), &mean_gradients(H, fill), &stiffness(H, fill, &material()), last, None)
    }

    fn bent(e: &[f64]) -> ElementCorners {
        let mut x = cube();
        x.iter_mut().enumerate().for_each(|(a, x)| *x += Vec3::from_column_slice(&e[3 * a..3 * a + 3]) * H);
        x
    }

    #[test]
    fn homogeneous_strain_stores_the_energy_of_the_filled_part_at_any_rotation() {
        let (lambda, mu) = (material().lame_lambda(), material().shear_modulus());
        let stretch = Mat3::new(0.7, 0.1, 0.0, 0.1, 1.2, -0.05, 0.0, -0.05, 0.9);
        let strain = stretch - Mat3::identity();
        let density = mu * strain.norm_squared() + 0.5 * lambda * strain.trace().powi(2);
        let turn = Quat::from_scaled_axis(Vec3::new(0.5, -0.8, 1.3));
        for fill in fills() {
            let e = evaluate(&cube().map(|x| turn * (stretch * x)), &fill, Mat3::identity());
            let exact = fill.fraction() * H.powi(3) * density;
            assert!((e.energy / exact - 1.0).abs() < 1e-10, "{} against {exact}", e.energy);
            assert!((e.rotation - turn.to_rotation_matrix().matrix()).norm() < 1e-10);
        }
    }

    proptest! {
        #[test]
        fn the_minimum_determinant_is_that_of_the_gradients(e in prop::collection::vec(-0.4f64..0.4, 24)) {
            let x = bent(&e);
            let det = |xi: &Vec3| deformation_gradient(&x, &hex8::gradients(xi, H)).determinant();
            let plain = hex8::gauss_points().iter().map(det).fold(f64::INFINITY, f64::min);
            prop_assert!((min_det(&x, H) - plain).abs() < 1e-12);
            for (xi, f) in hex8::gauss_points().iter().zip(gauss_gradients(&x, H)) {
                prop_assert!((f - deformation_gradient(&x, &hex8::gradients(xi, H))).norm() < 1e-12);
            }
        }

        #[test]
        fn force_is_the_derivative_of_energy_without_net_force_or_moment(
            e in prop::collection::vec(-0.2f64..0.2, 24), kind in 0usize..4,
        ) {
            let (x, fill) = (bent(&e), fills()[kind]);
            let (g, k0) = (mean_gradients(H, &fill), stiffness(H, &fill, &material()));
            let evaluate = |x: &ElementCorners, last: Mat3| elastic(x, &cube(), &g, &k0, last, None);
            let at = evaluate(&x, Mat3::identity());
            let scale = at.force.iter().map(|f| f.norm()).fold(0.0, f64::max);
            let step = 1e-6 * H;
            for a in 0..8 {
                for i in 0..3 {
                    let moved = |s: f64| { let mut y = x; y[a][i] += s; evaluate(&y, at.rotation).energy };
                    // Fourth-order central difference: its own error is below 1e-8 of the scale.
                    let slope = (8.0 * (moved(step) - moved(-step)) - (moved(2.0 * step) - moved(-2.0 * step))) / (12.0 * step);
                    prop_assert!((at.force[a][i] + slope).abs() < 1e-7 * scale.max(1e-3), "{} vs {}", at.force[a][i], -slope);
                }
            }
            let net: Vec3 = at.force.iter().sum();
            let moment: Vec3 = (0..8).map(|a| x[a].cross(&at.force[a])).sum();
            prop_assert!(net.norm() < 1e-12 * scale.max(1e-3) && moment.norm() < 1e-12 * scale.max(1e-3));
        }
    }
}
