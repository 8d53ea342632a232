//! Rest stiffness of one voxel: a trilinear hexahedron with mean dilatation (B-bar).
//!
//! B-bar: Hughes, *The Finite Element Method* (1987), §4.5: the volumetric part of the strain operator is replaced by
//! its mean over the element, which removes volumetric locking. A full voxel is integrated with 2×2×2 Gauss points; a
//! partly filled one at the centres of its filled sub-cells, plus [`GHOST`] of the full stiffness, so that an almost
//! empty voxel stays regular.

use super::material::ElasticMaterial;
use softvt_geometry::{
    Vec3, hex8,
    voxel::{OccupancyMask, SUBCELLS},
};

/// Stiffness added to a partly filled voxel, relative to that of a full one.
///
/// The nodes of a nearly empty voxel are light and have little else to hold them. With 1 %, some of them oscillated in
/// deep squeezes, sign-changing at every step; with 5 %, D of the standard objects is up to 8 % smaller.
pub const GHOST: f64 = 0.05;

/// A 24×24 matrix, column-major; degree of freedom `3 a + i` is axis `i` of corner `a`.
pub type Stiffness = Box<[f64; 576]>;

/// Local coordinates (each −1 or 1 over √3, mapped to `[0, 1]`) of the 2×2×2 Gauss points.
pub fn gauss_points() -> [Vec3; 8] {
    let at = |bit: usize| 0.5 + if bit == 1 { 0.5 } else { -0.5 } / 3f64.sqrt();
    std::array::from_fn(|g| Vec3::new(at(g & 1), at(g >> 1 & 1), at(g >> 2 & 1)))
}

/// Averages of the shape gradients over the material of a voxel of edge `h`, 1/m.
///
/// The weights are those of [`stiffness`]: 1 in filled sub-cells, and [`GHOST`] everywhere in a voxel that is not full.
/// So the rotation, which follows from these gradients, is that of the part that stores the energy. With gradients of
/// the whole voxel, a corner with hardly any material turns all of it, and the tangent `R K₀ Rᵀ` has no term for that:
/// it was found 3 to 5 times too soft there. In a full voxel the averages are `±1/(4h)` on each axis.
pub fn mean_gradients(h: f64, fill: &OccupancyMask) -> [Vec3; 8] {
    let whole: [Vec3; 8] = std::array::from_fn(|corner| hex8::corner_sign(corner) * (0.25 / h));
    if *fill == OccupancyMask::full() {
        return whole;
    }
    let cells = SUBCELLS * SUBCELLS * SUBCELLS;
    let ghost = GHOST * cells as f64;
    let (mut sum, mut weight) = (whole.map(|g| g * ghost), ghost);
    for cell in (0..cells).filter(|&cell| fill.contains(cell)) {
        weight += 1.0;
        sum.iter_mut().zip(hex8::gradients(&OccupancyMask::centre(cell), h)).for_each(|(sum, g)| *sum += g);
    }
    sum.map(|g| g / weight)
}

/// Stiffness of a voxel relative to a full one, as far as its fill determines it.
pub fn material_share(fill: &OccupancyMask) -> f64 {
    if *fill == OccupancyMask::full() { 1.0 } else { fill.fraction() + GHOST }
}

/// Stiffness of a voxel of edge `h` of which `fill` is material.
pub fn stiffness(h: f64, fill: &OccupancyMask, material: &ElasticMaterial) -> Stiffness {
    let gauss: Vec<(Vec3, f64)> = gauss_points().iter().map(|xi| (*xi, h.powi(3) / 8.0)).collect();
    let full = integrate(&gauss, h, material);
    if *fill == OccupancyMask::full() {
        return full;
    }
    let cells = SUBCELLS * SUBCELLS * SUBCELLS;
    let points: Vec<(Vec3, f64)> = (0..cells)
        .filter(|&cell| fill.contains(cell))
        .map(|cell| (OccupancyMask::centre(cell), h.powi(3) / cells as f64))
        .collect();
    let mut part = integrate(&points, h, material);
    part.iter_mut().zip(full.iter()).for_each(|(k, ghost)| *k += GHOST * ghost);
    part
}

/// `Σ w Bᵀ C B` over the points, with the dilatation averaged over them.
fn integrate(points: &[(Vec3, f64)], h: f64, material: &ElasticMaterial) -> Stiffness {
    let (lambda, mu) = (material.lame_lambda(), material.shear_modulus());
    let volume: f64 = points.iter().map(|(_, w)| w).sum();
    let mut mean = [Vec3::zeros(); 8];
    for (xi, w) in points {
        for (m, g) in mean.iter_mut().zip(hex8::gradients(xi, h)) {
            *m += g * (w / volume);
        }
    }
    let mut k = Box::new([0.0; 576]);
    for (xi, w) in points {
        add_point(&mut k, &hex8::gradients(xi, h), &mean, *w, lambda, mu);
    }
    k
}

/// Adds the deviatoric part of one point and the mean dilatation: `∫ 2μ dev ε : dev ε + κ tr̄²` with `κ = λ + 2μ/3`.
fn add_point(k: &mut [f64; 576], g: &[Vec3; 8], mean: &[Vec3; 8], w: f64, lambda: f64, mu: f64) {
    let kappa = lambda + 2.0 * mu / 3.0;
    for a in 0..8 {
        for b in 0..8 {
            let dot = g[a].dot(&g[b]);
            for i in 0..3 {
                for j in 0..3 {
                    let identity = if i == j { dot } else { 0.0 };
                    let shear = mu * (identity + g[a][j] * g[b][i] - 2.0 / 3.0 * g[a][i] * g[b][j]);
                    let bulk = kappa * mean[a][i] * mean[b][j];
                    k[(3 * b + j) * 24 + 3 * a + i] += w * (shear + bulk);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::Mat3;

    fn apply(k: &Stiffness, u: &[f64; 24]) -> [f64; 24] {
        std::array::from_fn(|r| (0..24).map(|c| k[c * 24 + r] * u[c]).sum())
    }

    fn field(h: f64, f: impl Fn(Vec3) -> Vec3) -> [f64; 24] {
        let mut u = [0.0; 24];
        for a in 0..8 {
            let x = hex8::corner(a) * h;
            u[3 * a..3 * a + 3].copy_from_slice(f(x).as_slice());
        }
        u
    }

    #[test]
    fn rigid_motion_needs_no_force_and_stiffness_is_symmetric() {
        let k =
            stiffness(0.01, &OccupancyMask::full(), &ElasticMaterial::new(3e4, 0.45, 1.0).expect("valid"));
        let scale = k.iter().cloned().fold(0.0, f64::max);
        for u in [field(0.01, |_| Vec3::x()), field(0.01, |x| Vec3::new(0.3, -0.2, 0.5).cross(&x) * 100.0)] {
            assert!(apply(&k, &u).iter().all(|f| f.abs() < 1e-12 * scale));
        }
        for r in 0..24 {
            for c in 0..24 {
                assert!((k[c * 24 + r] - k[r * 24 + c]).abs() < 1e-14 * scale);
            }
        }
    }

    #[test]
    fn mean_gradients_reproduce_linear_fields_for_any_fill() {
        let h = 0.013;
        for pattern in
            [|_| true, |cell| cell % 6 < 2, |cell| cell == 0, |cell| cell % 7 == 3, |cell| cell < 100]
        {
            let mut fill = OccupancyMask::default();
            (0..SUBCELLS * SUBCELLS * SUBCELLS)
                .filter(|&cell| pattern(cell))
                .for_each(|cell| fill.insert(cell));
            let g = mean_gradients(h, &fill);
            assert!(g.iter().sum::<Vec3>().norm() < 1e-12 / h);
            let moments: Mat3 = (0..8).map(|a| hex8::corner(a) * h * g[a].transpose()).sum();
            assert!((moments - Mat3::identity()).norm() < 1e-12);
        }
        let full = mean_gradients(h, &OccupancyMask::full());
        assert!((0..8).all(|a| (full[a] - hex8::corner_sign(a) * (0.25 / h)).norm() < 1e-12));
    }

    #[test]
    fn a_half_filled_voxel_carries_half_the_uniform_energy_and_the_ghost() {
        let mut half = OccupancyMask::default();
        (0..SUBCELLS * SUBCELLS * SUBCELLS)
            .filter(|cell| cell % SUBCELLS < SUBCELLS / 2)
            .for_each(|cell| half.insert(cell));
        let u = field(0.01, |x| Vec3::new(x.x, 0.0, 0.0));
        let energy = |fill: &OccupancyMask| {
            let k = stiffness(0.01, fill, &ElasticMaterial::new(1e4, 0.2, 1.0).expect("valid"));
            apply(&k, &u).iter().zip(u).map(|(f, u)| f * u).sum::<f64>()
        };
        assert!((energy(&half) / energy(&OccupancyMask::full()) - 0.5 - GHOST).abs() < 1e-12);
    }
}
