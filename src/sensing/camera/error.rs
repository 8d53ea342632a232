//! What can be wrong with a picture's inputs.

/// A picture cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A number of the camera is out of range; fields are named as scripts name them.
    #[error("camera {camera}: {field}: expected {expected}, got {got}")]
    Field {
        /// Name of the camera.
        camera: String,
        /// The field.
        field: &'static str,
        /// What it should be, with the unit.
        expected: String,
        /// What it is.
        got: String,
    },
    /// The camera stands inside of something, where none can be put.
    #[error("camera {camera}: position: it stands inside of {object}; move it out")]
    Inside {
        /// Name of the camera.
        camera: String,
        /// What it is inside of.
        object: String,
    },
    /// A number of the light is out of range; fields are named as scripts name them, where they have one.
    #[error("light: {field}: expected {expected}, got {got}")]
    Light {
        /// The field.
        field: &'static str,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        got: String,
    },
    /// A thing to be drawn has no triangles or wrong ones.
    #[error("{name} cannot be drawn: {reason}")]
    RenderMesh {
        /// Name of the thing.
        name: String,
        /// What is wrong and what to do.
        reason: String,
    },
    /// The state lacks a body that is to be drawn, or gives it another size.
    #[error("{name} cannot be drawn: the state has {reason}")]
    State {
        /// Name of the thing.
        name: String,
        /// What is missing.
        reason: String,
    },
}
