//! Isotropic, linearly elastic material and its moduli.

use serde::Serialize;

use super::relaxation::Relaxation;
use softvt_common::range::{Range, RangeError};

/// Isotropic, linearly elastic material. All its parameters are in their ranges: [`Self::new`] checks them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ElasticMaterial {
    youngs_pa: f64,
    poisson: f64,
    density: f64,
    #[serde(skip_serializing_if = "is_zero")]
    loss_factor: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl ElasticMaterial {
    /// Range of Young's modulus, Pa: usually from that of a soft gel to that of hard rubber.
    pub const YOUNGS_PA: Range = Range::POSITIVE.usually(300.0, 1e7);
    /// Range of Poisson's ratio; 0.5 would be incompressible.
    pub const POISSON: Range = Range::below(0.0, 0.5);
    /// Range of the density, kg/m³: usually from that of light foam to that of osmium.
    pub const DENSITY: Range = Range::POSITIVE.usually(5.0, 23_000.0);

    /// Range of the loss factor tan δ from 1 to 10 Hz. 0 stands for a material whose damping is that of the world.
    pub const LOSS_FACTOR: Range = Range::closed(0.0, 0.6);

    /// A material with this Young's modulus (Pa), Poisson's ratio and density (kg/m³).
    ///
    /// # Errors
    /// The first parameter that is out of its range.
    pub fn new(youngs_pa: f64, poisson: f64, density: f64) -> Result<Self, RangeError> {
        Self::YOUNGS_PA.check("youngs_pa", youngs_pa, "Pa")?;
        Self::POISSON.check("poisson", poisson, "")?;
        Self::DENSITY.check("density", density, "kg/m³")?;
        Ok(Self { youngs_pa, poisson, density, loss_factor: 0.0 })
    }

    /// The same material with another loss factor.
    ///
    /// # Errors
    /// It is out of its range.
    pub fn with_loss_factor(self, loss_factor: f64) -> Result<Self, RangeError> {
        Self::LOSS_FACTOR.check("loss_factor", loss_factor, "")?;
        Ok(Self { loss_factor, ..self })
    }

    /// Loss factor tan δ from 1 to 10 Hz.
    pub fn loss_factor(&self) -> f64 {
        self.loss_factor
    }

    /// Its damping, if it has a loss factor.
    pub(super) fn relaxation(&self) -> Option<Relaxation> {
        (self.loss_factor > 0.0).then(|| Relaxation::new(self.loss_factor))
    }

    /// Young's modulus at rest, Pa.
    pub fn youngs_pa(&self) -> f64 {
        self.youngs_pa
    }

    /// Poisson's ratio.
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Density, kg/m³.
    pub fn density(&self) -> f64 {
        self.density
    }

    /// The same material with another Young's modulus, Pa.
    ///
    /// # Errors
    /// It is out of its range.
    pub fn with_youngs_pa(self, youngs_pa: f64) -> Result<Self, RangeError> {
        Self::new(youngs_pa, self.poisson, self.density)?.with_loss_factor(self.loss_factor)
    }

    /// The same material with another Poisson's ratio.
    ///
    /// # Errors
    /// It is out of its range.
    pub fn with_poisson(self, poisson: f64) -> Result<Self, RangeError> {
        Self::new(self.youngs_pa, poisson, self.density)?.with_loss_factor(self.loss_factor)
    }

    /// The same material with another density, kg/m³.
    ///
    /// # Errors
    /// It is out of its range.
    pub fn with_density(self, density: f64) -> Result<Self, RangeError> {
        Self::new(self.youngs_pa, self.poisson, density)?.with_loss_factor(self.loss_factor)
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
    fn moduli_agree() {
        let material = ElasticMaterial::new(3e4, 0.3, 250.0).expect("valid");
        let exact = 3e4 * (1.0 - 0.3) / ((1.0 + 0.3) * (1.0 - 2.0 * 0.3));
        assert!((material.constrained_modulus() / exact - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_parameter_out_of_range_is_named_also_when_a_valid_material_changes() {
        let valid = ElasticMaterial::new(3e4, 0.3, 250.0).expect("valid");
        let message = |made: Result<ElasticMaterial, RangeError>| made.expect_err("refused").to_string();
        assert_eq!(
            message(ElasticMaterial::new(0.0, 0.3, 250.0)),
            "youngs_pa: expected a number above 0 (Pa), got 0"
        );
        assert!(message(valid.with_youngs_pa(f64::NAN)).starts_with("youngs_pa: expected a number above 0"));
        assert_eq!(message(valid.with_poisson(0.5)), "poisson: expected a number in 0..below 0.5, got 0.5");
        assert!(message(valid.with_density(-1.0)).starts_with("density: expected a number above 0 (kg/m³)"));
    }
}
