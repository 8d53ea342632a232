//! Elastic layer bonded to a rigid base, in Fourier space.
//!
//! For one wave number k the plane-strain problem of the layer has four unknowns and a closed form (Johnson, *Contact
//! Mechanics*, 1985, §5.8, for the normal part; O'Sullivan & King, J. Tribology 110 (1988) 235, for the method). With
//! α = k h, κ = 3 − 4ν and D = 2κ cosh 2α + 4α² + 1 + κ², tractions on the free surface move it by
//!
//! - normal to normal: (1−ν)/(μk) · (2κ sinh 2α − 4α)/D
//! - along k to along k: (1−ν)/(μk) · (2κ sinh 2α + 4α)/D
//! - across k to across k: tanh α/(μk)
//! - normal to along k and back: m = (4α² − 2κ(1−2ν)(cosh 2α − 1)) / (2μkD), a quarter wave apart.
//!
//! m changes its sign near α = 2: long waves of pressure squeeze a nearly incompressible layer outwards, where a half
//! space is drawn inwards.

use super::LayerMaterial;

/// Displacement of the surface per unit of traction at one wave number k, m/Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerResponse {
    /// Normal displacement by normal traction.
    pub normal: f64,
    /// Displacement along k by shear along k.
    pub longitudinal: f64,
    /// Displacement across k by shear across k.
    pub transverse: f64,
    /// m of the module: displacement along k by pressure is −i m, outwards by shear along k is −i m.
    pub coupling: f64,
}

/// α beyond which the base has no influence (e⁻⁴⁰) and the hyperbolic functions would overflow.
const MAX_ALPHA: f64 = 20.0;

impl LayerResponse {
    /// Response of a layer at wave number `k`, 1/m.
    pub fn new(layer: &LayerMaterial, k: f64) -> Self {
        let &LayerMaterial { shear_modulus: mu, poisson: nu, thickness: h } = layer;
        if k * h < 1e-6 {
            let normal = h * (1.0 - 2.0 * nu) / (2.0 * mu * (1.0 - nu));
            return Self { normal, longitudinal: h / mu, transverse: h / mu, coupling: 0.0 };
        }
        let alpha = (k * h).min(MAX_ALPHA);
        let kappa = 3.0 - 4.0 * nu;
        let cosh = (2.0 * alpha).cosh();
        let sinh = (2.0 * alpha).sinh();
        let d = 2.0 * kappa * cosh + 4.0 * alpha * alpha + 1.0 + kappa * kappa;
        let scale = (1.0 - nu) / (mu * k);
        Self {
            normal: scale * (2.0 * kappa * sinh - 4.0 * alpha) / d,
            longitudinal: scale * (2.0 * kappa * sinh + 4.0 * alpha) / d,
            transverse: alpha.tanh() / (mu * k),
            coupling: (4.0 * alpha * alpha - 2.0 * kappa * (1.0 - 2.0 * nu) * (cosh - 1.0))
                / (2.0 * mu * k * d),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix4, Vector4};

    use super::*;

    /// Displacements (U, W) and their derivatives (U', W') of one of the four solutions u_x = i U e^{ikx},
    /// u_z = W e^{ikx}.
    fn solution(which: usize, k: f64, z: f64, kappa: f64) -> [f64; 4] {
        let (up, down) = ((k * z).exp(), (-k * z).exp());
        match which {
            0 => [up, up, k * up, k * up],
            1 => [z * up, (z - kappa / k) * up, (1.0 + k * z) * up, (k * z - kappa + 1.0) * up],
            2 => [down, -down, -k * down, k * down],
            _ => [z * down, -(z + kappa / k) * down, (1.0 - k * z) * down, (k * z + kappa - 1.0) * down],
        }
    }

    /// (U, W) at the surface by solving the boundary conditions numerically.
    fn solved(layer: &LayerMaterial, k: f64, shear: f64, normal: f64) -> [f64; 2] {
        let &LayerMaterial { shear_modulus: mu, poisson: nu, thickness: h } = layer;
        let (kappa, lambda) = (3.0 - 4.0 * nu, 2.0 * mu * nu / (1.0 - 2.0 * nu));
        let mut matrix = Matrix4::zeros();
        for i in 0..4 {
            let [u, w, ..] = solution(i, k, 0.0, kappa);
            matrix[(0, i)] = u;
            matrix[(1, i)] = w;
            let [u, w, du, dw] = solution(i, k, h, kappa);
            matrix[(2, i)] = mu * (du + k * w);
            matrix[(3, i)] = (lambda + 2.0 * mu) * dw - lambda * k * u;
        }
        let c = matrix.lu().solve(&Vector4::new(0.0, 0.0, shear, normal)).expect("regular");
        [0, 1].map(|j| (0..4).map(|i| c[i] * solution(i, k, h, kappa)[j]).sum())
    }

    #[test]
    fn the_closed_form_solves_the_layers_boundary_value_problem() {
        let layer = LayerMaterial { shear_modulus: 0.145, poisson: 0.475, thickness: 4.0 };
        for k in [0.02, 0.1, 0.3, 0.7, 1.0, 2.0, 3.0] {
            let found = LayerResponse::new(&layer, k);
            let (shear, normal) = (solved(&layer, k, 1.0, 0.0), solved(&layer, k, 0.0, 1.0));
            for (a, b) in [
                (found.longitudinal, shear[0]),
                (found.coupling, shear[1]),
                (found.coupling, normal[0]),
                (found.normal, normal[1]),
            ] {
                assert!((a - b).abs() < 1e-6 * found.normal, "k {k}: {a} {b}");
            }
        }
    }

    #[test]
    fn the_response_to_short_waves_is_that_of_a_half_space() {
        let layer = LayerMaterial { shear_modulus: 1.0, poisson: 0.3, thickness: 1.0 };
        let found = LayerResponse::new(&layer, 200.0);
        let half_space = [0.7 / 200.0, 0.7 / 200.0, 1.0 / 200.0, -0.4 / 400.0];
        for (a, b) in
            [found.normal, found.longitudinal, found.transverse, found.coupling].into_iter().zip(half_space)
        {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
    }
}
