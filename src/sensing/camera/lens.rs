//! Pinhole projection of a posed camera, and validation of camera settings.

use nalgebra::Matrix3;

use super::{
    error::CameraError,
    math::{V3, Vec3x8, f32x8, is_finite},
};
use softvt_geometry::Pose;
use softvt_scene::{Camera, CameraMount, MAX_CAMERAS};

/// Maximum width and height of an image, pixels.
const MAX_EDGE: usize = 4096;
/// Maximum number of pixels of all cameras of a scene together: a cached background takes about 100 bytes per pixel.
const MAX_TOTAL_PIXELS: usize = MAX_EDGE * MAX_EDGE;
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
    /// Rotation from the world to the camera frame.
    to_view: Matrix3<f32>,
    /// Ray through the top left corner of the image, world, scaled so that its depth along the optical axis is 1.
    corner: V3,
    /// Change of the ray per pixel to the right.
    pub(crate) right: V3,
    /// Change of the ray per pixel downwards.
    pub(crate) down: V3,
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
    let require = |is_valid: bool, field, expected: &str, got: String| {
        if is_valid { Ok(()) } else { Err(field_error(camera, field, expected, got)) }
    };
    for (field, edge) in [("width", camera.width), ("height", camera.height)] {
        let expected = format!("1 to {MAX_EDGE} pixels");
        require((1..=MAX_EDGE).contains(&edge), field, &expected, edge.to_string())?;
    }
    // Comparisons with NaN are false.
    let (fovy, near, far) = (camera.fovy_rad, camera.near_m, camera.far_m);
    let is_valid = (0.01..=2.8).contains(&fovy);
    require(is_valid, "fovy", "0.01 to 2.8 rad (0.6° to 160°)", format!("{fovy} rad"))?;
    let is_valid = near >= 1e-4 && near.is_finite();
    require(is_valid, "near", "at least 0.0001 m", format!("{near} m"))?;
    let is_valid = far > near && far.is_finite();
    require(is_valid, "far", &format!("more than near ({near} m)"), format!("{far} m"))?;
    let (position, rotation) = (&camera.pose.translation.vector, &camera.pose.rotation.coords);
    let is_valid = position.iter().all(|x| x.abs() <= MAX_COORDINATE);
    require(is_valid, "position", "metres within ±1e6", format!("{:?}", position.as_slice()))?;
    let is_valid = (0.999..=1.001).contains(&rotation.norm());
    require(is_valid, "quat", "a unit quaternion", format!("{:?} (x, y, z, w)", rotation.as_slice()))
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
        let focal = (0.5 * camera.height as f64 / (0.5 * camera.fovy_rad).tan()) as f32;
        let to_world: Matrix3<f32> = pose.rotation.to_rotation_matrix().matrix().cast();
        let (pixel, slope) = (1.0 / focal, |edge: usize| 0.5 * edge as f32 / focal);
        Ok(Self {
            width: camera.width,
            height: camera.height,
            near: camera.near_m as f32,
            far: camera.far_m as f32,
            focal,
            eye: pose.translation.vector.cast(),
            to_view: pose.inverse().rotation.to_rotation_matrix().matrix().cast(),
            corner: to_world * V3::new(-slope(camera.width), slope(camera.height), -1.0),
            right: to_world * V3::new(pixel, 0.0, 0.0),
            down: to_world * V3::new(0.0, -pixel, 0.0),
        })
    }

    fn in_camera_frame(&self, p_w: &V3) -> V3 {
        // Subtracting the eye first keeps the precision of points near a camera that is far from the origin.
        self.to_view * (p_w - self.eye)
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

    /// The ray through the point (x, y) of the image, world, of depth 1, to 1e-7 of its length: a tenth of a pixel at
    /// the narrowest field of view, and a thousandth at a usual one.
    #[inline(always)]
    pub(crate) fn ray(&self, x: f32, y: f32) -> V3 {
        self.corner + self.right * x + self.down * y
    }

    /// The rays through eight points (x, y), as [`ray`](Self::ray).
    #[inline(always)]
    pub(crate) fn rays(&self, x: f32x8, y: f32x8) -> Vec3x8 {
        let [corner, right, down] = [&self.corner, &self.right, &self.down].map(Vec3x8::splat);
        corner + right * x + down * y
    }

    /// z components of the unit vectors along the rays through eight points (x, y).
    pub(crate) fn ray_direction_z(&self, x: f32x8, y: f32x8) -> f32x8 {
        self.rays(x, y).normalized().z
    }

    /// Depth of a point of the world along the optical axis, m.
    pub(crate) fn depth(&self, p_w: &V3) -> f32 {
        -self.in_camera_frame(p_w).z
    }

    /// False if all points lie more than `margin` outside one side of the view frustum, m.
    pub(crate) fn may_see_any(&self, points: &[V3], margin: f32) -> bool {
        let [x, y] = [self.width, self.height].map(|edge| 0.5 * edge as f32 / self.focal);
        let [nx, ny] = [x, y].map(|slope| 1.0 / (1.0 + slope * slope).sqrt());
        // Inward unit normals in the camera frame, which looks along −z.
        let sides = [
            V3::new(nx, 0.0, -x * nx),
            V3::new(-nx, 0.0, -x * nx),
            V3::new(0.0, ny, -y * ny),
            V3::new(0.0, -ny, -y * ny),
            -V3::z(),
        ];
        let to_world = self.to_view.transpose();
        sides.iter().all(|side| {
            let normal = to_world * side;
            let offset = normal.dot(&self.eye) - margin;
            points.iter().any(|p| normal.dot(p) >= offset)
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_beside_the_view_is_out_of_it_though_its_bounding_ball_is_not() {
        let camera = Camera { pose: Pose::identity(), ..Camera::third_person_table() };
        let lens = Lens::new(&camera, None).expect("a good camera");
        let half = 0.5 * camera.width as f32 / lens.focal;
        // A rod along the line of sight, and the same rod shifted until it meets the right side of the view.
        let rod = |x: f32| [V3::new(x, 0.0, 0.5), V3::new(x, 0.0, -0.5)];
        let radius = 0.5;
        for (x, is_seen) in [(0.0, true), (0.49 * half, true), (0.55 * half, false), (-0.55 * half, false)] {
            assert!(lens.may_see(&V3::new(x, 0.0, 0.0), radius), "{x}");
            assert_eq!(lens.may_see_any(&rod(x), 0.0), is_seen, "{x}");
            assert!(lens.may_see_any(&rod(x), 0.1), "{x}: within the margin");
        }
        assert!(!lens.may_see_any(&[V3::new(0.0, 0.0, 0.2), V3::new(0.1, 0.0, 0.3)], 0.1), "behind");
    }
}
