//! Errors of building a scene.

use super::soft_model::too_many;
use softvt_common::text::format_number;
use softvt_geometry::voxel::VoxelMeshError;
use softvt_physics::{joints::JointTreeError, rigid::RigidError};
use softvt_scene::Object;

/// An object cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum SceneBuildError {
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
    /// More nodes than can be simulated.
    #[error("the soft bodies of the scene have {}", too_many(*.0))]
    Nodes(usize),
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
        "objects {first} and {second}{} overlap by {} mm at the start; {}",
        placed(.second_at),
        tenths_of_mm(*.depth),
        overlap_remedy(.first, *.below_origin)
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
        /// Distance from the origin of the first object to the lowest point of its shape, m, if
        /// that explains the overlap.
        below_origin: Option<f64>,
    },
    /// An object overlaps the base of the robot.
    #[error("object {0} starts inside of the robot's base; move it away")]
    InBase(String),
    /// An object overlaps the hand of the robot.
    #[error(
        "object {object} starts inside of the robot's hand ({part}), {} mm deep; move it away, or the arm (scene.start_q)",
        tenths_of_mm(*.depth)
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
    #[error(
        "object {object} at ({}, {}) m has nothing below it; place it above a support{}",
        format_number(*.x),
        format_number(*.y),
        if .x.hypot(*.y) > FAR { "; lengths are in metres" } else { "" }
    )]
    NothingBelow {
        /// Object name.
        object: String,
        /// Position in the world, m.
        x: f64,
        /// Position in the world, m.
        y: f64,
    },
    /// An error about an object that a script placed.
    #[error("{place}: {source}")]
    At {
        /// `file:line`.
        place: String,
        /// The cause.
        source: Box<SceneBuildError>,
    },
    /// Two objects have the same name.
    #[error("the scene has two objects named {0}; names must be unique")]
    DuplicateName(String),
}

/// Distance beyond which a position is most likely in another unit, m.
const FAR: f64 = 3.0;

/// A length in mm with one decimal.
pub(super) fn tenths_of_mm(metres: f64) -> String {
    // 0 has no sign.
    format_number((1e4 * metres).round() / 10.0 + 0.0)
}

fn overlap_remedy(first: &str, below_origin: Option<f64>) -> String {
    match below_origin {
        Some(below) => format!(
            "the shape of {first} reaches {} mm below its origin: end it with :grounded(), or move the objects apart",
            tenths_of_mm(below)
        ),
        None => "move them apart".to_owned(),
    }
}

fn placed(at: &str) -> String {
    if at.is_empty() { String::new() } else { format!(" (placed at {at})") }
}

impl SceneBuildError {
    /// Adds the place in the script that placed `object`.
    pub(super) fn of(self, object: &Object) -> Self {
        match object.placed_at.as_str() {
            "" => self,
            place => Self::At { place: place.to_owned(), source: Box::new(self) },
        }
    }
}
