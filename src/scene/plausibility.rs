//! Materials that are valid and most likely a mistake.

use super::{Asset, Body, MovingPart, SoftMaterial};
use softvt_common::text::format_number;
use softvt_physics::{STANDARD_GRAVITY, contact::Friction, fem::ElasticMaterial};

/// Smallest plausible Young's modulus, Pa: soft gels have some hundred.
const MIN_YOUNGS_PA: f64 = 300.0;
/// Largest plausible Young's modulus of a soft body, Pa: that of hard rubber.
const MAX_YOUNGS_PA: f64 = 1e7;
/// Largest plausible strain that a soft body bears.
const MAX_STRAIN: f64 = 0.8;
/// Plausible densities, kg/m³: from light foam to osmium.
const MIN_DENSITY: f64 = 5.0;
const MAX_DENSITY: f64 = 23_000.0;

/// Compression by its own weight from which on a body hardly stands.
const MAX_SAG: f64 = 0.15;

impl Asset {
    /// Warnings about its material and visuals, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.material_warnings();
        warnings.extend(self.visual_warnings());
        warnings
    }

    /// A warning about a slippery surface that is not.
    pub fn friction_warning(&self) -> Option<String> {
        let own = self.friction.static_mu;
        let hidden = self.hidden_friction(own, Friction::STANDARD.static_mu, "tables and pads")?;
        let own = format_number(own);
        Some(format!("friction.static_mu is {own}, and {hidden}; for a slippery surface add coated = true"))
    }

    /// Why a static coefficient has no effect on a free object: `others` have a larger one, of at least `other_mu`.
    pub fn hidden_friction(&self, static_mu: f64, other_mu: f64, others: &str) -> Option<String> {
        let is_free = matches!(self.body, Body::Soft(_) | Body::Rigid { .. });
        (is_free && !self.friction.coated && static_mu < other_mu).then(|| {
            format!(
                "a pair of surfaces takes the larger coefficient, which is at least {} on {others}",
                format_number(other_mu)
            )
        })
    }

    fn material_warnings(&self) -> Vec<String> {
        match &self.body {
            Body::Soft(SoftMaterial { elastic, collapse_strain, damage_strain, .. }) => {
                let units = [
                    youngs_warning(elastic.youngs_pa()),
                    density_warning(elastic.density()),
                    strain_warning("collapse_strain", *collapse_strain),
                    strain_warning("damage_strain", *damage_strain),
                ];
                units.into_iter().flatten().chain(self.sag_warning(elastic)).collect()
            }
            Body::Rigid { density } => density_warning(*density).into_iter().collect(),
            Body::Articulated(parts) => parts.iter().filter_map(part_warning).collect(),
            Body::Static | Body::Scenery => Vec::new(),
        }
    }

    /// A warning about a soft body that is compressed by its own weight: ρ g h / 2 E for an upright block of height h.
    fn sag_warning(&self, material: &ElasticMaterial) -> Option<String> {
        let (youngs_pa, density) = (material.youngs_pa(), material.density());
        let sag_of = |height: f64| density * STANDARD_GRAVITY.norm() * height / (2.0 * youngs_pa);
        if sag_of(self.shape.loose_bounds().size().z) < MAX_SAG {
            return None;
        }
        let height = self.shape.bounds().size().z;
        let sag = sag_of(height);
        let left = match sag {
            ..MAX_SAG => return None,
            ..0.8 => format!("sags to about {:.0} % of its height", 100.0 * (1.0 - sag)),
            _ => "collapses".to_owned(),
        };
        Some(format!(
            "it {left} under its own weight ({} mm high, {} kg/m³, {} Pa); youngs_pa is in pascals, density in kg/m³",
            format_number((1e3 * height).round()),
            format_number(density),
            format_number(youngs_pa)
        ))
    }
}

fn part_warning(part: &MovingPart) -> Option<String> {
    density_warning(part.density).map(|warning| format!("part {}: {warning}", part.name))
}

fn youngs_warning(pascals: f64) -> Option<String> {
    if pascals < MIN_YOUNGS_PA {
        let (pascals, converted) = (format_number(pascals), format_number(1e3 * pascals));
        return Some(format!(
            "youngs_pa is {pascals} Pa, softer than a gel; did you mean {pascals} kPa, youngs_pa = {converted}?"
        ));
    }
    (pascals > MAX_YOUNGS_PA).then(|| {
        let pascals = format_number(pascals);
        format!("youngs_pa is {pascals} Pa, stiffer than rubber; give it in Pa, or use softvt.rigid for a hard object")
    })
}

fn strain_warning(name: &str, strain: Option<f64>) -> Option<String> {
    let strain = strain.filter(|strain| *strain > MAX_STRAIN)?;
    let (percent, converted) = (format_number(1e2 * strain), format_number(1e-2 * strain));
    Some(format!(
        "{name} is {strain}, a compression by {percent} %; did you mean {strain} %, {name} = {converted}?"
    ))
}

fn density_warning(density: f64) -> Option<String> {
    if density < MIN_DENSITY {
        let converted = 1e3 * density;
        return Some(format!(
            "density is {density} kg/m³, lighter than foam; did you mean {density} g/cm³, density = {converted}?"
        ));
    }
    (density > MAX_DENSITY)
        .then(|| format!("density is {density} kg/m³, heavier than any metal; give it in kg/m³"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::{Vec3, shape::Shape};

    #[test]
    fn a_slippery_surface_without_a_coating_is_doubted() {
        let of = |friction: Friction| {
            let asset = Asset {
                name: "soap".into(),
                shape: Shape::Box { half: Vec3::repeat(0.02) },
                body: Body::Rigid { density: 900.0 },
                friction,
                visuals: Vec::new(),
                hints: Default::default(),
            };
            asset.friction_warning()
        };
        let slippery = Friction::new(0.05, 0.04);
        let doubted = of(slippery);
        assert!(
            doubted
                .is_some_and(|text| text.starts_with("friction.static_mu is 0.05, and a pair of surfaces"))
        );
        assert_eq!(of(Friction { coated: true, ..slippery }), None);
        assert_eq!(of(Friction::default()), None);
    }

    fn warnings(youngs_pa: f64, density: f64) -> Vec<String> {
        let material = SoftMaterial {
            elastic: ElasticMaterial::new(youngs_pa, 0.3, density).expect("valid"),
            resolution: 6,
            grasp_spacing: 1e-3,
            collapse_strain: None,
            damage_strain: None,
        };
        let asset = Asset {
            name: "bun".into(),
            shape: Shape::Box { half: Vec3::repeat(0.02) },
            body: Body::Soft(material),
            friction: Friction::default(),
            visuals: Vec::new(),
            hints: Default::default(),
        };
        asset.warnings()
    }

    #[test]
    fn values_in_other_units_are_doubted_with_the_likely_one() {
        assert_eq!(warnings(4e4, 300.0), [""; 0]);
        let both = warnings(40.0, 0.3);
        assert!(both[0].contains("did you mean 40 kPa, youngs_pa = 40000?"), "{both:?}");
        assert!(both[1].contains("did you mean 0.3 g/cm³, density = 300?"), "{both:?}");
        assert_eq!(warnings(1e3, 20.0), [""; 0], "a soft, light foam");
        assert!(warnings(6e7, 300.0)[0].contains("stiffer than rubber"));
        assert_eq!(strain_warning("damage_strain", Some(0.6)), None);
        let doubted = strain_warning("collapse_strain", Some(1.0));
        let expected =
            "collapse_strain is 1, a compression by 100 %; did you mean 1 %, collapse_strain = 0.01?";
        assert_eq!(doubted.as_deref(), Some(expected));
    }

    #[test]
    fn a_body_that_its_weight_compresses_is_doubted() {
        assert_eq!(warnings(5e3, 1000.0), [""; 0]);
        // ρ g h / 2 E = 0.39.
        let sagging = warnings(500.0, 1000.0);
        assert!(
            sagging[0].starts_with("it sags to about 61 % of its height under its own weight"),
            "{sagging:?}"
        );
        assert!(warnings(25.0, 300.0)[1].starts_with("it collapses under its own weight"));
    }
}
