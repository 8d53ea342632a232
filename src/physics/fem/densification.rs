//! Densification: the stiffening of an element that has lost most of its volume.
//!
//! The corotational law opposes compression with a finite stress even at zero volume, so a large enough force turns an
//! element inside out. In a cellular solid, cell walls touch long before that, and stress rises steeply: at the volume
//! ratio `1.4 ρ/ρ_s` (Gibson & Ashby, *Cellular Solids*, 1997, ch. 5), about 0.3 for bread crumb. This law adds to each
//! Gauss point the energy `w c ψ(J)` of its volume ratio `J = det F`, with
//!
//! `ψ = (J₀ − J)³ / (3 J₀ J)` for `J < J₀ = ` [`ONSET`], and 0 above,
//!
//! which has two continuous derivatives at `J₀`. The modulus `c` is `λ + 2μ`, that of uniaxial strain, and `w` is the
//! point's share of the voxel's material. Below [`FLOOR`], ψ continues as its Taylor polynomial of degree two, so that
//! the force of an element that one step has turned inside out is finite and opposes the inversion.
//!
//! With `∂J/∂F = cof F` the force on corner `a` is `−w c ψ' cof(F) g_a`: no net force, since `Σ g_a = 0`, and no
//! moment, since `cof(F) Fᵀ = J I`. The second derivative is `ψ'' cof F ⊗ cof F + ψ' ∂²J/∂F²`. The second term is
//! indefinite. In the frame of the polar rotation of `F`, its only positive part (`ψ' < 0`) acts on symmetric `δF`,
//! with eigenvalues of at most `−ψ' |F|`. [`Densification::add_tangent`] takes this bound for all symmetric `δF`: the
//! tangent is positive semidefinite, and not below the exact one while `J ≥ 0`, so that a linearised step does not
//! overshoot.

use super::{
    force::{ElasticResponse, ElementCorners, deformation_gradient},
    material::ElasticMaterial,
};
use softvt_geometry::{Mat3, Vec3, hex8};

/// Volume ratio `det F` below which an element stiffens.
pub(crate) const ONSET: f64 = 0.3;
/// Volume ratio below which the stress grows linearly.
pub(crate) const FLOOR: f64 = 0.05;

/// The law for voxels of one size and material.
#[derive(Clone, Debug)]
pub(crate) struct Densification {
    /// Modulus times the volume of a Gauss point, J.
    scale: f64,
    /// Shape gradients at the Gauss points, 1/m.
    gradients: [[Vec3; 8]; 8],
}

/// ψ and its first two derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Potential {
    value: f64,
    slope: f64,
    curvature: f64,
}

impl Potential {
    fn at(j: f64) -> Self {
        if j >= ONSET {
            return Self::default();
        }
        if j >= FLOOR {
            return Self::rational(j);
        }
        let Self { value, slope, curvature } = Self::rational(FLOOR);
        let d = j - FLOOR;
        Self { value: value + (slope + 0.5 * curvature * d) * d, slope: slope + curvature * d, curvature }
    }

    /// `d³/(3 J₀ J)` with `d = J₀ − J`.
    fn rational(j: f64) -> Self {
        let ratio = (ONSET - j) / j;
        let (d, scale) = (ONSET - j, 1.0 / (3.0 * ONSET));
        Self {
            value: scale * d * d * ratio,
            slope: -scale * d * ratio * (3.0 + ratio),
            curvature: scale * ratio * (6.0 + ratio * (6.0 + 2.0 * ratio)),
        }
    }
}

/// Cofactor matrix, `∂ det F / ∂F`.
fn cofactor(f: &Mat3) -> Mat3 {
    let (a, b, c) = (f.column(0), f.column(1), f.column(2));
    Mat3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

impl Densification {
    /// The law for voxels of edge `h` (m).
    pub(crate) fn new(material: &ElasticMaterial, h: f64) -> Self {
        let modulus = material.constrained_modulus();
        Self {
            scale: modulus * h.powi(3) / 8.0,
            gradients: hex8::gauss_points().map(|xi| hex8::gradients(&xi, h)),
        }
    }

    /// Adds force and energy of a voxel at corner positions `x` of which `share` is material. Returns the largest
    /// curvature ψ'' of its Gauss points.
    pub(crate) fn add(&self, x: &ElementCorners, share: f64, elastic: &mut ElasticResponse) -> f64 {
        let scale = self.scale * share;
        let mut largest: f64 = 0.0;
        for g in &self.gradients {
            let f = deformation_gradient(x, g);
            let Potential { value, slope, curvature } = Potential::at(f.determinant());
            let stress = cofactor(&f) * (scale * slope);
            elastic.energy += scale * value;
            elastic.force.iter_mut().zip(g).for_each(|(force, g)| *force -= stress * g);
            largest = largest.max(curvature);
        }
        largest
    }

    /// Adds the 3×3 blocks of the tangent, in the frame `rotation`, for the corner pairs `(a, b ≤ a)` in row order.
    pub(crate) fn add_tangent(
        &self,
        x: &ElementCorners,
        rotation: &Mat3,
        share: f64,
        blocks: &mut [Mat3; 36],
    ) {
        for g in &self.gradients {
            let f = rotation.tr_mul(&deformation_gradient(x, g));
            let Potential { slope, curvature, .. } = Potential::at(f.determinant());
            let (volumetric, symmetric) =
                (self.scale * share * curvature, -self.scale * share * slope * f.norm());
            let cofactor = cofactor(&f);
            let n = g.map(|g| cofactor * g);
            let pairs = (0..8).flat_map(|a| (0..=a).map(move |b| (a, b)));
            for (block, (a, b)) in blocks.iter_mut().zip(pairs) {
                let strain = Mat3::from_diagonal_element(g[a].dot(&g[b])) + g[b] * g[a].transpose();
                *block += n[a] * n[b].transpose() * volumetric + strain * (0.5 * symmetric);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rotation::polar_svd;
    use proptest::prelude::*;
    use softvt_geometry::Quat;

    const H: f64 = 0.01;
    const SHARE: f64 = 0.7;

    fn law() -> Densification {
        Densification::new(&ElasticMaterial::new(3e4, 0.3, 300.0).expect("valid"), H)
    }

    fn evaluate(x: &ElementCorners) -> ElasticResponse {
        let mut out = ElasticResponse { rotation: Mat3::identity(), force: [Vec3::zeros(); 8], energy: 0.0 };
        law().add(x, SHARE, &mut out);
        out
    }

    /// A cube pressed to `height` of its own, turned, with corners moved by `e` edges.
    fn pressed(height: f64, e: &[f64]) -> ElementCorners {
        let turn = Quat::from_scaled_axis(Vec3::new(0.4, -1.1, 0.3));
        std::array::from_fn(|a| {
            let moved = hex8::corner(a) + Vec3::from_column_slice(&e[3 * a..3 * a + 3]);
            turn * (moved.component_mul(&Vec3::new(1.1, 1.05, height)) * H)
        })
    }

    /// Second derivative of the energy along `d`, by central differences of the force.
    fn exact_curvature(x: &ElementCorners, d: &ElementCorners, step: f64) -> f64 {
        let along = |s: f64| {
            let moved: ElementCorners = std::array::from_fn(|a| x[a] + d[a] * s);
            -evaluate(&moved).force.iter().zip(d).map(|(f, d)| f.dot(d)).sum::<f64>()
        };
        (along(step) - along(-step)) / (2.0 * step)
    }

    fn quadratic_form(blocks: &[Mat3; 36], rotation: &Mat3, d: &ElementCorners) -> f64 {
        let d = d.map(|d| rotation.tr_mul(&d));
        let pairs = (0..8).flat_map(|a| (0..=a).map(move |b| (a, b)));
        pairs.zip(blocks).map(|((a, b), k)| d[a].dot(&(k * d[b])) * if a == b { 1.0 } else { 2.0 }).sum()
    }

    #[test]
    fn the_potential_has_two_continuous_derivatives_and_vanishes_above_its_onset() {
        assert_eq!(Potential::at(ONSET), Potential::default());
        assert_eq!(Potential::at(1.7), Potential::default());
        for joint in [ONSET, FLOOR] {
            let (below, above) = (Potential::at(joint - 1e-9), Potential::at(joint + 1e-9));
            assert!((below.value - above.value).abs() < 1e-6 && (below.slope - above.slope).abs() < 1e-5);
            assert!((below.curvature - above.curvature).abs() < 1e-4, "{joint}: {below:?} {above:?}");
        }
        for j in [-0.4, 0.0, 0.03, 0.06, 0.1, 0.2, 0.29] {
            let (up, down, at) = (Potential::at(j + 1e-5), Potential::at(j - 1e-5), Potential::at(j));
            assert!(((up.value - down.value) / 2e-5 / at.slope - 1.0).abs() < 1e-5, "at {j}");
            assert!(((up.slope - down.slope) / 2e-5 / at.curvature - 1.0).abs() < 1e-5, "at {j}");
            assert!(at.slope < 0.0 && at.curvature > 0.0);
        }
    }

    proptest! {
        #[test]
        fn force_is_the_derivative_of_energy_without_net_force_or_moment(
            height in -0.1f64..0.35, e in prop::collection::vec(-0.03f64..0.03, 24),
        ) {
            let x = pressed(height, &e);
            let at = evaluate(&x);
            let scale = at.force.iter().map(|f| f.norm()).fold(1e-6, f64::max);
            let step = 1e-6 * H;
            for a in 0..8 {
                for i in 0..3 {
                    let moved = |s: f64| { let mut y = x; y[a][i] += s; evaluate(&y).energy };
                    let slope = (8.0 * (moved(step) - moved(-step)) - (moved(2.0 * step) - moved(-2.0 * step))) / (12.0 * step);
                    prop_assert!((at.force[a][i] + slope).abs() < 1e-5 * scale, "{} vs {}", at.force[a][i], -slope);
                }
            }
            let net: Vec3 = at.force.iter().sum();
            let moment: Vec3 = (0..8).map(|a| x[a].cross(&at.force[a])).sum();
            prop_assert!(net.norm() < 1e-12 * scale && moment.norm() < 1e-12 * scale * H.max(1.0));
        }

        #[test]
        fn nothing_acts_above_the_onset(height in 0.45f64..1.5, e in prop::collection::vec(-0.05f64..0.05, 24)) {
            let at = evaluate(&pressed(height, &e));
            prop_assert!(at.energy == 0.0 && at.force.iter().all(|f| *f == Vec3::zeros()));
        }

        #[test]
        fn a_rigid_motion_turns_the_force(axis in prop::array::uniform3(-2.0f64..2.0)) {
            let x = pressed(0.12, &[0.0; 24]);
            let turn = Quat::from_scaled_axis(Vec3::from(axis));
            let (at, turned) = (evaluate(&x), evaluate(&x.map(|x| turn * x + Vec3::new(0.3, -0.1, 0.2))));
            prop_assert!((at.energy / turned.energy - 1.0).abs() < 1e-9);
            for (f, g) in at.force.iter().zip(&turned.force) {
                prop_assert!((turn * f - g).norm() < 1e-9 * f.norm());
            }
        }

        #[test]
        fn the_tangent_is_not_below_the_exact_one_and_semidefinite(
            height in 0.02f64..0.3, e in prop::collection::vec(-0.01f64..0.01, 24), d in prop::collection::vec(-1.0f64..1.0, 24),
        ) {
            let x = pressed(height, &e);
            prop_assume!(crate::fem::force::min_det(&x, H) > 0.0);
            let d: ElementCorners = std::array::from_fn(|a| Vec3::from_column_slice(&d[3 * a..3 * a + 3]));
            let centre = hex8::gauss_points().iter().map(|xi| deformation_gradient(&x, &hex8::gradients(xi, H))).sum::<Mat3>() / 8.0;
            let rotation = polar_svd(&centre);
            let mut blocks = [Mat3::zeros(); 36];
            law().add_tangent(&x, &rotation, SHARE, &mut blocks);
            let (tangent, exact) = (quadratic_form(&blocks, &rotation, &d), exact_curvature(&x, &d, 1e-7 * H));
            prop_assert!(tangent >= 0.0 && tangent > 0.98 * exact - 1e-6, "{tangent} against {exact}");
        }
    }
}
