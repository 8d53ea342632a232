//! Errors of sensors.

use softvt_scene::Camera;
use softvt_sensing::{
    camera::CameraError,
    tactile::{TactileContactError, TactileSensorError},
};

#[derive(Debug, thiserror::Error)]
pub enum SensingError {
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error(transparent)]
    Sensor(#[from] TactileSensorError),
    #[error(transparent)]
    Field(#[from] TactileContactError),
    #[error("{at}: {source}")]
    Set { at: String, source: Box<SensingError> },
    #[error("camera {camera}: name: {image:?} is an image of {owner} already; give the camera another name")]
    Name { camera: String, image: String, owner: String },
    #[error("there is no camera {name:?}; the scene has {have}")]
    NoCamera { name: String, have: String },
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
