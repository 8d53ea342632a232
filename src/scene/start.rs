//! Where a scene starts from, when it is not its layout that says so.

use serde::{Deserialize, Serialize};

use super::Scene;
use crate::geometry::{Pose, Quat, Vec3};

/// What is put elsewhere in a scene before anything is simulated: a demonstration that was made in another world brings its own
/// start. Nothing is checked here; a scene whose objects overlap is refused when it is built, as any is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Arm joint angles, rad; those of the layout if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<[f64; 7]>,
    /// Objects that stand elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<Place>,
}

/// Where an object stands; its height is the layout's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Name in the scene.
    pub name: String,
    /// Place of its origin on the ground, m, world.
    pub xy: [f64; 2],
    /// Turn about the vertical, rad; the layout's if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw: Option<f64>,
}

impl Start {
    /// Puts everything there; names that the scene does not have are passed over.
    pub fn apply(&self, scene: &mut Scene) {
        scene.start_q = self.joints.unwrap_or(scene.start_q);
        for place in &self.places {
            let Some(object) = scene.objects.iter_mut().find(|object| object.name == place.name) else {
                continue;
            };
            let at = Vec3::new(place.xy[0], place.xy[1], object.pose_w.translation.z);
            let turn = place.yaw.map(|yaw| Quat::from_axis_angle(&Vec3::z_axis(), yaw));
            object.pose_w = Pose::from_parts(at.into(), turn.unwrap_or(object.pose_w.rotation));
        }
    }
}
