//! What the variation of a suite changed in the scene of an episode. Only records and experts see it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use softvt_common::range::RangeError;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_physics::contact::Friction;

use super::{Body, CameraMount, Object, Scene};
use std::sync::Arc;

/// Factors that make an instance of an asset another object of the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectVariation {
    /// Factor on its size.
    pub scale: f64,
    /// Factor on Young's modulus.
    pub youngs_factor: f64,
    /// Factor on the density.
    pub density_factor: f64,
    /// Factor on both coefficients of friction.
    pub friction_factor: f64,
    /// Factors on the colours, linear RGB.
    pub colour: [f64; 3],
    /// Properties that do not show, whose effects on stiffness and density the factors above contain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hidden: Option<HiddenProperties>,
}

impl ObjectVariation {
    /// Changes an object. Sizes and material numbers are multiplied.
    ///
    /// # Errors
    /// A product is out of the range of the material.
    pub fn apply(&self, object: &mut Object) -> Result<(), RangeError> {
        object.set_scale(object.scale * self.scale);
        let asset = Arc::make_mut(&mut object.asset);
        asset.friction.static_mu *= self.friction_factor;
        asset.friction.dynamic_mu *= self.friction_factor;
        if let Body::Soft(material) = &mut asset.body {
            let nominal = material.elastic;
            material.elastic = nominal
                .with_youngs_pa(nominal.youngs_pa() * self.youngs_factor)?
                .with_density(nominal.density() * self.density_factor)?;
            if let Some(hidden) = self.hidden {
                let strains = [&mut material.collapse_strain, &mut material.damage_strain];
                strains.into_iter().flatten().for_each(|strain| *strain *= hidden.strain_factor);
                asset.friction = Friction::coated(hidden.coating);
            }
        }
        asset.visuals.iter_mut().for_each(|visual| visual.tint(self.colour));
        Ok(())
    }
}

/// Properties of a soft object that do not show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HiddenProperties {
    /// Relative density of the foam: a factor on the density, and by its square on Young's modulus.
    pub aeration: f64,
    /// Factor on Young's modulus by age.
    pub staling: f64,
    /// Factor on the collapse and the damage strain by age.
    pub strain_factor: f64,
    /// Factor on the mass.
    pub filling: f64,
    /// Static friction of every pair with the object.
    pub coating: f64,
    /// Largest over smallest safe grip force, by the calibration of the asset; 1 where no grip is safe.
    pub window_ratio: f64,
    /// Number of draws until this one was kept.
    pub draws: u32,
}

/// Factors on the light of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightVariation {
    /// Factor on the strength of lamp and sky.
    pub strength: f64,
}

/// Displacement of a camera in its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraVariation {
    /// Translation, m.
    pub offset_m: [f64; 3],
    /// Rotation, as an axis times an angle in rad.
    pub rotation_rad: [f64; 3],
}

/// Changes of a scene by a variation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneVariation {
    /// By name in the scene.
    pub objects: BTreeMap<String, ObjectVariation>,
    /// Factors on the light.
    pub light: LightVariation,
    /// By name of the camera.
    pub cameras: BTreeMap<String, CameraVariation>,
}

impl SceneVariation {
    /// True if a variation may change the object: it is a soft body.
    pub fn applies_to(body: &Body) -> bool {
        matches!(body, Body::Soft(_))
    }

    /// True if a variation may move a camera with this mount: the one on the hand is calibrated.
    pub fn moves(mount: CameraMount) -> bool {
        mount == CameraMount::World
    }

    /// Changes the scene. Sizes and material numbers are multiplied, so that those of the layout still count. Names
    /// that the scene does not contain are ignored.
    ///
    /// # Errors
    /// As [`ObjectVariation::apply`].
    pub fn apply(&self, scene: &mut Scene) -> Result<(), RangeError> {
        for object in &mut scene.objects {
            let Some(drawn) = self.objects.get(&object.name) else { continue };
            drawn.apply(object)?;
        }
        scene.lighting.key.strength *= self.light.strength;
        scene.lighting.sky.strength *= self.light.strength;
        for camera in &mut scene.cameras {
            let Some(drawn) = self.cameras.get(&camera.name) else { continue };
            let turn = Quat::from_scaled_axis(Vec3::from(drawn.rotation_rad));
            camera.pose *= Pose::from_parts(Vec3::from(drawn.offset_m).into(), turn);
        }
        Ok(())
    }
}
