//! Errors of building a scene.

use softvt_common::text::format_number;
use softvt_geometry::voxel::VoxelMeshError;
use softvt_physics::{joints::JointTreeError, rigid::RigidError};
use softvt_scene::Object;

/// An object cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The shape cannot be meshed.
    #[error("asset {asset}: {source}")]
    Geometry {
        /// Asset name.
        asset: String,
        /// The cause.
        source: VoxelMeshError,
    },
    /// The mass properties are invalid.
    #[error("asset {asset}: {source}")]
    Rigid {
        /// Asset name.
        asset: String,
        /// The cause.
        source: RigidError,
    },
    /// A material parameter or a dimension is out of range.
    #[error("asset {asset}: {what}")]
    Material {
        /// Asset name.
        asset: String,
        /// The problem and the expected range.
        what: String,
    },
    /// The joints do not form a valid tree.
    #[error("object {object}: {source}")]
    Joints {
        /// Object name.
        object: String,
        /// The cause.
        source: JointTreeError,
    },
    /// Two objects overlap by more than contact allows.
    #[error(
        "objects {first} and {second}{} overlap by {} mm at the start; move them apart",
        placed(.second_at),
        format_number((1e4 * .depth).round() / 10.0)
    )]
    Overlap {
        /// Name of the object that was placed last.
        first: String,
        /// Name of the other object.
        second: String,
        /// `file:line` of the other object; empty if no script placed it.
        second_at: String,
        /// Penetration depth, m.
        depth: f64,
    },
    /// An object overlaps the base of the robot.
    #[error("object {0} starts inside of the robot's base; move it away")]
    InBase(String),
    /// An object overlaps the hand of the robot.
    #[error(
        "object {object} starts inside of the robot's hand ({part}), {} mm deep; move it away, or the arm (scene.start_q)",
        format_number((1e4 * .depth).round() / 10.0)
    )]
    InRobot {
        /// Object name.
        object: String,
        /// Collider of the hand.
        part: String,
        /// Penetration depth, m.
        depth: f64,
    },
    /// An object would fall out of the world.
    #[error("object {0} has nothing below it; place it above a support")]
    NothingBelow(String),
    /// An error about an object that a script placed.
    #[error("{place}: {source}")]
    At {
        /// `file:line`.
        place: String,
        /// The cause.
        source: Box<BuildError>,
    },
    /// Two objects have the same name.
    #[error("the scene has two objects named {0}; names must be unique")]
    DuplicateName(String),
}

fn placed(at: &str) -> String {
    if at.is_empty() { String::new() } else { format!(" (placed at {at})") }
}

impl BuildError {
    /// Adds the place in the script that placed `object`.
    pub(super) fn of(self, object: &Object) -> Self {
        match object.placed_at.as_str() {
            "" => self,
            place => Self::At { place: place.to_owned(), source: Box::new(self) },
        }
    }
}
