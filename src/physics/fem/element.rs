//! Rest stiffness of one voxel: a trilinear hexahedron with incompatible modes.
//!
//! A trilinear hexahedron is too stiff in bending. Three quadratic displacements that end at its faces, `a_k (ξ_k −
//! c_k)²` with any vectors `a_k`, remove that (Wilson, Taylor, Doherty & Ghaboussi, "Incompatible displacement models",
//! 1973). Their gradients have no mean over the material, whose centre is `c`, so that a homogeneous strain stays exact
//! (Taylor, Beresford & Wilson, "A non-conforming element for stress analysis", Int. J. Numer. Meth. Eng. 10, 1976).
//! They are eliminated from the stiffness, once for each fill, and cost nothing in a step. The dilatation is projected
//! on the linear functions over the material, as they can make it vanish in an incompressible material, where products
//! of coordinates would lock (B-bar: Hughes, *The Finite Element Method*, 1987, §4.5).
//!
//! A full voxel is integrated with 2×2×2 Gauss points; a partly filled one at the centres of its filled sub-cells. So
//! that an almost empty voxel stays regular, it also has [`GHOST`] of what resists all but homogeneous strains in a
//! full one: the difference of 2×2×2 points and a single one (hourglass stiffness: Flanagan & Belytschko, Int. J.
//! Numer. Meth. Eng. 17, 1981).

use nalgebra::{SMatrix, Vector4};

use super::material::ElasticMaterial;
use softvt_geometry::{
    Vec3,
    hex8::{self, QuadraturePoint},
    voxel::OccupancyMask,
};

/// Hourglass stiffness of a partly filled voxel besides that of its material, relative to that of a full one.
///
/// The nodes of a nearly empty voxel are light and have little else to hold them. With 1 %, some of them oscillated in
/// deep squeezes, sign-changing at every step.
pub const GHOST: f64 = 0.05;

/// A 24×24 matrix, column-major; degree of freedom `3 a + i` is axis `i` of corner `a`.
pub type Stiffness = Box<[f64; 576]>;

/// Averages of the shape gradients over the material of a voxel of edge `h`, 1/m.
///
/// A voxel that is not full has [`GHOST`] of the whole besides. So the rotation, which follows from these gradients, is
/// that of the part that stores the energy. With gradients of the whole voxel, a corner with hardly any material turns
/// all of it, and the tangent `R K₀ Rᵀ` has no term for that: it was found 3 to 5 times too soft there. In a full voxel
/// the averages are `±1/(4h)` on each axis.
pub fn mean_gradients(h: f64, fill: &OccupancyMask) -> [Vec3; 8] {
    let mut points = fill.quadrature(h);
    if *fill != OccupancyMask::full() {
        points.extend(hex8::gauss_rule(GHOST * h.powi(3)));
    }
    let volume: f64 = points.iter().map(|point| point.weight).sum();
    let mut mean = [Vec3::zeros(); 8];
    for QuadraturePoint { xi, weight } in points {
        let share = weight / volume;
        mean.iter_mut().zip(hex8::gradients(&xi, h)).for_each(|(mean, g)| *mean += g * share);
    }
    mean
}

/// Scalar displacement modes of an element: those of its corners, and one along each axis that is eliminated.
const MODES: usize = 8 + 3;
/// Degrees of freedom: `3 m + i` is axis `i` of mode `m`.
const FREEDOMS: usize = 3 * MODES;
/// Degrees of freedom of the corners.
const CORNERS: usize = 3 * 8;

/// Stiffness of a voxel of edge `h` of which `fill` is material.
pub fn stiffness(h: f64, fill: &OccupancyMask, material: &ElasticMaterial) -> Stiffness {
    let mut points = fill.quadrature(h);
    if *fill != OccupancyMask::full() {
        let ghost = GHOST * h.powi(3);
        points.extend(hex8::gauss_rule(ghost));
        points.push(QuadraturePoint { xi: Vec3::repeat(0.5), weight: -ghost });
    }
    let volume: f64 = points.iter().map(|point| point.weight).sum();
    let centre = points.iter().map(|point| point.xi * point.weight).sum::<Vec3>() / volume;
    let mu = material.shear_modulus();
    let bulk = material.lame_lambda() + 2.0 / 3.0 * mu;
    let mut all = SMatrix::<f64, FREEDOMS, FREEDOMS>::zeros();
    // Products of the linear functions with each other and with the dilatation of each degree of freedom.
    let mut products = SMatrix::<f64, 4, 4>::zeros();
    let mut dilatations = SMatrix::<f64, 4, FREEDOMS>::zeros();
    for QuadraturePoint { xi, weight } in &points {
        let away = xi - centre;
        let linear = Vector4::new(1.0, away.x, away.y, away.z);
        let mut g = [Vec3::zeros(); MODES];
        g[..8].copy_from_slice(&hex8::gradients(xi, h));
        (0..3).for_each(|axis| g[8 + axis][axis] = 2.0 * away[axis] / h);
        products += linear * linear.transpose() * *weight;
        for (mut column, slope) in dilatations.column_iter_mut().zip(g.iter().flatten()) {
            column += linear * (weight * slope);
        }
        add_deviatoric(&mut all, &g, weight * mu);
    }
    all.fill_upper_triangle_with_lower_triangle();
    if let Some(inverse) = products.try_inverse() {
        all += dilatations.transpose() * inverse * dilatations * bulk;
    }
    let inner = all.fixed_view::<9, 9>(CORNERS, CORNERS).into_owned();
    let coupling = all.fixed_view::<9, CORNERS>(CORNERS, 0).into_owned();
    let mut k: SMatrix<f64, CORNERS, CORNERS> = all.fixed_view::<CORNERS, CORNERS>(0, 0).into_owned();
    if let Some(inverse) = inner.cholesky() {
        k -= coupling.transpose() * inverse.solve(&coupling);
    }
    let mut stiffness = Box::new([0.0; 576]);
    // Rounding leaves it slightly unsymmetric.
    stiffness.copy_from_slice((0.5 * (k + k.transpose())).as_slice());
    stiffness
}

/// Adds the lower blocks of `w 2 dev ε : dev ε` for the gradients `g` of the modes at a point, with `w` the shear
/// modulus times its volume.
fn add_deviatoric(k: &mut SMatrix<f64, FREEDOMS, FREEDOMS>, g: &[Vec3; MODES], w: f64) {
    for (b, g_b) in g.iter().enumerate() {
        for (a, g_a) in g.iter().enumerate().skip(b) {
            let dot = w * g_a.dot(g_b);
            for j in 0..3 {
                for i in 0..3 {
                    let mixed = w * (g_a[j] * g_b[i] - 2.0 / 3.0 * g_a[i] * g_b[j]);
                    k[(3 * a + i, 3 * b + j)] += if i == j { dot + mixed } else { mixed };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::{Mat3, voxel::SUBCELLS};

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
            let g = mean_gradients(h, &OccupancyMask::from_fn(pattern));
            assert!(g.iter().sum::<Vec3>().norm() < 1e-12 / h);
            let moments: Mat3 = (0..8).map(|a| hex8::corner(a) * h * g[a].transpose()).sum();
            assert!((moments - Mat3::identity()).norm() < 1e-12);
        }
        let full = mean_gradients(h, &OccupancyMask::full());
        assert!((0..8).all(|a| (full[a] - hex8::corner_sign(a) * (0.25 / h)).norm() < 1e-12));
    }

    #[test]
    fn a_half_filled_voxel_carries_half_the_uniform_energy() {
        let half = OccupancyMask::from_fn(|cell| cell % SUBCELLS < SUBCELLS / 2);
        let u = field(0.01, |x| Vec3::new(x.x, 0.0, 0.0));
        let energy = |fill: &OccupancyMask| {
            let k = stiffness(0.01, fill, &ElasticMaterial::new(1e4, 0.2, 1.0).expect("valid"));
            apply(&k, &u).iter().zip(u).map(|(f, u)| f * u).sum::<f64>()
        };
        assert!((energy(&half) / energy(&OccupancyMask::full()) - 0.5).abs() < 1e-12);
    }
}
