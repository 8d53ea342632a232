//! Errors of the camera renderer.

/// A camera image cannot be rendered.
#[allow(missing_docs)] // The messages say what the fields are.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A camera setting is out of range. Fields are named as in Lua.
    #[error("camera {camera}: {field}: expected {expected}, got {got}")]
    Field { camera: String, field: &'static str, expected: String, got: String },
    /// The camera was placed inside an object.
    #[error("camera {camera}: position: it is inside {object}; move it out")]
    Inside { camera: String, object: String },
    /// A light setting is out of range. Fields are named as in Lua where Lua has them.
    #[error("light: {field}: expected {expected}, got {got}")]
    Light { field: &'static str, expected: &'static str, got: String },
    /// An object has no triangles or invalid ones.
    #[error("{name} cannot be drawn: {reason}")]
    Mesh { name: String, reason: String },
    /// The state lacks the body of an object, or the body does not match its mesh.
    #[error("{name} cannot be drawn: the state has {reason}")]
    State { name: String, reason: String },
}
