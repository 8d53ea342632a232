//! Assets: kinds of objects with shape, body, friction and appearance; articulated objects and their joints.

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};

use super::visual::Visual;
use crate::{
    geometry::{Pose, Vec3, mass::mass_properties, shape::Shape},
    physics::contact::Friction,
};

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
    /// Voxels along the longest edge of the bounding box, at most [`Self::MAX_RESOLUTION`].
    pub resolution: usize,
    /// Spacing of the contact samples on surfaces that a gripper can reach, m.
    pub grasp_spacing: f64,
}

impl SoftMaterial {
    /// Largest resolution.
    pub const MAX_RESOLUTION: usize = 64;
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

/// How a part moves against what carries it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointMotion {
    /// Along the axis; joint values are metres.
    Slide,
    /// About the axis; joint values are radians.
    Turn,
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// How the part moves.
    pub motion: JointMotion,
    /// Unit direction, object frame with all joints at 0.
    pub axis_o: Vec3,
    /// A point of the axis of a turning part, object frame with all joints at 0, m.
    pub origin_o: Vec3,
    /// Lowest value, m or rad.
    pub lower: f64,
    /// Highest value, m or rad.
    pub upper: f64,
    /// Viscous damping, N s/m or N m s/rad.
    pub damping: f64,
    /// Dry friction, N or N m.
    pub friction: f64,
}

impl Joint {
    /// Unit of its values: "m" or "rad".
    pub fn unit(&self) -> &'static str {
        match self.motion {
            JointMotion::Slide => "m",
            JointMotion::Turn => "rad",
        }
    }

    /// The value that it has if nothing else is said: 0, or the limit nearest to it.
    pub fn rest(&self) -> f64 {
        0f64.clamp(self.lower, self.upper)
    }
}

/// A part that a joint carries.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name, unique in the object: "top_drawer".
    pub name: String,
    /// Its shape and looks in the frame of the whole object with all joints at 0; its name is that of the part, its body
    /// rigid.
    pub asset: Arc<Asset>,
    /// Density, kg/m³.
    pub density: f64,
    /// Index of the part that carries it, below its own; `None` for the base.
    pub parent: Option<usize>,
    /// Its joint.
    pub joint: Joint,
}

impl Part {
    /// Its mass, kg.
    pub fn mass(&self) -> f64 {
        mass_properties(&self.asset.shape, self.density).mass
    }

    /// Makes it `factor` times as heavy.
    pub(super) fn scale_mass(&mut self, factor: f64) {
        self.density *= factor;
        Arc::make_mut(&mut self.asset).scale_mass(factor);
    }
}

/// Frames of the parts in the frame of their object at joint values `joints` (m or rad, one a part): each takes the part's
/// shape, given with all joints at 0, to where it is.
pub fn part_poses(parts: &[Part], joints: &[f64]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::with_capacity(parts.len());
    for (part, &value) in parts.iter().zip(joints) {
        let own = match part.joint.motion {
            JointMotion::Slide => Pose::from(part.joint.axis_o * value),
            JointMotion::Turn => {
                let turn = Pose::rotation(part.joint.axis_o * value);
                Pose::from(part.joint.origin_o) * turn * Pose::from(-part.joint.origin_o)
            }
        };
        poses.push(part.parent.map_or(own, |parent| poses[parent] * own));
    }
    poses
}
