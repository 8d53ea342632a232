//! An object of the scene in the world of a simulation.

use std::sync::Arc;

use crate::{
    geometry::{Aabb, Pose, Vec3},
    physics::{BodyId, ColliderId},
    scene::{Asset, Joint},
};

/// A part of an articulated object.
#[derive(Clone, Debug, PartialEq)]
pub struct ArticulatedPart {
    /// Index of the whole object in [`Simulation::objects`](super::Simulation::objects).
    pub object: usize,
    /// Name within the object.
    pub name: String,
    /// Joint between the part and its parent.
    pub joint: Joint,
}

/// An object of the scene, or a part of one, in the world of a simulation.
#[derive(Clone, Debug)]
pub struct ObjectInstance {
    /// Name in the scene; for a part `object.part`.
    pub name: String,
    /// Shape, material and appearance.
    pub asset: Arc<Asset>,
    /// Body in the world.
    pub body: BodyId,
    /// Initial pose of the object frame, world.
    pub start_w: Pose,
    /// Colliders of the body; none for a soft body.
    pub colliders: Vec<ColliderId>,
    /// Bounds of the shape at rest, object frame. For a part: that of the whole object with all joints at 0.
    pub bounds: Aabb,
    /// The part, if this is not a whole object.
    pub part: Option<ArticulatedPart>,
}

impl ObjectInstance {
    /// Reference point for placing other objects on or in this one, object frame, m: the lowest point on the vertical
    /// centre line. It is the origin for whole objects.
    pub fn foot_o(&self) -> Vec3 {
        match self.part {
            Some(_) => Vec3::new(self.bounds.centre().x, self.bounds.centre().y, self.bounds.min.z),
            None => Vec3::zeros(),
        }
    }

    /// Frame of a part's joint in the object frame. It coincides with the frame of the link.
    pub(super) fn joint_frame_o(&self) -> Pose {
        self.part.as_ref().map_or(Pose::identity(), |part| Pose::from(part.joint.origin_o))
    }
}
