//! Fingerprints of assets: short hashes that are equal only for mechanically equal assets.

use sha2::{Digest, Sha256};

use super::asset::{Asset, Body, Part};

impl Asset {
    /// Hash of everything that a calibration depends on: shape, body with its material and resolution, and friction.
    ///
    /// 16 hexadecimal digits of a SHA-256. Appearance, hints and name do not enter. Numbers enter with seven
    /// significant digits, since trigonometric functions differ between platforms in the last bits.
    pub fn fingerprint(&self) -> String {
        let body = match &self.body {
            Body::Articulated(parts) => {
                let bare = |part: &Part| {
                    (part.asset.shape.unpainted(), part.density, part.parent, part.joint.clone())
                };
                format!("{:?}", parts.iter().map(bare).collect::<Vec<_>>())
            }
            body => format!("{body:?}"),
        };
        // Calibration files store these hashes: the `Debug` text of the types below must not change.
        let text = format!("({:?}, {body}, {:?})", self.shape.unpainted(), self.friction);
        let digest = Sha256::digest(rounded(&text).as_bytes());
        digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Rewrites all numbers with a fraction or an exponent in `text` with seven significant digits.
fn rounded(text: &str) -> String {
    let is_separator = |c: char| !(c.is_alphanumeric() || "._-".contains(c));
    let round = |piece: &str| {
        let token = piece.trim_end_matches(is_separator);
        match token.parse::<f64>() {
            // Adding zero turns -0.0 into 0.0.
            Ok(x) if token.contains(['.', 'e']) => {
                format!("{:.6e}{}", if x.abs() < 1e-12 { 0.0 } else { x + 0.0 }, &piece[token.len()..])
            }
            _ => piece.to_owned(),
        }
    };
    text.split_inclusive(is_separator).map(round).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{SoftMaterial, Visual};
    use softvt_geometry::{Pose, Vec3, mesh::Mesh, shape::Shape};
    use softvt_physics::contact::Friction;

    fn bun() -> Asset {
        Asset {
            name: "bun".into(),
            shape: Shape::Placed {
                shape: Arc::new(Shape::Sphere { radius: 0.03 }),
                pose: Pose::translation(0.0, 0.0, 0.03),
            },
            body: Body::Soft(SoftMaterial {
                youngs_pa: 2e4,
                poisson: 0.4,
                density: 300.0,
                resolution: 6,
                grasp_spacing: 7.5e-4,
                collapse_strain: Some(0.1),
                damage_strain: None,
            }),
            friction: Friction::default(),
            visuals: vec![Visual::default()],
            hints: Default::default(),
        }
    }

    #[test]
    fn mechanical_properties_enter_and_appearance_and_name_do_not() {
        let known = bun().fingerprint();
        assert_eq!(known.len(), 16);
        let changed = |change: &dyn Fn(&mut Asset)| {
            let mut asset = bun();
            change(&mut asset);
            asset.fingerprint() != known
        };
        let soft = |change: &dyn Fn(&mut SoftMaterial)| {
            changed(&|asset| {
                let Body::Soft(material) = &mut asset.body else { unreachable!() };
                change(material);
            })
        };
        assert!(changed(&|a| a.shape = Shape::Sphere { radius: 0.030_001 }));
        assert!(changed(&|a| a.shape = Shape::Box { half: Vec3::repeat(0.03) }));
        assert!(changed(&|a| a.friction.static_mu = 0.7));
        assert!(soft(&|m| m.youngs_pa = 2.1e4) && soft(&|m| m.poisson = 0.3) && soft(&|m| m.density = 301.0));
        assert!(soft(&|m| m.resolution = 7));
        assert!(soft(&|m| m.collapse_strain = None) && soft(&|m| m.damage_strain = Some(0.1)));
        assert!(!changed(&|a| a.name = "roll".into()));
        assert!(!changed(&|a| a.visuals.clear()));
        let brush = || Shape::Sphere { radius: 0.02 };
        assert!(!changed(&|a| a.shape = a.shape.clone().painted(1, Some(brush()))));
        assert!(
            !changed(&|a| {
                let inner = Shape::Sphere { radius: 0.03 }.painted(2, None).translated(Vec3::z() * 0.01);
                a.shape = inner.painted(1, Some(brush())).translated(Vec3::z() * 0.02);
            }),
            "paint between two placements"
        );
        assert!(!soft(&|m| m.youngs_pa = 2e4 * (1.0 + f64::EPSILON)), "the last bit does not enter");
    }

    #[test]
    fn meshes_with_equal_counts_are_distinguished() {
        let tetrahedron = |height: f64| {
            let vertices = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z() * height].to_vec();
            let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
            let shape = Shape::from_mesh(Mesh { vertices, triangles, uvs: Vec::new() }).expect("a solid");
            Asset { shape, ..bun() }.fingerprint()
        };
        assert_eq!(tetrahedron(1.0), tetrahedron(1.0));
        assert_ne!(tetrahedron(1.0), tetrahedron(1.1));
    }

    #[test]
    fn numbers_are_rounded_while_words_and_integers_are_kept() {
        assert_eq!(
            rounded("a1.5 { x: -0.0, n: 12, y: 1.25e-7 }"),
            "a1.5 { x: 0.000000e0, n: 12, y: 1.250000e-7 }"
        );
    }

    #[test]
    fn a_strain_that_is_not_stated_leaves_no_trace_in_the_hashed_text() {
        let Body::Soft(material) = bun().body else { unreachable!() };
        let plain = SoftMaterial { collapse_strain: None, ..material.clone() };
        assert_eq!(
            format!("{plain:?}"),
            "SoftMaterial { youngs_pa: 20000.0, poisson: 0.4, density: 300.0, resolution: 6, grasp_spacing: 0.00075 }"
        );
        assert!(format!("{material:?}").ends_with(", collapse_strain: Some(0.1) }"));
    }
}
