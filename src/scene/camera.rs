//! Camera parameters, and the two cameras of the paper.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Quaternion;
use serde::{Deserialize, Serialize};

use softvt_common::range::Range;
use softvt_geometry::{Pose, Quat, Vec3};

/// Frame to which a camera is attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraMount {
    /// Fixed to the world frame.
    World,
    /// Hand frame of the robot (`panda_hand`).
    Hand,
}

/// A pinhole camera with square pixels and its optical axis at the image centre.
///
/// Camera frame as in OpenGL: view direction −z, +x to the right and +y up in the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name, unique in the scene; part of the names of image streams.
    pub name: String,
    /// Frame to which it is attached.
    pub mount: CameraMount,
    /// Camera frame in the frame of the mount.
    pub pose: Pose,
    /// Vertical field of view, rad.
    pub fovy_rad: f64,
    /// Near clipping distance along the optical axis, m.
    pub near_m: f64,
    /// Far clipping distance along the optical axis, m.
    pub far_m: f64,
    /// Width of the image, pixels.
    pub width: usize,
    /// Height of the image, pixels.
    pub height: usize,
    /// Source location (`file:line`) where a script last set the camera, for messages; `None` for a default camera.
    #[serde(skip)]
    pub set_at: Option<String>,
}

softvt_common::settings! {
    /// Size of the images of all cameras (settings `cameras.*`). The vertical field of view stays.
    #[derive(Copy, Eq)]
    pub struct CameraSettings {
        /// Width, pixels; `None` for that of the scene.
        width: Option<usize> = None, "pixels", Range::closed(1.0, MAX_IMAGE_EDGE);
        /// Height, pixels; `None` for that of the scene.
        height: Option<usize> = None, "pixels", Range::closed(1.0, MAX_IMAGE_EDGE);
    }
}

impl CameraSettings {
    /// Gives all cameras of a scene this size.
    pub fn apply(&self, cameras: &mut [Camera]) {
        for camera in cameras {
            camera.width = self.width.unwrap_or(camera.width);
            camera.height = self.height.unwrap_or(camera.height);
        }
    }
}

/// Largest width and height of an image, pixels.
const MAX_IMAGE_EDGE: f64 = 4096.0;

/// Vertical field of view (rad) of a lens with this focal length and aperture height, both in the same unit.
fn fovy_from_lens(focal: f64, aperture: f64) -> f64 {
    2.0 * (0.5 * aperture / focal).atan()
}

/// Width and height of the default policy images, pixels.
const POLICY_IMAGE_EDGE: usize = 224;

/// Names of the cameras that every scene has: [`Camera::third_person_table`] and [`Camera::wrist`].
pub const STANDARD_CAMERAS: [&str; 2] = ["third_person", "wrist"];
/// Largest number of cameras of a scene; each renders its own images.
pub const MAX_CAMERAS: usize = 64;

impl Camera {
    /// The third-person camera of table scenes (SoftVTBench's environment: focal length 18, aperture 15, table at
    /// z = 0.90 m). Image right is +y of the world.
    pub fn third_person_table() -> Self {
        let at = Vec3::new(0.6586, 0.0, 0.7104);
        Self {
            name: STANDARD_CAMERAS[0].to_owned(),
            mount: CameraMount::World,
            pose: placed(at, Quaternion::new(0.6380, 0.3048, 0.3048, 0.6380)),
            fovy_rad: fovy_from_lens(18.0, 15.0),
            near_m: 0.05,
            far_m: 20.0,
            width: POLICY_IMAGE_EDGE,
            height: POLICY_IMAGE_EDGE,
            set_at: None,
        }
    }

    /// The wrist camera on the hand (SoftVTBench's environment: focal length 9.77, aperture 15). Image right
    /// is the hand's +y.
    pub fn wrist() -> Self {
        Self {
            name: STANDARD_CAMERAS[1].to_owned(),
            mount: CameraMount::Hand,
            pose: placed(Vec3::new(0.05, 0.0, 0.0), Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0)),
            fovy_rad: fovy_from_lens(9.77, 15.0),
            near_m: 0.01,
            ..Self::third_person_table()
        }
    }

    /// Intrinsic matrix, pixels, for the axes of OpenCV: x to the right, y down, z forward. The image begins at (0, 0),
    /// so that the centre of its first pixel is at (0.5, 0.5).
    pub fn intrinsic(&self) -> [[f64; 3]; 3] {
        let focal = 0.5 * self.height as f64 / (0.5 * self.fovy_rad).tan();
        [[focal, 0.0, 0.5 * self.width as f64], [0.0, focal, 0.5 * self.height as f64], [0.0, 0.0, 1.0]]
    }

    /// True if a ball may be in the image, given its centre in the frame of the camera and its radius, m.
    pub fn can_show(&self, centre_c: &Vec3, radius: f64) -> bool {
        let depth = -centre_c.z;
        let half_height = (0.5 * self.fovy_rad).tan();
        let half_width = half_height * self.width as f64 / self.height as f64;
        // Distance from the plane through the camera and an edge of the image.
        let is_beyond = |along: f64, slope: f64| along.abs() - slope * depth > radius * slope.hypot(1.0);
        depth + radius > self.near_m
            && depth - radius < self.far_m
            && !is_beyond(centre_c.x, half_width)
            && !is_beyond(centre_c.y, half_height)
    }

    /// The same camera with a square image of `edge` pixels.
    #[must_use]
    pub fn with_edge(mut self, edge: usize) -> Self {
        (self.width, self.height) = (edge, edge);
        self
    }
}

fn placed(at: Vec3, rotation: Quaternion<f64>) -> Pose {
    Pose::from_parts(at.into(), Quat::from_quaternion(rotation))
}
