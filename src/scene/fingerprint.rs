//! Fingerprints of assets: short hashes that are equal only for mechanically equal assets.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::asset::{Asset, Body, Joint, MovingPart, SoftMaterial};
use softvt_common::text::hex;
use softvt_geometry::shape::Shape;
use softvt_physics::contact::Friction;

/// Content of the fingerprint of an asset. Calibration files store the hashes: the names of these fields, and of those
/// of the types below them, must not change.
#[derive(Serialize)]
struct Mechanics<'a> {
    shape: Shape,
    body: BodyMechanics<'a>,
    friction: Friction,
}

#[derive(Serialize)]
enum BodyMechanics<'a> {
    Soft(&'a SoftMaterial),
    Rigid { density: f64 },
    Articulated(Vec<PartMechanics<'a>>),
    Static,
    Scenery,
}

#[derive(Serialize)]
struct PartMechanics<'a> {
    shape: Shape,
    density: f64,
    parent: Option<usize>,
    joint: &'a Joint,
}

impl<'a> PartMechanics<'a> {
    fn new(part: &'a MovingPart) -> Self {
        let MovingPart { asset, density, parent, joint, .. } = part;
        Self { shape: asset.shape.unpainted(), density: *density, parent: *parent, joint }
    }
}

impl Asset {
    /// Hash of everything that a calibration depends on: shape, body with its material and resolution, and friction.
    ///
    /// 16 hexadecimal digits of the SHA-256 of a canonical JSON text. Appearance, hints and name do not enter. Numbers
    /// have seven significant digits, since trigonometric functions differ between platforms in the last bits.
    pub fn fingerprint(&self) -> String {
        let body = match &self.body {
            Body::Soft(material) => BodyMechanics::Soft(material),
            Body::Rigid { density } => BodyMechanics::Rigid { density: *density },
            Body::Articulated(parts) => {
                BodyMechanics::Articulated(parts.iter().map(PartMechanics::new).collect())
            }
            Body::Static => BodyMechanics::Static,
            Body::Scenery => BodyMechanics::Scenery,
        };
        let mechanics = Mechanics { shape: self.shape.unpainted(), body, friction: self.friction };
        let mut text = String::new();
        write_canonical(&serde_json::to_value(mechanics).unwrap_or_default(), &mut text);
        hex(&Sha256::digest(text)[..8])
    }

    /// The same hash without the discretisation of a soft body: equal for all meshes of one object.
    pub fn object_fingerprint(&self) -> String {
        let mut object = self.clone();
        if let Body::Soft(material) = &mut object.body {
            (material.resolution, material.grasp_spacing) = (0, 0.0);
        }
        object.fingerprint()
    }
}

/// Writes JSON with sorted keys, without spaces, and with seven significant digits of numbers that are not integers.
/// Numbers that are not finite are null.
fn write_canonical(value: &Value, text: &mut String) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let x = number.as_f64().unwrap_or_default();
            // The bound also turns -0.0 into 0.0.
            *text += &format!("{:.6e}", if x.abs() < 1e-12 { 0.0 } else { x });
        }
        Value::Array(values) => {
            text.push('[');
            for (index, value) in values.iter().enumerate() {
                text.push_str(if index > 0 { "," } else { "" });
                write_canonical(value, text);
            }
            text.push(']');
        }
        Value::Object(fields) => {
            let sorted: BTreeMap<_, _> = fields.iter().collect();
            text.push('{');
            for (index, (key, value)) in sorted.into_iter().enumerate() {
                text.push_str(if index > 0 { "," } else { "" });
                *text += &Value::from(key.as_str()).to_string();
                text.push(':');
                write_canonical(value, text);
            }
            text.push('}');
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => *text += &value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{SoftMaterial, Visual};
    use softvt_geometry::{Pose, Vec3, mesh::Mesh, shape::Shape};
    use softvt_physics::{contact::Friction, fem::ElasticMaterial};

    fn bun() -> Asset {
        Asset {
            name: "bun".into(),
            shape: Shape::Placed {
                shape: Arc::new(Shape::Sphere { radius: 0.03 }),
                pose: Pose::translation(0.0, 0.0, 0.03),
            },
            body: Body::Soft(SoftMaterial {
                elastic: ElasticMaterial::new(2e4, 0.4, 300.0).expect("valid"),
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
        let elastic = |youngs_pa, poisson, density| {
            soft(&|m| m.elastic = ElasticMaterial::new(youngs_pa, poisson, density).expect("valid"))
        };
        assert!(elastic(2.1e4, 0.4, 300.0) && elastic(2e4, 0.3, 300.0) && elastic(2e4, 0.4, 301.0));
        assert!(soft(&|m| m.resolution = 7));
        let object = |resolution, poisson| {
            let elastic = ElasticMaterial::new(2e4, poisson, 300.0).expect("valid");
            let Body::Soft(material) = bun().body else { unreachable!() };
            let body = Body::Soft(SoftMaterial { elastic, resolution, grasp_spacing: 1e-3, ..material });
            Asset { body, ..bun() }.object_fingerprint()
        };
        assert!(object(6, 0.4) == object(7, 0.4) && object(6, 0.4) != object(6, 0.3));
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
        assert!(!elastic(2e4 * (1.0 + f64::EPSILON), 0.4, 300.0), "the last bit does not enter");
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
    fn keys_are_sorted_and_numbers_rounded_while_words_and_integers_are_kept() {
        let value =
            serde_json::json!({ "y": [1.25e-7, null, f64::INFINITY], "a\"": "1.5", "n": 12, "x": -0.0 });
        let mut text = String::new();
        write_canonical(&value, &mut text);
        assert_eq!(text, r#"{"a\"":"1.5","n":12,"x":0.000000e0,"y":[1.250000e-7,null,null]}"#);
    }
}
