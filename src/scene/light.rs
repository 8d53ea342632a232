//! Lighting parameters: a key light, a sky, and the exposure.

use serde::{Deserialize, Serialize};

use softvt_geometry::Vec3;

/// A distant light source with soft shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyLight {
    /// Direction towards the light, world frame; any length.
    pub direction_w: Vec3,
    /// Colour, linear RGB.
    pub colour: [f64; 3],
    /// Irradiance on a surface that faces the light, relative to π: at 1 and exposure 1 a white diffuse
    /// surface has radiance 1.
    pub strength: f64,
    /// Angular radius of the light source, rad; determines how fast shadows soften with distance.
    pub softness_rad: f64,
}

/// Environment light from all directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Radiance from straight above, linear RGB.
    pub zenith: [f64; 3],
    /// Radiance from the horizon, linear RGB; also the colour of empty background.
    pub horizon: [f64; 3],
    /// Radiance from straight below, linear RGB.
    pub ground: [f64; 3],
    /// Factor on the three colours.
    pub strength: f64,
}

/// Lighting of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lighting {
    /// Key light, the only one that casts shadows.
    pub key: KeyLight,
    /// Environment light from all directions.
    pub sky: Sky,
    /// Factor on the radiance that reaches the camera, before tone mapping.
    pub exposure: f64,
    /// Centre of the shadow sphere, world frame, m. Moving objects cast shadows only inside of it, and shadows of fixed
    /// objects have full resolution only inside of it.
    pub shadow_centre_w: Vec3,
    /// Radius of the shadow sphere, m.
    pub shadow_radius_m: f64,
}

impl Default for Lighting {
    /// A large lamp, high on the left of the third-person camera, in bright surroundings.
    fn default() -> Self {
        Self {
            key: KeyLight {
                direction_w: Vec3::new(0.45, -0.55, 1.0),
                colour: [1.0, 0.95, 0.87],
                strength: 0.92,
                softness_rad: 0.06,
            },
            sky: Sky {
                zenith: [0.97, 0.98, 1.02],
                horizon: [0.66, 0.67, 0.70],
                ground: [0.36, 0.30, 0.25],
                strength: 0.52,
            },
            exposure: 1.0,
            shadow_centre_w: Vec3::new(-0.15, 0.0, 0.15),
            shadow_radius_m: 0.85,
        }
    }
}
