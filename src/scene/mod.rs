//! A scene as plain data: assets, placed objects and their appearance, the robot's base, lighting, cameras, the workspace.
//!
//! Lengths are metres, angles radians, colours linear RGB. The world frame has z up and z = 0 on the support surface.

mod asset;
mod camera;
mod decal;
mod fingerprint;
mod light;
mod visual;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, Quat, Vec3};

pub use asset::{Asset, Body, Joint, JointMotion, Part, SoftMaterial, part_poses};
pub use camera::{Camera, CameraMount, POLICY_IMAGE_EDGE, fovy_from_lens};
pub use decal::{GlyphCoverage, MAX_LETTERS, TextDecal, TextLine, Typeface};
pub use light::{KeyLight, Lighting, Sky};
pub use visual::{Mask, Visual, VisualLayer};

/// An asset put somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the scene, unique: "left", "right", "plate".
    pub name: String,
    /// What it is.
    pub asset: Arc<Asset>,
    /// Object frame in the world.
    pub pose_w: Pose,
    /// InitialState values of the joints of an articulated object, in the order of its parts, m or rad.
    pub joints: Vec<f64>,
    /// Where it was placed, `file:line`, for messages; empty if no script did.
    pub placed_at: String,
}

/// An axis-aligned box, world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Lowest corner, m.
    pub min: Vec3,
    /// Highest corner, m.
    pub max: Vec3,
}

/// Everything an episode starts from, before settling.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Placed objects; the order is part of the scene.
    pub objects: Vec<Object>,
    /// Robot base in the world.
    pub base_w: Pose,
    /// Arm joint angles at the start, rad.
    pub start_q: [f64; 7],
    /// Gravity, m/s², world frame.
    pub gravity: Vec3,
    /// An object outside of this box has left the workspace.
    pub workspace: Region,
    /// The light.
    pub lighting: Lighting,
    /// The cameras; names are unique. A policy asks for pictures by name.
    pub cameras: Vec<Camera>,
}

impl Scene {
    /// Names of the objects, each followed by those of its parts: cabinet, cabinet.top_drawer.
    pub fn names(&self) -> Vec<String> {
        let of = |object: &Object| {
            let parts = object.asset.parts().iter().map(|part| format!("{}.{}", object.name, part.name));
            std::iter::once(object.name.clone()).chain(parts).collect::<Vec<_>>()
        };
        self.objects.iter().flat_map(of).collect()
    }

    /// The same scene with every soft body made rigid: same shapes, places, densities, friction and looks.
    pub fn rigid_twin(mut self) -> Self {
        for object in &mut self.objects {
            if let Body::Soft(material) = &object.asset.body {
                let density = material.density;
                Arc::make_mut(&mut object.asset).body = Body::Rigid { density };
            }
        }
        self
    }

    /// A camera by name.
    pub fn camera(&self, name: &str) -> Option<&Camera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }
}

/// What is put elsewhere in a scene before anything is simulated: a demonstration that was made in another world brings its own
/// start. Nothing is checked here; a scene whose objects overlap is refused when it is built, as any is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InitialState {
    /// Arm joint angles, rad; those of the layout if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<[f64; 7]>,
    /// Objects that stand elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ObjectPlacement>,
}

/// Where an object stands; its height is the layout's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectPlacement {
    /// Name in the scene.
    pub name: String,
    /// ObjectPlacement of its origin on the ground, m, world.
    pub xy: [f64; 2],
    /// Turn about the vertical, rad; the layout's if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw: Option<f64>,
}

impl InitialState {
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
