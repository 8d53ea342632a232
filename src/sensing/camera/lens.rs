//! A camera in its place: checks, and the way from the world to the image.

use crate::sensing::camera::{CameraError, FrameView, V3, raster::binning::Seen, scene::pose::Rigid};
use crate::{
    geometry::Pose,
    scene::{Camera, CameraMount},
};

/// Largest edge of an image, pixels.
const MOST_EDGE: usize = 4096;
/// Most pixels of all cameras of a scene together: their kept backgrounds take a hundred bytes a pixel.
const MOST_PIXELS: usize = MOST_EDGE * MOST_EDGE;
/// Most cameras of a scene.
const MOST_CAMERAS: usize = 64;

/// A camera in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    pub width: usize,
    pub height: usize,
    pub near: f32,
    pub far: f32,
    /// Pixels a unit of slope.
    pub focal: f32,
    pub eye: V3,
    to_view: Rigid,
    to_world: Rigid,
}

/// That `camera` has something else in `field` than it may.
fn wrong(camera: &Camera, field: &'static str, expected: &str, got: String) -> CameraError {
    CameraError::Field { camera: camera.name.clone(), field, expected: expected.to_owned(), got }
}

/// Checks the numbers of a scene's cameras, each by itself and all together; no state is needed.
///
/// # Errors
/// The first camera with a number out of its range, or that is one too many or too large beside those before it.
pub fn check_cameras(cameras: &[Camera]) -> Result<(), (usize, CameraError)> {
    let mut pixels = 0_usize;
    for (index, camera) in cameras.iter().enumerate() {
        let fault = |e| (index, e);
        check(camera).map_err(fault)?;
        if index == MOST_CAMERAS {
            let expected = format!("at most {MOST_CAMERAS} cameras in a scene");
            return Err(fault(wrong(camera, "name", &expected, format!("{} of them", cameras.len()))));
        }
        pixels += camera.width * camera.height;
        if pixels > MOST_PIXELS {
            let expected = format!("at most {MOST_PIXELS} pixels in all cameras of a scene together");
            return Err(fault(wrong(
                camera,
                "width and height",
                &expected,
                format!("{pixels} up to this one"),
            )));
        }
    }
    Ok(())
}

/// Checks the numbers of a camera.
fn check(camera: &Camera) -> Result<(), CameraError> {
    let wrong = |field, expected: &str, got: String| Err(wrong(camera, field, expected, got));
    for (field, edge) in [("width", camera.width), ("height", camera.height)] {
        if !(1..=MOST_EDGE).contains(&edge) {
            return wrong(field, &format!("1 to {MOST_EDGE} pixels"), edge.to_string());
        }
    }
    if !(camera.fovy_rad >= 0.01 && camera.fovy_rad <= 2.8) {
        let expected = "0.01 to 2.8 rad (0.6° to 160°)";
        return wrong("fovy", expected, format!("{} rad", camera.fovy_rad));
    }
    if !(camera.near_m >= 1e-4 && camera.near_m.is_finite()) {
        return wrong("near", "at least 0.0001 m", format!("{} m", camera.near_m));
    }
    if !(camera.far_m > camera.near_m && camera.far_m.is_finite()) {
        let expected = format!("more than near ({} m)", camera.near_m);
        return wrong("far", &expected, format!("{} m", camera.far_m));
    }
    let (place, turn) = (&camera.pose.translation.vector, &camera.pose.rotation.coords);
    // Beyond, single precision cannot tell a pixel from the next.
    if !place.iter().all(|x| x.abs() <= 1e6) {
        return wrong("position", "metres within ±1e6", format!("{:?}", place.as_slice()));
    }
    // A turn that is no number has no norm either.
    if !(0.999..=1.001).contains(&turn.norm()) {
        return wrong("quat", "a unit quaternion", format!("{:?} (x, y, z, w)", turn.as_slice()));
    }
    Ok(())
}

impl Lens {
    /// `camera` where `view` has it.
    pub(crate) fn new(camera: &Camera, view: &FrameView) -> Result<Self, CameraError> {
        check(camera)?;
        let pose: Pose = match camera.mount {
            CameraMount::World => camera.pose,
            CameraMount::Hand => {
                let hand = view.hand_w.ok_or_else(|| CameraError::Field {
                    camera: camera.name.clone(),
                    field: "mount",
                    expected: "a hand in the state".to_owned(),
                    got: "a state without a robot".to_owned(),
                })?;
                hand * camera.pose
            }
        };
        if !pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite()) {
            return Err(CameraError::Field {
                camera: camera.name.clone(),
                field: "mount",
                expected: "a finite hand pose".to_owned(),
                got: "one that is not a number".to_owned(),
            });
        }
        Ok(Self {
            width: camera.width,
            height: camera.height,
            near: camera.near_m as f32,
            far: camera.far_m as f32,
            focal: (0.5 * camera.height as f64 / (0.5 * camera.fovy_rad).tan()) as f32,
            eye: pose.translation.vector.cast(),
            to_view: Rigid::of(&pose.inverse()),
            to_world: Rigid::of(&pose),
        })
    }

    pub(crate) fn see(&self, p_w: &V3) -> Seen {
        self.project(self.to_view.turn(&(p_w - self.eye)))
    }

    /// The image of a point of the camera frame.
    pub(crate) fn project(&self, view: V3) -> Seen {
        let w = -1.0 / view.z;
        let scale = self.focal * w;
        let middle = |edge: usize| 0.5 * edge as f32;
        Seen { x: middle(self.width) + scale * view.x, y: middle(self.height) - scale * view.y, w, view }
    }

    /// The ray through the top left of the image, world, as long as a unit along the axis; and what it changes by a pixel
    /// to the right, and a pixel down.
    pub(crate) fn rays(&self) -> [V3; 3] {
        let slope = |edge: usize| 0.5 * edge as f32 / self.focal;
        let pixel = 1.0 / self.focal;
        [
            V3::new(-slope(self.width), slope(self.height), -1.0),
            V3::new(pixel, 0.0, 0.0),
            V3::new(0.0, -pixel, 0.0),
        ]
        .map(|v| self.to_world.turn(&v))
    }

    /// Depth along the axis of a point of the world, m.
    pub(crate) fn depth(&self, p_w: &V3) -> f32 {
        -self.to_view.turn(&(p_w - self.eye)).z
    }

    /// Whether a ball can be in the image.
    pub(crate) fn may_see(&self, centre: &V3, radius: f32) -> bool {
        let c = self.to_view.turn(&(centre - self.eye));
        let inside = |along: f32, edge: usize| {
            let half = 0.5 * edge as f32 / self.focal;
            (along.abs() + c.z * half) < radius * (1.0 + half * half).sqrt()
        };
        -c.z + radius > self.near && inside(c.x, self.width) && inside(c.y, self.height)
    }
}
