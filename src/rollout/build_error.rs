//! Errors of building a scene.

use super::soft_model::too_many;
use softvt_common::text::format_number;
use softvt_geometry::voxel::VoxelMeshError;
use softvt_physics::{joints::JointTreeError, rigid::RigidError};
use softvt_scene::Object;

/// An object cannot be built. Lengths are in m. Places are `file:line`, empty if no script placed the object.
#[derive(Debug, thiserror::Error)]
pub enum SceneBuildError {
    #[error("asset {asset}: {source}")]
    Geometry { asset: String, source: VoxelMeshError },
    #[error("asset {asset}: {source}")]
    Rigid { asset: String, source: RigidError },
    #[error("asset {asset}: {what}")]
    Material { asset: String, what: String },
    #[error("the soft bodies of the scene have {}", too_many(*.0))]
    Nodes(usize),
    #[error("object {object}: {source}")]
    Joints { object: String, source: JointTreeError },
    #[error(
        "objects {first} and {second}{} overlap by {} mm at the start; {}",
        placed(.second_at),
        tenths_of_mm(*.depth),
        overlap_remedy(.first, *.below_origin)
    )]
    Overlap { first: String, second: String, second_at: String, depth: f64, below_origin: Option<f64> },
    #[error("object {0} starts inside of the robot's base; move it away")]
    InBase(String),
    #[error(
        "object {object} starts inside of the robot's hand ({part}), {} mm deep; move it away, or the arm (scene.start_q)",
        tenths_of_mm(*.depth)
    )]
    InRobot { object: String, part: String, depth: f64 },
    #[error(
        "object {object} at ({}, {}) m has nothing below it; place it above a support{}",
        format_number(*.x),
        format_number(*.y),
        if .x.hypot(*.y) > FAR { "; lengths are in metres" } else { "" }
    )]
    NothingBelow { object: String, x: f64, y: f64 },
    #[error("{place}: {source}")]
    At { place: String, source: Box<SceneBuildError> },
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
