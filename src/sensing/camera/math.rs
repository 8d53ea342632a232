//! Single-precision vectors and rigid transforms of the renderer.

use crate::geometry::Pose;

/// A point, direction or linear RGB colour.
pub(crate) type V3 = nalgebra::Vector3<f32>;

/// A rigid transform in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidTransform {
    rotation: nalgebra::Matrix3<f32>,
    translation: V3,
}

impl RigidTransform {
    pub(crate) fn from_pose(pose: &Pose) -> Self {
        Self {
            rotation: pose.rotation.to_rotation_matrix().matrix().cast(),
            translation: pose.translation.vector.cast(),
        }
    }

    pub(crate) fn rotate(&self, v: &V3) -> V3 {
        self.rotation * v
    }

    pub(crate) fn transform_point(&self, p: &V3) -> V3 {
        self.rotation * p + self.translation
    }
}

/// True if no component of `pose` is infinite or NaN.
pub(crate) fn is_finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
}
