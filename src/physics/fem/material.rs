//! Isotropic, linearly elastic material and its moduli.

use softvt_common::text::format_number;

/// Isotropic, linearly elastic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticMaterial {
    /// Young's modulus, Pa.
    pub youngs_pa: f64,
    /// Poisson's ratio, 0 ≤ ν < 0.5.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density: f64,
}

/// A parameter of a material that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus is not a positive number.
    #[error("Young's modulus is {} Pa, expected a positive number", format_number(*.0))]
    Youngs(f64),
    /// Poisson's ratio is not that of a compressible material.
    #[error("Poisson's ratio is {}, expected 0 <= poisson < 0.5", format_number(*.0))]
    Poisson(f64),
    /// The density is not a positive number.
    #[error("density is {} kg/m³, expected a positive number", format_number(*.0))]
    Density(f64),
}

impl ElasticMaterial {
    /// Checks the ranges of all parameters.
    ///
    /// # Errors
    /// The first that is out of range.
    pub fn check(&self) -> Result<(), MaterialError> {
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        match *self {
            Self { youngs_pa, .. } if !is_positive(youngs_pa) => Err(MaterialError::Youngs(youngs_pa)),
            Self { poisson, .. } if !(0.0..0.5).contains(&poisson) => Err(MaterialError::Poisson(poisson)),
            Self { density, .. } if !is_positive(density) => Err(MaterialError::Density(density)),
            _ => Ok(()),
        }
    }

    /// First Lamé parameter λ, Pa.
    pub fn lame_lambda(&self) -> f64 {
        self.youngs_pa * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// Shear modulus μ, Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.youngs_pa / (2.0 * (1.0 + self.poisson))
    }

    /// Constrained modulus λ + 2μ, Pa: of compression without lateral strain.
    pub fn constrained_modulus(&self) -> f64 {
        self.lame_lambda() + 2.0 * self.shear_modulus()
    }

    /// Plane-strain modulus E / (1 − ν²), Pa: of the indentation of a half-space.
    pub fn plane_strain_modulus(&self) -> f64 {
        self.youngs_pa / (1.0 - self.poisson * self.poisson)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moduli_agree_and_parameters_out_of_range_are_named() {
        let material = ElasticMaterial { youngs_pa: 3e4, poisson: 0.3, density: 250.0 };
        let (nu, m) = (material.poisson, material.constrained_modulus());
        let exact = material.youngs_pa * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
        assert!((m / exact - 1.0).abs() < 1e-14);
        assert_eq!(material.check(), Ok(()));
        let message = |material: ElasticMaterial| material.check().unwrap_err().to_string();
        assert!(message(ElasticMaterial { poisson: 0.5, ..material }).starts_with("Poisson's ratio is 0.5"));
        assert!(message(ElasticMaterial { youngs_pa: f64::NAN, ..material }).starts_with("Young's modulus"));
        assert!(message(ElasticMaterial { density: 0.0, ..material }).starts_with("density is 0"));
    }
}
