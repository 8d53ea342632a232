//! A scene as plain data: assets, placed objects and their appearance, the robot's base,
//! lighting, cameras, the workspace.
//!
//! Lengths are metres, angles radians, colours linear RGB. The world frame has z up and z = 0 on the support surface.
//!
//! # Example
//!
//! A soft ball with a rough brown surface, and its rigid counterpart:
//!
//! ```
//! use softvt_geometry::{Vec3, shape::Shape};
//! use softvt_physics::{contact::Friction, fem::ElasticMaterial};
//! use softvt_scene::{Asset, Body, SoftMaterial, Visual};
//!
//! let material = SoftMaterial {
//!     elastic: ElasticMaterial::new(5e4, 0.4, 300.0)?,
//!     resolution: 10,
//!     grasp_spacing: 7.5e-4,
//!     collapse_strain: Some(0.1),
//!     damage_strain: Some(0.4),
//! };
//! let soft = Asset {
//!     name: "bun".to_owned(),
//!     // The lowest point of an asset is at z = 0.
//!     shape: Shape::Sphere { radius: 0.03 }.translated(Vec3::z() * 0.03),
//!     body: Body::Soft(material.clone()),
//!     friction: Friction::default(),
//!     visuals: vec![Visual::plain([0.6, 0.4, 0.2], 0.8, 0.0)],
//!     hints: Default::default(),
//! };
//! let rigid = Asset { body: Body::Rigid { density: material.elastic.density() }, ..soft.clone() };
//!
//! let mass = soft.mass().expect("a soft body has a mass");
//! assert!((mass / 0.0339 - 1.0).abs() < 0.02, "{mass} kg");
//! assert_eq!(rigid.mass(), Some(mass));
//! // Calibrations refer to assets by this hash, which appearance and name do not enter.
//! assert_ne!(rigid.fingerprint(), soft.fingerprint());
//! # Ok::<(), softvt_common::range::RangeError>(())
//! ```
#![warn(missing_docs, unreachable_pub)]

mod asset;
mod camera;
mod decal;
mod fingerprint;
mod light;
mod mesh_colours;
mod scale;
mod variation;
mod visual;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use softvt_geometry::{Aabb, Pose, Quat, Vec3};

pub use asset::{
    Asset, Body, CARRY_PACE_HINT, EXPERT_HINTS, GRASP_HEIGHT_HINT, GRASP_WIDTH_HINT, Joint, JointMotion,
    MovingPart, SoftMaterial, part_poses,
};
pub use camera::{Camera, CameraMount, CameraSettings, MAX_CAMERAS, STANDARD_CAMERAS};
pub use decal::{GlyphCoverage, LabelLine, MAX_LETTERS, TextDecal, Typeface};
pub use light::{KeyLight, Lighting, Sky};
pub use mesh_colours::{ColouredMesh, MeshColours, MeshMaterial, SurfaceImage};
pub use scale::LENGTH_HINT;
pub use variation::{CameraVariation, HiddenProperties, LightVariation, ObjectVariation, SceneVariation};
pub use visual::{Mask, Visual, VisualLayer};

/// Largest number of objects of a scene, and of bodies that are drawn, among them the parts of articulated objects
/// and of the robot.
pub const MAX_OBJECTS: usize = 1000;
/// Segmentation id of the robot. Objects have ids from 1 in the order of the scene, each followed by its parts.
pub const ROBOT_SEGMENTATION_ID: u16 = 1000;
// With the robot at most MAX_OBJECTS bodies are drawn, so the last object has a smaller id.
const _: () = assert!(ROBOT_SEGMENTATION_ID as usize >= MAX_OBJECTS);

/// An asset placed in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name, unique in the scene, for example "left" or "plate".
    pub name: String,
    /// The object as it is in this scene: its asset, with what the layout or a shift changed of it.
    pub asset: Arc<Asset>,
    /// The asset as its file defines it. Its fingerprint is the one that a calibration refers to.
    pub nominal: Arc<Asset>,
    /// Size relative to that of the nominal asset.
    pub scale: f64,
    /// Object frame in the world frame, before settling.
    pub pose_w: Pose,
    /// Initial joint values of an articulated object, in the order of its parts, m or rad.
    pub joints: Vec<f64>,
    /// Source location (`file:line`) of the placing call, for messages; empty if no script placed the object.
    pub placed_at: String,
}

impl Object {
    /// The same object with `factor` times the resolution of a soft body.
    #[must_use]
    pub fn refined(&self, factor: f64) -> Self {
        let refined = |asset: &Arc<Asset>| match &asset.body {
            Body::Soft(material) => {
                Arc::new(Asset { body: Body::Soft(material.refined(factor)), ..Asset::clone(asset) })
            }
            _ => asset.clone(),
        };
        Self { asset: refined(&self.asset), nominal: refined(&self.nominal), ..self.clone() }
    }

    /// An instance of `asset` as it is, with all joints at rest.
    pub fn new(name: &str, asset: Arc<Asset>, pose_w: Pose) -> Self {
        let joints = asset.parts().iter().map(|part| part.joint.rest()).collect();
        Self {
            name: name.to_owned(),
            nominal: asset.clone(),
            asset,
            scale: 1.0,
            pose_w,
            joints,
            placed_at: String::new(),
        }
    }
}

/// The state from which an episode starts, before settling.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Placed objects. Their order determines the order of bodies in the simulation, and with it the
    /// last bits of results.
    pub objects: Vec<Object>,
    /// Robot base frame in the world frame.
    pub base_w: Pose,
    /// Initial joint angles of the arm, rad.
    pub start_q: [f64; 7],
    /// Gravitational acceleration, m/s², world frame.
    pub gravity: Vec3,
    /// Box outside of which an object counts as having left the workspace, world frame.
    pub workspace: Aabb,
    /// Light sources and exposure.
    pub lighting: Lighting,
    /// Cameras with unique names, by which policies request images.
    pub cameras: Vec<Camera>,
}

impl Object {
    /// Reason why the deformation limit of the nominal asset does not hold for this object; `None` if it does.
    ///
    /// D is a strain over a diagonal, so that a limit holds whatever the stiffness, density, friction, colour or
    /// uniform scale. Poisson's ratio changes how a shape deforms under the same strain.
    pub fn departure(&self) -> Option<String> {
        let [own, nominal] = [self.asset.elastic()?.poisson(), self.nominal.elastic()?.poisson()];
        (own != nominal).then(|| format!("Poisson's ratio {own} instead of {nominal}"))
    }
}

impl Scene {
    /// Names of the objects, each followed by those of its parts, for example `cabinet`, `cabinet.top_drawer`.
    pub fn names(&self) -> Vec<String> {
        let of = |object: &Object| {
            let parts = object.asset.parts().iter().map(|part| format!("{}.{}", object.name, part.name));
            std::iter::once(object.name.clone()).chain(parts).collect::<Vec<_>>()
        };
        self.objects.iter().flat_map(of).collect()
    }

    /// The rigid twin: the same scene with all soft bodies made rigid. Shapes, poses, densities, friction and
    /// appearance stay the same.
    pub fn rigid_twin(mut self) -> Self {
        for object in &mut self.objects {
            if let Body::Soft(material) = &object.asset.body {
                let density = material.elastic.density();
                Arc::make_mut(&mut object.asset).body = Body::Rigid { density };
            }
        }
        self
    }

    /// Returns the camera with this name.
    pub fn camera(&self, name: &str) -> Option<&Camera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }
}

/// Overrides of the initial state of a scene, as given by a demonstration imported from another simulator.
///
/// Nothing is validated here: overlapping objects are refused when the simulation is built from the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InitialStateOverride {
    /// Joint angles of the arm, rad; `None` keeps those of the layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<[f64; 7]>,
    /// Objects with other poses than in the layout.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ObjectPlacement>,
}

/// Pose of an object on the support surface; its height is that of the layout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectPlacement {
    /// Name of the object in the scene.
    pub name: String,
    /// Horizontal position of the object's origin, m, world frame.
    pub xy: [f64; 2],
    /// Angle about the vertical, rad; `None` keeps the orientation of the layout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw: Option<f64>,
}

impl InitialStateOverride {
    /// Applies the overrides to `scene`. Names that the scene does not contain are ignored.
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
