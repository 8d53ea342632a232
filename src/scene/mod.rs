//! A scene as plain data: assets, placed objects, their looks, the robot's place, light, cameras, regions. Knows no
//! physics.

mod articulated;
mod camera;
mod light;
mod print;
mod start;
mod visual;

mod fingerprint;

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, Vec3, mass::mass_properties, shape::Shape};

pub use articulated::{Joint, Motion, Part, part_poses};
pub use camera::{Camera, CameraMount, POLICY_EDGE, fovy_of_lens};
pub use light::{KeyLight, Lighting, Sky};
pub use print::{Letters, Line, MOST_LETTERS, Print, Typeface};
pub use start::{Place, Start};
pub use visual::{Layer, Mask, Visual};

/// How an object moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// A finite-element soft body.
    Soft(SoftMaterial),
    /// A free rigid body of uniform density, kg/m³.
    Rigid {
        /// Density, kg/m³.
        density: f64,
    },
    /// Parts on joints; the asset's own shape is their base, which is part of the world.
    Articulated(Vec<Part>),
    /// Part of the world; never moves.
    Static,
    /// Part of the picture only: it never moves and nothing touches it.
    Scenery,
}

/// Linear-elastic isotropic material and discretisation of a soft body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoftMaterial {
    /// Young's modulus, Pa.
    pub youngs_pa: f64,
    /// Poisson's ratio, 0 ≤ ν < 0.5.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Voxels along the longest edge of the bounding box, at most [`Self::FINEST`].
    pub resolution: usize,
    /// Spacing of the contact samples on surfaces that a gripper can reach, m.
    pub grasp_spacing: f64,
}

impl SoftMaterial {
    /// Largest resolution.
    pub const FINEST: usize = 64;
}

/// Coulomb friction coefficients of a surface; a pair of surfaces takes the larger of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// Static coefficient.
    pub static_mu: f64,
    /// Dynamic coefficient, not above the static one.
    pub dynamic_mu: f64,
}

impl Default for Friction {
    /// 0.6 / 0.5, that of every object and surface but the pads.
    fn default() -> Self {
        Self { static_mu: 0.6, dynamic_mu: 0.5 }
    }
}

/// A kind of object: its shape at rest with its lowest point at z = 0 and its centre on the z axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// Name, unique in a scene's library.
    pub name: String,
    /// Shape in the object frame, m.
    pub shape: Shape,
    /// How it moves.
    pub body: Body,
    /// Friction of its surface.
    pub friction: Friction,
    /// Appearances by material id of the shape (0 is the default).
    pub visuals: Vec<Visual>,
    /// Free-form hints for experts (grasp axis, height …), numbers only, read by scripts.
    pub hints: BTreeMap<String, f64>,
}

impl Asset {
    /// Its parts on joints, if it is articulated; a carrier comes before what it carries.
    pub fn parts(&self) -> &[Part] {
        match &self.body {
            Body::Articulated(parts) => parts,
            _ => &[],
        }
    }

    /// Mass of a soft or rigid body, or of the moving parts of an articulated one, kg; none of what never moves.
    pub fn mass(&self) -> Option<f64> {
        match &self.body {
            Body::Soft(SoftMaterial { density, .. }) | Body::Rigid { density } => {
                Some(mass_properties(&self.shape, *density).mass)
            }
            Body::Articulated(parts) => Some(parts.iter().map(Part::mass).sum()),
            Body::Static | Body::Scenery => None,
        }
    }

    /// Makes whatever of it moves `factor` times as heavy.
    pub fn scale_mass(&mut self, factor: f64) {
        match &mut self.body {
            Body::Soft(SoftMaterial { density, .. }) | Body::Rigid { density } => *density *= factor,
            Body::Articulated(parts) => parts.iter_mut().for_each(|part| part.scale_mass(factor)),
            Body::Static | Body::Scenery => {}
        }
    }
}

/// An asset put somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the scene, unique: "left", "right", "plate".
    pub name: String,
    /// What it is.
    pub asset: Arc<Asset>,
    /// Object frame in the world.
    pub pose_w: Pose,
    /// Start values of the joints of an articulated object, in the order of its parts, m or rad.
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
