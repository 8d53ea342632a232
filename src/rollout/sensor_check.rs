//! What of the sensors can be told to be wrong before anything runs, and how their pictures are called.

use super::{
    sensor_assets::SensorAssets,
    sensors::{SensingError, SensorSuite},
};
use crate::{
    geometry::Pose,
    physics::world::Frame,
    policy::SensorStreams,
    scene::{Camera, CameraMount, Scene},
    sensing::{
        camera::{CameraError, Renderer, check_cameras, check_light},
        tactile::{OpticsModel, TactileSpec},
    },
};

/// What is added to a camera's name for its picture, its depth and its segmentation.
pub const CAMERA_IMAGE_SUFFIXES: [&str; 3] = ["", "_depth", "_segmentation"];
/// What is added to a finger's name for its picture, and for the picture with its markers as dots and as arrows.
pub const TACTILE_IMAGE_SUFFIXES: [&str; 3] = ["", "_markers", "_arrows"];
/// Names of the left and right finger's pictures.
pub const TACTILE_IMAGES: [&str; 2] = ["tactile_left", "tactile_right"];

/// Edge of the pictures that only try out whether there can be one, pixels.
const TRIAL_EDGE: usize = 16;

/// Checks the senses of a scene as far as no state is needed: the cameras' numbers, names and sizes, the light, and that a
/// tactile sensor with tables of its own has them.
///
/// # Errors
/// What is wrong, with the place in the script that set it.
pub fn check_sensors(
    scene: &Scene,
    spec: &TactileSpec,
    sensor_assets: &SensorAssets,
) -> Result<(), SensingError> {
    check_cameras(&scene.cameras)
        .map_err(|(index, error)| SensingError::from(error).set_by(&scene.cameras[index]))?;
    check_names(&scene.cameras)?;
    check_light(&scene.lighting)?;
    // The others have no file that could be missing.
    if let OpticsModel::Taxim { .. } = spec.optics {
        sensor_assets.sensor(spec)?;
    }
    Ok(())
}

/// No camera may be called as a picture of another or of a finger is: one file would replace the other.
fn check_names(cameras: &[Camera]) -> Result<(), SensingError> {
    let called = |owner: &str, kinds: [&str; 3]| kinds.map(|kind| format!("{owner}{kind}"));
    let mut taken: Vec<(String, String)> = Vec::new();
    for finger in TACTILE_IMAGES {
        taken.extend(called(finger, TACTILE_IMAGE_SUFFIXES).map(|name| (name, "a finger".to_owned())));
    }
    for camera in cameras {
        for name in called(&camera.name, CAMERA_IMAGE_SUFFIXES) {
            if let Some((_, owner)) = taken.iter().find(|(known, _)| *known == name) {
                let (camera_name, owner) = (camera.name.clone(), owner.clone());
                return Err(SensingError::Name { camera: camera_name, picture: name, owner }.set_by(camera));
            }
        }
        let owner = format!("camera {}", camera.name);
        taken.extend(called(&camera.name, CAMERA_IMAGE_SUFFIXES).map(|name| (name, owner.clone())));
    }
    Ok(())
}

impl SensorSuite {
    /// Looks once at `streams` in the state in which an episode starts: whatever would go wrong in its first control step
    /// goes wrong here.
    ///
    /// # Errors
    /// As [`SensorSuite::render_unobstructed`] and [`SensorSuite::tactile_readings`].
    pub fn validate(&mut self, frame: &Frame, streams: &SensorStreams) -> Result<(), SensingError> {
        for name in &streams.cameras {
            let camera = self.camera(name)?.clone().with_edge(TRIAL_EDGE);
            self.render_unobstructed(frame, &camera)?;
        }
        if streams.touch {
            self.tactile_readings(frame)?;
        }
        Ok(())
    }

    /// Whether a camera of the scene stands inside of something in the state in which an episode starts, by the shapes of
    /// the objects: nothing of them is drawn, which would take a hundred times as long.
    ///
    /// # Errors
    /// A camera inside of something, or a picture of the robot alone that cannot be drawn.
    pub fn check_camera_positions(&mut self, frame: &Frame) -> Result<(), SensingError> {
        let robot = self.robot_alone()?;
        let view = self.view(frame);
        for camera in self.cameras() {
            let mount_w = match (camera.mount, view.hand_w) {
                (CameraMount::Hand, Some(hand_w)) => hand_w,
                _ => Pose::identity(),
            };
            let eye_w = mount_w * nalgebra::Point3::from(camera.pose.translation.vector);
            let object = match self.around(&eye_w) {
                Some(name) => Some(name.to_owned()),
                None => {
                    let picture =
                        Renderer::default().render(&robot, &view, &camera.clone().with_edge(TRIAL_EDGE));
                    picture.map_err(|error| SensingError::from(error).set_by(camera))?.inside
                }
            };
            if let Some(object) = object {
                let inside = CameraError::Inside { camera: camera.name.clone(), object };
                return Err(SensingError::from(inside).set_by(camera));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Vec<Camera> {
        let camera = |name: &&str| Camera { name: (*name).to_owned(), ..Camera::wrist() };
        names.iter().map(camera).collect()
    }

    #[test]
    fn no_two_pictures_have_one_name() {
        assert!(check_names(&named(&["third_person", "wrist", "wrist_2", "depth"])).is_ok());
        for (names, words) in [
            (
                ["wrist", "wrist_depth"],
                "camera wrist_depth: name: \"wrist_depth\" is a picture of camera wrist",
            ),
            (
                ["wrist_depth", "wrist"],
                "camera wrist: name: \"wrist_depth\" is a picture of camera wrist_depth",
            ),
            (["wrist", "tactile_left"], "\"tactile_left\" is a picture of a finger"),
            (["wrist", "tactile_right_arrows"], "\"tactile_right_arrows\" is a picture of a finger"),
            (["wrist", "wrist"], "camera wrist: name: \"wrist\" is a picture of camera wrist"),
        ] {
            let error = check_names(&named(&names)).expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
