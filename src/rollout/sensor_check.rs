//! Checks of a scene's sensors before an episode runs, and the names of their images.

use super::{
    sensor_assets::{SensingError, SensorAssets},
    sensors::SensorSuite,
};
use crate::{
    geometry::Pose,
    physics::world::WorldSnapshot,
    policy::SensorStreams,
    scene::{Camera, CameraMount, Scene},
    sensing::{
        camera::{CameraError, Renderer, check_cameras, check_light},
        tactile::{OpticsModel, TactileSpec},
    },
};

/// Suffixes of a camera's name for its colour, depth and segmentation images.
pub const CAMERA_IMAGE_SUFFIXES: [&str; 3] = ["", "_depth", "_segmentation"];
/// Suffixes of a finger's name for its tactile image, and for those with the markers as dots and as arrows.
pub const TACTILE_IMAGE_SUFFIXES: [&str; 3] = ["", "_markers", "_arrows"];
/// Names of the left and right finger's tactile images.
pub const TACTILE_IMAGES: [&str; 2] = ["tactile_left", "tactile_right"];

/// Edge of the images that are rendered as a check only, px.
const TRIAL_EDGE: usize = 16;

/// Checks the sensors of a scene without a simulation: parameters, names and sizes of the cameras, the light, and the
/// table files of the tactile sensor.
///
/// # Errors
/// The first invalid value, with the place in the script that set it.
pub fn check_sensors(
    scene: &Scene,
    spec: &TactileSpec,
    sensor_assets: &SensorAssets,
) -> Result<(), SensingError> {
    check_cameras(&scene.cameras)
        .map_err(|(index, error)| SensingError::from(error).set_by(&scene.cameras[index]))?;
    check_names(&scene.cameras)?;
    check_light(&scene.lighting)?;
    // Other optics models read no files.
    if let OpticsModel::Taxim { .. } = spec.optics {
        sensor_assets.sensor(spec)?;
    }
    Ok(())
}

/// Checks that no two images of cameras and fingers have the same name; their files would overwrite each other.
fn check_names(cameras: &[Camera]) -> Result<(), SensingError> {
    let image_names = |owner: &str, kinds: [&str; 3]| kinds.map(|kind| format!("{owner}{kind}"));
    let mut taken: Vec<(String, String)> = Vec::new();
    for finger in TACTILE_IMAGES {
        taken.extend(image_names(finger, TACTILE_IMAGE_SUFFIXES).map(|name| (name, "a finger".to_owned())));
    }
    for camera in cameras {
        for name in image_names(&camera.name, CAMERA_IMAGE_SUFFIXES) {
            if let Some((_, owner)) = taken.iter().find(|(known, _)| *known == name) {
                let (camera_name, owner) = (camera.name.clone(), owner.clone());
                return Err(SensingError::Name { camera: camera_name, image: name, owner }.set_by(camera));
            }
        }
        let owner = format!("camera {}", camera.name);
        taken.extend(image_names(&camera.name, CAMERA_IMAGE_SUFFIXES).map(|name| (name, owner.clone())));
    }
    Ok(())
}

impl SensorSuite {
    /// Computes the requested streams once in the initial state of an episode, so that errors appear before
    /// its first control step.
    ///
    /// # Errors
    /// As [`SensorSuite::render_unobstructed`] and [`SensorSuite::tactile_readings`].
    pub fn validate(&mut self, frame: &WorldSnapshot, streams: &SensorStreams) -> Result<(), SensingError> {
        for name in &streams.cameras {
            let camera = self.camera(name)?.clone().with_edge(TRIAL_EDGE);
            self.render_unobstructed(frame, &camera)?;
        }
        if streams.touch {
            self.tactile_readings(frame)?;
        }
        Ok(())
    }

    /// Checks that no camera of the scene is inside an object in the initial state. It evaluates the shapes of the
    /// objects, which is a hundred times faster than rendering them; only the robot is rendered.
    ///
    /// # Errors
    /// A camera is inside an object, or the robot cannot be rendered.
    pub fn check_camera_positions(&mut self, frame: &WorldSnapshot) -> Result<(), SensingError> {
        let robot = self.robot_scene()?;
        let view = self.view(frame);
        for camera in self.cameras() {
            let mount_w = match (camera.mount, view.hand_w) {
                (CameraMount::Hand, Some(hand_w)) => hand_w,
                _ => Pose::identity(),
            };
            let eye_w = mount_w * nalgebra::Point3::from(camera.pose.translation.vector);
            let object = match self.object_around(&eye_w) {
                Some(name) => Some(name.to_owned()),
                None => {
                    let image =
                        Renderer::default().render(&robot, &view, &camera.clone().with_edge(TRIAL_EDGE));
                    image.map_err(|error| SensingError::from(error).set_by(camera))?.inside
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
    fn names_of_images_are_unique() {
        assert!(check_names(&named(&["third_person", "wrist", "wrist_2", "depth"])).is_ok());
        for (names, words) in [
            (
                ["wrist", "wrist_depth"],
                "camera wrist_depth: name: \"wrist_depth\" is an image of camera wrist",
            ),
            (
                ["wrist_depth", "wrist"],
                "camera wrist: name: \"wrist_depth\" is an image of camera wrist_depth",
            ),
            (["wrist", "tactile_left"], "\"tactile_left\" is an image of a finger"),
            (["wrist", "tactile_right_arrows"], "\"tactile_right_arrows\" is an image of a finger"),
            (["wrist", "wrist"], "camera wrist: name: \"wrist\" is an image of camera wrist"),
        ] {
            let error = check_names(&named(&names)).expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
