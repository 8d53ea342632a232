//! Cameras as plain data, and the two that the paper uses.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Quaternion;
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, Quat, Vec3};

/// What a camera is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraMount {
    /// The world.
    World,
    /// The robot's hand frame (`panda_hand`).
    Hand,
}

/// A pinhole camera with square pixels. Its frame is OpenGL's: it looks along −z, +y is up in the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name, as in a stream's name.
    pub name: String,
    /// What it is fixed to.
    pub mount: CameraMount,
    /// Camera frame in the frame of the mount.
    pub pose: Pose,
    /// Vertical field of view, rad.
    pub fovy_rad: f64,
    /// Nothing nearer is seen, m along the optical axis.
    pub near_m: f64,
    /// Nothing farther is seen, m along the optical axis.
    pub far_m: f64,
    /// Width of the image, pixels.
    pub width: usize,
    /// Height of the image, pixels.
    pub height: usize,
    /// Where a script last set it, as messages name a place (`file:line`); `None` for one that no script touched.
    #[serde(skip)]
    pub set_at: Option<String>,
}

/// Vertical field of view, rad, of a lens of some focal length behind an aperture of some height (one unit for both).
pub fn fovy_from_lens(focal: f64, aperture: f64) -> f64 {
    2.0 * (0.5 * aperture / focal).atan()
}

/// Edge of the images that a policy sees, pixels.
pub const POLICY_IMAGE_EDGE: usize = 224;

impl Camera {
    /// The third-person camera over the table (SoftVTBench's environment: focal 18, aperture 15, its table at
    /// z = 0.90 m). Image right is +y of the world.
    pub fn third_person_table() -> Self {
        Self::third_person(Vec3::new(0.6586, 0.0, 0.7104), [0.6380, 0.3048, 0.3048, 0.6380])
    }

    /// The third-person camera over the floor, for scenes whose robot stands on it.
    pub fn third_person_floor() -> Self {
        Self::third_person(Vec3::new(0.8966, 0.0, 0.65), [0.6182, 0.3432, 0.3432, 0.6182])
    }

    /// The camera on the hand (SoftVTBench's environment: focal 9.77, aperture 15). Image right is the hand's +y.
    pub fn wrist() -> Self {
        Self {
            name: "wrist".to_owned(),
            mount: CameraMount::Hand,
            pose: placed(Vec3::new(0.05, 0.0, 0.0), [0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0]),
            fovy_rad: fovy_from_lens(9.77, 15.0),
            near_m: 0.01,
            far_m: 20.0,
            width: POLICY_IMAGE_EDGE,
            height: POLICY_IMAGE_EDGE,
            set_at: None,
        }
    }

    fn third_person(eye_w: Vec3, wxyz: [f64; 4]) -> Self {
        Self {
            name: "third_person".to_owned(),
            mount: CameraMount::World,
            pose: placed(eye_w, wxyz),
            fovy_rad: fovy_from_lens(18.0, 15.0),
            near_m: 0.05,
            far_m: 20.0,
            width: POLICY_IMAGE_EDGE,
            height: POLICY_IMAGE_EDGE,
            set_at: None,
        }
    }

    /// The same camera with a square image of another edge, pixels.
    #[must_use]
    pub fn with_edge(mut self, edge: usize) -> Self {
        (self.width, self.height) = (edge, edge);
        self
    }
}

fn placed(at: Vec3, [w, x, y, z]: [f64; 4]) -> Pose {
    Pose::from_parts(at.into(), Quat::from_quaternion(Quaternion::new(w, x, y, z)))
}
