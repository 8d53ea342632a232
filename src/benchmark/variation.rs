//! Variation of the soft objects, the light and the cameras of a suite from episode to episode.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::seed::{EpisodeSeed, RandomStream, uniform};
use softvt_scene::{CameraVariation, LightVariation, ObjectVariation, Scene, SceneVariation};

/// Ends of the range of a factor; both are positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FactorRange {
    /// Smallest factor.
    pub min: f64,
    /// Largest factor.
    pub max: f64,
}

impl FactorRange {
    /// The range of a factor that changes nothing.
    pub const ONE: Self = Self { min: 1.0, max: 1.0 };

    fn uniform(self, rng: &mut ChaCha8Rng) -> f64 {
        self.min + (self.max - self.min) * uniform(rng)
    }

    /// Log-uniform: a half is as likely as a double.
    fn log_uniform(self, rng: &mut ChaCha8Rng) -> f64 {
        self.min * (self.max / self.min).powf(uniform(rng))
    }
}

/// Ranges from which the objects, the light and the cameras of an episode are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariationRanges {
    /// Name in results.
    pub name: String,
    /// Size of a soft object, uniform.
    pub size: FactorRange,
    /// Young's modulus of a soft object, log-uniform.
    pub stiffness: FactorRange,
    /// Density of a soft object, log-uniform.
    pub density: FactorRange,
    /// Friction of a soft object, log-uniform.
    pub friction: FactorRange,
    /// Largest relative change of each colour channel of a soft object.
    pub colour: f64,
    /// Strength of lamp and sky, log-uniform.
    pub light: FactorRange,
    /// Largest displacement of a camera along each of its axes, m.
    pub camera_offset_m: f64,
    /// Largest rotation of a camera about each of its axes, rad.
    pub camera_rotation_rad: f64,
}

impl VariationRanges {
    /// Draws the variation of an episode. Each factor has a stream of its own, except stiffness, density and friction,
    /// which are drawn from that of the material. Soft objects are drawn in the order of the scene.
    pub fn draw(&self, seed: &EpisodeSeed, scene: &Scene) -> SceneVariation {
        let [mut size, mut material, mut colour, mut light, mut camera] = [
            RandomStream::Size,
            RandomStream::Material,
            RandomStream::Colour,
            RandomStream::Light,
            RandomStream::Camera,
        ]
        .map(|stream| seed.stream(stream));
        let around_zero = |rng: &mut ChaCha8Rng, most: f64| most * (2.0 * uniform(rng) - 1.0);
        let mut objects = BTreeMap::new();
        for object in scene.objects.iter().filter(|object| SceneVariation::applies_to(&object.asset.body)) {
            let drawn = ObjectVariation {
                scale: self.size.uniform(&mut size),
                youngs_factor: self.stiffness.log_uniform(&mut material),
                density_factor: self.density.log_uniform(&mut material),
                friction_factor: self.friction.log_uniform(&mut material),
                colour: std::array::from_fn(|_| 1.0 + around_zero(&mut colour, self.colour)),
            };
            objects.insert(object.name.clone(), drawn);
        }
        let mut cameras = BTreeMap::new();
        for moved in scene.cameras.iter().filter(|camera| SceneVariation::moves(camera.mount)) {
            let drawn = CameraVariation {
                offset_m: std::array::from_fn(|_| around_zero(&mut camera, self.camera_offset_m)),
                rotation_rad: std::array::from_fn(|_| around_zero(&mut camera, self.camera_rotation_rad)),
            };
            cameras.insert(moved.name.clone(), drawn);
        }
        let light = LightVariation { strength: self.light.log_uniform(&mut light) };
        SceneVariation { objects, light, cameras }
    }
}
