//! Pinhole projection of a posed camera, and validation of camera settings.

use crate::{
    geometry::Pose,
    scene::{Camera, CameraMount},
    sensing::camera::{
        CameraError,
        math::{RigidTransform, V3, is_finite},
    },
};

/// Maximum width and height of an image, pixels.
const MAX_EDGE: usize = 4096;
/// Maximum number of pixels of all cameras of a scene together: a cached background takes about 100 bytes per pixel.
const MAX_TOTAL_PIXELS: usize = MAX_EDGE * MAX_EDGE;
/// Maximum number of cameras of a scene.
const MAX_CAMERAS: usize = 64;
/// Maximum distance of a camera from the origin along each axis, m. Farther out, single precision does
/// not resolve a pixel.
const MAX_COORDINATE: f64 = 1e6;

/// A camera at its pose in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) near: f32,
    pub(crate) far: f32,
    /// Focal length, pixels.
    pub(crate) focal: f32,
    /// Position of the camera, world, m.
    pub(crate) eye: V3,
    to_view: RigidTransform,
    to_world: RigidTransform,
}

/// A vertex projected into the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenVertex {
    /// Pixels from the left edge of the image.
    pub(crate) x: f32,
    /// Pixels from the top edge of the image.
    pub(crate) y: f32,
    /// Reciprocal depth, 1/m.
    pub(crate) w: f32,
    /// Position in the camera frame, m.
    pub(crate) view: V3,
}

/// The rays through the pixels of an image, in the world frame: `origin + x · right + y · down` is the ray through
/// (x, y), scaled so that its depth along the optical axis is 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayBasis {
    /// Ray through the top left corner of the image.
    pub(crate) corner: V3,
    /// Change of the ray per pixel to the right.
    pub(crate) right: V3,
    /// Change of the ray per pixel downwards.
    pub(crate) down: V3,
}

fn field_error(camera: &Camera, field: &'static str, expected: &str, got: String) -> CameraError {
    CameraError::Field { camera: camera.name.clone(), field, expected: expected.to_owned(), got }
}

/// Validates the settings of all cameras of a scene, which needs no state of the simulation.
///
/// # Errors
/// Returns the index of the first camera with a setting out of range, or with which the scene exceeds the limits on the
/// number of cameras and pixels.
pub fn check_cameras(cameras: &[Camera]) -> Result<(), (usize, CameraError)> {
    let mut pixels = 0_usize;
    for (index, camera) in cameras.iter().enumerate() {
        let at_index = |error| (index, error);
        check_camera(camera).map_err(at_index)?;
        if index == MAX_CAMERAS {
            let expected = format!("at most {MAX_CAMERAS} cameras in a scene");
            return Err(at_index(field_error(camera, "name", &expected, cameras.len().to_string())));
        }
        pixels += camera.width * camera.height;
        if pixels > MAX_TOTAL_PIXELS {
            let expected = format!("at most {MAX_TOTAL_PIXELS} pixels in all cameras of a scene together");
            let got = format!("{pixels} up to this one");
            return Err(at_index(field_error(camera, "width and height", &expected, got)));
        }
    }
    Ok(())
}

fn check_camera(camera: &Camera) -> Result<(), CameraError> {
    let fail = |field, expected: &str, got: String| Err(field_error(camera, field, expected, got));
    for (field, edge) in [("width", camera.width), ("height", camera.height)] {
        if !(1..=MAX_EDGE).contains(&edge) {
            return fail(field, &format!("1 to {MAX_EDGE} pixels"), edge.to_string());
        }
    }
    if !(camera.fovy_rad >= 0.01 && camera.fovy_rad <= 2.8) {
        return fail("fovy", "0.01 to 2.8 rad (0.6° to 160°)", format!("{} rad", camera.fovy_rad));
    }
    if !(camera.near_m >= 1e-4 && camera.near_m.is_finite()) {
        return fail("near", "at least 0.0001 m", format!("{} m", camera.near_m));
    }
    if !(camera.far_m > camera.near_m && camera.far_m.is_finite()) {
        let expected = format!("more than near ({} m)", camera.near_m);
        return fail("far", &expected, format!("{} m", camera.far_m));
    }
    let (position, rotation) = (&camera.pose.translation.vector, &camera.pose.rotation.coords);
    if !position.iter().all(|x| x.abs() <= MAX_COORDINATE) {
        return fail("position", "metres within ±1e6", format!("{:?}", position.as_slice()));
    }
    // Also false for NaN.
    if !(0.999..=1.001).contains(&rotation.norm()) {
        return fail("quat", "a unit quaternion", format!("{:?} (x, y, z, w)", rotation.as_slice()));
    }
    Ok(())
}

impl Lens {
    /// Places `camera` in the world; `hand_w` is the pose of the hand frame for cameras mounted on it.
    pub(crate) fn new(camera: &Camera, hand_w: Option<Pose>) -> Result<Self, CameraError> {
        check_camera(camera)?;
        let mount_error = |expected: &str, got: &str| field_error(camera, "mount", expected, got.to_owned());
        let pose: Pose = match camera.mount {
            CameraMount::World => camera.pose,
            CameraMount::Hand => {
                let hand =
                    hand_w.ok_or_else(|| mount_error("a hand in the state", "a state without a robot"))?;
                hand * camera.pose
            }
        };
        if !is_finite(&pose) {
            return Err(mount_error("a finite hand pose", "NaN or infinity"));
        }
        Ok(Self {
            width: camera.width,
            height: camera.height,
            near: camera.near_m as f32,
            far: camera.far_m as f32,
            focal: (0.5 * camera.height as f64 / (0.5 * camera.fovy_rad).tan()) as f32,
            eye: pose.translation.vector.cast(),
            to_view: RigidTransform::from_pose(&pose.inverse()),
            to_world: RigidTransform::from_pose(&pose),
        })
    }

    fn in_camera_frame(&self, p_w: &V3) -> V3 {
        // Subtracting the eye first keeps the precision of points near a camera that is far from the origin.
        self.to_view.rotate(&(p_w - self.eye))
    }

    /// Projects a point of the world.
    pub(crate) fn project(&self, p_w: &V3) -> ScreenVertex {
        self.project_view(self.in_camera_frame(p_w))
    }

    /// Projects a point of the camera frame.
    pub(crate) fn project_view(&self, view: V3) -> ScreenVertex {
        let w = -1.0 / view.z;
        let scale = self.focal * w;
        let middle = |edge: usize| 0.5 * edge as f32;
        ScreenVertex {
            x: middle(self.width) + scale * view.x,
            y: middle(self.height) - scale * view.y,
            w,
            view,
        }
    }

    /// Returns the rays through the pixels.
    pub(crate) fn rays(&self) -> RayBasis {
        let slope = |edge: usize| 0.5 * edge as f32 / self.focal;
        let pixel = 1.0 / self.focal;
        let [corner, right, down] = [
            V3::new(-slope(self.width), slope(self.height), -1.0),
            V3::new(pixel, 0.0, 0.0),
            V3::new(0.0, -pixel, 0.0),
        ]
        .map(|v| self.to_world.rotate(&v));
        RayBasis { corner, right, down }
    }

    /// Depth of a point of the world along the optical axis, m.
    pub(crate) fn depth(&self, p_w: &V3) -> f32 {
        -self.in_camera_frame(p_w).z
    }

    /// False if a ball lies wholly outside the view frustum.
    pub(crate) fn may_see(&self, centre: &V3, radius: f32) -> bool {
        let c = self.in_camera_frame(centre);
        let is_inside = |along: f32, edge: usize| {
            let half = 0.5 * edge as f32 / self.focal;
            (along.abs() + c.z * half) < radius * (1.0 + half * half).sqrt()
        };
        -c.z + radius > self.near && is_inside(c.x, self.width) && is_inside(c.y, self.height)
    }
}
