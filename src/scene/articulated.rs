//! Furniture that moves: parts on a fixed base, each carried by a joint with limits, damping and friction.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Asset;
use crate::geometry::{Pose, Vec3, mass::mass_properties};

/// How a part moves against what carries it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// Along the axis; joint values are metres.
    Slide,
    /// About the axis; joint values are radians.
    Turn,
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// How the part moves.
    pub motion: Motion,
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
            Motion::Slide => "m",
            Motion::Turn => "rad",
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
            Motion::Slide => Pose::from(part.joint.axis_o * value),
            Motion::Turn => {
                let turn = Pose::rotation(part.joint.axis_o * value);
                Pose::from(part.joint.origin_o) * turn * Pose::from(-part.joint.origin_o)
            }
        };
        poses.push(part.parent.map_or(own, |parent| poses[parent] * own));
    }
    poses
}
