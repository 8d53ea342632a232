//! Assets: kinds of objects with shape, body, friction and appearance; articulated objects and their joints.

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};

use super::visual::Visual;
use softvt_common::range::{Range, RangeError};
use softvt_geometry::{Pose, Vec3, mass::mass_properties, shape::Shape};
use softvt_physics::{contact::Friction, fem::ElasticMaterial};

/// Hint that gives the width of an asset where the fingers grasp it.
pub const GRASP_WIDTH_HINT: &str = "grasp_width_m";

/// Hint that gives the height above the lowest point of an asset where the fingers grasp it.
pub const GRASP_HEIGHT_HINT: &str = "grasp_height_m";

/// Hint that gives the share of their usual speed at which experts carry an asset.
pub const CARRY_PACE_HINT: &str = "carry_pace";

/// Hints that the standard experts read. An asset may have others, for experts of its own.
pub const EXPERT_HINTS: [&str; 12] = [
    GRASP_HEIGHT_HINT,
    GRASP_WIDTH_HINT,
    "grasp_rim_m",
    "grasp_offset_m",
    CARRY_PACE_HINT,
    "surface_m",
    "wall_m",
    "handle_height_m",
    "handle_width_m",
    "grip_width_m",
    "grip_length_m",
    "grip_depth_m",
];

/// Kind of body that an object is.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// A finite-element soft body.
    Soft(SoftMaterial),
    /// A free rigid body of uniform density, kg/m³.
    Rigid {
        /// Density, kg/m³.
        density: f64,
    },
    /// Parts on joints. The asset's own shape is their base, which is fixed to the world.
    Articulated(Vec<MovingPart>),
    /// Fixed to the world; collides.
    Static,
    /// Rendered only: fixed and without collisions.
    Scenery,
}

/// Material of a soft body, and its discretisation. Its serialised names are part of fingerprints of assets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoftMaterial {
    /// Elasticity and density; the shipped pastries have Young's moduli of 2.5e4 to 2.2e5 Pa.
    #[serde(flatten)]
    pub elastic: ElasticMaterial,
    /// Voxels (finite elements) along the longest edge of the bounding box, within [`Self::RESOLUTION`].
    pub resolution: usize,
    /// Spacing of the contact samples on surfaces that a gripper can reach (|n_z| ≤ 0.7 in the object frame), m,
    /// within [`Self::GRASP_SPACING_M`].
    pub grasp_spacing: f64,
    /// Compressive strain, within [`Self::STRAIN`], at which cell walls buckle and a plateau of stress begins.
    pub collapse_strain: Option<f64>,
    /// Compressive strain, within [`Self::STRAIN`], that leaves a visible crack or set.
    pub damage_strain: Option<f64>,
}

impl SoftMaterial {
    /// Largest allowed number of voxels along an edge.
    pub const MAX_RESOLUTION: usize = 64;
    /// Range of the resolution.
    pub const RESOLUTION: Range = Range::closed(1.0, Self::MAX_RESOLUTION as f64);
    /// Range of the spacing of contact samples, m.
    pub const GRASP_SPACING_M: Range = Range::closed(1e-4, 0.02);
    /// Range of the strains at which the material changes.
    pub const STRAIN: Range = Range::above(0.0, 1.0).usually(0.002, 0.8);

    /// The same material with `factor` times the resolution.
    #[must_use]
    pub fn refined(&self, factor: f64) -> Self {
        Self { resolution: (factor * self.resolution as f64).round().max(1.0) as usize, ..self.clone() }
    }

    /// Strain up to which the material is stable and undamaged: the smaller of its two limits.
    pub fn stable_strain(&self) -> Option<f64> {
        match (self.collapse_strain, self.damage_strain) {
            (Some(collapse), Some(damage)) => Some(collapse.min(damage)),
            (one, other) => one.or(other),
        }
    }
}

/// A kind of object, which scenes place any number of times.
///
/// Object frame (`_o`): z up, lowest point at z = 0, centre on the z axis, in the rest state with all joints at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// Name, unique among the assets of a scene.
    pub name: String,
    /// Shape at rest, object frame, m.
    pub shape: Shape,
    /// Kind of body, with its material.
    pub body: Body,
    /// Coulomb friction of the surface.
    pub friction: Friction,
    /// Appearances, indexed by the material ids of the shape ([`Shape::material`]); 0 is the default.
    pub visuals: Vec<Visual>,
    /// Numbers for scripted experts by name, for example the grasp height; the simulation ignores them.
    pub hints: BTreeMap<String, f64>,
}

impl Asset {
    /// Parts of an articulated object, parents before children; empty for other bodies.
    pub fn parts(&self) -> &[MovingPart] {
        match &self.body {
            Body::Articulated(parts) => parts,
            _ => &[],
        }
    }

    /// Mass (kg) of a soft or rigid body, or of the moving parts of an articulated one; `None` for fixed objects.
    pub fn mass(&self) -> Option<f64> {
        match &self.body {
            Body::Articulated(parts) => Some(parts.iter().map(MovingPart::mass).sum()),
            _ => self.density().map(|density| mass_properties(&self.shape, density).mass),
        }
    }

    /// Elasticity and density of a soft body.
    pub fn elastic(&self) -> Option<ElasticMaterial> {
        match &self.body {
            Body::Soft(material) => Some(material.elastic),
            _ => None,
        }
    }

    /// Density of a soft or rigid body, kg/m³.
    pub fn density(&self) -> Option<f64> {
        match &self.body {
            Body::Soft(material) => Some(material.elastic.density()),
            Body::Rigid { density } => Some(*density),
            Body::Articulated(_) | Body::Static | Body::Scenery => None,
        }
    }

    /// Width between two fingers that grasp from above, m: the hint of the asset, or the narrower horizontal side. Not
    /// that of an articulated object, which is grasped by its parts.
    pub fn grasp_width(&self) -> f64 {
        let narrow_side = || {
            let size = self.shape.bounds().size();
            size.x.min(size.y)
        };
        self.hints.get(GRASP_WIDTH_HINT).copied().unwrap_or_else(narrow_side)
    }

    /// Multiplies the density of everything that moves by `factor`.
    ///
    /// # Errors
    /// The product is not the density of a soft body.
    pub fn scale_mass(&mut self, factor: f64) -> Result<(), RangeError> {
        match &mut self.body {
            Body::Soft(SoftMaterial { elastic, .. }) => {
                *elastic = elastic.with_density(elastic.density() * factor)?;
            }
            Body::Rigid { density } => *density *= factor,
            Body::Articulated(parts) => parts.iter_mut().try_for_each(|part| part.scale_mass(factor))?,
            Body::Static | Body::Scenery => {}
        }
        Ok(())
    }
}

/// Kind of motion that a joint allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointMotion {
    /// Prismatic: translation along the axis; joint values are metres.
    Slide,
    /// Revolute: rotation about the axis; joint values are radians.
    Turn,
}

/// A joint with one degree of freedom, between a part and its parent.
/// Its serialised names are part of fingerprints of assets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Translation along the axis or rotation about it.
    pub motion: JointMotion,
    /// Unit vector of the axis, object frame with all joints at 0.
    pub axis_o: Vec3,
    /// Point on the axis of a revolute joint, object frame with all joints at 0, m.
    pub origin_o: Vec3,
    /// Lower limit, m or rad.
    pub lower: f64,
    /// Upper limit, m or rad.
    pub upper: f64,
    /// Viscous damping, N s/m or N m s/rad.
    pub damping: f64,
    /// Dry (Coulomb) friction, N or N m.
    pub friction: f64,
}

impl Joint {
    /// Differences of values that goals and checks ignore, m or rad.
    pub const TOLERANCE: f64 = 1e-4;

    /// Unit of the joint's values: "m" or "rad".
    pub fn unit(&self) -> &'static str {
        match self.motion {
            JointMotion::Slide => "m",
            JointMotion::Turn => "rad",
        }
    }

    /// Default value: 0, or the nearest limit.
    pub fn rest(&self) -> f64 {
        0f64.clamp(self.lower, self.upper)
    }
}

/// A moving part of an articulated object.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingPart {
    /// Name, unique in the object, for example "top_drawer".
    pub name: String,
    /// Shape and appearance in the frame of the whole object with all joints at 0. The asset has the name of the part
    /// and a rigid body.
    pub asset: Arc<Asset>,
    /// Density, kg/m³.
    pub density: f64,
    /// Index of the parent part, less than the part's own; `None` for the base.
    pub parent: Option<usize>,
    /// Joint to the parent.
    pub joint: Joint,
}

impl MovingPart {
    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        mass_properties(&self.asset.shape, self.density).mass
    }

    /// Multiplies the density by `factor`.
    fn scale_mass(&mut self, factor: f64) -> Result<(), RangeError> {
        self.density *= factor;
        Arc::make_mut(&mut self.asset).scale_mass(factor)
    }
}

/// Poses of the parts relative to the object frame at joint values `joints` (m or rad, one per part).
///
/// A pose maps the shape of its part, which is given with all joints at 0, to its place in the object frame.
pub fn part_poses(parts: &[MovingPart], joints: &[f64]) -> Vec<Pose> {
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
