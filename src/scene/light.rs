//! Light as plain data: one key light, a sky, and the exposure.

use serde::{Deserialize, Serialize};

use crate::geometry::Vec3;

/// A far light with soft shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyLight {
    /// Direction to the light, world; any length.
    pub direction_w: Vec3,
    /// Colour, linear RGB.
    pub colour: [f64; 3],
    /// Irradiance on a surface that faces it; 1 shows white at full value for exposure 1 (that is π of radiance).
    pub strength: f64,
    /// Half the angle under which it is seen, rad: how fast shadows soften with distance.
    pub softness_rad: f64,
}

/// Light from everywhere else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// From straight above, linear RGB.
    pub zenith: [f64; 3],
    /// From the horizon, linear RGB; also what is seen where nothing is.
    pub horizon: [f64; 3],
    /// From straight below, linear RGB.
    pub ground: [f64; 3],
    /// Factor on all of it.
    pub strength: f64,
}

/// All light of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lighting {
    /// The key light.
    pub key: KeyLight,
    /// Everything else.
    pub sky: Sky,
    /// Factor on what reaches the camera, before tone mapping.
    pub exposure: f64,
    /// Middle of the ball in which what moves casts shadows, and in which those of fixed things are fine, world, m.
    pub shadow_centre_w: Vec3,
    /// Radius of that ball, m.
    pub shadow_radius_m: f64,
}

impl Default for Lighting {
    /// A large lamp high on the camera's left and a bright room.
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
