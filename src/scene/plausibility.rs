//! Material values that are valid numbers and most likely in another unit.

use super::{Asset, Body, Part, SoftMaterial};

/// Smallest plausible Young's modulus, Pa: soft gels have some hundred.
const MIN_YOUNGS_PA: f64 = 300.0;
/// Largest plausible Young's modulus of a body that deforms visibly in a hand, Pa.
const MAX_YOUNGS_PA: f64 = 1e9;
/// Plausible densities, kg/m³: from light foam to osmium.
const MIN_DENSITY: f64 = 5.0;
const MAX_DENSITY: f64 = 23_000.0;

impl Asset {
    /// Doubts about the units of its material, one sentence each.
    pub fn unit_doubts(&self) -> Vec<String> {
        match &self.body {
            Body::Soft(SoftMaterial { youngs_pa, density, .. }) => {
                youngs_doubt(*youngs_pa).into_iter().chain(density_doubt(*density)).collect()
            }
            Body::Rigid { density } => density_doubt(*density).into_iter().collect(),
            Body::Articulated(parts) => parts.iter().filter_map(part_doubt).collect(),
            Body::Static | Body::Scenery => Vec::new(),
        }
    }
}

fn part_doubt(part: &Part) -> Option<String> {
    density_doubt(part.density).map(|doubt| format!("part {}: {doubt}", part.name))
}

fn youngs_doubt(pascals: f64) -> Option<String> {
    if pascals < MIN_YOUNGS_PA {
        let converted = 1e3 * pascals;
        return Some(format!(
            "youngs_pa is {pascals} Pa, softer than a gel; did you mean {pascals} kPa, youngs_pa = {converted}?"
        ));
    }
    (pascals > MAX_YOUNGS_PA).then(|| {
        format!("youngs_pa is {pascals} Pa, stiffer than plastic; give it in Pa, or use softvt.rigid for a hard object")
    })
}

fn density_doubt(density: f64) -> Option<String> {
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
    use softvt_physics::contact::Friction;

    fn doubts(youngs_pa: f64, density: f64) -> Vec<String> {
        let material = SoftMaterial {
            youngs_pa,
            poisson: 0.3,
            density,
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
        asset.unit_doubts()
    }

    #[test]
    fn values_in_other_units_are_doubted_with_the_likely_one() {
        assert_eq!(doubts(4e4, 300.0), [""; 0]);
        let both = doubts(40.0, 0.3);
        assert!(both[0].contains("did you mean 40 kPa, youngs_pa = 40000?"), "{both:?}");
        assert!(both[1].contains("did you mean 0.3 g/cm³, density = 300?"), "{both:?}");
        assert_eq!(doubts(1e3, 20.0), [""; 0], "a soft, light foam");
    }
}
