//! Errors of sensors.

use softvt_scene::Camera;
use softvt_sensing::{
    camera::CameraError,
    tactile::{TactileContactError, TactileSensorError},
};

/// Data of a sensor cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum SensingError {
    /// An image cannot be rendered.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The tactile sensor cannot be built.
    #[error(transparent)]
    Sensor(#[from] TactileSensorError),
    /// A tactile contact cannot be computed.
    #[error(transparent)]
    Field(#[from] TactileContactError),
    /// An error about a camera that a script has set.
    #[error("{at}: {source}")]
    Set {
        /// File and line of the setting.
        at: String,
        /// The cause.
        source: Box<SensingError>,
    },
    /// Two images have the same name.
    #[error("camera {camera}: name: {image:?} is an image of {owner} already; give the camera another name")]
    Name {
        /// Name of the camera.
        camera: String,
        /// Name of the image.
        image: String,
        /// Owner of the image with that name.
        owner: String,
    },
    /// The scene has no camera of a name.
    #[error("there is no camera {name:?}; the scene has {have}")]
    NoCamera {
        /// Name that no camera has.
        name: String,
        /// Names of the scene's cameras.
        have: String,
    },
    /// A soft body and its skin do not match.
    #[error("{0}: its surface lies outside of its voxel mesh; build both from one shape")]
    Skin(String),
}

impl SensingError {
    /// Adds the place in the script that set the camera.
    pub(in crate::sensors) fn set_by(self, camera: &Camera) -> Self {
        match &camera.set_at {
            Some(at) => Self::Set { at: at.clone(), source: Box::new(self) },
            None => self,
        }
    }
}
