//! Uniform scaling of placed objects: their shape, contact samples, visuals and hints at another size.

use std::sync::Arc;

use softvt_geometry::{Vec3, shape::Shape};

use super::{
    Body, Object, SoftMaterial,
    decal::TextDecal,
    visual::{Mask, Visual, VisualLayer},
};

/// Ending of the names of hints that are lengths.
pub const LENGTH_HINT: &str = "_m";

impl Object {
    /// True if the object can have another size. An articulated one cannot: the range, damping and friction of its
    /// joints belong to its size.
    pub fn is_scalable(&self) -> bool {
        !matches!(self.nominal.body, Body::Articulated(_))
    }

    /// Gives the object `scale` times the size of its asset: shape, spacing of contact samples, patterns of the visuals
    /// and hints that are lengths. Material numbers and changed base colours stay. The mass follows as the cube of the
    /// scale, the number of voxels stays. Objects that are not [scalable](Self::is_scalable) are unchanged.
    pub fn set_scale(&mut self, scale: f64) {
        if !self.is_scalable() {
            return;
        }
        let nominal = self.nominal.clone();
        let asset = Arc::make_mut(&mut self.asset);
        self.scale = scale;
        asset.shape = resized(&nominal.shape, scale);
        if let (Body::Soft(own), Body::Soft(SoftMaterial { grasp_spacing, .. })) =
            (&mut asset.body, &nominal.body)
        {
            own.grasp_spacing = grasp_spacing * scale;
        }
        for (own, visual) in asset.visuals.iter_mut().zip(&nominal.visuals) {
            if let (Some(own), Some(nominal)) = (&mut own.colours, &visual.colours) {
                own.shape = Arc::new(resized(&nominal.shape, scale));
            }
            for (layer, nominal) in own.layers.iter_mut().zip(&visual.layers) {
                layer.mask = nominal.mask.scaled(scale);
                layer.relief_m = nominal.relief_m * scale;
            }
        }
        for (name, value) in &nominal.hints {
            let factor = if name.ends_with(LENGTH_HINT) { scale } else { 1.0 };
            asset.hints.insert(name.clone(), value * factor);
        }
    }

    /// Young's modulus relative to that of the asset; `None` if it is not a soft body.
    pub fn youngs_factor(&self) -> Option<f64> {
        Some(self.asset.elastic()?.youngs_pa() / self.nominal.elastic()?.youngs_pa())
    }

    /// Stable strain of the material relative to that of the asset; `None` if it is not a soft body that states one.
    pub fn strain_factor(&self) -> Option<f64> {
        match (&self.asset.body, &self.nominal.body) {
            (Body::Soft(own), Body::Soft(nominal)) => Some(own.stable_strain()? / nominal.stable_strain()?),
            _ => None,
        }
    }

    /// Static coefficient of its coating; `None` without one.
    pub fn coating(&self) -> Option<f64> {
        let friction = self.asset.friction;
        friction.coated.then_some(friction.static_mu)
    }

    /// Density relative to that of the asset; `None` if it is neither a soft nor a rigid body.
    pub fn density_factor(&self) -> Option<f64> {
        Some(self.asset.density()? / self.nominal.density()?)
    }
}

/// The shape at `scale` times its size. At 1 it is the shape itself, bit for bit.
fn resized(shape: &Shape, scale: f64) -> Shape {
    if scale == 1.0 { shape.clone() } else { shape.clone().scaled(Vec3::repeat(scale)) }
}

impl Visual {
    /// Multiplies the colours of the base and of all layers by `tint`, up to the largest value of a colour, 1.
    pub fn tint(&mut self, tint: [f64; 3]) {
        let apply = |albedo: &mut [f64; 3]| {
            albedo.iter_mut().zip(tint).for_each(|(value, factor)| *value = (*value * factor).min(1.0));
        };
        apply(&mut self.albedo);
        self.layers.iter_mut().for_each(|VisualLayer { albedo, .. }| apply(albedo));
    }
}

impl Mask {
    /// The mask of a surface at `scale` times the size: all lengths are multiplied.
    pub fn scaled(&self, scale: f64) -> Self {
        let mut mask = self.clone();
        match &mut mask {
            Self::Whole | Self::Facing { .. } => {}
            Self::Checker { size_m: length }
            | Self::Stripes { pitch_m: length, .. }
            | Self::Weave { pitch_m: length } => {
                *length *= scale;
            }
            Self::Gradient { from_m: first, to_m: second, .. }
            | Self::Boards { length_m: first, width_m: second, .. }
            | Self::Specks { spacing_m: first, radius_m: second, .. } => {
                *first *= scale;
                *second *= scale;
            }
            Self::Seams { length_m, width_m, gap_m } => {
                [length_m, width_m, gap_m].into_iter().for_each(|length| *length *= scale);
            }
            Self::Noise { size_m, .. } => *size_m = size_m.map(|length| length * scale),
            Self::Rings { centre_m, pitch_m, wobble_m, .. } => {
                centre_m.iter_mut().chain([pitch_m, wobble_m]).for_each(|length| *length *= scale);
            }
            Self::Inside { shape, soft_m } => {
                *shape = Arc::new(resized(shape, scale));
                *soft_m *= scale;
            }
            Self::Text { decal } => {
                let mut line = decal.line.clone();
                let lengths = line.at.iter_mut().chain([&mut line.height_m]).chain(&mut line.wrap_m);
                lengths.for_each(|length| *length *= scale);
                *decal = Arc::new(TextDecal::new(line));
            }
            Self::Inverse { mask } => *mask = Arc::new(mask.scaled(scale)),
            Self::Product { masks } => masks.iter_mut().for_each(|mask| *mask = Arc::new(mask.scaled(scale))),
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Asset;
    use softvt_geometry::Pose;
    use softvt_physics::{contact::Friction, fem::ElasticMaterial};

    fn ball() -> Object {
        let material = SoftMaterial {
            elastic: ElasticMaterial::new(2e4, 0.4, 300.0).expect("valid"),
            resolution: 6,
            grasp_spacing: 1e-3,
            collapse_strain: None,
            damage_strain: None,
        };
        let gradient = Mask::Gradient { axis: [0.0, 0.0, 1.0], from_m: 0.01, to_m: 0.05 };
        let layer =
            VisualLayer { mask: gradient, albedo: [0.9; 3], roughness: 0.5, opacity: 1.0, relief_m: 1e-4 };
        let asset = Arc::new(Asset {
            name: "ball".to_owned(),
            shape: Shape::Sphere { radius: 0.03 }.translated(Vec3::z() * 0.03),
            body: Body::Soft(material),
            friction: Friction::default(),
            visuals: vec![Visual::plain([0.5; 3], 0.5, 0.0).with(layer)],
            hints: [("grasp_height_m".to_owned(), 0.03), ("count".to_owned(), 3.0)].into(),
        });
        Object::new("left", asset, Pose::identity())
    }

    #[test]
    fn everything_that_has_a_size_follows_the_scale() {
        let mut object = ball();
        object.set_scale(1.2);
        let asset = &object.asset;
        let radius = asset.shape.bounds().size() / 2.0;
        assert!((radius - Vec3::repeat(0.036)).norm() < 1e-9, "{radius}");
        assert!(asset.shape.bounds().min.z.abs() < 1e-9, "the lowest point stays at z = 0");
        let mass = [&object.asset, &object.nominal].map(|asset| asset.mass().expect("soft"));
        assert!((mass[0] / mass[1] - 1.2f64.powi(3)).abs() < 1e-9, "{mass:?}");
        assert!((asset.hints["grasp_height_m"] - 0.036).abs() < 1e-12);
        assert_eq!(asset.hints["count"], 3.0, "not a length");
        let Body::Soft(material) = &asset.body else { panic!("soft") };
        assert!((material.grasp_spacing - 1.2e-3).abs() < 1e-12);
        let layer = &asset.visuals[0].layers[0];
        assert_eq!(
            layer.mask,
            Mask::Gradient { axis: [0.0, 0.0, 1.0], from_m: 0.01 * 1.2, to_m: 0.05 * 1.2 }
        );
        assert!((layer.relief_m - 1.2e-4).abs() < 1e-12);
    }

    #[test]
    fn scales_do_not_accumulate_and_a_scale_of_one_is_the_asset_itself() {
        let mut object = ball();
        object.set_scale(0.5);
        object.set_scale(1.2);
        let twice = object.asset.clone();
        let mut once = ball();
        once.set_scale(1.2);
        assert_eq!(twice, once.asset);
        object.set_scale(1.0);
        assert_eq!(object.asset, object.nominal);
        assert_eq!(object.asset.fingerprint(), ball().asset.fingerprint());
    }

    #[test]
    fn changed_materials_survive_the_scale_and_count_as_factors() {
        let mut object = ball();
        let Body::Soft(material) = &mut Arc::make_mut(&mut object.asset).body else { panic!("soft") };
        material.elastic = ElasticMaterial::new(4e4, 0.4, 150.0).expect("valid");
        Arc::make_mut(&mut object.asset).visuals[0].tint([0.5, 1.0, 3.0]);
        object.set_scale(0.9);
        assert_eq!((object.youngs_factor(), object.density_factor()), (Some(2.0), Some(0.5)));
        assert_eq!(object.asset.visuals[0].albedo, [0.25, 0.5, 1.0]);
        assert_eq!(object.asset.visuals[0].layers[0].albedo, [0.45, 0.9, 1.0]);
        assert_ne!(object.asset.fingerprint(), object.nominal.fingerprint());
        Arc::make_mut(&mut object.asset).body = Body::Static;
        assert_eq!((object.youngs_factor(), object.density_factor()), (None, None));
    }
}
